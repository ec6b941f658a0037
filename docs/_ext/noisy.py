"""Print a channel of a result as CSV, with normal noise: RESULT CHANNEL STANDARD_DEVIATION."""

import sys

import numpy as np

import frictionsim as fs

path, name, deviation = sys.argv[1:]
channel = fs.open(path).dataset[name]
noise = np.random.default_rng(1).normal(0.0, float(deviation), channel.size)
print(f"time [s],{name} [{channel.units}]")
for time, value in zip(channel.time.values, channel.values + noise, strict=True):
    print(f"{time:.6g},{value:.6g}")
