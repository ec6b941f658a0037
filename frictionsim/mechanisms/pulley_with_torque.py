"""A pulley that a torque turns, without masses on its cord: I w' = tau - W r_e - b w + T.

The force P on the cord is zero, so that the reaction of the shaft is W.
"""

from typing import TYPE_CHECKING, Any

from frictionsim.mechanisms.journal_friction import CONTACT_NAME, ROUNDING
from frictionsim.mechanisms.single_dof import kinetic_energy, set_up
from frictionsim.results import Quantities, Quantity
from frictionsim.scenario.signal_tables import signal_from
from frictionsim.solvers.mechanism import DryFriction, Mechanism, Trajectory, Value

if TYPE_CHECKING:
    from frictionsim.mechanisms.pulley import PulleyScenario


def build(scenario: "PulleyScenario") -> Mechanism:
    """Return the mechanism, composed of the effects in the scenario."""
    arm, load = scenario.mechanism.cord_radius, scenario.mechanism.load
    journal, damping = scenario.effects.shaft_friction, scenario.effects.viscous_damping
    assert scenario.drive.torque is not None  # checked by the model of the drive

    def applied_torque(torque: Value, angle: Value, velocity: Value) -> Value:
        return torque - load * arm

    flows: dict[str, Any] = {"energy_input": lambda torque, angle, velocity: torque * velocity}
    if damping is not None:
        b = damping.coefficient

        def applied_torque(torque: Value, angle: Value, velocity: Value) -> Value:
            return torque - load * arm - b * velocity

        flows["energy_damping"] = lambda torque, angle, velocity: b * velocity * velocity

    contact = None
    if journal is not None:
        r_s, r_k = journal.static_radius, journal.kinetic_radius
        contact = DryFriction(
            name=CONTACT_NAME,
            # Of the drive and the direction, for arrays of them.
            static_limit=lambda torque, angle: r_s * load + 0.0 * torque,
            kinetic_limit=lambda torque, angle, velocity, direction: r_k * load + 0.0 * torque,
            roundoff=lambda torque, angle: ROUNDING * (abs(torque) + arm * load),
            **journal.law_of_contact(),
        )

    def channels(trajectory: Trajectory) -> dict[str, Value]:
        return {"drive_torque": trajectory.drive, "shaft_reaction": load}

    def quantities(trajectory: Trajectory) -> Quantities:
        return limit_torques(scenario)

    return Mechanism(
        drive=signal_from(scenario.drive.torque),
        inertia=scenario.mechanism.inertia,
        applied_torque=applied_torque,
        contact=contact,
        power_flows=flows,
        stored_energies={
            "energy_kinetic": kinetic_energy(scenario.mechanism.inertia),
            "energy_potential": lambda angle, velocity: load * arm * angle,
        },
        channels=channels,
        quantities=quantities,
        **set_up(scenario),
    )


def limit_torques(scenario: "PulleyScenario") -> Quantities:
    """Return the torques of impending motion, W (r_e +- r_s)."""
    journal = scenario.effects.shaft_friction
    return _torques(scenario, journal.static_radius if journal else 0.0, "lift", "hold")


def statics(scenario: "PulleyScenario") -> Quantities:
    """Return the limit torques of eq 24, static and kinetic."""
    journal = scenario.effects.shaft_friction
    r_s = journal.static_radius if journal else 0.0
    r_k = journal.kinetic_radius if journal else 0.0
    return {
        **limit_torques(scenario),
        **_torques(scenario, r_k, "keep_lifting", "keep_lowering"),
        "friction_radius_static": Quantity(r_s, "m"),
        "friction_radius_kinetic": Quantity(r_k, "m"),
    }


def _torques(scenario: "PulleyScenario", radius: float, up: str, down: str) -> Quantities:
    """Return the torques at the limit of friction for motion up and down."""
    arm, load = scenario.mechanism.cord_radius, scenario.mechanism.load
    return {
        f"torque_to_{up}": Quantity(load * (arm + radius), "N m"),
        f"torque_to_{down}": Quantity(load * (arm - radius), "N m"),
    }
