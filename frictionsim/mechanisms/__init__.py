"""The kinds of mechanism, by the name that a scenario gives as `kind`.

Each is a folder with its channels, the tables of its scenarios, its equations and its statics. The
folder itself exports what `extension` says that the module of a kind has. A kind with a mesh may
have mesh_study, with what `belt_drive.study` has: a study then compares meshes, too.

A mechanism of one coordinate composes its equations from the effects of the scenario in
build(scenario). `single_dof` has the parts that all of them share: the base of the scenario, the
common channels, METRICS and `simulation`.

A new mechanism is a folder of this package, a line in `frictionsim.scenario.kinds`, its views in
the table VIEWS of `plots` and a module of its name in `motion`; or a module of another package with
an entry point of the group `frictionsim.kinds`. `extension` has what such a module needs, and says
what is stable.
"""
