"""What Kubas 2014 shows of its two drives, beside what we find."""

import json
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.io import hdf5_reader
from tests.benchmarks.results_common import (
    RESULTS,
    Table,
    command,
    spans,
    write,
)

if TYPE_CHECKING:
    from frictionsim.results import Record

START = 0.5  # s, from which on means are taken
PRINTED = {
    "speed of the driver [rad/s]": "about -22.5 from 0.3 s on (expected -25.1)",
    "slip [%]": "almost 1.5",
    "tension of the active span [N]": "about 780",
    "tension of the passive span [N]": "about 250",
    "median relative speed [m/s]": "far above 1.5e-5",
    "share of touching bodies that stick": "only slip occurs",
    "end [s]": "",
    "audit": "",
    "wall time [s]": "",
}
TOLERANCES = ("1e-2",)  # of the published law; 1e-3 takes minutes, 1e-4 a quarter of an hour
EXACT = "exact stick"
CODES = 0, 1, 3  # also of a solver or a self-audit that failed: that is what is told here


class Solved(NamedTuple):
    """A result, and the wall time that it took."""

    result: "Record"
    seconds: float


def paper() -> None:
    """Solve the drive by both laws, draw it, and write the numbers down."""
    runs = {EXACT: _solve("belt_drive")}
    for rtol in TOLERANCES:
        options = ("--set", "solver.duration=2.0", "--set", f"solver.rtol={rtol}")
        runs[f"published law, rtol {rtol}"] = _solve("belt_drive_published", *options)
    for view in ("speeds", "drive"):
        options = ("--view", view, "-o", f"results/belt_drive_{view}.png")
        command("plot", "results/belt_drive.h5", *options)
    write(_table(runs), "belt_paper")


def _solve(name: str, *options: str) -> Solved:
    line = ("solve", f"scenarios/{name}.toml", *options, "-o", f"results/{name}.h5", "--json")
    solver = json.loads(command(*line, codes=CODES))["solver"]
    return Solved(hdf5_reader.read(RESULTS / f"{name}.h5"), solver["wall_seconds"])


def _table(runs: dict[str, Solved]) -> Table:
    columns = [_numbers(solved) for solved in runs.values()]
    rows = [(name, words, *(column[name] for column in columns)) for name, words in PRINTED.items()]
    above = [f"Means from {START:g} to 2 s of `belt_drive.toml` and `belt_drive_published.toml`."]
    return Table(
        "The belt drive of Kubas 2014 and ours", above, ("quantity", "paper", *runs), rows, []
    )


def _numbers(solved: Solved) -> dict[str, Any]:
    """Return the means of a run; none of them if it ended before."""
    result, channels = solved.result, solved.result.channels
    found = dict.fromkeys(PRINTED, float("nan")) | {
        "end [s]": float(channels["time"][-1]),
        "audit": result.attributes["reason"] or "passed",
        "wall time [s]": solved.seconds,
    }
    late = channels["time"] >= START
    if not late.any():
        return found
    turned = np.ptp(channels["pulley_angle"][late], axis=0)
    touching = channels["pulley_index"][late] >= 0
    speeds = np.abs(channels["slip_velocity"][late][touching])
    active, passive = spans(channels, late)
    return found | {
        "speed of the driver [rad/s]": float(np.mean(channels["pulley_speed"][late, 0])),
        "slip [%]": 100.0 * float(1.0 - turned[1] / turned[0]),
        "tension of the active span [N]": active,
        "tension of the passive span [N]": passive,
        "median relative speed [m/s]": float(np.median(speeds)),
        "share of touching bodies that stick": float(np.mean(channels["sticking"][late][touching])),
    }
