"""The functions and classes behind `import frictionsim`, which the command line uses as well.

    solving       solve and resume
    statics       static
    result        Result and open
    result_base   what all results have
    sweep_result  Sweep and open_sweep
    studies       cost and Study
    fitting       fit and Fit
    comparing     compare
    pictures      plot
    arguments     checks of arguments
    warming       warm_up
    dataset       results as xarray.Dataset
    tables        results as text and HTML
    progress      the progress bar

They return values and raise the exceptions of `frictionsim.errors`; only `progress` prints.
"""
