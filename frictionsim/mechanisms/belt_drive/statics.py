"""The belt at rest at its pretension, without friction, and what friction could hold there."""

from collections.abc import Iterator
from contextlib import suppress
from math import exp, log, sin, tanh
from sys import float_info
from typing import TYPE_CHECKING

import numpy as np

from frictionsim.errors import ScenarioError
from frictionsim.mechanisms.belt_drive.belt import patch_of_bodies
from frictionsim.mechanisms.belt_drive.equilibrium import Rest, at_rest
from frictionsim.results import Quantities, Quantity
from frictionsim.scenario.signal_tables import held_value

if TYPE_CHECKING:
    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario

MAX_EXPONENT = log(float_info.max)


def statics(scenario: "BeltDriveScenario") -> Quantities:
    """Return tension, lengths, wrap angles, loads and depths at rest, and what friction could hold.

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
        if not scenario.guided:
            on = equilibrium.pulley == j
            away = np.hypot(
                equilibrium.x[on] - pulley.center[0], equilibrium.y[on] - pulley.center[1]
            )
            depth = pulley.radius - float(np.mean(away))
            quantities[f"contact_depth_{name}"] = Quantity(depth, "m")
        if friction is not None:
            exponent = friction.pulleys.get(name, friction).mu_s * abs(arc.wrap_angle)
            ratio = exp(exponent) if exponent < MAX_EXPONENT else None
            quantities[f"capstan_ratio_{name}"] = Quantity(ratio, "1")
            limit = _torque_limit(tension, pulley.radius, exponent)
            quantities[f"torque_limit_{name}"] = Quantity(limit, "N m")
    return quantities


def _torque_limit(tension: float, radius: float, exponent: float) -> float:
    """Return 2 T R (e - 1)/(e + 1), N m, with e = exp(exponent)."""
    return 2.0 * tension * radius * tanh(0.5 * exponent)


def overloads(scenario: "BeltDriveScenario") -> Iterator[str]:
    """Say which torques, held up to the end of the run, no friction can balance.

    The limit is that of `statics`, which the pretension gives without an equilibrium. It holds for
    two pulleys, whose sides keep the sum of their tensions; several may share it otherwise.
    """
    if len(scenario.mechanism.pulleys) > 2:
        return
    friction, belt = scenario.effects.belt_friction, scenario.mechanism.belt
    path = scenario.mechanism.path()
    tension = belt.pretension or belt.axial_rigidity * (path.length / (belt.length or 1.0) - 1.0)
    for pulley, arc in zip(scenario.mechanism.pulleys, path.arcs, strict=True):
        drive = scenario.drive.get(pulley.name)
        torque = held_value(drive.torque, scenario.solver.duration) if drive else None
        if friction is None or torque is None:
            continue
        mu = friction.pulleys.get(pulley.name, friction).mu_s
        limit = _torque_limit(tension, pulley.radius, mu * abs(arc.wrap_angle))
        if abs(torque) > limit:
            yield (
                f"drive.{pulley.name}.torque = {torque:g} N m is beyond {limit:.4g} N m, what"
                f" friction balances at a pretension of {tension:.4g} N: no load keeps the speed"
                f" steady without slip of the whole belt on '{pulley.name}'; give less torque, or"
                " more pretension, friction or arc"
            )


def empty_patches(scenario: "BeltDriveScenario") -> Iterator[str]:
    """Say which patches no body of the belt has its middle in; of a belt that is not found none."""
    patches = scenario.effects.patches
    wide = 2.0 * scenario.mechanism.path().length / scenario.mechanism.belt.bodies
    if all(patch.end - patch.start > wide for patch in patches):
        return  # without the belt at rest, which takes time
    with suppress(ScenarioError):
        length = at_rest(scenario).body_length
        places = patch_of_bodies(scenario, length)
        for i in sorted({*range(len(patches))} - {*places}):
            yield (
                f"no body of the belt lies in effects.patch{f'.{i}' if len(patches) > 1 else ''},"
                f" {patches[i].start} to {patches[i].end} m: the patch changes nothing; make it"
                f" longer than a body, {length:.4g} m"
            )


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
