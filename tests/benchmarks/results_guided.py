"""Guided belts against the closed forms of creep."""

from statistics import median

import frictionsim as fs
from tests.benchmarks.results_common import Table, quantity_of, say, tensions_of, warning_on, write
from tests.support.belt_scenarios import scenario_of
from tests.support.drawn_drives import drawn_drive, scenario_of_drive, steady

DRIVES = 23
ERRORS = {  # relative ones in %, those of arcs in rad
    "creep": ("creep", "%"),
    "tension_tight": ("tight span", "%"),
    "tension_slack": ("slack span", "%"),
    "adhesion_arc": ("arc of adhesion", "rad"),
}


def creep() -> None:
    """Write how far guided belts are off the closed forms, on drives of two unlike pulleys."""
    rows = []
    for points in (60, 150, 300):
        errors = [errors_of(seed, points) for seed in range(DRIVES)]
        rows.append({"points": points})
        for key, (words, unit) in ERRORS.items():
            sizes = [abs(size) for error in errors for size in error[key]]
            rows[-1] |= {f"{words}, median [{unit}]": median(sizes)}
            rows[-1] |= {f"{words}, largest [{unit}]": max(sizes)}
    above = [
        f"{DRIVES} drives of two pulleys, with radii of 20 to 120 mm, coefficients of friction of"
        " 0.25 to 1 and 10 to 90 % of the torque at which the belt slips as a whole, with a tenth"
        " of each arc at least that sticks, run as guided belts with `moreau` for 2 s; means of the"
        " last fifth."
    ]
    write(Table("Creep of guided belts", above, rows), "guided_creep")


def errors_of(seed: int, points: int) -> dict[str, list[float]]:
    """Run one drive; return its errors, % and rad."""
    drive = drawn_drive(seed)
    exact = steady(drive)
    done = fs.solve(scenario_of(scenario_of_drive(drive, points))).record
    assert not warning_on(done), warning_on(done)
    tight, slack = tensions_of(done)
    names = zip(("driver", "driven"), exact.adhesion, strict=True)
    errors = {
        "creep": [quantity_of(done, "slip_percent") / exact.creep - 100.0],
        "tension_tight": [100.0 * (tight / exact.tight - 1.0)],
        "tension_slack": [100.0 * (slack / exact.slack - 1.0)],
        "adhesion_arc": [quantity_of(done, f"adhesion_arc_{name}") - arc for name, arc in names],
    }
    say(f"  {points} points, drive {seed}: {errors} {done.warnings}")
    return errors
