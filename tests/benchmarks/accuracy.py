"""What the backends reach on the pulley's reference profile, tolerance by tolerance.

Run it with `python tests/benchmarks/accuracy.py` from the root of the project.
"""

import sys
from pathlib import Path
from statistics import median
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[2]))

from frictionsim.results import Record
from tests.support.problems import RETURN_FORCE, RETURN_STICK
from tests.support.scenarios import pulley, simulate, with_method

REPEATS = 9
PUBLISHED = ("published", "rkf45")


def measured(law: str, backend: str, **solver: Any) -> tuple[Record, float]:
    """Return a run of the return profile and the median of its wall seconds."""
    data = pulley(drive__force=RETURN_FORCE, solver__duration=12.0, **solver)
    data = with_method(data, law, backend)
    runs = [simulate(data) for _ in range(REPEATS)]
    return runs[-1], median(run.statistics.wall_seconds for run in runs)


def main() -> None:
    print(f"{'backend':10s} {'setting':>12s} {'stop, s':>9s} {'angle, rad':>10s} {'steps':>7s} ms")
    settings = [
        (law, backend, {"rtol": rtol, "atol": rtol * 1e-3})
        for law, backend in (("set-valued", "events"), ("set-valued", "rkf45"), PUBLISHED)
        for rtol in (1e-4, 1e-6, 1e-8, 1e-10, 1e-12)
    ]
    settings += [(*PUBLISHED, {"step": step}) for step in (1e-2, 1e-3, 1e-4)]
    for law, backend, setting in settings:
        changes = {f"solver__{name}": value for name, value in setting.items()}
        run, seconds = measured(law, backend, **changes)
        if run.status != "done":
            print(f"{law:10s} {backend:10s} {run.status}: {run.reason}")
            continue
        stop = abs(run.transitions[1].time - RETURN_STICK[0])
        angle = abs(run.channels["angle"][-1] - RETURN_STICK[1])
        name, value = next(iter(setting.items()))
        print(
            f"{law:10s} {backend:10s} {name + f' {value:.0e}':>12s} {stop:9.1e} {angle:10.1e}"
            f" {run.statistics.steps:7d} {seconds * 1e3:.1f}"
        )


if __name__ == "__main__":
    main()
