"""The scenario of kind `shaft`: its tables and channels."""

from collections.abc import Callable, Mapping
from math import hypot, inf, radians
from sys import float_info
from typing import Any, ClassVar, Literal, Self

from pydantic import Field, field_validator, model_validator

from frictionsim.mechanisms.effects import Gravity, ShaftFriction, ViscousDamping
from frictionsim.mechanisms.journal import CHANNELS as JOURNAL_CHANNELS
from frictionsim.mechanisms.shaft.loads import Arms, arms_of_force
from frictionsim.mechanisms.single_dof import SingleDofScenario, base_channels
from frictionsim.results import Channel
from frictionsim.scenario.methods import EVENTS_ONLY, SET_VALUED, Pairs
from frictionsim.scenario.schema import Params, inconsistent, unit_field
from frictionsim.scenario.signal_tables import MotionSignal, TimeSignals

CHANNELS = base_channels("body") | {
    "angle": Channel("rad", "angle of the body, positive counter-clockwise"),
    "applied_torque": Channel("N m", "torque on the body, of all but dry friction and end stops"),
    "drive_torque": Channel("N m", "torque of the drive that gives the speed, one of the applied"),
    "stop_torque": Channel("N m", "torque of an end stop on the body that rests on it"),
    "shaft_reaction": Channel("N", "reaction of the shaft"),
    **JOURNAL_CHANNELS,
    "reaction_x": Channel("N", "reaction of the shaft on the body, component to the right"),
    "reaction_y": Channel("N", "reaction of the shaft on the body, component upwards"),
    "energy_input": Channel("J", "work of the forces and couples"),
    "energy_kinetic": Channel("J", "kinetic energy of the body"),
    "energy_potential": Channel("J", "potential energy of the eccentric mass and the spring"),
    "energy_damping": Channel("J", "heat of viscous damping"),
    "energy_impact": Channel("J", "energy lost in impacts on the end stops"),
}
PANELS = ("drive_torque", "applied_torque", "friction_torque", "angular_velocity", "angle")

MAX_LOADS = 1000
# Of unknowns, the endings of those that decide whether a force acts within the friction circle.
RADII = ".shaft_radius", ".mu_s", ".cord_radius", ".distance"
# Closer to 1, the impacts at ordinary speeds lose no more than the rounding of the flights gives.
MAX_RESTITUTION = 1.0 - 1e-9


class ShaftParameters(Params):
    """`[mechanism]`."""

    inertia: float = unit_field(
        "kg m^2",
        "Moment of inertia of the body about the axis, without an eccentric mass; 0 needs one, or"
        " a given speed.",
        ge=0,
    )
    mass: float = unit_field(
        "kg", "Mass of the body, whose centre is on the axis, without an eccentric mass.", 0.0, ge=0
    )
    initial_angle_deg: float = unit_field("deg", "Angle at the start.", 0.0)
    initial_angular_velocity: float = unit_field("rad/s", "Angular velocity at the start.", 0.0)


_NAME: Any = Field(
    min_length=1, pattern=r"^[\w-]+$", description="Name, for quantities, pictures and --set."
)


class Force(Params):
    """`[[forces]]`: a force at a point of the body, or of a cord on it.

    x points to the right, y upwards; points and directions are those at the angle 0 of the body.
    """

    name: str = _NAME
    size: MotionSignal = unit_field("N", "Size of the force; a negative one pushes the other way.")
    direction: tuple[float, float] = unit_field(
        "1", "Direction, x to the right and y upwards; its length does not matter.", strict=False
    )
    direction_turns: bool = Field(False, description="The direction turns with the body.")
    point: tuple[float, float] | None = unit_field(
        "m", "Point of application from the axis, x and y; give this or cord_radius.", None,
        strict=False,
    )  # fmt: skip
    point_turns: bool = Field(True, description="The point turns with the body.")
    cord_radius: float | None = unit_field(
        "m",
        "Of a cord that leaves the body at this radius in the direction: its constant arm, positive"
        " if it turns the body counter-clockwise.",
        None,
    )

    @model_validator(mode="after")
    def _check_direction_and_point(self) -> Self:
        if hypot(*self.direction) < float_info.min:  # smaller numbers have no digits left
            raise inconsistent(
                ("direction",),
                f"expected a direction, found one of length {hypot(*self.direction):.3g}, which"
                " points nowhere; give x and y, as in [0.0, -1.0]",
            )
        if (self.point is None) == (self.cord_radius is None):
            keys = "neither" if self.point is None else "both"
            raise inconsistent(
                (), f"expected either point or cord_radius, found {keys}; give one of them"
            )
        if self.cord_radius is not None and self.direction_turns:
            raise inconsistent(
                ("direction_turns",),
                "a cord leaves the body in a fixed direction; give point, or remove this key",
            )
        return self

    @property
    def arms(self) -> Arms:
        """Moment and components per size."""
        length = hypot(*self.direction)
        x, y = (component / length for component in self.direction)
        if self.cord_radius is not None:
            return Arms((self.cord_radius, x, y))
        assert self.point is not None  # checked above
        return arms_of_force((x, y), self.point, self.direction_turns, self.point_turns)


class Couple(Params):
    """`[[couples]]`: a torque on the body. It does not load the shaft, nor oppose the motion."""

    name: str = _NAME
    size: MotionSignal = unit_field("N m", "Size of the couple, positive counter-clockwise.")


class ShaftDrive(Params):
    """`[drive]`: the prescribed speed of the body, under any forces and couples."""

    speed: TimeSignals = unit_field(
        "rad/s", "Given angular velocity of the body, counter-clockwise; its torque is computed."
    )


class EccentricMassTable(Params):
    """A point mass on the body, beside the axis."""

    mass: float = unit_field("kg", "Mass, in addition to the mass of the body.", ge=0)
    radius: float = unit_field("m", "Distance from the axis.", ge=0)
    azimuth_deg: float = unit_field(
        "deg", "Where it is at the angle 0 of the body; 0 is to the right, 90 above.", 0.0
    )

    @property
    def first_moment(self) -> float:
        """m e, kg m."""
        return self.mass * self.radius


class TorsionSpring(Params):
    """A torsion spring between body and ground: a torque -k (q - q_0)."""

    stiffness: float = unit_field("N m/rad", "Torque per angle.", ge=0)
    free_angle_deg: float = unit_field("deg", "Angle at which it is free.", 0.0)


class EndStopsTable(Params):
    """End stops: the body stays between two angles, and loses energy in impacts on them.

    A stop is a couple on the body and does not load the shaft. It takes all torque that presses a
    body at rest into it, and dry friction none.
    """

    lowest_angle_deg: float | None = unit_field(
        "deg", "Angle of the clockwise end stop; omit for no stop.", None
    )
    highest_angle_deg: float | None = unit_field(
        "deg", "Angle of the counter-clockwise end stop; omit for no stop.", None
    )
    restitution: float = unit_field(
        "1",
        "Speed after an impact, relative to that before it; at most 1 - 1e-9.",
        0.0,
        ge=0,
        lt=1,
    )
    capture_speed: float = unit_field(
        "rad/s", "After an impact below this speed the body does not rebound.", 1e-3, gt=0
    )

    @field_validator("restitution")
    @classmethod
    def _an_impact_loses_energy(cls, value: float) -> float:
        if value > MAX_RESTITUTION:
            raise ValueError(
                f"expected a number of at most 1 - 1e-9, got {value!r}: rounding hides the loss of"
                " an impact"
            )
        return value

    @property
    def lowest(self) -> float:
        """Lowest angle, rad; -inf without a stop."""
        return -inf if self.lowest_angle_deg is None else radians(self.lowest_angle_deg)

    @property
    def highest(self) -> float:
        """Highest angle, rad; inf without a stop."""
        return inf if self.highest_angle_deg is None else radians(self.highest_angle_deg)

    @model_validator(mode="after")
    def _check_positions(self) -> Self:
        if self.lowest_angle_deg is None and self.highest_angle_deg is None:
            raise inconsistent(
                (), "expected lowest_angle_deg or highest_angle_deg, or both; found neither"
            )
        if not self.lowest < self.highest:
            raise inconsistent(
                ("lowest_angle_deg",),
                f"{self.lowest_angle_deg} is not below highest_angle_deg ="
                f" {self.highest_angle_deg}; the body turns between them",
            )
        return self


class ShaftEffects(Params):
    """`[effects]`: one table for each effect that is simulated."""

    gravity: Gravity | None = None
    eccentric_mass: EccentricMassTable | None = None
    shaft_friction: ShaftFriction | None = None
    viscous_damping: ViscousDamping | None = None
    torsion_spring: TorsionSpring | None = None
    end_stops: EndStopsTable | None = None

    @model_validator(mode="after")
    def _check_law(self) -> Self:
        journal = self.shaft_friction
        if self.end_stops is not None and journal is not None and journal.law != SET_VALUED:
            raise inconsistent(
                ("shaft_friction", "law"),
                f"'{journal.law}' does not go with end_stops, whose impacts are located events: use"
                f" law = '{SET_VALUED}', or remove effects.end_stops",
            )
        return self


class Statics(Params):
    """`[statics]`: what `frictionsim static` computes."""

    unknown: str | None = Field(
        None,
        description="Key for which eq 24 is solved: `forces.NAME.size`, `.cord_radius` or"
        " `.distance`, `couples.NAME.size`, `effects.shaft_friction.mu_s` and others.",
    )
    angle_deg: float | None = unit_field(
        "deg", "Angle of the body; that of the start without it.", None
    )
    time: float = unit_field("s", "Time of the sizes that change over time.", 0.0, ge=0)

    @field_validator("unknown", mode="before")
    @classmethod
    def _unknown_is_one(cls, unknown: Any) -> Any:
        several = unknown if isinstance(unknown, list | tuple) else str(unknown).split(",")
        if len(several) > 1:
            keys = ", ".join(str(key).strip() for key in several)
            message = f"eq 24 is one equation and has one unknown; found {len(several)}: {keys}"
            raise inconsistent((), message)
        return unknown


class ShaftScenario(SingleDofScenario):
    """A scenario of kind `shaft`."""

    CHANNELS: ClassVar[Mapping[str, Channel]] = CHANNELS
    PRESCRIBES: ClassVar[bool] = True
    # Checks that need the balance of forces; `frictionsim.mechanisms.shaft` sets them.
    CHECKS: ClassVar[tuple[Callable[["ShaftScenario"], None], ...]] = ()

    kind: Literal["shaft"]
    mechanism: ShaftParameters
    forces: tuple[Force, ...] = Field((), max_length=MAX_LOADS, strict=False)
    couples: tuple[Couple, ...] = Field((), max_length=MAX_LOADS, strict=False)
    drive: ShaftDrive | None = None
    effects: ShaftEffects = ShaftEffects()
    statics: Statics | None = None

    @property
    def pairs(self) -> Pairs:
        """The pairs of law and method: with end stops, impacts are located events."""
        return self.PAIRS if self.effects.end_stops is None else EVENTS_ONLY

    @property
    def called(self) -> str:
        """The name of the mechanism in messages."""
        return "shaft" if self.effects.end_stops is None else "shaft with end_stops"

    @property
    def signals(self) -> dict[str, Any]:
        """The input signals, by their keys in the scenario."""
        forces = {f"forces.{force.name}.size": force.size for force in self.forces}
        couples = {f"couples.{couple.name}.size": couple.size for couple in self.couples}
        return forces | couples | ({"drive.speed": self.drive.speed} if self.drive else {})

    @model_validator(mode="after")
    def _check_drive(self) -> Self:
        if self.drive is None and self.inertia <= 0.0:
            raise inconsistent(
                ("mechanism", "inertia"),
                "0, and no eccentric mass beside the axis gives some: nothing limits the"
                " acceleration; give an inertia, or [effects.eccentric_mass]",
            )
        if self.drive is not None and self.effects.end_stops is not None:
            raise inconsistent(
                ("effects", "end_stops"),
                "a body of given speed does not stop at one: leave end_stops or drive.speed out",
            )
        return self

    @property
    def has_weight(self) -> bool:
        """Whether a weight acts on the body."""
        eccentric, gravity = self.effects.eccentric_mass, self.effects.gravity
        mass = self.mechanism.mass + (eccentric.mass if eccentric else 0.0)
        return gravity is not None and mass * gravity.g > 0.0

    @property
    def inertia(self) -> float:
        """Moment of inertia about the axis, with an eccentric mass, kg m^2."""
        eccentric = self.effects.eccentric_mass
        added = eccentric.first_moment * eccentric.radius if eccentric else 0.0
        return self.mechanism.inertia + added

    @model_validator(mode="after")
    def _check_names(self) -> Self:
        names: list[str] = []
        for table in ("forces", "couples"):
            for i, part in enumerate(getattr(self, table)):
                if part.name in names:
                    raise inconsistent(
                        (table, i, "name"),
                        f"there is a force or couple '{part.name}' already; give another name",
                    )
                names.append(part.name)
        return self

    @model_validator(mode="after")
    def _check_loads(self) -> Self:
        effects = self.effects
        acts = [self.forces, self.couples, self.has_weight, effects.torsion_spring, self.drive]
        if self.mechanism.initial_angular_velocity:  # a coast-down, by what brakes it
            acts += [effects.viscous_damping, effects.eccentric_mass, effects.end_stops]
            acts += [effects.shaft_friction and effects.shaft_friction.normal_load is not None]
        if not any(acts):
            raise inconsistent(
                (),
                "no force acts on the body: give [[forces]], [[couples]], a mass with"
                " [effects.gravity], or [effects.torsion_spring]",
            )
        return self

    @model_validator(mode="after")
    def _check_start(self) -> Self:
        stops, start = self.effects.end_stops, self.mechanism.initial_angle_deg
        if stops is None:
            return self
        _check_between(stops, start, ("mechanism", "initial_angle_deg"), "start")
        if self.statics is not None and self.statics.angle_deg is not None:
            where = ("statics", "angle_deg")
            _check_between(stops, self.statics.angle_deg, where, "give an angle")
        return self

    @property
    def largest_arm(self) -> float:
        """The largest arm of the forces and weights over a turn, m."""
        eccentric = self.effects.eccentric_mass
        arms = [force.arms.largest for force in self.forces]
        arms += [eccentric.radius] if eccentric is not None and self.has_weight else []
        return max(arms, default=0.0)

    def warnings(self) -> list[str]:
        """Return the warnings; also of a thick shaft, and of a mass without weight."""
        journal, arm = self.effects.shaft_friction, self.largest_arm
        warnings = super().warnings()
        if self.effects.gravity is None and self.mechanism.mass > 0.0:
            warnings.append("mechanism.mass has no effect: no weight without [effects.gravity]")
        if journal is not None and 0.0 < arm <= journal.shaft_radius:
            warnings.insert(
                0,
                f"effects.shaft_friction.shaft_radius = {journal.shaft_radius} m is not below the"
                f" largest arm of the forces, {arm:.6g} m; the friction radius is"
                f" {journal.static_radius:.6g} m",
            )
        return warnings

    @model_validator(mode="after")
    def _check_locking(self) -> Self:
        """Refuse a body at rest under one force that friction holds, whatever its size.

        |M| = a R <= r_s R. Of several forces R may be smaller than their sum. Of a radius or
        mu_s that is the unknown of the statics, the value here does not count.
        """
        journal, arm = self.effects.shaft_friction, self.largest_arm
        others = self.couples or self.effects.torsion_spring or self.has_weight
        moves = self.drive or self.mechanism.initial_angular_velocity != 0.0
        if journal is None or journal.normal_load is not None or others or moves:
            return self
        if len(self.forces) != 1:
            return self
        unknown = None if self.statics is None else self.statics.unknown
        if 0.0 < arm <= journal.static_radius and not str(unknown).endswith(RADII):
            raise inconsistent(
                ("effects", "shaft_friction", "shaft_radius"),
                f"{journal.shaft_radius} m with mu_s = {journal.mu_s} gives a friction radius of"
                f" {journal.static_radius:.6g} m, not below the arm of the only force, {arm:.6g} m:"
                " the body locks, whatever the force; make the shaft thinner or the arm longer",
            )
        return self

    @model_validator(mode="after")
    def _check_sliding(self) -> Self:
        journal, eccentric = self.effects.shaft_friction, self.effects.eccentric_mass
        if journal is None or journal.normal_load is not None or eccentric is None or self.drive:
            return self
        product = eccentric.first_moment * journal.radius_over_speed.largest
        if product >= self.inertia:
            raise inconsistent(
                ("effects", "eccentric_mass"),
                f"mass x radius x kinetic friction radius = {product:.6g} kg m^2 is not below the"
                f" moment of inertia, {self.inertia:.6g} kg m^2: sliding has no unique"
                " acceleration; increase mechanism.inertia",
            )
        return self

    @model_validator(mode="after")
    def _check_balance(self) -> Self:
        for check in self.CHECKS:
            check(self)
        return self


def _check_between(
    stops: EndStopsTable, angle: float, where: tuple[str, ...], way_out: str
) -> None:
    """Check that an angle, deg, is between the end stops."""
    for name, beyond in (("lowest", -1.0), ("highest", 1.0)):
        stop = getattr(stops, f"{name}_angle_deg")
        if stop is not None and beyond * (angle - stop) > 0.0:
            raise inconsistent(
                where,
                f"{angle} is beyond the end stop effects.end_stops.{name}_angle_deg = {stop};"
                f" {way_out} between the stops, or at one of them",
            )
