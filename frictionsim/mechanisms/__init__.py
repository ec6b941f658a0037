"""The kinds of mechanism, by the name that a scenario gives as `kind`.

Each module holds one mechanism whole - parameters, effects, equations, statics, outputs - as

    Scene              the model of its scenario files, with the BACKENDS that can do it and the
                       CHANNELS that it may have
    simulation(scene)  the Simulation of a scene
    statics(scene)     its figures of impending motion
    PANELS             the courses that a plot of it shows
    MEASURES           what the cost of accuracy is judged by

and, where the defaults of `frictionsim.work_precision` do not fit, ladders(scene, tolerances),
references(scene, rtol) and tighter(scene): settings to compare, settings to judge by, and the
setting that `solve --estimate-error` compares with.

A mechanism of one coordinate has its equations in build(scene), composed of the effects that the
scene names, and leaves the rest to OneCoordinate.
"""
