"""The equation of motion of a pulley without masses on its cord."""

from math import sqrt
from typing import TYPE_CHECKING, Any

from frictionsim.mechanisms.effects import CONTACT_NAME, ROUNDING
from frictionsim.mechanisms.pulley.schema import PulleyScenario
from frictionsim.mechanisms.pulley.statics import impending_motion_forces, limit_torques
from frictionsim.mechanisms.single_dof import (
    kinetic_energy,
    set_up,
)
from frictionsim.results import Quantities
from frictionsim.scenario.signal_tables import signal_from
from frictionsim.solvers.mechanism import DryFriction, Mechanism, Trajectory, Value

if TYPE_CHECKING:
    from frictionsim.solvers.multi_contact import MultiContactMechanism


def build(scenario: PulleyScenario) -> "Mechanism | MultiContactMechanism":
    """Return the mechanism, composed of the effects in the scenario."""
    if scenario.effects.hanging_masses is not None:
        from frictionsim.mechanisms.pulley.masses import with_masses

        return with_masses(scenario)
    if scenario.drive.force is None:
        return driven_by_torque(scenario)
    arm, inertia, load = (
        scenario.mechanism.cord_radius,
        scenario.mechanism.inertia,
        scenario.mechanism.load,
    )
    journal, damping = scenario.effects.shaft_friction, scenario.effects.viscous_damping

    def drive_torque(force: Value, angle: Value, velocity: Value) -> Value:
        return (force - load) * arm

    def vertical_reaction(force: Value) -> Value:
        return abs(force + load)

    def horizontal_reaction(force: Value) -> Value:
        return (force * force + load * load) ** 0.5

    vertical = scenario.drive.direction == "vertical"
    reaction = vertical_reaction if vertical else horizontal_reaction

    applied_torque = drive_torque
    power_flows = {"energy_input": lambda force, angle, velocity: force * arm * velocity}
    if damping is not None:
        b = damping.coefficient

        def applied_torque(force: Value, angle: Value, velocity: Value) -> Value:
            return (force - load) * arm - b * velocity

        power_flows["energy_damping"] = lambda force, angle, velocity: b * velocity * velocity

    contact = None
    if journal is not None:
        r_s, r_k = journal.static_radius, journal.kinetic_radius
        contact = DryFriction(
            name=CONTACT_NAME,
            static_limit=lambda force, angle: r_s * reaction(force),
            kinetic_limit=lambda force, angle, velocity, direction: r_k * reaction(force),
            roundoff=lambda force, angle: ROUNDING * arm * (abs(force) + load),
            monotonicity_breaks=_critical_forces(arm, r_s, load, vertical),
            **journal.law_of_contact(),
        )

    def channels(trajectory: Trajectory) -> dict[str, Value]:
        force = trajectory.drive
        return {"drive_force": force, "shaft_reaction": reaction(force)}

    def quantities(trajectory: Trajectory) -> Quantities:
        return impending_motion_forces(scenario)

    return Mechanism(
        drive=signal_from(scenario.drive.force),
        inertia=inertia,
        applied_torque=applied_torque,
        contact=contact,
        power_flows=power_flows,
        stored_energies={
            "energy_kinetic": kinetic_energy(inertia),
            "energy_potential": lambda angle, velocity: load * arm * angle,
        },
        channels=channels,
        quantities=quantities,
        **set_up(scenario),
    )


def driven_by_torque(scenario: PulleyScenario) -> Mechanism:
    """Return a pulley that a torque turns: I w' = tau - W r_e - b w + T.

    The force P on the cord is zero, so that the reaction of the shaft is W.
    """
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


def _critical_forces(arm: float, r_s: float, load: float, vertical: bool) -> tuple[float, ...]:
    """Return the extrema of +-(P - W) r_e - r_s R over P, N."""
    if vertical:
        return (-load,)
    if r_s <= arm:
        return (0.0,)
    extremum = load * arm / sqrt(r_s * r_s - arm * arm)
    return (-extremum, extremum)
