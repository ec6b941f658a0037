"""How far guided belts are off the closed forms of creep, on drives of two unlike pulleys.

Each drive is drawn at random: radii, distance, stiffness, mass, pretension, a coefficient of
friction for each pulley, the torque and the direction. An error of the creep or a tension is
relative to its exact value, that of an arc of adhesion in rad.
"""

from statistics import median
from typing import Any

from frictionsim.simulation.simulate import run
from tests.benchmarks.results_common import Table, quantity_of, say, warning_on, write
from tests.support.belt_scenarios import scenario_of
from tests.support.drawn_drives import drawn_drive, scenario_of_drive, steady

DRIVES, POINTS = 23, (60, 150, 300)
ERRORS = ("creep", "tension_tight", "tension_slack", "adhesion_arc")
HEADING = (
    *("points", "creep, median [%]", "creep, largest [%]"),
    *("tight span, median [%]", "tight span, largest [%]"),
    *("slack span, median [%]", "slack span, largest [%]"),
    *("arc of adhesion, median [rad]", "arc of adhesion, largest [rad]"),
)


def drawn_creep() -> None:
    """Measure, and write the table."""
    rows = [row(points) for points in POINTS]
    above = [
        f"{DRIVES} drives of two pulleys, with radii of 20 to 120 mm, coefficients of friction of"
        " 0.25 to 1 and 10 to 90 % of the torque at which the belt slips as a whole, with a tenth"
        " of each arc at least that sticks, run as guided belts with `moreau` for 2 s; means of the"
        " last fifth.",
    ]
    write(Table("Creep of guided belts", above, HEADING, rows), "guided_creep")


def row(points: int) -> tuple[Any, ...]:
    """Return the medians and largest errors of all drives at a number of points."""
    errors = [errors_of(seed, points) for seed in range(DRIVES)]
    found: list[Any] = [points]
    for key in ERRORS:
        sizes = [abs(size) for error in errors for size in error[key]]
        found += [median(sizes), max(sizes)]
    return tuple(found)


def errors_of(seed: int, points: int) -> dict[str, list[float]]:
    """Run one drive; return its errors, % and rad."""
    drive = drawn_drive(seed)
    exact, done = steady(drive), run(scenario_of(scenario_of_drive(drive, points)), lambda t: None)
    assert not warning_on(done), warning_on(done)
    found = {
        "creep": [quantity_of(done, "slip_percent") / exact.creep - 100.0],
        "tension_tight": [100.0 * (quantity_of(done, "tension_tight") / exact.tight - 1.0)],
        "tension_slack": [100.0 * (quantity_of(done, "tension_slack") / exact.slack - 1.0)],
        "adhesion_arc": [
            quantity_of(done, f"adhesion_arc_{name}") - arc
            for name, arc in zip(("driver", "driven"), exact.adhesion, strict=True)
        ],
    }
    say(f"  {points} points, drive {seed}: {found} {done.warnings}")
    return found
