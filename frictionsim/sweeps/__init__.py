"""Sweeps and samples: many runs of one scenario with other values.

Each combination of values (`values`, `design`) is validated before anything runs.
"""
