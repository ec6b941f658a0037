"""A marble machine: a pinion drives a gear whose slots lift marbles, on a dry shaft.

theta is the angle of the gear. n = slots/2 marbles are on its rising half, at the angles
delta + p j from the bottom, j = 0 .. n - 1, with the pitch p = 2 pi/slots and
delta = theta mod p. When delta reaches p, one marble leaves at the top and the next is picked up
at the bottom.

    I theta'' = k T_p - M_L(theta) - b theta' + T,    I = I_gear + n m R^2 + k^2 J
    M_L = m g R sum_j sin(delta + p j) = m g R cos(delta - p/2)/sin(p/2)
    |T| <= r_s R_shaft sticking,  T = -s r_k R_shaft sliding
    R_shaft = sqrt((c_z T_m)^2 + (W + c_y T_m)^2),   T_m = T_p - J k theta''

T_p is the torque on the pinion, k the gear ratio, W the weight of gear and marbles. The teeth
press with T_m/(r_p cos alpha) along the line of action: with the pinion at azimuth psi from the
horizontal through the gear's centre and a gear that turns counter-clockwise, at psi + 90 deg +
alpha; c_z and c_y are its components per torque, c_y downwards.

The structure follows [1]_; missing data of the paper are reconstructed. The centripetal force of
the marbles and the impact of the pick-up are neglected.

References
----------
.. [1] "Analysis of friction systems on shafts", Int. J. Applied Engineering Research 13(11),
   2018, 8871-8881, eqs 24 and 53-58.
"""

from collections.abc import Mapping
from math import cos as cosine
from math import pi, radians
from math import sin as sine
from typing import Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from frictionsim.mechanisms.effects import RENAMED_AIR_DRAG, Gravity, ViscousDamping
from frictionsim.mechanisms.journal_friction import ShaftFriction
from frictionsim.mechanisms.marble_machine_statics import (
    ROUNDING,
    Mesh,
    impending_motion_torques,
    mesh_of,
)
from frictionsim.mechanisms.marble_machine_statics import statics as statics
from frictionsim.mechanisms.scalar_math import cos, sin
from frictionsim.mechanisms.single_dof import METRICS as METRICS
from frictionsim.mechanisms.single_dof import (
    SingleDofScenario,
    base_channels,
    kinetic_energy,
    set_up,
    simulation_of,
    total,
)
from frictionsim.results import STICK, Channel, Quantities, Quantity
from frictionsim.scenario.schema import Params, inconsistent, unit_field
from frictionsim.scenario.signal_checks import extremes
from frictionsim.scenario.signal_tables import TimeSignal, signal_from
from frictionsim.scenario.signals import Constant, Signal
from frictionsim.solvers.mechanism import (
    DryFriction,
    Mechanism,
    SwitchingSurface,
    Trajectory,
    Value,
)

CHANNELS = base_channels("gear") | {
    "motor_torque": Channel("N m", "torque on the pinion"),
    "load_torque": Channel("N m", "moment of the marbles on the gear"),
    "shaft_reaction": Channel("N", "reaction of the shaft of the gear"),
    "carried_marbles": Channel("1", "marbles on the gear", integer=True),
    "energy_input": Channel("J", "work of the torque on the pinion"),
    "energy_kinetic": Channel("J", "kinetic energy of gear, marbles and motor"),
    "energy_potential": Channel("J", "potential energy of the marbles, delivered ones included"),
    "energy_damping": Channel("J", "heat of viscous damping"),
}
PANELS = ("motor_torque", "load_torque", "friction_torque", "angular_velocity", "angle")


class MarbleMachineParameters(Params):
    """`[mechanism]`."""

    pinion_radius: float = unit_field("m", "Pitch radius of the pinion.", gt=0)
    pressure_angle_deg: float = unit_field("deg", "Pressure angle of the teeth.", ge=0, lt=90)
    gear_ratio: float = unit_field("1", "Turns of the pinion for one turn of the gear.", gt=0)
    mesh_azimuth_deg: float = unit_field(
        "deg", "Where the pinion is, from the centre of the gear; 0 is to the right."
    )
    slots: int = unit_field(
        "1", "Slots of the gear, an even number; half of them carry marbles.", gt=0
    )
    marble_mass: float = unit_field("kg", "Mass of a marble.", ge=0)
    marble_circle_radius: float = unit_field(
        "m", "Radius of the circle on which the marbles ride.", gt=0
    )
    gear_mass: float = unit_field("kg", "Mass of the gear, whose weight loads the shaft.", ge=0)
    gear_inertia: float = unit_field(
        "kg m^2", "Moment of inertia of the gear without marbles.", gt=0
    )
    initial_angle_deg: float = unit_field("deg", "Angle at the start.", 0.0)
    initial_angular_velocity: float = unit_field("rad/s", "Angular velocity at the start.", 0.0)

    @model_validator(mode="after")
    def _one_leaves_as_one_comes(self) -> Self:
        if self.slots % 2:
            raise inconsistent(
                ("slots",),
                f"expected an even number, so that one marble leaves the gear when the next is"
                f" picked up, got {self.slots}",
            )
        return self

    @property
    def carried(self) -> int:
        """n: marbles on the rising half."""
        return self.slots // 2

    @property
    def pitch(self) -> float:
        """p, rad."""
        return 2.0 * pi / self.slots


class Motor(Params):
    """A gear motor: T_p = stall_torque (1 - w/no_load_speed) at the speed w of the pinion."""

    stall_torque: float = unit_field("N m", "Torque at standstill.", gt=0)
    no_load_speed: float = unit_field(
        "rad/s", "Speed of the pinion at which the torque is zero.", gt=0
    )
    name: str = Field("", description="Name of the motor, for the reader.")


class MarbleMachineDrive(Params):
    """`[drive]`: a torque on the pinion, or a motor on it."""

    torque: TimeSignal | None = unit_field("N m", "Torque on the pinion; give this or motor.", None)
    motor: Motor | None = None

    @model_validator(mode="after")
    def _one_of_them(self) -> Self:
        if (self.torque is None) == (self.motor is None):
            raise inconsistent((), "give one of torque and motor")
        return self


class MotorInertia(Params):
    """Inertia of motor and pinion, about the pinion's axis."""

    inertia: float = unit_field(
        "kg m^2", "Moment of inertia of motor and pinion, about the pinion's axis.", ge=0
    )


class MarbleMachineEffects(Params):
    """`[effects]`: one table for each effect that is simulated."""

    RETIRED: ClassVar[Mapping[str, str]] = {"air_drag": RENAMED_AIR_DRAG}

    gravity: Gravity | None = None
    shaft_friction: ShaftFriction | None = None
    viscous_damping: ViscousDamping | None = None
    motor_inertia: MotorInertia | None = None


class MarbleMachineScenario(SingleDofScenario):
    """A scenario of kind `marble_machine`."""

    CHANNELS: ClassVar[Mapping[str, Channel]] = CHANNELS

    kind: Literal["marble_machine"]
    mechanism: MarbleMachineParameters
    drive: MarbleMachineDrive
    effects: MarbleMachineEffects = MarbleMachineEffects()

    @model_validator(mode="after")
    def _the_shaft_is_thinner_than_the_gear(self) -> Self:
        geometry, journal = self.mechanism, self.effects.shaft_friction
        base = geometry.gear_ratio * geometry.pinion_radius
        base *= cosine(radians(geometry.pressure_angle_deg))
        if journal is not None and journal.shaft_radius >= base:
            raise inconsistent(
                ("effects", "shaft_friction", "shaft_radius"),
                f"expected less than the base radius of the gear, {base:.6g} m = gear_ratio"
                f" pinion_radius cos(pressure_angle_deg), got {journal.shaft_radius} m: the shaft"
                " of a gear is thinner than the gear",
            )
        return self

    @property
    def largest_torque(self) -> float:
        """The largest torque of the drive on the pinion at rest, N m."""
        motor, torque = self.drive.motor, self.drive.torque
        if motor is not None:
            return motor.stall_torque
        return extremes(torque, self.solver.duration)[1]

    def warnings(self) -> list[str]:
        """Return the warnings; also of a drive that cannot lift the marbles."""
        warnings = super().warnings()
        if self.effects.gravity is None or not self.mechanism.marble_mass * self.effects.gravity.g:
            return warnings
        largest, worst = (
            self.largest_torque,
            impending_motion_torques(self)["torque_to_lift_worst"].value,
        )
        what = "the stall torque of the motor" if self.drive.motor else "the torque of the drive"
        if worst is None:
            warnings.append(
                "no torque on the pinion lifts the marbles: the friction increases with the torque"
            )
        elif largest <= worst:
            warnings.append(
                f"{what} is {largest:.6g} N m at most, not above the {worst:.6g} N m needed to lift"
                " the marbles in the position of the largest load: the gear will stall or run back"
            )
        return warnings


SCENARIO = MarbleMachineScenario


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
        found = {
            "motor_torque": torque,
            "shaft_reaction": mesh.reaction(through_mesh, weight),
            "carried_marbles": n,
        }
        if effects.gravity is not None:
            found["load_torque"] = load(trajectory.position)
        return found

    def quantities(trajectory: Trajectory) -> Quantities:
        found = impending_motion_torques(scenario)
        if trajectory.time.size:
            cell = trajectory.position // p
            found["marbles_delivered"] = Quantity(float(cell.max() - cell[0]), "1")
            torque = pinion_torque(trajectory.drive, trajectory.velocity)
            found["motor_torque_peak"] = Quantity(float(abs(torque).max()), "N m")
            span = float(trajectory.time[-1])
            if span > 0.0:
                work = float(trajectory.energy_integrals["energy_input"][-1])
                found["motor_power_mean"] = Quantity(work / span, "W")
        return found

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


simulation = simulation_of(build)


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
