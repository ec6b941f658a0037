"""The kinds of mechanism, by the name that a scenario gives as `kind`.

Each module holds one mechanism whole - parameters, effects, equations, statics, outputs - as

    SCENARIO              the model of its scenario files, with the PAIRS of friction law and method
                          that can do it and the CHANNELS that it may have
    simulation(scenario)  the `Simulation` of a scenario
    statics(scenario)     its quantities of impending motion
    PANELS                the channels that a plot of it shows
    METRICS               what the cost of accuracy is judged by

and, where the defaults of `frictionsim.work_precision` do not fit, ladders(scenario, tolerances),
references(scenario, rtol) and tighter(scenario): settings to compare, settings to judge by, and the
setting that `solve --estimate-error` compares with.

A mechanism of one coordinate has its equations in build(scenario), composed of the effects that the
scenario names, and takes what it shares with others from `single_dof`: the base of its scenario,
the channels of any body that turns, METRICS, and `simulation`. A new one is a module of this
package and a line in `frictionsim.scenario.kinds`.
"""
