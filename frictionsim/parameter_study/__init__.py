"""Studies of many runs of one scenario with other values: sweeps, samples and identification.

A sweep runs a scenario for many combinations of values (`values`, `design`), each of which is
validated before anything runs. A fit varies free values until a run agrees with measured data.
"""
