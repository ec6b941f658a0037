"""Guided belts against the closed forms of creep, and against chains of bodies in the plane."""

from statistics import median
from typing import Any

import numpy as np

import frictionsim as fs
from frictionsim.results import Record
from tests.benchmarks.results_common import Table, quantity_of, say, tensions_of, warning_on, write
from tests.support.belt_scenarios import scenario_of
from tests.support.drawn_belts import drawn
from tests.support.drawn_drives import drawn_drive, scenario_of_drive, steady
from tests.support.scenarios import Scenario, changed, scenario_run

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


BODIES, POINTS = 600, 300
DEPTHS = (2e-4, 2e-5)  # m, at rest
LOAD = 0.3  # of the torque that is drawn, so that no belt slips as a whole
SETTINGS = {"solver__duration": 0.8, "solver__backend": "moreau", "output__channels": []}


def drawn_belts() -> None:
    """Write how guided strings differ from chains of bodies, on belt drives drawn at random.

    They are to differ by no more than the depth of the contact explains: a body that is pressed p
    deep into a rim of the radius R comes on to it with the strain p/(2R) to make up, so that a
    tension may be off by a part of EA p/(2R), and by as much less as the rim is firmer.
    """
    above = [
        f"Belts on 2 to 7 pulleys, some with a roller on the back, a torque on one and a resistance"
        f" over speed on another; {POINTS} points of a guided string against {BODIES} bodies with"
        f" wrap factors, pressed p = {1e3 * DEPTHS[0]:g} mm into the rims at rest, and"
        f" {1e3 * DEPTHS[1]:g} mm; {SETTINGS['solver__duration']} s, means of the last fifth. R is"
        " the smallest radius."
    ]
    rows = [_drawn_row(seed) for seed in range(8)]
    write(Table("Guided strings against chains of bodies", above, rows), "belt_drawn")


def _drawn_row(seed: int) -> dict[str, Any]:
    data = drawn(seed, **SETTINGS)
    torque = data["drive"]["p0"]["torque"]
    torque["value"] = [LOAD * value for value in torque["value"]]
    guided = _solved(changed(data, mechanism__belt__bodies=POINTS))
    chains = [_solved(_with_contact(data, depth)) for depth in DEPTHS]
    radius = min(pulley["radius"] for pulley in data["mechanism"]["pulleys"])
    strain = 0.5 * DEPTHS[0] / radius * data["mechanism"]["belt"]["axial_rigidity"]
    tensions = [np.max(np.abs(_spans(chain) - _spans(guided))) for chain in chains]
    string = quantity_of(guided, "slip_percent")
    slips = [abs(quantity_of(chain, "slip_percent") - string) for chain in chains]
    return {
        "seed": seed,
        "pulleys": len(data["mechanism"]["pulleys"]),
        "EA p/(2R) [N]": strain,
        "greatest difference of a span [N]": tensions[0],
        "the same, p a tenth [N]": tensions[1],
        "slip of the string [%]": string,
        "difference of the slip [%]": slips[0],
        "the same, p a tenth [%]": slips[1],
    }


def _with_contact(data: Scenario, depth: float) -> Scenario:
    """Return a belt on rims that it is pressed so deep into at rest, m, where they are smallest."""
    belt, pulleys = data["mechanism"]["belt"], data["mechanism"]["pulleys"]
    length = scenario_of(data).mechanism.path().length / BODIES
    force = belt["pretension"] * length / min(pulley["radius"] for pulley in pulleys)
    stiffness, mass = force / depth, belt["mass_per_length"] * length
    contact = {
        "c2": float(stiffness),
        "damping": float(0.3 * np.sqrt(stiffness * mass)),
        "p_max": depth,
        "reference_bodies": BODIES,
    }
    return changed(data, effects__contact=contact, mechanism__belt__bodies=BODIES)


def _solved(data: Scenario) -> Record:
    done = fs.solve(scenario_of(data)).record
    assert done.status == "done", done.reason
    say("".join(f"    {text}\n" for text in done.warnings))
    return done


def _spans(done: Record) -> Any:
    names = scenario_run(done).mechanism.names
    pairs = zip(names, (*names[1:], names[0]), strict=True)
    return np.array([done.quantities[f"tension_{a}_to_{b}"].value for a, b in pairs])
