"""The scenario of kind `marble_machine`: what its tables must agree on, and its warnings."""

from collections.abc import Mapping
from math import cos as cosine
from math import radians
from typing import ClassVar, Literal, Self

from pydantic import model_validator

from frictionsim.mechanisms.marble_machine.channels import CHANNELS
from frictionsim.mechanisms.marble_machine.statics import impending_motion_torques
from frictionsim.mechanisms.marble_machine.tables import (
    MarbleMachineDrive,
    MarbleMachineEffects,
    MarbleMachineParameters,
)
from frictionsim.mechanisms.single_dof import (
    SingleDofScenario,
)
from frictionsim.results import Channel
from frictionsim.scenario.schema import inconsistent
from frictionsim.scenario.signal_tables import extremes


class MarbleMachineScenario(SingleDofScenario):
    """A scenario of kind `marble_machine`."""

    CHANNELS: ClassVar[Mapping[str, Channel]] = CHANNELS

    kind: Literal["marble_machine"]
    mechanism: MarbleMachineParameters
    drive: MarbleMachineDrive
    effects: MarbleMachineEffects = MarbleMachineEffects()

    @model_validator(mode="after")
    def _check_shaft_radius(self) -> Self:
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
        at_rest = impending_motion_torques(self.mechanism, self.effects, self.drive.motor)
        largest, worst = self.largest_torque, at_rest["torque_to_lift_worst"].value
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
