"""The scenario of a mechanism that the package does not have: a disc on a wire."""

from collections.abc import Mapping
from typing import ClassVar, Literal

from frictionsim.mechanisms.extension import (
    Channel,
    FrictionLaw,
    Params,
    SingleDofScenario,
    TimeSignal,
    unit_field,
)


class Parameters(Params):
    inertia: float = unit_field("kg m^2", "Moment of inertia.", gt=0)


class Drive(Params):
    torque: TimeSignal = unit_field("N m", "Torque on the body.")


class HubFriction(FrictionLaw):
    torque_static: float = unit_field("N m", "Static limit.", ge=0)


class Wire(Params):
    stiffness: float = unit_field("N m/rad", "Torsional stiffness of the wire.", gt=0)


class Effects(Params):
    wire: Wire | None = None
    hub_friction: HubFriction | None = None


class TorsionPendulumScenario(SingleDofScenario):
    CHANNELS: ClassVar[Mapping[str, Channel]] = {}

    kind: Literal["torsion_pendulum"]
    mechanism: Parameters
    drive: Drive
    effects: Effects = Effects()


SCENARIO = TorsionPendulumScenario
