"""What the wrap factor of the bodies is worth: closed forms over bodies, with it and without.

In the mean the torques balance, T1 - T2 = M/R. A string creeps by (T1 - T2)/EA, and has the tension
of the tight span where it sticks to the driver; without load it has the tension of its spans
everywhere. The limit of fine meshes is not that string: bodies that press themselves into a soft
rim enter it at an angle.
"""

from itertools import pairwise
from math import log2
from typing import NamedTuple

from frictionsim.results import Record
from tests.benchmarks.results_common import (
    WARM_UP_FRACTION,
    Table,
    arc_over_span,
    quantity_of,
    say,
    slip,
    solve,
    warning_on,
    where_it_sticks,
    write,
)

BODIES = (60, 100, 150, 300, 600, 1200)
MODELS = ("polygon", "corrected")
HEADING = (
    *("model", "bending", "bodies", "T1 [N]", "T2 [N]", "T1 - T2 [N]"),
    *("slip over elastic creep", "off its limit [%]"),
    *("tension where it sticks to the driver, over T1", "unloaded: arc over span"),
    *("unloaded: slip [%]", "warning"),
)
RECORDED = "output.channels=['pulley_speed', 'pulley_index', 'sticking', 'tension']"
# Loaded and without load, s: enough of a fine mesh passes in less time.
DURATIONS, FINE, OF_FINE = (2.0, 2.0), 1200, (1.2, 0.8)
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
RIGIDITY = 1.52e5  # N


class Row(NamedTuple):
    """What one mesh gives: tensions in N, slip over elastic creep, tensions over each other."""

    model: str
    bending: str
    bodies: int
    tight: float
    slack: float
    ratio: float
    arc: float
    unloaded_arc: float
    unloaded_slip: float
    warning: str


def wrap(bodies: tuple[int, ...] = BODIES) -> None:
    """Measure, and write the table."""
    tabulate(
        [
            measure(model, bending, count)
            for bending in ("without", "with")
            for model in MODELS
            for count in bodies
        ]
    )


def tabulate(rows: list[Row]) -> None:
    """Write the table of what was measured."""
    above = [
        "`belt_drive` with its resistance continued beyond 8 pi rad/s, and without load behind a"
        " driver of 25 rad/s; fixed steps (`moreau`). `polygon` takes the slip from the velocity"
        " of a body's centre, `corrected` from that times its wrap factor. The torque asks for"
        " T1 - T2 = 555.56 N; a string without mass, bending or depth has T1 = 835.7 N, T2 ="
        " 280.1 N, and 1 in each of the ratios. The limit of the slip is that of `corrected` at"
        " the two finest meshes, extrapolated with the square of the length of a body.",
    ]
    limits = {bending: _limit(rows, "corrected", bending) for bending in ("without", "with")}
    cells = [
        (
            *(row.model, row.bending, row.bodies, row.tight, row.slack, row.tight - row.slack),
            *(row.ratio, 100.0 * (row.ratio / limits[row.bending] - 1.0)),
            *(row.arc, row.unloaded_arc, row.unloaded_slip, row.warning),
        )
        for row in rows
    ]
    below = [
        _order(rows, model, bending, limit) for bending, limit in limits.items() for model in MODELS
    ]
    write(Table("What the wrap factor is worth", above, HEADING, cells, below), "belt_wrap")


def measure(model: str, bending: str, count: int) -> Row:
    """Run one mesh, loaded and without load."""
    say(f"  {model}, {count} bodies, {bending} bending")
    durations = OF_FINE if count >= FINE else DURATIONS
    loaded = _run(model, bending, count, durations[0], LOAD)
    idle = _run(model, bending, count, durations[1], IDLE)
    tight, slack = quantity_of(loaded, "tension_tight"), quantity_of(loaded, "tension_slack")
    found = Row(
        *(model, bending, count, tight, slack),
        slip(loaded) * RIGIDITY / (tight - slack),
        where_it_sticks(loaded) / tight,
        arc_over_span(idle),
        100.0 * slip(idle),
        warning_on(loaded) or warning_on(idle),
    )
    say(f"  {found}")
    return found


def _run(model: str, bending: str, count: int, duration: float, drive: tuple[str, ...]) -> Record:
    settings = (
        *("solver.backend=moreau", f"mechanism.belt.bodies={count}"),
        *(f"mechanism.belt.wrap={model}", *drive, RECORDED),
    )
    without = () if bending == "with" else ("bending",)
    solve("belt_drive", *settings, *WARM_UP_FRACTION, without=without)
    return solve("belt_drive", *settings, f"solver.duration={duration}", without=without)


def _family(rows: list[Row], model: str, bending: str) -> list[Row]:
    return [row for row in rows if (row.model, row.bending) == (model, bending)]


def _limit(rows: list[Row], model: str, bending: str) -> float:
    """Return the slip of bodies without length, over elastic creep."""
    coarse, fine = _family(rows, model, bending)[-2:]
    grown = (fine.bodies / coarse.bodies) ** 2
    return fine.ratio + (fine.ratio - coarse.ratio) / (grown - 1.0)


def _order(rows: list[Row], model: str, bending: str, limit: float) -> str:
    """Return in words how fast the slip comes to its limit, from mesh to mesh.

    Where the limit follows from the two finest meshes, these say nothing about an order.
    """
    family = _family(rows, model, bending)
    known = family[:-1] if model == "corrected" else family
    orders = [
        log2(abs((coarse.ratio - limit) / (fine.ratio - limit))) / log2(fine.bodies / coarse.bodies)
        for coarse, fine in pairwise(known)
    ]
    listed = ", ".join(f"{order:.1f}" for order in orders)
    own = _limit(rows, model, bending)
    return (
        f"{model}, {bending} bending: slip goes to {limit:.4f} with the orders {listed} from mesh"
        f" to mesh; its own two finest meshes give {own:.4f}."
    )
