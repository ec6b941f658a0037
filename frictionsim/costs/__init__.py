"""Work-precision studies: one scenario solved by every backend with several settings.

settings.py         the options of a study, its settings and references
study.py            runs, times and judges the settings
study_table.py      rows, the table of their columns, JSON, and the recommended settings
error_estimate.py   `frictionsim solve --estimate-error`
"""
