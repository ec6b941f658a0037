"""What accuracy costs: one scenario solved by every backend, at a ladder of settings of each.

settings.py   a setting, and the ladders of mechanisms of one coordinate
measures.py   what is judged; a kind of mechanism names its own
judgement.py  the errors of a run against a reference
study.py      runs and times the settings one after another
advice.py     the cheapest setting that is exact enough
report.py     table, JSON, CSV and HDF5;   diagram.py   the work-precision diagram
command.py    `frictionsim cost`;   estimate.py   `frictionsim solve --estimate-error`
"""
