"""The scenario of kind `marble_machine`: its tables, channels and warnings."""

from collections.abc import Mapping
from math import cos, pi, radians, tan
from typing import ClassVar, Literal, Self

from pydantic import Field, model_validator

from frictionsim.mechanisms.effects import Gravity, ShaftFriction, ViscousDamping
from frictionsim.mechanisms.journal import CHANNELS as JOURNAL_CHANNELS
from frictionsim.mechanisms.marble_machine.statics import impending_motion_torques
from frictionsim.mechanisms.single_dof import SingleDofScenario, base_channels
from frictionsim.results import Channel
from frictionsim.scenario.schema import Params, inconsistent, unit_field
from frictionsim.scenario.signal_tables import TimeSignal, extremes

CHANNELS = base_channels("gear") | {
    "friction_torque": Channel("N m", "torque of the dry friction, along the angle of the gear"),
    "motor_torque": Channel("N m", "torque on the pinion"),
    "load_torque": Channel("N m", "moment of the marbles, against the angle of the gear"),
    "shaft_reaction": Channel("N", "reaction of the shaft of the gear"),
    **JOURNAL_CHANNELS,
    "tooth_force_tangential": Channel("N", "force of the pinion's teeth on the gear, tangential"),
    "tooth_force_radial": Channel("N", "force of the pinion's teeth on the gear, to its axis"),
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
    def _check_slots(self) -> Self:
        if self.slots % 2:
            raise inconsistent(
                ("slots",),
                f"expected an even number, so that one marble leaves the gear when the next is"
                f" picked up, got {self.slots}",
            )
        return self

    @property
    def tooth_slope(self) -> float:
        """tan alpha: radial over tangential force of the teeth."""
        return tan(radians(self.pressure_angle_deg))

    @property
    def carried(self) -> int:
        """n: marbles on the rising half."""
        return self.slots // 2

    @property
    def pitch(self) -> float:
        """p, rad."""
        return 2.0 * pi / self.slots


class MotorTable(Params):
    """A gear motor: T_p = stall_torque (1 - w/no_load_speed) at the speed w of the pinion."""

    stall_torque: float = unit_field("N m", "Torque at standstill.", gt=0)
    no_load_speed: float = unit_field(
        "rad/s", "Speed of the pinion at which the torque is zero.", gt=0
    )
    name: str = Field("", description="Name of the motor, for the reader.")


class MarbleMachineDrive(Params):
    """`[drive]`: a torque on the pinion, or a motor on it."""

    torque: TimeSignal | None = unit_field("N m", "Torque on the pinion; give this or motor.", None)
    motor: MotorTable | None = None

    @model_validator(mode="after")
    def _check_inputs(self) -> Self:
        if (self.torque is None) == (self.motor is None):
            raise inconsistent((), "give one of torque and motor")
        return self


class MotorInertiaTable(Params):
    """Inertia of motor and pinion, about the pinion's axis."""

    inertia: float = unit_field(
        "kg m^2", "Moment of inertia of motor and pinion, about the pinion's axis.", ge=0
    )


class MarbleMachineEffects(Params):
    """`[effects]`: one table for each effect that is simulated."""

    gravity: Gravity | None = None
    shaft_friction: ShaftFriction | None = None
    viscous_damping: ViscousDamping | None = None
    motor_inertia: MotorInertiaTable | None = None

    @property
    def g(self) -> float:
        """Acceleration of gravity, m/s^2; 0 without it."""
        return self.gravity.g if self.gravity else 0.0


class MarbleMachineScenario(SingleDofScenario):
    """A scenario of kind `marble_machine`."""

    CHANNELS: ClassVar[Mapping[str, Channel]] = CHANNELS

    kind: Literal["marble_machine"]
    mechanism: MarbleMachineParameters
    drive: MarbleMachineDrive
    effects: MarbleMachineEffects = MarbleMachineEffects()

    @property
    def inertia(self) -> float:
        """Moment of inertia about the axis of the gear, with marbles and motor, kg m^2."""
        geometry, motor = self.mechanism, self.effects.motor_inertia
        marbles = geometry.carried * geometry.marble_mass * geometry.marble_circle_radius**2
        k = geometry.gear_ratio
        return geometry.gear_inertia + marbles + k * k * (motor.inertia if motor else 0.0)

    @model_validator(mode="after")
    def _check_shaft_radius(self) -> Self:
        geometry, journal = self.mechanism, self.effects.shaft_friction
        base = geometry.gear_ratio * geometry.pinion_radius
        base *= cos(radians(geometry.pressure_angle_deg))
        if journal is not None and journal.shaft_radius >= base:
            raise inconsistent(
                ("effects", "shaft_friction", "shaft_radius"),
                f"expected less than the base radius of the gear, {base:.6g} m = gear_ratio"
                f" pinion_radius cos(pressure_angle_deg), got {journal.shaft_radius} m: the shaft"
                " of a gear is thinner than the gear",
            )
        return self

    def warnings(self) -> list[str]:
        """Return the warnings; also of a drive that cannot lift the marbles."""
        warnings, motor = super().warnings(), self.drive.motor
        if not self.mechanism.marble_mass * self.effects.g:
            return warnings
        if motor is not None:
            what, largest = "the stall torque of the motor", motor.stall_torque
        else:
            _, largest = extremes(self.drive.torque, self.solver.duration)
            what = "the torque of the drive"
        worst = impending_motion_torques(self)["torque_to_lift_worst"].value
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
