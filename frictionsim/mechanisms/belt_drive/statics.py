"""The belt at rest at its pretension, without friction, and what friction could hold there."""

from math import exp, log, sin, tanh
from sys import float_info
from typing import TYPE_CHECKING

import numpy as np

from frictionsim.mechanisms.belt_drive.equilibrium import Rest, at_rest
from frictionsim.results import Quantities, Quantity

if TYPE_CHECKING:
    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario

MAX_EXPONENT = log(float_info.max)


def statics(scenario: "BeltDriveScenario") -> Quantities:
    """Return tension, lengths, wrap angles and loads at rest, and what friction could hold.

    capstan_ratio is exp(mu_s wrap_angle), the largest ratio of the tensions on the two sides of a
    pulley, undefined beyond the largest number; torque_limit what it would transmit at the belt's
    pretension if its sides could share it freely: 2 T R (e - 1)/(e + 1) with e the ratio.
    """
    equilibrium, path = at_rest(scenario), scenario.mechanism.path()
    bodies = scenario.mechanism.belt.bodies
    tension = float(np.mean(equilibrium.tension))
    quantities = {
        "pretension": Quantity(tension, "N"),
        "tension_min": Quantity(float(np.min(equilibrium.tension)), "N"),
        "tension_max": Quantity(float(np.max(equilibrium.tension)), "N"),
        "path_length": Quantity(path.length, "m"),
        "belt_length": Quantity(equilibrium.body_length * bodies, "m"),
        "body_length": Quantity(equilibrium.body_length, "m"),
        "strain": Quantity(tension / scenario.mechanism.belt.axial_rigidity, "1"),
        "residual_force": Quantity(equilibrium.residual, "N"),
    }
    friction, loads = scenario.effects.belt_friction, _shaft_loads(scenario, equilibrium)
    for j, (pulley, arc) in enumerate(zip(scenario.mechanism.pulleys, path.arcs, strict=True)):
        name = pulley.name
        quantities[f"wrap_angle_{name}"] = Quantity(abs(arc.wrap_angle), "rad")
        quantities[f"shaft_load_{name}"] = Quantity(loads[j], "N")
        if friction is not None:
            mu = friction.pulleys.get(name, friction).mu_s
            exponent = mu * abs(arc.wrap_angle)
            ratio = exp(exponent) if exponent < MAX_EXPONENT else None
            quantities[f"capstan_ratio_{name}"] = Quantity(ratio, "1")
            limit = 2.0 * tension * pulley.radius * tanh(0.5 * exponent)
            quantities[f"torque_limit_{name}"] = Quantity(limit, "N m")
    return quantities


def _shaft_loads(scenario: "BeltDriveScenario", equilibrium: Rest) -> list[float]:
    """Return the force of the belt on each shaft, N."""
    arcs, loads = scenario.mechanism.path().arcs, []
    for j, (pulley, arc) in enumerate(zip(scenario.mechanism.pulleys, arcs, strict=True)):
        if scenario.guided:  # two pulls of one tension
            tension = float(equilibrium.tension[0])
            loads.append(2.0 * tension * abs(sin(0.5 * arc.wrap_angle)))
            continue
        on = equilibrium.pulley == j
        places = np.column_stack([equilibrium.x[on], equilibrium.y[on]]) - pulley.center
        force = equilibrium.normal_force[on] @ places
        loads.append(float(np.hypot(*force)) / pulley.radius)
    return loads
