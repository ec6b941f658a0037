"""Torques of impending motion and of uniform rotation of an epicyclic gear."""

from frictionsim.mechanisms.epicyclic.equation import build, constants_of, uniform_torque_mean
from frictionsim.mechanisms.epicyclic.schema import EpicyclicScenario
from frictionsim.results import Quantities, Quantity


def statics(scenario: EpicyclicScenario) -> Quantities:
    """Return the torques of impending motion at the initial angle, and of uniform rotation.

    The published equation has no rest, and so no impending motion: what its drive has at the
    initial angle is the torque of uniform rotation, eq 28.
    """
    system = build(scenario).system
    angle, friction = system.start[0], system.friction
    balance = -system.torque(0.0, angle, 0.0)
    limit = friction.static(0.0, angle) if friction else 0.0
    is_published = scenario.mechanism.formulation == "published"
    other = "consistent" if is_published else "published"
    changed = scenario.model_copy(
        update={"mechanism": scenario.mechanism.model_copy(update={"formulation": other})}
    )
    at_start = {
        "torque_to_start_forward": Quantity(balance + limit, "N m"),
        "torque_to_start_backward": Quantity(balance - limit, "N m"),
    }
    if is_published:
        at_start = {"uniform_torque_at_start": Quantity(balance, "N m")}
    return {
        **at_start,
        "uniform_torque_mean": Quantity(uniform_torque_mean(scenario, 0.0), "N m"),
        f"uniform_torque_mean_{other}": Quantity(uniform_torque_mean(changed, 0.0), "N m"),
        "gravity_moment": Quantity(constants_of(scenario).K, "N m"),
        "inertia": Quantity(scenario.mechanism.inertia, "kg m^2"),
    }
