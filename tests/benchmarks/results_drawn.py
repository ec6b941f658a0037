"""Guided strings against chains of bodies in the plane, on belt drives drawn at random.

Both are run to a steady state. They are to differ by no more than the depth of the contact
explains: a body that is pressed p deep into a rim of the radius R comes on to it with the strain
p/(2R) to make up, so that a tension may be off by a part of EA p/(2R), and by as much less as the
rim is firmer.
"""

from typing import Any

import numpy as np

from frictionsim.results import Record
from frictionsim.simulation.simulate import run
from tests.benchmarks.results_common import Table, say, write
from tests.support.belt_scenarios import scenario_of
from tests.support.drawn_belts import drawn
from tests.support.scenarios import Scenario, changed, scenario_run

SEEDS = range(8)
BODIES, POINTS = 600, 300
DEPTHS = (2e-4, 2e-5)  # m, at rest
LOAD = 0.3  # of the torque that is drawn, so that no belt slips as a whole
SETTINGS = {"solver__duration": 0.8, "solver__backend": "moreau", "output__channels": []}
HEADING = (
    *("seed", "pulleys", "EA p/(2R) [N]", "greatest difference of a span [N]"),
    *("the same, p a tenth [N]", "slip of the string [%]", "difference of the slip [%]"),
    "the same, p a tenth [%]",
)


def drawn_belts() -> None:
    """Measure, and write the table."""
    rows = [measure(seed) for seed in SEEDS]
    above = [
        f"Belts on 2 to 7 pulleys, some with a roller on the back, a torque on one and a resistance"
        f" over speed on another; {POINTS} points of a guided string against {BODIES} bodies with"
        f" wrap factors, pressed p = {1e3 * DEPTHS[0]:g} mm into the rims at rest, and"
        f" {1e3 * DEPTHS[1]:g} mm; {SETTINGS['solver__duration']} s, means of the last fifth. R is"
        " the smallest radius.",
    ]
    write(Table("Guided strings against chains of bodies", above, HEADING, rows), "belt_drawn")


def measure(seed: int) -> tuple[Any, ...]:
    """Run one belt as a string and on rims of two depths."""
    data = drawn(seed, **SETTINGS)
    torque = data["drive"]["p0"]["torque"]
    torque["value"] = [LOAD * value for value in torque["value"]]
    guided = solved(changed(data, mechanism__belt__bodies=POINTS))
    chains = [solved(with_contact(data, depth)) for depth in DEPTHS]
    radius = min(pulley["radius"] for pulley in data["mechanism"]["pulleys"])
    strain = 0.5 * DEPTHS[0] / radius * data["mechanism"]["belt"]["axial_rigidity"]
    tensions = [np.max(np.abs(spans(chain) - spans(guided))) for chain in chains]
    slips = [abs(slip(chain) - slip(guided)) for chain in chains]
    row = (seed, len(data["mechanism"]["pulleys"]), strain, *tensions, slip(guided), *slips)
    say(f"  {row}")
    return row


def with_contact(data: Scenario, depth: float) -> Scenario:
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


def solved(data: Scenario) -> Record:
    """Run a scenario to its end."""
    done = run(scenario_of(data), lambda t: None)
    assert done.status == "done", done.reason
    for text in done.warnings:
        say(f"    {text}")
    return done


def spans(done: Record) -> Any:
    """Return the mean tension of each span, N."""
    names = scenario_run(done).mechanism.names
    pairs = zip(names, (*names[1:], names[0]), strict=True)
    return np.array([done.quantities[f"tension_{a}_to_{b}"].value for a, b in pairs])


def slip(done: Record) -> float:
    """Return the slip, %."""
    value = done.quantities["slip_percent"].value
    assert value is not None
    return float(value)
