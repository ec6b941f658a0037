"""What the depth of the contact does to slip and tension: the belt of the paper on firmer rims.

A body that presses itself p deep into a rim of the radius R comes on to it at an angle of about
sqrt(2 p/R) at most, and where it is seated it is on a circle smaller by p: friction catches it
before that. What is left between the slip and the creep of a string goes with that depth, not with
the mesh.
"""

from math import degrees, sqrt
from typing import Any

from tests.benchmarks.results_common import (
    WARM_UP_FRACTION,
    Table,
    quantity_of,
    say,
    slip,
    solve,
    warning_on,
    where_it_sticks,
    write,
)
from tests.benchmarks.results_wrap import LOAD, RECORDED, RIGIDITY

STIFFNESSES = (1, 4, 16, 64)  # over that of `belt_drive`, c1 and c2 alike
# Bending changes little but the level of both spans: the finest mesh does without.
MESHES = ((300, "without"), (600, "without"), (300, "with"))
HEADING = (
    *("stiffness over the paper's", "bodies", "bending", "depth at rest [mm]"),
    *("angle of entry [deg]", "T1 [N]", "T2 [N]", "slip over elastic creep"),
    *("tension where it sticks to the driver, over T1", "step [us]", "warning"),
)
DURATION = 1.2  # s
C1, C2, DAMPING, P_MAX = 3.0256e9, 6.5e5, 300.0, 1e-3  # of a body of a belt of 150
TENSION, RADIUS, LENGTH = 555.0, 0.027, 1.2 / 150  # N, m, and m of a body of a belt of 150


def seat(meshes: tuple[tuple[int, str], ...] = MESHES) -> None:
    """Measure, and write the table."""
    tabulate(
        [
            measure(stiffness, bodies, bending)
            for bodies, bending in meshes
            for stiffness in STIFFNESSES
        ]
    )


def tabulate(rows: list[tuple[Any, ...]]) -> None:
    """Write the table of what was measured."""
    above = [
        "`belt_drive` with its resistance continued beyond 8 pi rad/s and contacts whose c1 and c2"
        " are so many times the paper's; their damping goes with the root of that, their p_max with"
        " the depth. Wrap factors, fixed steps (`moreau`), each as long as the method takes by"
        f" itself; {DURATION} s, means of the last 0.6 of it. A string without mass, bending or"
        " depth has T1 = 835.7 N, T2 = 280.1 N, and 1 in both ratios.",
    ]
    write(Table("What the depth of the contact does", above, HEADING, rows), "belt_seat")


def depth(stiffness: float) -> float:
    """Return how deep a body rests in the rim, m: N = T l/R = c1 p^2 + c2 p."""
    force, c1, c2 = TENSION * LENGTH / RADIUS, stiffness * C1, stiffness * C2
    return 2.0 * force / (c2 + sqrt(c2 * c2 + 4.0 * c1 * force))


def measure(stiffness: int, bodies: int, bending: str) -> tuple[Any, ...]:
    """Run one mesh on rims of one stiffness."""
    say(f"  {stiffness} times as stiff, {bodies} bodies, {bending} bending")
    contact = {
        "c1": stiffness * C1,
        "c2": stiffness * C2,
        "damping": sqrt(stiffness) * DAMPING,
        "p_max": P_MAX * depth(stiffness) / depth(1.0),
    }
    settings = (
        *(f"effects.contact.{key}={value!r}" for key, value in contact.items()),
        *(f"mechanism.belt.bodies={bodies}", "solver.backend=moreau", *LOAD, RECORDED),
    )
    without = () if bending == "with" else ("bending",)
    solve("belt_drive", *settings, *WARM_UP_FRACTION, without=without)
    found = solve("belt_drive", *settings, f"solver.duration={DURATION}", without=without)
    tight, slack = quantity_of(found, "tension_tight"), quantity_of(found, "tension_slack")
    row = (
        *(stiffness, bodies, bending, 1e3 * depth(stiffness)),
        degrees(sqrt(depth(stiffness) / RADIUS)),
        *(tight, slack, slip(found) * RIGIDITY / (tight - slack)),
        where_it_sticks(found) / tight,
        1e6 * DURATION / found.statistics.steps,
        warning_on(found),
    )
    say(f"  {row}")
    return row
