"""The scenario of kind `pulley`: its tables and channels."""

from collections.abc import Mapping
from math import exp, inf, radians
from typing import Any, ClassVar, Literal, NamedTuple, Self

from pydantic import ConfigDict, Field, model_validator
from pydantic.config import JsonDict

from frictionsim.mechanisms.effects import ShaftFriction, ViscousDamping, radii_of
from frictionsim.mechanisms.journal import CHANNELS as JOURNAL_CHANNELS
from frictionsim.mechanisms.single_dof import (
    SINGLE_DOF_MODES,
    SingleDofScenario,
    base_channels,
)
from frictionsim.results import Channel
from frictionsim.scenario.kinetic_friction import (
    KineticCoefficient,
    OverSpeed,
    check_kinetic_friction,
    over_speed,
)
from frictionsim.scenario.methods import EVENTS_ONLY, SET_VALUED, Pairs
from frictionsim.scenario.schema import Params, inconsistent, unit_field
from frictionsim.scenario.signal_tables import SpeedOrTimeSignals, TimeSignals, extremes

SLACK_SIDES = ((0, "none"), (1, "car"), (2, "counterweight"), (3, "both"))
CHANNELS = base_channels("pulley") | {
    "angle": Channel("rad", "angle of the pulley, positive where the load rises"),
    "drive_force": Channel("N", "force on the cord"),
    "drive_torque": Channel("N m", "torque on the pulley"),
    "shaft_reaction": Channel("N", "reaction of the shaft"),
    **JOURNAL_CHANNELS,
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
    "cord_slip": Channel("m", "slip of the cord on the pulley, positive when lifting"),
    "cord_mode": Channel(
        "1", "of the cord on the pulley: 0 sticking, +1 and -1 slipping", "", True, SINGLE_DOF_MODES
    ),
    "energy_input": Channel("J", "work of the drive"),
    "energy_kinetic": Channel("J", "kinetic energy of the pulley and of the masses on the cord"),
    "energy_potential": Channel("J", "potential energy of the load and of the masses"),
    "energy_damping": Channel("J", "heat of viscous damping"),
    "energy_cord_friction": Channel("J", "heat of the cord slipping over the pulley"),
    "energy_impact": Channel("J", "energy lost when a slack cord becomes taut"),
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

MAX_EXPONENT = 100.0  # of exp(mu_s wrap), the ratio of tensions at which a cord slips


def limiting_ratio(mu: float, wrap_deg: float) -> float:
    """Return exp(mu phi), the ratio of the tensions of a cord that slips or is about to."""
    return exp(mu * radians(wrap_deg))


class HangingMasses(Params):
    """Masses on the cord: a car in place of the load, a counterweight on the side of the force.

    The tensions depend on the acceleration, and the load of the shaft with them. A side whose
    tension would be negative goes slack, and becomes taut with an impact. Half of the rope hangs on
    each side, and its weight is compensated: it does not shift with the travel.
    """

    car: float = unit_field(
        "kg", "Mass of the car with all that hangs from it, on the side of the load.", gt=0
    )
    counterweight: float = unit_field(
        "kg", "Mass of the counterweight, on the side of the force.", ge=0
    )
    rope: float = unit_field("kg", "Mass of the rope, half of it on each side.", 0.0, ge=0)
    g: float = unit_field("m/s^2", "Acceleration of gravity.", 9.81, ge=0)
    restitution: float = unit_field(
        "1",
        "Coefficient of restitution when a slack rope becomes taut. The part e^2 of"
        " the work that takes it up is given back.",
        0.0,
        ge=0,
        lt=1,
    )
    capture_speed: float = unit_field(
        "m/s", "A rope that becomes taut more slowly does not bounce.", 1e-3, gt=0
    )

    @property
    def car_side(self) -> float:
        """m1, kg."""
        return self.car + 0.5 * self.rope

    @property
    def other_side(self) -> float:
        """m2, kg."""
        return self.counterweight + 0.5 * self.rope


class CordFriction(Params):
    """Dry friction of the cord on the pulley, of Euler and Eytelwein: the cord may slip.

    It sticks while the ratio of the tensions is at most exp(mu_s wrap); slipping, the ratio is
    exp(mu_k wrap). The speed of a `mu_k` over speed is that of the slip.
    """

    mu_s: float = unit_field("1", "Static coefficient of friction, not below mu_k.", ge=0)
    mu_k: KineticCoefficient = unit_field("1", "Kinetic coefficient of friction.")
    wrap_deg: float = unit_field("deg", "Angle of wrap, of all turns together.", 180.0, gt=0)

    @model_validator(mode="after")
    def _check_cord_friction(self) -> Self:
        check_kinetic_friction("mu_k", self.mu_k, "mu_s", self.mu_s)
        if self.mu_s * radians(self.wrap_deg) > MAX_EXPONENT:
            raise inconsistent(
                ("wrap_deg",),
                f"the ratio of tensions exp(mu_s wrap) exceeds exp({MAX_EXPONENT:g}): such a cord"
                " never slips; leave cord_friction out",
            )
        return self

    @property
    def ratio_over_speed(self) -> OverSpeed:
        """exp(mu_k wrap) over the rate of slip, m/s."""
        mu_k = over_speed(self.mu_k, self.mu_s)
        return mu_k.of(1.0, lambda mu: limiting_ratio(mu, self.wrap_deg))


class LiftParameters(NamedTuple):
    """The numbers of a pulley with masses on its cord.

    Attributes
    ----------
    r, inertia : float, m and kg m^2
    m1, m2 : float, kg
        Of car and counterweight, each with half of the rope.
    g : float, m/s^2
    damping : float, N m s
        b.
    r_s, r_k : float, m
        Friction radii of the shaft, r_k at the speed zero; zero without its friction.
    static_ratio, kinetic_ratio : float
        exp(mu phi) of the cord, with mu_k at the speed zero; inf where it cannot slip.
    by_torque : bool
        The drive is a torque on the pulley, not a force on the cord.
    """

    r: float
    inertia: float
    m1: float
    m2: float
    g: float
    damping: float
    r_s: float
    r_k: float
    static_ratio: float
    kinetic_ratio: float
    by_torque: bool

    @property
    def weight_1(self) -> float:
        """m1 g, N."""
        return self.m1 * self.g

    @property
    def weight_2(self) -> float:
        """m2 g, N."""
        return self.m2 * self.g


class PulleyParameters(Params):
    """`[mechanism]`."""

    cord_radius: float = unit_field("m", "Radius from the axis to the middle of the cord.", gt=0)
    inertia: float = unit_field(
        "kg m^2", "Moment of inertia of the pulley; 0 with taut masses or a given speed.", ge=0
    )
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
    """`[drive]`: a force on the cord, a torque on the pulley, or its prescribed speed."""

    force: TimeSignals | None = unit_field("N", "Force on the cord.", None)
    torque: SpeedOrTimeSignals | None = unit_field(
        "N m",
        "Torque on the pulley, positive if it lifts, over time or speed.",
        None,
    )
    speed: TimeSignals | None = unit_field(
        "rad/s", "Given angular velocity of the pulley, whose torque is computed.", None
    )
    direction: Literal["vertical", "horizontal"] = Field(
        "vertical", description="Direction of the force, which decides the reaction of the shaft."
    )

    @model_validator(mode="after")
    def _check_inputs(self) -> Self:
        ways = {"force": self.force, "torque": self.torque, "speed": self.speed}
        found = [name for name, signal in ways.items() if signal is not None]
        if len(found) != 1:
            keys = " and ".join(found) or "none"
            raise inconsistent((), f"expected one of force, torque and speed; found {keys}")
        if self.force is None and self.direction != "vertical":
            raise inconsistent(
                ("direction",),
                f"it is the direction of force, and the drive is a {found[0]}; remove this key",
            )
        return self

    @property
    def given(self) -> Any:
        """The force or the torque; None of a given speed."""
        return self.torque if self.force is None else self.force


class PulleyEffects(Params):
    """`[effects]`: one table for each effect that is simulated."""

    shaft_friction: ShaftFriction | None = None
    viscous_damping: ViscousDamping | None = None
    hanging_masses: HangingMasses | None = None
    cord_friction: CordFriction | None = None

    @model_validator(mode="after")
    def _check_combination(self) -> Self:
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
        if journal is not None and journal.normal_load is not None:
            raise inconsistent(
                ("shaft_friction", "normal_load"),
                "hanging_masses press on the shaft by the tensions of their cord, which change with"
                " the acceleration; leave normal_load out",
            )
        if self.cord_friction is not None and masses.other_side == 0.0:
            raise inconsistent(
                ("hanging_masses", "counterweight"),
                "a cord that may slip needs a mass at its other end: give counterweight or rope, or"
                " leave cord_friction out",
            )
        return self


# Load or car: for editors, what `_check_load` checks.
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
    PRESCRIBES: ClassVar[bool] = True

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
        """The name of the mechanism in messages."""
        return "pulley" if self.effects.hanging_masses is None else "pulley with hanging_masses"

    @model_validator(mode="after")
    def _check_load(self) -> Self:
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
    def _check_drive(self) -> Self:
        masses = self.effects.hanging_masses
        if masses is None:
            if self.mechanism.inertia == 0.0 and self.drive.speed is None:
                raise inconsistent(
                    ("mechanism", "inertia"),
                    "0, and load is a force without inertia: nothing limits the acceleration; give"
                    " the inertia of the pulley, or [effects.hanging_masses]",
                )
            return self
        if self.drive.direction != "vertical":
            raise inconsistent(
                ("drive", "direction"),
                "masses hang on both sides of the pulley: with hanging_masses it is vertical",
            )
        self._check_masses()
        return self

    def _check_masses(self) -> None:
        """Raise an error of hanging masses that a drive pushes, or that have no unique motion."""
        n, force = self.lift_parameters, self.drive.force
        minimum = 0.0 if force is None else extremes(force, self.solver.duration)[0]
        if minimum < 0.0 and (self.effects.cord_friction is not None or n.m2 == 0.0):
            what, other = "the end of a cord without mass", "a counterweight"
            if self.effects.cord_friction is not None:
                what, other = "a cord that may slip", "leave cord_friction out"
            raise inconsistent(
                ("drive", "force"),
                f"it has a minimum of {minimum:.6g} N, and {what} cannot push: give a force that is"
                f" not negative, or {other}",
            )
        if self.drive.speed is not None:
            return
        journal = self.effects.shaft_friction
        r_k = journal.radius_over_speed.largest if journal else 0.0
        for name, mass in (("car", n.m1), ("counterweight", n.m2)):
            if mass > 0.0 and n.inertia + mass * n.r * (n.r - r_k) <= 0.0:
                raise inconsistent(
                    ("effects", "shaft_friction", "shaft_radius"),
                    f"the kinetic friction radius {r_k:.6g} m is so far above cord_radius ="
                    f" {n.r} m that the {name} of {mass:.6g} kg would turn the pulley backward by"
                    " accelerating it: the equations have no unique solution; give a thinner shaft",
                )
        if n.inertia == 0.0:
            self._check_massless_pulley(n, r_k)

    def _check_massless_pulley(self, n: LiftParameters, r_k: float) -> None:
        """Raise an error if a pulley without inertia may lose what hangs on it."""
        where, masses = ("mechanism", "inertia"), "0: the masses give the pulley its inertia, and"
        if self.effects.cord_friction is not None:
            raise inconsistent(
                where,
                f"{masses} a slipping cord gives none: give an inertia, or leave cord_friction out",
            )
        # The extremes of the drive, in both directions of friction, have to leave all ropes taut.
        cases = [
            (n.weight_2, u, arm) if n.by_torque else (n.weight_2 + u, 0.0, arm)
            for u in extremes(self.drive.given, self.solver.duration)
            for arm in (n.r + r_k, n.r - r_k)
        ]
        nets = [pull * (2.0 * n.r - arm) - n.weight_1 * arm + tau for pull, tau, arm in cases]
        # A damping torque stays below that at the start, or that of the largest uniform speed.
        start, worst = abs(self.mechanism.initial_angular_velocity), inf
        damped = max(n.damping * start, *map(abs, nets)) if n.damping else 0.0
        for (pull, _, arm), net in zip(cases, nets, strict=True):
            for torque in (net - damped, net + damped):
                rim = n.r * torque / (n.m1 * n.r * arm + n.m2 * n.r * (2.0 * n.r - arm))
                worst = min(worst, n.weight_1 + n.m1 * rim)
                if n.m2 > 0.0:
                    worst = min(worst, pull, pull - n.m2 * rim)
        if worst <= 0.0:
            raise inconsistent(
                where,
                f"{masses} a slack rope gives none; with this drive a tension may fall to"
                f" {worst:.6g} N: give an inertia, or a drive that keeps the ropes taut",
            )

    @property
    def lift_parameters(self) -> LiftParameters:
        """The numbers of a scenario with hanging masses."""
        geometry, effects = self.mechanism, self.effects
        masses, cord = effects.hanging_masses, effects.cord_friction
        damping = effects.viscous_damping
        assert masses is not None
        return LiftParameters(
            *(geometry.cord_radius, geometry.inertia),
            *(masses.car_side, masses.other_side, masses.g),
            damping.coefficient if damping else 0.0,
            *radii_of(effects.shaft_friction),
            limiting_ratio(cord.mu_s, cord.wrap_deg) if cord else inf,
            cord.ratio_over_speed.at_rest if cord else inf,
            self.drive.force is None,
        )

    def warnings(self) -> list[str]:
        """Return the warnings; also of a shaft as thick as the pulley and of a pushing cord."""
        journal, arm = self.effects.shaft_friction, self.mechanism.cord_radius
        warnings = super().warnings()
        if journal is not None and journal.shaft_radius >= arm:
            warnings.insert(
                0,
                f"effects.shaft_friction.shaft_radius = {journal.shaft_radius} m is not below"
                f" mechanism.cord_radius = {arm} m",
            )
        if self.drive.force is None:
            return warnings
        minimum, _ = extremes(self.drive.force, self.solver.duration)
        if minimum < 0.0:
            warnings.append(f"drive.force has a minimum of {minimum:.6g} N; a cord cannot push")
        return warnings
