"""A mechanism that the package does not have: what a fifth one of one coordinate takes.

I theta'' = u - c theta + T,    |T| <= M_s sticking,    T = -s M_k sliding
"""

from collections.abc import Mapping
from typing import ClassVar, Literal, Self

from pydantic import model_validator

from frictionsim.mechanisms.single_dof import METRICS as METRICS
from frictionsim.mechanisms.single_dof import (
    SingleDofScenario,
    base_channels,
    kinetic_energy,
    set_up,
    simulation_of,
    total,
)
from frictionsim.results import Channel, Quantities, Quantity
from frictionsim.scenario.schema import FrictionLaw, Params, check_kinetic, unit_field
from frictionsim.scenario.signal_tables import TimeSignal, signal_from
from frictionsim.solvers.mechanism import DryFriction, Mechanism, Trajectory, Value

CHANNELS = base_channels("disc") | {
    "drive_torque": Channel("N m", "torque on the disc"),
    "spring_torque": Channel("N m", "torque of the wire on the disc"),
    "energy_input": Channel("J", "work of the torque"),
    "energy_kinetic": Channel("J", "kinetic energy of the disc"),
    "energy_potential": Channel("J", "energy of the wire"),
}
PANELS = ("drive_torque", "spring_torque", "angle")


class Parameters(Params):
    inertia: float = unit_field("kg m^2", "Moment of inertia.", gt=0)
    initial_angle_deg: float = unit_field("deg", "Angle at the start.", 0.0)
    initial_angular_velocity: float = unit_field("rad/s", "Angular velocity at the start.", 0.0)


class Drive(Params):
    torque: TimeSignal = unit_field("N m", "Torque on the body.")


class HubFriction(FrictionLaw):
    torque_static: float = unit_field("N m", "Static limit.", ge=0)
    torque_kinetic: float = unit_field("N m", "Kinetic limit.", ge=0)

    @model_validator(mode="after")
    def _kinetic_not_above_static(self) -> Self:
        check_kinetic("torque_kinetic", self.torque_kinetic, "torque_static", self.torque_static)
        return self


class Wire(Params):
    stiffness: float = unit_field("N m/rad", "Torsional stiffness of the wire.", gt=0)


class Effects(Params):
    wire: Wire | None = None
    hub_friction: HubFriction | None = None


class TorsionPendulumScenario(SingleDofScenario):
    CHANNELS: ClassVar[Mapping[str, Channel]] = CHANNELS

    kind: Literal["torsion_pendulum"]
    mechanism: Parameters
    drive: Drive
    effects: Effects = Effects()


SCENARIO = TorsionPendulumScenario


def build(scenario: TorsionPendulumScenario) -> Mechanism:
    wire, hub = scenario.effects.wire, scenario.effects.hub_friction
    c = wire.stiffness if wire else 0.0
    inertia = scenario.mechanism.inertia
    stored = {"energy_kinetic": kinetic_energy(inertia)}
    if wire is not None:
        stored["energy_potential"] = lambda angle, velocity: 0.5 * c * angle * angle

    contact = None
    if hub is not None:
        static, kinetic = hub.torque_static, hub.torque_kinetic
        contact = DryFriction(
            name="hub",
            static_limit=lambda u, angle: static,
            kinetic_limit=lambda u, angle, velocity, direction: kinetic,
            roundoff=lambda u, angle: 1e-14 * (abs(u) + c * abs(angle)),
            **hub.law_of_contact(),
        )

    def channels(trajectory: Trajectory) -> dict[str, Value]:
        found = {"drive_torque": trajectory.drive}
        if wire is not None:
            found["spring_torque"] = -c * trajectory.position
        return found

    return Mechanism(
        drive=signal_from(scenario.drive.torque),
        inertia=inertia,
        applied_torque=total(
            lambda u, angle, velocity: u, (lambda u, angle, velocity: -c * angle) if wire else None
        ),
        contact=contact,
        power_flows={"energy_input": lambda u, angle, velocity: u * velocity},
        stored_energies=stored,
        channels=channels,
        quantities=lambda trajectory: statics(scenario),
        **set_up(scenario),
    )


simulation = simulation_of(build)


def statics(scenario: TorsionPendulumScenario) -> Quantities:
    hub = scenario.effects.hub_friction
    return {"torque_to_start": Quantity(hub.torque_static if hub else 0.0, "N m")}
