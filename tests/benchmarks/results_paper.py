"""What Kubas 2014 shows of its two drives, beside what we find."""

import json
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from frictionsim.io import hdf5_reader
from frictionsim.plots import draw
from frictionsim.plots.belt_geometry import middle_of_first_span
from frictionsim.plots.style import BLACK, GREY, add_legend, grid, line_style
from tests.benchmarks.results_common import (
    RESULTS,
    WIDTH,
    Table,
    command,
    save_picture,
    spans,
    write,
)

if TYPE_CHECKING:
    from frictionsim.results import Record

START = 0.5  # s, from which on means are taken
PRINTED_SPEED, EXPECTED_SPEED = -22.5, -25.1  # rad/s, of the drive
PRINTED_SLIP = 1.5  # %
PASSIVE, ACTIVE = 250.0, 780.0  # N
TRANSITION = 1.5e-5  # m/s
LEAST = 1e-9  # m/s, below which relative speeds are drawn on the lower edge
MARKS = (  # in the first panels of a body: value, words, and which side of the words it is on
    ((PRINTED_SPEED, "paper: -22.5", "bottom"), (EXPECTED_SPEED, "expected: -25.1", "top")),
    ((PASSIVE, "paper: passive, 250", "top"), (ACTIVE, "paper: active, 780", "top")),
)
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
    """Solve both drives, draw what one body meets, and write the numbers down."""
    runs = {EXACT: _solve("belt_drive")}
    for rtol in TOLERANCES:
        options = ("--set", "solver.duration=2.0", "--set", f"solver.rtol={rtol}")
        runs[f"published law, rtol {rtol}"] = _solve("belt_drive_published", *options)
    figure = draw(runs[EXACT].result, "body")
    _mark(figure)
    save_picture(figure, "belt_drive_body")
    save_picture(_relative_speed(runs), "belt_drive_slip")
    for view in ("speeds", "drive", "tension"):
        _draw("belt_drive", view)
    _solve("belt_verification")
    for view in ("speeds", "body", "tension"):
        _draw("belt_verification", view)
    write(_table(runs), "belt_paper")


def _solve(name: str, *options: str) -> Solved:
    line = ("solve", f"scenarios/{name}.toml", *options, "-o", f"results/{name}.h5", "--json")
    solver = json.loads(command(*line, codes=CODES))["solver"]
    return Solved(hdf5_reader.read(RESULTS / f"{name}.h5"), solver["wall_seconds"])


def _draw(name: str, view: str) -> None:
    command("plot", f"results/{name}.h5", "--view", view, "-o", f"results/{name}_{view}.png")


def _mark(figure: Figure) -> None:
    """Mark the numbers of the paper in the panels of a body."""
    for panel, marks in zip(figure.axes, MARKS, strict=False):
        panel.margins(y=0.2)
        for value, words, side in marks:
            panel.axhline(value, color=BLACK, linewidth=0.8, linestyle=(0, (1, 1)))
            panel.annotate(
                words,
                (0.995, value),
                (0.0, 2.0 if side == "bottom" else -2.0),
                xycoords=("axes fraction", "data"),
                textcoords="offset points",
                ha="right",
                va=side,
                fontsize="x-small",
            )
    figure.suptitle(
        "What one body meets (Kubas 2014, figs 14 to 18), exact stick, scenarios/belt_drive.toml",
        fontsize="medium",
    )


def _relative_speed(runs: dict[str, Solved]) -> Figure:
    """Draw speed of the drive and speed of one body against its pulley, by either law."""
    figure = Figure(figsize=(WIDTH, 5.0), layout="constrained")
    figure.suptitle(
        "Exact stick and the published law, as far as they come in 2 s", fontsize="medium"
    )
    speed, relative = figure.subplots(2, 1, sharex=True)
    number = middle_of_first_span(runs[EXACT].result.channels["pulley_index"][0])
    handles = []
    for i, (label, (result, _)) in enumerate(runs.items()):
        time = result.channels["time"]
        label = f"{label}, to {time[-1]:.3g} s"
        handles += speed.plot(
            time, result.channels["pulley_speed"][:, 0], **line_style(i), label=label
        )
        relative.plot(time, _of_body(result, number), **line_style(i) | {"linewidth": 0.8})
    speed.set_ylabel("speed of the driver,\nrad/s")
    speed.axhline(PRINTED_SPEED, color=GREY, linewidth=0.8, linestyle=(0, (1, 1)))
    relative.set_yscale("log")
    relative.set_ylim(LEAST, 10.0)
    style = {"color": BLACK, "linewidth": 0.8, "linestyle": (0, (1, 1))}
    handles.append(relative.axhline(TRANSITION, **style, label="1.5e-5 m/s"))
    relative.set_ylabel(f"speed of body {number} against\nthe pulley it touches, m/s")
    relative.set_xlabel("time, s")
    for panel in (speed, relative):
        grid(panel)
    add_legend(figure, handles, columns=2)
    return figure


def _of_body(result: "Record", number: int) -> Any:
    touching = result.channels["pulley_index"][:, number] >= 0
    speed = np.maximum(np.abs(result.channels["slip_velocity"][:, number]), LEAST)
    return np.where(touching, speed, np.nan)


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
