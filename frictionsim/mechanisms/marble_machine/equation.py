"""The equation of motion of a marble machine."""

from array import array
from math import sin as sine
from typing import Any, NamedTuple

from frictionsim.mechanisms.effects import (
    Damping,
    Journal,
    damping_of,
    journal_of,
    with_damping,
    with_damping_power,
)
from frictionsim.mechanisms.marble_machine.schema import MarbleMachineScenario
from frictionsim.mechanisms.marble_machine.statics import (
    ROUNDING,
    GearMesh,
    impending_motion_torques,
    mesh_of,
)
from frictionsim.mechanisms.single_dof import MultiplesOf, cos, kinetic_energy_of, set_up, sin, sqrt
from frictionsim.results import STICK, Quantities, Quantity
from frictionsim.scenario.signal_tables import signal_from
from frictionsim.scenario.signals import Constant, Curve, Signal, curve_of
from frictionsim.solvers.compilation import compilable
from frictionsim.solvers.mechanism import Mechanism, Trajectory, Value, equation_of, friction_of


class Motor(NamedTuple):
    """A gear motor: T_p = u (1 - slope theta')."""

    slope: float


class Marbles(NamedTuple):
    """The weight of the marbles: m g R and m g R/sin(p/2), N m, with the pitch p, rad."""

    lift: float
    largest: float
    sine: float
    p: float

    def moment(self, angle: Value) -> Value:
        """Return M_L, N m."""
        return self.largest * cos(angle % self.p - 0.5 * self.p)

    def energy(self, angle: Value) -> Value:
        """Return the potential energy of the marbles, delivered ones included, J."""
        delta = angle % self.p
        lifted = 2.0 * (angle // self.p) + sin(delta - 0.5 * self.p) / self.sine + 1.0
        return self.lift * lifted


class MotorInertia(NamedTuple):
    """The inertia J of motor and pinion.

    T_m differs from T_p by it. With ratio = J k/I > 0 and I theta'' = M - s F, the kinetic limit
    F = r_k R_shaft(T_m) is the root of

        T_m = T_0 + ratio s F,  T_0 = T_p - ratio M
        A F^2 - 2 B F - C = 0,  A = 1 - (r_k c ratio)^2,  B = r_k^2 ratio s (c^2 T_0 + W c_y),
        C = (r_k R_shaft(T_0))^2,  c^2 = c_z^2 + c_y^2

    with one non-negative root, since r_k c ratio < 1: the shaft is thinner than the gear.
    """

    ratio: float
    c_2: float
    a: float


class MarbleMachine(NamedTuple):
    """I theta'' = k T_p - M_L - b theta' + T, with the torque T_p of the pinion."""

    drive: Curve
    inertia: float
    k: float
    mesh: GearMesh
    weight: float
    scale: float
    journal: tuple[Journal, ...]
    motor: tuple[Motor, ...]
    marbles: tuple[Marbles, ...]
    damping: tuple[Damping, ...]
    motor_inertia: tuple[MotorInertia, ...]
    breaks: "array[float]"
    surfaces: tuple[MultiplesOf, ...]
    stops: tuple[Any, ...] = ()
    reversing_load: tuple[Any, ...] = ()

    def pinion_torque(self, u: Value, velocity: Value) -> Value:
        """Return T_p, N m."""
        return _motor_torque(self.motor, u, velocity)

    def applied_torque(self, u: Value, angle: Value, velocity: Value) -> Value:
        """Return k T_p - M_L - b theta', N m."""
        driving = _less_marbles(self.marbles, self.k * self.pinion_torque(u, velocity), angle)
        return with_damping(driving, self.damping, velocity)

    def static_limit(self, u: Value, angle: Value) -> Value:
        """Return r_s R_shaft, N m."""
        return self.journal[0].r_s * self.mesh.reaction(self.pinion_torque(u, 0.0), self.weight)

    def kinetic_limit(self, u: Value, angle: Value, velocity: Value, s: Value) -> Value:
        """Return r_k R_shaft, N m."""
        return _kinetic_limit(self.motor_inertia, self, u, angle, velocity, s)

    def roundoff(self, u: Value, angle: Value) -> Value:
        """Return the roundoff of the torque and its limit, N m."""
        return ROUNDING * (self.k * abs(u) + self.scale)

    def powers(self, u: Value, angle: Value, velocity: Value) -> tuple[Value, ...]:
        """Return the powers of pinion and damping, W."""
        power = self.k * self.pinion_torque(u, velocity) * velocity
        powers: tuple[Value, ...] = with_damping_power((power,), self.damping, velocity)
        return powers

    def torques_and_powers(
        self, u: Value, angle: Value, velocity: Value, s: Value
    ) -> tuple[Value, Value, tuple[Value, ...]]:
        """Return the applied torque, its kinetic limit and the powers."""
        return (
            self.applied_torque(u, angle, velocity),
            self.kinetic_limit(u, angle, velocity, s),
            self.powers(u, angle, velocity),
        )

    def stored_energies(self, angle: Value, velocity: Value) -> tuple[Value, ...]:
        """Return the kinetic energy, and the potential one with gravity, J."""
        kinetic = kinetic_energy_of(self.inertia, velocity)
        energies: tuple[Value, ...] = _with_marbles(self.marbles, (kinetic,), angle)
        return energies

    def first_excess(self, angle: float, a: float, b: float) -> float:
        """Return b: the limits are monotone between the breaks."""
        return b


@compilable
def _motor_torque(motor: tuple[Motor, ...], u: Value, velocity: Value) -> Value:
    if len(motor) == 0:
        return u
    return u * (1.0 - motor[0].slope * velocity)


@compilable
def _less_marbles(marbles: tuple[Marbles, ...], torque: Value, angle: Value) -> Value:
    if len(marbles) == 0:
        return torque
    return torque - marbles[0].moment(angle)


@compilable
def _with_marbles(marbles: tuple[Marbles, ...], energies: Any, angle: Value) -> Any:
    if len(marbles) == 0:
        return energies
    return (*energies, marbles[0].energy(angle))


@compilable
def _kinetic_limit(
    motor_inertia: tuple[MotorInertia, ...],
    gear: MarbleMachine,
    u: Value,
    angle: Value,
    velocity: Value,
    s: Value,
) -> Value:
    r_k, torque, weight = gear.journal[0].r_k, gear.pinion_torque(u, velocity), gear.weight
    if len(motor_inertia) == 0:
        return r_k * gear.mesh.reaction(torque, weight)
    ratio, c_2, a = motor_inertia[0].ratio, motor_inertia[0].c_2, motor_inertia[0].a
    t_0 = torque - ratio * gear.applied_torque(u, angle, velocity)
    b = r_k * r_k * ratio * s * (c_2 * t_0 + weight * gear.mesh.c_y)
    root_c = r_k * gear.mesh.reaction(t_0, weight)
    return (b + sqrt(b * b + a * (root_c * root_c))) / a


def system_of(scenario: MarbleMachineScenario) -> tuple[Signal, MarbleMachine]:
    """Return the input u over time, and the equation with the terms of the effects."""
    geometry, effects, motor = scenario.mechanism, scenario.effects, scenario.drive.motor
    k, p, n = geometry.gear_ratio, geometry.pitch, geometry.carried
    mesh, g = mesh_of(geometry), effects.gravity.g if effects.gravity else 0.0
    lift, half_sine = geometry.marble_mass * g * geometry.marble_circle_radius, sine(0.5 * p)
    motor_inertia = effects.motor_inertia.inertia if effects.motor_inertia else 0.0
    inertia = (
        geometry.gear_inertia
        + n * geometry.marble_mass * geometry.marble_circle_radius**2
        + k * k * motor_inertia
    )
    journal, ratio = journal_of(effects.shaft_friction), motor_inertia * k / inertia
    c_2 = mesh.c_z**2 + mesh.c_y**2
    table = scenario.drive.torque
    signal = signal_from(table) if table is not None else Constant(motor.stall_torque)  # type: ignore[union-attr]
    return signal, MarbleMachine(
        curve_of(signal),
        inertia,
        k,
        mesh,
        weight=(geometry.gear_mass + n * geometry.marble_mass) * g,
        scale=lift / half_sine,
        journal=journal,
        motor=() if motor is None else (Motor(k / motor.no_load_speed),),
        marbles=(Marbles(lift, lift / half_sine, half_sine, p),) if effects.gravity else (),
        damping=damping_of(effects.viscous_damping),
        motor_inertia=tuple(
            MotorInertia(ratio, c_2, 1.0 - radii.r_k * radii.r_k * c_2 * ratio * ratio)
            for radii in journal
            if ratio != 0.0
        ),
        breaks=array("d"),
        surfaces=(MultiplesOf(p, is_event=True, event="transfer"),),
    )


def build(scenario: MarbleMachineScenario) -> Mechanism:
    """Return the mechanism, composed of the effects in the scenario."""
    geometry, effects = scenario.mechanism, scenario.effects
    p = geometry.pitch
    signal, system = system_of(scenario)
    motor_inertia = effects.motor_inertia.inertia if effects.motor_inertia else 0.0

    def channels(trajectory: Trajectory) -> dict[str, Value]:
        torque = system.pinion_torque(trajectory.drive, trajectory.velocity)
        through_mesh = torque - motor_inertia * system.k * trajectory.acceleration
        values = {
            "motor_torque": torque,
            "shaft_reaction": system.mesh.reaction(through_mesh, system.weight),
            "carried_marbles": geometry.carried,
        }
        if effects.gravity is not None:
            values["load_torque"] = system.marbles[0].moment(trajectory.position)
        return values

    def quantities(trajectory: Trajectory) -> Quantities:
        values = impending_motion_torques(geometry, effects, scenario.drive.motor)
        if trajectory.time.size:
            cell = trajectory.position // p
            values["marbles_delivered"] = Quantity(float(cell.max() - cell[0]), "1")
            torque = system.pinion_torque(trajectory.drive, trajectory.velocity)
            values["motor_torque_peak"] = Quantity(float(abs(torque).max()), "N m")
            span = float(trajectory.time[-1])
            if span > 0.0:
                work = float(trajectory.energy_integrals["energy_input"][-1])
                values["motor_power_mean"] = Quantity(work / span, "W")
        return values

    def run_warnings(trajectory: Trajectory) -> list[str]:
        return _run_warnings(
            scenario, trajectory, system.pinion_torque(trajectory.drive, trajectory.velocity)
        )

    friction, damping = effects.shaft_friction, effects.viscous_damping
    flows = ("energy_input", "energy_damping")[: 2 if damping else 1]
    stored = ("energy_kinetic", "energy_potential")[: 2 if effects.gravity else 1]
    return Mechanism(
        drive=signal,
        contact=friction_of(system, "shaft", friction.law_of_contact()) if friction else None,
        channels=channels,
        quantities=quantities,
        run_warnings=run_warnings,
        **equation_of(system, flows, stored),
        **set_up(scenario),
    )


def _run_warnings(
    scenario: MarbleMachineScenario, trajectory: Trajectory, torque: Any
) -> list[str]:
    """Return warnings if the gear ran back, stands still under a torque, or is sampled coarsely."""
    from frictionsim.simulation.run_warnings import (  # imports numpy, not needed by `check`
        against_drive,
        hidden_turns,
    )

    duration, interval = scenario.solver.duration, scenario.interval
    warnings = hidden_turns(trajectory.position, trajectory.velocity, interval, duration)
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
