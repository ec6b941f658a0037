"""Seeded faults: small errors set into the package one at a time, to see which tests find them.

`faults.toml` has what each means, and the text that sets it; `python -m tests.faults` draws new
ones, checks that all can still be set, and runs the tests against each.
"""
