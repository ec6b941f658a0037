"""The functions and classes behind `import frictionsim`, which the command line uses as well.

    scenarios     static, new, kinds, scenarios, warm_up
    solving       solve and resume
    result        Result and open, and the base of all results
    opening       files of results and sweeps, and names of several
    sweeping      sweep and resume_sweep
    sweep_result  Sweep and open_sweep
    studies       cost and Study
    fitting       fit and Fit
    comparing     compare
    pictures      plot and animate
    reporting     report
    dataset       results as xarray.Dataset
    progress      progress bars

They return values and raise the exceptions of `frictionsim.errors`; only `progress` prints.
"""
