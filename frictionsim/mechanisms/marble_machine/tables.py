"""The tables of a scenario of kind `marble_machine`."""

from math import pi, radians, tan
from typing import Self

from pydantic import Field, model_validator

from frictionsim.mechanisms.effects import (
    Gravity,
    ShaftFriction,
    ViscousDamping,
)
from frictionsim.scenario.schema import Params, inconsistent, unit_field
from frictionsim.scenario.signal_tables import TimeSignal


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
