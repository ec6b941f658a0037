"""Torques of impending motion and of uniform rotation of an epicyclic gear; its tracer's swing."""

from frictionsim.mechanisms.epicyclic.equation import (
    build,
    constants_of,
    path_of,
    uniform_torque_mean,
    uniform_torques,
)
from frictionsim.mechanisms.epicyclic.schema import EpicyclicScenario
from frictionsim.results import Quantities, Quantity


def statics(scenario: EpicyclicScenario) -> Quantities:
    """Return the torques of impending motion at the initial angle, and of uniform rotation.

    The published equation has no rest, and so no impending motion.
    """
    system, gear = build(scenario).system, scenario.mechanism
    other = "consistent" if gear.formulation == "published" else "published"
    changed = scenario.model_copy(
        update={"mechanism": gear.model_copy(update={"formulation": other})}
    )
    values: Quantities = {}
    if gear.formulation == "consistent":
        angle, friction = system.start[0], system.friction
        balance = -system.torque(0.0, angle, 0.0)
        limit = friction.static(0.0, angle) if friction else 0.0
        values = {
            "torque_to_start_forward": Quantity(balance + limit, "N m"),
            "torque_to_start_backward": Quantity(balance - limit, "N m"),
        }
    return {
        **values,
        **uniform_torques(scenario),
        f"uniform_torque_mean_{other}": Quantity(uniform_torque_mean(changed, 0.0), "N m"),
        "gravity_moment": Quantity(constants_of(scenario).K, "N m"),
        "inertia": Quantity(gear.inertia, "kg m^2"),
        "planet_speed_ratio": Quantity(gear.planet_speed_ratio, "1"),
        **(path_of(scenario).quantities() if scenario.effects.tracer_point else {}),
    }
