"""What the wrap factor of the bodies is worth: closed forms over bodies, with it and without.

In the mean the torques balance, T1 - T2 = M/R. A string creeps by (T1 - T2)/EA, and has the tension
of the tight span where it sticks to the driver; without load it has the tension of its spans
everywhere. The limit of fine meshes is not that string: bodies that press themselves into a soft
rim enter it at an angle.
"""

from math import log2
from typing import Any

import numpy as np

from frictionsim.simulation.simulate import RunResult
from tests.benchmarks.results_common import (
    WARM_UP_FRACTION,
    Table,
    quantity_of,
    say,
    solve,
    warning_on,
    write,
)

BODIES = (60, 150, 300, 600, 1200)
MODELS = ("polygon", "corrected")
HEADING = (
    *("model", "bending", "bodies", "T1 [N]", "T2 [N]", "T1 - T2 over M/R"),
    *("slip over elastic creep", "tension where it sticks to the driver, over T1"),
    *("unloaded: arc over span", "unloaded: slip [%]", "wall time [s]", "warning"),
)
MODEL, BENDING, COUNT, RATIO, ARC = 0, 1, 2, 6, 7
RECORDED = "output.channels=['pulley_speed', 'pulley_index', 'sticking', 'tension']"
DURATION = 2.0  # s
# The resistance goes on with the speed: so coarse meshes have one, too.
LOAD = (
    "drive.driven.torque={speed = [-251.327412, 251.327412], value = [150.0, -150.0]}",
    "output.interval=1e-3",
)
IDLE = (
    "drive.driver={speed = {time = [0.0, 0.1], value = [0.0, -25.0]}}",
    "drive.driven.torque={time = [0.0], value = [0.0]}",
    "output.interval=1e-3",
)
TORQUE, RADIUS, RIGIDITY = 15.0, 0.027, 1.52e5  # N m, m, N


def wrap(bodies: tuple[int, ...] = BODIES) -> None:
    """Measure, and write the table."""
    rows = [
        _measure(model, bends, count)
        for bends in (False, True)
        for model in MODELS
        for count in bodies
    ]
    above = [
        "`belt_drive` with its resistance continued beyond 8 pi rad/s, and without load behind a"
        " driver of 25 rad/s; fixed steps (`moreau`), slip and arcs from 0.8 s to 2 s, spans over"
        " the last fifth. `polygon`"
        " takes the slip from the velocity of a body's centre, `corrected` from that times its wrap"
        " factor.",
    ]
    below = [_order(rows, model, bends) for bends in ("without", "with") for model in MODELS]
    write(Table("What the wrap factor is worth", above, HEADING, rows, below), "belt_wrap")


def _measure(model: str, bends: bool, count: int) -> tuple[Any, ...]:
    say(f"  {model}, {count} bodies, {'with' if bends else 'without'} bending")
    loaded, idle = (_run(model, bends, count, drive) for drive in (LOAD, IDLE))
    late = loaded.time >= 0.4 * loaded.time[-1]
    tight, slack = quantity_of(loaded, "tension_tight"), quantity_of(loaded, "tension_slack")
    slip = _slip(loaded, late)
    row = (
        *(model, "with" if bends else "without", count, tight, slack),
        (tight - slack) * RADIUS / TORQUE,
        slip * RIGIDITY / (tight - slack),
        _where_it_sticks(loaded, late) / tight,
        _arc_over_span(idle, late),
        100.0 * _slip(idle, late),
        loaded.statistics.wall_seconds,
        warning_on(loaded) or warning_on(idle),
    )
    say(f"  {row}")
    return row


def _slip(found: RunResult, late: Any) -> float:
    """Return the slip; a window that fades at its ends leaves nothing of the pulleys' swing."""
    speed = found.channels["pulley_speed"][late]
    driver, driven = np.hanning(len(speed)) @ speed
    return float(1.0 - driven / driver)


def _run(model: str, bends: bool, count: int, drive: tuple[str, ...]) -> RunResult:
    settings = (
        *("solver.backend=moreau", f"mechanism.belt.bodies={count}"),
        *(f"mechanism.belt.wrap={model}", *drive, RECORDED),
    )
    without = () if bends else ("bending",)
    solve("belt_drive", *settings, *WARM_UP_FRACTION, without=without)
    return solve("belt_drive", *settings, f"solver.duration={DURATION}", without=without)


def _inside(found: RunResult, late: Any, pulley: float) -> Any:
    """Return which joints are between two bodies on a pulley, or on none, -1."""
    on = found.channels["pulley_index"][late] == pulley
    return on & np.roll(on, 1, axis=1)


def _where_it_sticks(found: RunResult, late: Any) -> float:
    """Return the median tension of the joints on the driver whose body sticks there, N."""
    inside = _inside(found, late, 0.0) & (found.channels["sticking"][late] > 0.0)
    return float(np.median(found.channels["tension"][late][inside]))


def _arc_over_span(found: RunResult, late: Any) -> float:
    """Return the mean tension on the driver over that of the joints that touch nothing."""
    tension = found.channels["tension"][late]
    arc, span = (tension[_inside(found, late, pulley)] for pulley in (0.0, -1.0))
    return float(np.mean(arc) / np.mean(span))


def _order(rows: list[tuple[Any, ...]], model: str, bends: str) -> str:
    """Return in words how fast the slip comes to that of the finest mesh."""
    family = [row for row in rows if row[MODEL] == model and row[BENDING] == bends]
    finest = family[-1][RATIO]
    errors = [abs(row[RATIO] / finest - 1.0) for row in family[:-1]]
    shares = ", ".join(
        f"{100.0 * error:.2g} % at {row[COUNT]}" for row, error in zip(family, errors, strict=False)
    )
    steps = zip(family, family[1:-1], errors, errors[1:], strict=False)
    orders = ", ".join(
        f"{log2(before / after) / log2(fine[COUNT] / coarse[COUNT]):.1f}"
        for coarse, fine, before, after in steps
    )
    return (
        f"{model}, {bends} bending: slip off that of the finest mesh by {shares}; orders {orders}."
    )
