"""Work-precision studies: one scenario solved by every backend with several settings.

settings.py         the settings and references of mechanisms of one coordinate
outcome.py          what a study runs, the errors of a run, rows and references
study.py            runs and times the settings
recommendation.py   the fastest setting for a required error
table.py            JSON, CSV and columns for HDF5, and the study of such a table
error_estimate.py   `frictionsim solve --estimate-error`
"""
