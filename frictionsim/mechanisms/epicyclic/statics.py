"""Torques of impending motion and of uniform rotation of an epicyclic gear."""

from frictionsim.mechanisms.epicyclic.equation import EquationTerms, build, uniform_torque_mean
from frictionsim.mechanisms.epicyclic.schema import EpicyclicScenario
from frictionsim.results import Quantities, Quantity


def statics(scenario: EpicyclicScenario) -> Quantities:
    """Return the torques of impending motion at the initial angle, and of uniform rotation."""
    terms, mechanism = EquationTerms(scenario), build(scenario)
    angle = mechanism.position
    balance = -mechanism.applied_torque(0.0, angle, 0.0)
    limit = mechanism.contact.static_limit(0.0, angle) if mechanism.contact else 0.0
    other = "published" if scenario.mechanism.formulation == "consistent" else "consistent"
    changed = scenario.model_copy(
        update={"mechanism": scenario.mechanism.model_copy(update={"formulation": other})}
    )
    return {
        "torque_to_start_forward": Quantity(balance + limit, "N m"),
        "torque_to_start_backward": Quantity(balance - limit, "N m"),
        "uniform_torque_mean": Quantity(uniform_torque_mean(scenario, 0.0), "N m"),
        f"uniform_torque_mean_{other}": Quantity(uniform_torque_mean(changed, 0.0), "N m"),
        "gravity_moment": Quantity(terms.gravity_moment, "N m"),
        "inertia": Quantity(scenario.mechanism.inertia, "kg m^2"),
    }
