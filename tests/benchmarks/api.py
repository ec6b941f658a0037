"""How long functions take in a Python that runs already, as in a notebook or a loop.

Run it with `python -m tests.benchmarks.api`. Functions take turns, so that a machine whose speed
drifts treats them alike.
"""

import tempfile
from collections.abc import Callable
from pathlib import Path
from statistics import median
from time import perf_counter
from typing import Any

import frictionsim as fs

RUNS = 101


def main() -> None:
    """Print a table of medians."""
    path = fs.scenarios()["pulley"]
    pulley = fs.load(path)
    samples = pulley.replace({"output.interval": 0.01, "output.at_events": False})
    without = pulley.replace({"output.interval": pulley.solver.duration, "output.at_events": False})
    file = Path(tempfile.mkdtemp()) / "pulley.h5"
    saved = fs.solve(samples)
    saved.save(file)
    calls: dict[str, Callable[[], Any]] = {
        "solve, 301 samples": lambda: fs.solve(samples),
        "solve, 301 samples, and dataset": lambda: fs.solve(samples).dataset,
        "solve without samples": lambda: fs.solve(without),
        "solve from the path, 301 samples": lambda: fs.solve(path),
        "load": lambda: fs.load(path),
        "replace": lambda: pulley.replace({"solver.rtol": 1e-8}),
        "dataset": lambda: fs.Result(saved.record).dataset,
        "save": lambda: saved.save(file),
        "open": lambda: fs.open(file),
        "static": lambda: fs.static(pulley),
    }
    times: dict[str, list[float]] = {name: [] for name in calls}
    for run in range(RUNS + 1):
        for name, call in calls.items():
            started = perf_counter()
            call()
            if run:  # the first one imports
                times[name].append(perf_counter() - started)
    print(f"{'function':34s} {'median ms':>9s} {'least ms':>9s}")
    for name, measured in times.items():
        print(f"{name:34s} {median(measured) * 1e3:9.2f} {min(measured) * 1e3:9.2f}")


if __name__ == "__main__":
    main()
