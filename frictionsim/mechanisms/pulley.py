"""A pulley on a dry fixed shaft: a force P on the cord lifts, holds or lowers a load W.

    I dw/dt = (P - W) r_e - b w + T,    |T| <= r_s R sticking,    T = -s r_k R sliding [1]_

theta > 0 lifts the load. The reaction of the shaft is R = |P + W| with P vertical and
sqrt(P^2 + W^2) with P horizontal. W and P are forces: as in the paper, the equation neglects the
inertia of the load, its effect on the cord tension, and the weight of the pulley. A torque on the
pulley may take the place of the force P. Masses on the cord, which may then fall slack or slip,
are in `pulley_with_masses`.

References
----------
.. [1] "Analysis of friction systems on shafts", Int. J. Applied Engineering Research 13(11),
   2018, 8871-8881, eqs 24 and 49-52.
"""

from collections.abc import Mapping
from math import sqrt
from typing import TYPE_CHECKING, ClassVar, Literal, NamedTuple, Self

from pydantic import ConfigDict, Field, model_validator
from pydantic.config import JsonDict

from frictionsim.mechanisms.effects import (
    RENAMED_AIR_DRAG,
    CordFriction,
    HangingMasses,
    ViscousDamping,
)
from frictionsim.mechanisms.journal_friction import CONTACT_NAME, ROUNDING, ShaftFriction
from frictionsim.mechanisms.single_dof import METRICS as METRICS
from frictionsim.mechanisms.single_dof import (
    SINGLE_DOF_MODES,
    SingleDofScenario,
    base_channels,
    kinetic_energy,
    set_up,
    simulation_of,
)
from frictionsim.results import Channel, Quantities, Quantity
from frictionsim.scenario.methods import EVENTS_ONLY, SET_VALUED, Pairs
from frictionsim.scenario.schema import Params, inconsistent, unit_field
from frictionsim.scenario.signal_checks import extremes
from frictionsim.scenario.signal_tables import TimeSignal, signal_from
from frictionsim.solvers.mechanism import DryFriction, Mechanism, Trajectory, Value

if TYPE_CHECKING:
    from frictionsim.solvers.multi_contact import MultiContactMechanism

SLACK_SIDES = ((0, "none"), (1, "car"), (2, "counterweight"), (3, "both"))


CHANNELS = base_channels("pulley") | {
    "angle": Channel("rad", "angle of the pulley, positive where the load rises"),
    "drive_force": Channel("N", "force on the cord"),
    "drive_torque": Channel("N m", "torque on the pulley"),
    "shaft_reaction": Channel("N", "reaction of the shaft"),
    "rope_tension_car": Channel("N", "tension of the cord on the side of the car"),
    "rope_tension_counterweight": Channel(
        "N", "tension of the cord on the side of the counterweight"
    ),
    "car_position": Channel("m", "height of the car above its start"),
    "car_velocity": Channel("m/s", "velocity of the car, upward"),
    "car_acceleration": Channel("m/s^2", "acceleration of the car, upward"),
    "counterweight_position": Channel("m", "height of the counterweight above its start"),
    "counterweight_velocity": Channel("m/s", "velocity of the counterweight, upward"),
    "slack": Channel("1", "sides on which the cord is slack", integer=True, flags=SLACK_SIDES),
    "cord_slip": Channel("m", "way that the cord has slipped over the pulley, towards lifting"),
    "cord_mode": Channel(
        "1", "of the cord on the pulley: 0 sticking, +1 and -1 slipping", "", True, SINGLE_DOF_MODES
    ),
    "energy_input": Channel("J", "work of the drive"),
    "energy_kinetic": Channel("J", "kinetic energy of the pulley and of the masses on the cord"),
    "energy_potential": Channel("J", "potential energy of the load and of the masses"),
    "energy_damping": Channel("J", "heat of viscous damping"),
    "energy_cord_friction": Channel("J", "heat of the cord slipping over the pulley"),
    "energy_impact": Channel("J", "energy lost where a slack cord is taken up"),
}


# The channels of the default plot, from top to bottom.
PANELS = (
    "drive_force",
    "drive_torque",
    "rope_tension_car",
    "rope_tension_counterweight",
    "friction_torque",
    "angular_velocity",
    "angle",
    "car_velocity",
    "car_position",
    "cord_slip",
)


class PulleyParameters(Params):
    """`[mechanism]`."""

    cord_radius: float = unit_field("m", "Radius from the axis to the middle of the cord.", gt=0)
    inertia: float = unit_field("kg m^2", "Moment of inertia of the pulley.", gt=0)
    load: float = unit_field(
        "N",
        "Weight that hangs from the other end of the cord. Required, but left out, or 0, with"
        " hanging_masses: car is what hangs there.",
        0.0,
        ge=0,
    )
    initial_angle_deg: float = unit_field("deg", "Angle at the start.", 0.0)
    initial_angular_velocity: float = unit_field("rad/s", "Angular velocity at the start.", 0.0)


class PulleyDrive(Params):
    """`[drive]`: a force on the cord, or a torque on the pulley."""

    force: TimeSignal | None = unit_field("N", "Force on the cord.", None)
    torque: TimeSignal | None = unit_field(
        "N m", "Torque on the pulley, positive where it lifts the load; give this or force.", None
    )
    direction: Literal["vertical", "horizontal"] = Field(
        "vertical", description="Direction of the force, which decides the reaction of the shaft."
    )

    @model_validator(mode="after")
    def _one_of_them(self) -> Self:
        if (self.force is None) == (self.torque is None):
            found = "neither" if self.force is None else "both"
            raise inconsistent((), f"expected either force or torque; found {found}")
        if self.torque is not None and self.direction != "vertical":
            raise inconsistent(
                ("direction",),
                "it is the direction of force, and the drive is a torque; remove this key",
            )
        return self


class PulleyEffects(Params):
    """`[effects]`: one table for each effect that is simulated."""

    RETIRED: ClassVar[Mapping[str, str]] = {"air_drag": RENAMED_AIR_DRAG}

    shaft_friction: ShaftFriction | None = None
    viscous_damping: ViscousDamping | None = None
    hanging_masses: HangingMasses | None = None
    cord_friction: CordFriction | None = None

    @model_validator(mode="after")
    def _go_together(self) -> Self:
        masses, journal = self.hanging_masses, self.shaft_friction
        if masses is None:
            if self.cord_friction is not None:
                raise inconsistent(
                    ("cord_friction",),
                    "a cord slips by the tensions of its two sides: add [effects.hanging_masses]",
                )
            return self
        if journal is not None and journal.law != SET_VALUED:
            raise inconsistent(
                ("shaft_friction", "law"),
                f"'{journal.law}' does not go with hanging_masses, whose slip and slack are located"
                f" events: use law = '{SET_VALUED}'",
            )
        if self.cord_friction is not None and masses.other_side == 0.0:
            raise inconsistent(
                ("hanging_masses", "counterweight"),
                "a cord that may slip needs a mass at its other end: give counterweight or rope, or"
                " leave cord_friction out",
            )
        return self


# Load or car: for editors, what `_load_or_car` checks.
LOAD_OR_CAR: JsonDict = {
    "if": {
        "required": ["effects"],
        "properties": {"effects": {"required": ["hanging_masses"]}},
    },
    "then": {"properties": {"mechanism": {"properties": {"load": {"const": 0}}}}},
    "else": {"properties": {"mechanism": {"required": ["load"]}}},
}


class PulleyScenario(SingleDofScenario):
    """A scenario of kind `pulley`."""

    model_config = ConfigDict(json_schema_extra=LOAD_OR_CAR)
    CHANNELS: ClassVar[Mapping[str, Channel]] = CHANNELS

    kind: Literal["pulley"]
    mechanism: PulleyParameters
    drive: PulleyDrive
    effects: PulleyEffects = PulleyEffects()

    @property
    def needs_samples(self) -> bool:
        """Whether quantities follow from samples: only those of masses on the cord do."""
        return self.effects.hanging_masses is not None

    @property
    def pairs(self) -> Pairs:
        """The pairs of law and method: with masses, slip and slack are located events."""
        return self.PAIRS if self.effects.hanging_masses is None else EVENTS_ONLY

    @property
    def called(self) -> str:
        """What it is called in messages."""
        return "pulley" if self.effects.hanging_masses is None else "pulley with hanging_masses"

    @model_validator(mode="after")
    def _load_or_car(self) -> Self:
        masses, load = self.effects.hanging_masses, self.mechanism.load
        if masses is None:
            if "load" not in self.mechanism.model_fields_set:
                raise inconsistent(("mechanism", "load"), "missing; expected a number in N")
        elif load > 0.0:
            message = (
                f"{load} N would hang on the side of the car of {masses.car} kg, besides it: leave"
                " load out"
            )
            if masses.g > 0.0:
                mass = load / masses.g
                message += (
                    "; if it is the weight of the car, give effects.hanging_masses.car ="
                    f" {mass:.6g}, and if it hangs from the car, {masses.car + mass:.6g}"
                )
            raise inconsistent(("mechanism", "load"), message)
        return self

    @model_validator(mode="after")
    def _drive_suits_the_masses(self) -> Self:
        masses = self.effects.hanging_masses
        if masses is None:
            return self
        if self.drive.direction != "vertical":
            raise inconsistent(
                ("drive", "direction"),
                "masses hang on both sides of the pulley: with hanging_masses it is vertical",
            )
        from frictionsim.mechanisms.pulley_with_masses import fault_of

        if fault := fault_of(self):
            raise inconsistent(*fault)
        return self

    def warnings(self) -> list[str]:
        """Return the warnings; also of a shaft as thick as the pulley and of a pushing cord."""
        journal, arm = self.effects.shaft_friction, self.mechanism.cord_radius
        warnings = super().warnings()
        if journal is not None and journal.shaft_radius >= arm:
            thick = f"shaft_radius = {journal.shaft_radius} m is not below cord_radius = {arm} m"
            warnings.insert(0, thick)
        if self.drive.force is None:
            return warnings
        minimum, _ = extremes(self.drive.force, self.solver.duration)
        if minimum < 0.0:
            warnings.append(f"drive.force has a minimum of {minimum:.6g} N; a cord cannot push")
        return warnings


SCENARIO = PulleyScenario


def build(scenario: PulleyScenario) -> "Mechanism | MultiContactMechanism":
    """Return the mechanism, composed of the effects in the scenario."""
    if scenario.effects.hanging_masses is not None:
        from frictionsim.mechanisms.pulley_with_masses import build as with_masses

        return with_masses(scenario)
    if scenario.drive.force is None:
        from frictionsim.mechanisms.pulley_with_torque import build as with_torque

        return with_torque(scenario)
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
    if scenario.effects.hanging_masses is not None:
        from frictionsim.mechanisms.hanging_masses import statics as with_masses

        return with_masses(scenario)
    if scenario.drive.force is None:
        from frictionsim.mechanisms.pulley_with_torque import statics as with_torque

        return with_torque(scenario)
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
