"""The equation of motion of a marble machine."""

from math import sin as sine
from typing import Any

from frictionsim.mechanisms.marble_machine.schema import MarbleMachineScenario
from frictionsim.mechanisms.marble_machine.statics import (
    ROUNDING,
    Mesh,
    impending_motion_torques,
    mesh_of,
)
from frictionsim.mechanisms.single_dof import (
    cos,
    kinetic_energy,
    set_up,
    sin,
    total,
)
from frictionsim.results import STICK, Quantities, Quantity
from frictionsim.scenario.signal_tables import signal_from
from frictionsim.scenario.signals import Constant, Signal
from frictionsim.solvers.mechanism import (
    DryFriction,
    Mechanism,
    SwitchingSurface,
    Trajectory,
    Value,
)


def build(scenario: MarbleMachineScenario) -> Mechanism:
    """Return the mechanism, composed of the effects in the scenario."""
    geometry, effects = scenario.mechanism, scenario.effects
    k, p, n = geometry.gear_ratio, geometry.pitch, geometry.carried
    mesh, g = mesh_of(geometry), effects.gravity.g if effects.gravity else 0.0
    weight = (geometry.gear_mass + n * geometry.marble_mass) * g
    lift = geometry.marble_mass * g * geometry.marble_circle_radius  # m g R
    motor_inertia = effects.motor_inertia.inertia if effects.motor_inertia else 0.0
    inertia = (
        geometry.gear_inertia
        + n * geometry.marble_mass * geometry.marble_circle_radius**2
        + k * k * motor_inertia
    )

    def load(angle: Value) -> Value:
        return (lift / sine(0.5 * p)) * cos(angle % p - 0.5 * p)

    def potential(angle: Value, velocity: Value) -> Value:
        delta = angle % p
        lifted = 2.0 * (angle // p) + sin(delta - 0.5 * p) / sine(0.5 * p) + 1.0
        return lift * lifted

    drive, pinion_torque = _pinion_torque(scenario)
    applied_torque = _applied_torque(scenario, pinion_torque, load)
    power_flows = {
        "energy_input": lambda u, angle, velocity: k * pinion_torque(u, velocity) * velocity
    }
    stored_energies = {"energy_kinetic": kinetic_energy(inertia)}
    if effects.gravity is not None:
        stored_energies["energy_potential"] = potential
    if effects.viscous_damping is not None:
        b = effects.viscous_damping.coefficient
        power_flows["energy_damping"] = lambda u, angle, velocity: b * velocity * velocity

    contact = None
    if effects.shaft_friction is not None:
        r_s = effects.shaft_friction.static_radius
        scale = lift / sine(0.5 * p)
        contact = DryFriction(
            name="shaft",
            static_limit=lambda u, angle: r_s * mesh.reaction(pinion_torque(u, 0.0), weight),
            kinetic_limit=_kinetic_limit(
                effects.shaft_friction.kinetic_radius,
                mesh,
                weight,
                pinion_torque,
                applied_torque,
                motor_inertia * k / inertia,
            ),
            roundoff=lambda u, angle: ROUNDING * (k * abs(u) + scale),
            **effects.shaft_friction.law_of_contact(),
        )

    def channels(trajectory: Trajectory) -> dict[str, Value]:
        torque = pinion_torque(trajectory.drive, trajectory.velocity)
        through_mesh = torque - motor_inertia * k * trajectory.acceleration
        values = {
            "motor_torque": torque,
            "shaft_reaction": mesh.reaction(through_mesh, weight),
            "carried_marbles": n,
        }
        if effects.gravity is not None:
            values["load_torque"] = load(trajectory.position)
        return values

    def quantities(trajectory: Trajectory) -> Quantities:
        values = impending_motion_torques(geometry, effects, scenario.drive.motor)
        if trajectory.time.size:
            cell = trajectory.position // p
            values["marbles_delivered"] = Quantity(float(cell.max() - cell[0]), "1")
            torque = pinion_torque(trajectory.drive, trajectory.velocity)
            values["motor_torque_peak"] = Quantity(float(abs(torque).max()), "N m")
            span = float(trajectory.time[-1])
            if span > 0.0:
                work = float(trajectory.energy_integrals["energy_input"][-1])
                values["motor_power_mean"] = Quantity(work / span, "W")
        return values

    def run_warnings(trajectory: Trajectory) -> list[str]:
        return _run_warnings(
            scenario, trajectory, pinion_torque(trajectory.drive, trajectory.velocity)
        )

    return Mechanism(
        drive=drive,
        inertia=inertia,
        applied_torque=applied_torque,
        contact=contact,
        power_flows=power_flows,
        stored_energies=stored_energies,
        channels=channels,
        quantities=quantities,
        run_warnings=run_warnings,
        switching_surfaces=(SwitchingSurface(every=p, event="transfer"),),
        **set_up(scenario),
    )


def _run_warnings(
    scenario: MarbleMachineScenario, trajectory: Trajectory, torque: Any
) -> list[str]:
    """Return warnings if the gear ran back, or stands still under a driving torque."""
    from frictionsim.simulation.run_warnings import (
        against_drive,  # imports numpy, not needed by `check`
    )

    warnings = []
    back = against_drive(trajectory.time, torque, trajectory.position)
    cell = trajectory.position // scenario.mechanism.pitch
    if back and trajectory.position[-1] < trajectory.position[0]:
        warnings.append(f"the gear {back}: {cell[0] - cell[-1]:.0f} marbles were carried back")
    rests = [e.time for e in trajectory.transitions if e.mode_to == STICK != e.mode_from]
    if (
        scenario.effects.shaft_friction
        and rests
        and trajectory.mode[-1] == STICK
        and torque[-1] > 0.0
    ):
        warnings.append(
            f"the gear stands still from {rests[-1]:.6g} s on, although the torque on the pinion is"
            f" {torque[-1]:.6g} N m at the end"
        )
    return warnings


def _pinion_torque(scenario: MarbleMachineScenario) -> tuple[Signal, Any]:
    """Return the input u over time, and the torque T_p of u and the speed of the gear."""
    motor = scenario.drive.motor
    if motor is None:
        assert scenario.drive.torque is not None  # checked by the model of the drive
        return signal_from(scenario.drive.torque), lambda u, velocity: u
    slope = scenario.mechanism.gear_ratio / motor.no_load_speed
    return Constant(motor.stall_torque), lambda u, velocity: u * (1.0 - slope * velocity)


def _applied_torque(scenario: MarbleMachineScenario, pinion_torque: Any, load: Any) -> Any:
    """Return k T_p - M_L - b theta', with the terms of the effects in the scenario."""
    k, effects = scenario.mechanism.gear_ratio, scenario.effects
    b = effects.viscous_damping.coefficient if effects.viscous_damping else 0.0
    return total(
        lambda u, angle, velocity: k * pinion_torque(u, velocity),
        (lambda u, angle, velocity: -load(angle)) if effects.gravity else None,
        (lambda u, angle, velocity: -b * velocity) if effects.viscous_damping else None,
    )


def _kinetic_limit(
    r_k: float, mesh: Mesh, weight: float, pinion_torque: Any, applied_torque: Any, ratio: float
) -> Any:
    """Return the kinetic limit F = r_k R_shaft(T_m), a function of u, angle, velocity, direction.

    Without motor inertia T_m = T_p. With it, ratio = J k/I > 0 and I theta'' = M - s F:

        T_m = T_0 + ratio s F,  T_0 = T_p - ratio M
        A F^2 - 2 B F - C = 0,  A = 1 - (r_k c ratio)^2,  B = r_k^2 ratio s (c^2 T_0 + W c_y),
        C = (r_k R_shaft(T_0))^2,  c^2 = c_z^2 + c_y^2

    with one non-negative root, since r_k c ratio < 1: the shaft is thinner than the gear.
    """
    if ratio == 0.0:
        return lambda u, angle, velocity, direction: (
            r_k * mesh.reaction(pinion_torque(u, velocity), weight)
        )
    c_2 = mesh.c_z**2 + mesh.c_y**2
    a = 1.0 - r_k * r_k * c_2 * ratio * ratio

    def limit(u: Value, angle: Value, velocity: Value, direction: Value) -> Value:
        t_0 = pinion_torque(u, velocity) - ratio * applied_torque(u, angle, velocity)
        b = r_k * r_k * ratio * direction * (c_2 * t_0 + weight * mesh.c_y)
        c = (r_k * mesh.reaction(t_0, weight)) ** 2
        return (b + (b * b + a * c) ** 0.5) / a

    return limit
