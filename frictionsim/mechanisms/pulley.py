"""A pulley on a dry fixed shaft: a force P on the cord lifts, holds or lowers a load W.

    I dw/dt = (P - W) r_e - b w + T,    |T| <= r_s R sticking,    T = -s r_k R sliding [1]_

theta > 0 lifts the load. The reaction of the shaft is R = |P + W| with P vertical and
sqrt(P^2 + W^2) with P horizontal. W and P are forces: as in the paper, the equation neglects the
inertia of the load, its effect on the cord tension, and the weight of the pulley.

References
----------
.. [1] "Analysis of friction systems on shafts", Int. J. Applied Engineering Research 13(11),
   2018, 8871-8881, eqs 24 and 49-52.
"""

from collections.abc import Mapping
from math import sqrt
from sys import float_info
from typing import ClassVar, Literal, NamedTuple

from pydantic import Field

from frictionsim.mechanisms.effects import RENAMED_AIR_DRAG, ViscousDamping
from frictionsim.mechanisms.journal_friction import ShaftFriction
from frictionsim.mechanisms.single_dof import METRICS as METRICS
from frictionsim.mechanisms.single_dof import (
    SingleDofScenario,
    base_channels,
    kinetic_energy,
    set_up,
    simulation_of,
)
from frictionsim.results import Channel, Quantities, Quantity
from frictionsim.scenario.schema import Params, unit_field
from frictionsim.scenario.signal_checks import extremes
from frictionsim.scenario.signal_tables import TimeSignal, signal_from
from frictionsim.solvers.mechanism import DryFriction, Mechanism, Trajectory, Value

CONTACT_NAME = "shaft"

# Torque and limit are sums of three products: a few roundings of each.
ROUNDING = 16 * float_info.epsilon

CHANNELS = base_channels("pulley") | {
    "angle": Channel("rad", "angle of the pulley, positive where the load rises"),
    "drive_force": Channel("N", "force on the cord"),
    "shaft_reaction": Channel("N", "reaction of the shaft"),
    "energy_input": Channel("J", "work of the force on the cord"),
    "energy_kinetic": Channel("J", "kinetic energy of the pulley"),
    "energy_potential": Channel("J", "potential energy of the load"),
    "energy_damping": Channel("J", "heat of viscous damping"),
}


# The channels of the default plot, from top to bottom.
PANELS = ("drive_force", "friction_torque", "angular_velocity", "angle")


class PulleyParameters(Params):
    """`[mechanism]`."""

    cord_radius: float = unit_field("m", "Radius from the axis to the middle of the cord.", gt=0)
    inertia: float = unit_field("kg m^2", "Moment of inertia of the pulley.", gt=0)
    load: float = unit_field("N", "Weight that hangs from the other end of the cord.", ge=0)
    initial_angle_deg: float = unit_field("deg", "Angle at the start.", 0.0)
    initial_angular_velocity: float = unit_field("rad/s", "Angular velocity at the start.", 0.0)


class PulleyDrive(Params):
    """`[drive]`."""

    force: TimeSignal = unit_field("N", "Force on the cord.")
    direction: Literal["vertical", "horizontal"] = Field(
        "vertical", description="Direction of the force, which decides the reaction of the shaft."
    )


class PulleyEffects(Params):
    """`[effects]`: one table for each effect that is simulated."""

    RETIRED: ClassVar[Mapping[str, str]] = {"air_drag": RENAMED_AIR_DRAG}

    shaft_friction: ShaftFriction | None = None
    viscous_damping: ViscousDamping | None = None


class PulleyScenario(SingleDofScenario):
    """A scenario of kind `pulley`."""

    CHANNELS: ClassVar[Mapping[str, Channel]] = CHANNELS

    kind: Literal["pulley"]
    mechanism: PulleyParameters
    drive: PulleyDrive
    effects: PulleyEffects = PulleyEffects()

    @property
    def needs_samples(self) -> bool:
        """False: the quantities are those of the end, of events and of statics."""
        return False

    def warnings(self) -> list[str]:
        """Return the warnings; also of a shaft as thick as the pulley and of a pushing cord."""
        journal, arm = self.effects.shaft_friction, self.mechanism.cord_radius
        warnings = super().warnings()
        if journal is not None and journal.shaft_radius >= arm:
            thick = f"shaft_radius = {journal.shaft_radius} m is not below cord_radius = {arm} m"
            warnings.insert(0, thick)
        minimum, _ = extremes(self.drive.force, self.solver.duration)
        if minimum < 0.0:
            warnings.append(f"drive.force has a minimum of {minimum:.6g} N; a cord cannot push")
        return warnings


SCENARIO = PulleyScenario


def build(scenario: PulleyScenario) -> Mechanism:
    """Return the mechanism, composed of the effects in the scenario."""
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


simulation = simulation_of(build)


def _critical_forces(arm: float, r_s: float, load: float, vertical: bool) -> tuple[float, ...]:
    """Return the extrema of +-(P - W) r_e - r_s R over P, N."""
    if vertical:
        return (-load,)
    if r_s <= arm:
        return (0.0,)
    extremum = load * arm / sqrt(r_s * r_s - arm * arm)
    return (-extremum, extremum)


class LimitForces(NamedTuple):
    """The limits of the force at rest, N; `lift` is None if no force lifts."""

    lift: float | None
    hold: float


def limit_forces(arm: float, radius: float, load: float, vertical: bool) -> LimitForces:
    """Solve |(P - W) r_e| = r_f R for the force P, eq 24.

        vertical     P = W (r_e +- r_f)/(r_e -+ r_f)
        horizontal   (1 - q) P^2 - 2 W P + (1 - q) W^2 = 0,  q = (r_f/r_e)^2

    Parameters
    ----------
    arm : float, m
        Cord radius r_e.
    radius : float, m
        Friction radius r_f: r_s for impending motion, r_k for steady motion.
    load : float, N
        W.
    vertical : bool

    Returns
    -------
    LimitForces, N
        If r_f >= r_e, no force lifts the load, and none is needed to hold it.
    """
    if radius >= arm:
        return LimitForces(None, 0.0)
    if vertical:
        ratio = (arm + radius) / (arm - radius)
        return LimitForces(load * ratio, load / ratio)
    q = (radius / arm) ** 2
    root = sqrt(q * (2.0 - q))
    return LimitForces(load * (1.0 + root) / (1.0 - q), load * (1.0 - q) / (1.0 + root))


def impending_motion_forces(scenario: PulleyScenario) -> Quantities:
    """Return the forces of impending motion, in the direction of the scenario."""
    journal = scenario.effects.shaft_friction
    r_s = journal.static_radius if journal else 0.0
    vertical = scenario.drive.direction == "vertical"
    forces = limit_forces(scenario.mechanism.cord_radius, r_s, scenario.mechanism.load, vertical)
    return {
        "force_to_lift": Quantity(forces.lift, "N"),
        "force_to_hold": Quantity(forces.hold, "N"),
    }


def statics(scenario: PulleyScenario) -> Quantities:
    """Return the limit forces of eq 24: vertical and horizontal, static and kinetic."""
    journal = scenario.effects.shaft_friction
    r_s = journal.static_radius if journal else 0.0
    r_k = journal.kinetic_radius if journal else 0.0
    arm, load = scenario.mechanism.cord_radius, scenario.mechanism.load
    found = impending_motion_forces(scenario)
    steady = limit_forces(arm, r_k, load, scenario.drive.direction == "vertical")
    found["force_to_keep_lifting"] = Quantity(steady.lift, "N")
    found["force_to_keep_lowering"] = Quantity(steady.hold, "N")
    for direction in ("vertical", "horizontal"):
        forces = limit_forces(arm, r_s, load, direction == "vertical")
        found[f"force_to_lift_{direction}"] = Quantity(forces.lift, "N")
        found[f"force_to_hold_{direction}"] = Quantity(forces.hold, "N")
    found["friction_radius_static"] = Quantity(r_s, "m")
    found["friction_radius_kinetic"] = Quantity(r_k, "m")
    return found
