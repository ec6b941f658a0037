"""Attacks on the command line: damaged, foreign and extreme input, signals, streams, environments.

Each module has a function `attack(rng, folder)` that tries one case in an empty folder and returns
what came of it in a word or two; it raises `BrokenPromise` if a promise of the program was broken.
A function `warm_up()` makes what its cases change, before the time of the first of them counts.
"""
