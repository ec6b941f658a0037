"""Work-precision studies: one scenario solved by every backend with several settings.

settings.py         the settings and references of mechanisms of one coordinate
mesh_limit.py       the limit of ever finer meshes
outcome.py          what a study runs and finds
errors.py           the errors of a run against a reference
study.py            runs and times the settings
recommendation.py   the fastest setting for a required error
report.py           JSON, CSV and columns for HDF5
error_estimate.py   `frictionsim solve --estimate-error`
"""
