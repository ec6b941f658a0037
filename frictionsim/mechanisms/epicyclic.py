"""An epicyclic gear: a crank carries a planet that rolls on a fixed sun.

phi is the angle of the crank from the horizontal, L = r1 + r2 its length, lambda = L/r2 the
rotations of the planet per turn of the crank, G the weights. Formulation `consistent` (derived by
both Lagrange and Newton-Euler):

    J phi'' = M_O - K cos phi + T,   J = (2 m_OA + 9 m_2) L^2/6,   K = (G_OA/2 + G_2) L
    sliding    T = -s (M_A r1/r2 + f N lambda)
    sticking   T holds while |T| <= M_As r1/r2 + f |G_2 sin phi| lambda
    N = |G_2 sin phi| (`weight`) or |G_2 sin phi - m_2 L phi'^2| (`radial`)

M_A is the friction couple of the hinge between planet and crank; its power is that of their
relative rotation phi' r1/r2. f is the arm of rolling friction at the mesh. The distribution of the
planet's radial load between crank and mesh is indeterminate; `normal_load` states an assumption.

Formulation `published` is eq 26 of [1]_ as published, for all directions of motion:

    J phi'' = M_O - (G_OA/2 + 2 G_2) L cos phi - M_A lambda - f G_2 sin phi lambda

It counts the weight of the planet twice, applies the couple of the hinge against the ground, and
its friction has positive power where phi' < 0 or sin phi < 0; it cannot stick.

References
----------
.. [1] Z. Mchedlishvili, Z. Tsitskishvili, doi 10.36073/1512-0996-2026-1-143-147.
"""

from collections.abc import Mapping
from sys import float_info
from typing import Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from frictionsim.mechanisms.effects import Gravity
from frictionsim.mechanisms.epicyclic_equation import (
    Terms,
    contact_of,
    equation,
    published_equation,
    published_resistance,
    switching_surfaces,
    uniform_torque_mean,
)
from frictionsim.mechanisms.scalar_math import sin
from frictionsim.mechanisms.single_dof import METRICS as METRICS
from frictionsim.mechanisms.single_dof import (
    SingleDofScenario,
    base_channels,
    kinetic_energy,
    set_up,
    simulation_of,
)
from frictionsim.mechanisms.tracer_point import (
    TracerPoint,
    count_cusps,
    longest_dwell,
    pace,
    tracer_position,
)
from frictionsim.results import Channel, Quantities, Quantity
from frictionsim.scenario.friction_law import FrictionLaw, check_kinetic
from frictionsim.scenario.methods import REGULARISED, SET_VALUED
from frictionsim.scenario.schema import Params, inconsistent, unit_field
from frictionsim.scenario.signal_tables import TimeSignal, signal_from
from frictionsim.solvers.mechanism import (
    Mechanism,
    Trajectory,
    Value,
)

# The applied torque is a sum of torques: a few roundings of each.
ROUNDING = 16 * float_info.epsilon

CHANNELS = base_channels("crank") | {
    "angle": Channel("rad", "angle of the crank from the horizontal"),
    "drive_torque": Channel("N m", "torque on the crank"),
    "uniform_torque": Channel("N m", "torque that would turn the crank uniformly forward here"),
    "normal_load": Channel("N", "load of the rolling friction at the mesh"),
    "friction_torque": Channel("N m", "friction of hinge and mesh, on the crank"),
    "tracer_x": Channel("m", "horizontal place of the tracer point"),
    "tracer_y": Channel("m", "vertical place of the tracer point"),
    "energy_input": Channel("J", "work of the torque on the crank"),
    "energy_kinetic": Channel("J", "kinetic energy of crank and planet"),
    "energy_potential": Channel("J", "potential energy of the weights in the equation"),
    "energy_friction": Channel("J", "heat of hinge and mesh"),
}
PANELS = ("drive_torque", "uniform_torque", "friction_torque", "angular_velocity", "angle")


class EpicyclicParameters(Params):
    """`[mechanism]`."""

    sun_radius: float = unit_field("m", "Pitch radius of the fixed sun.", gt=0)
    planet_radius: float = unit_field("m", "Pitch radius of the planet.", gt=0)
    crank_mass: float = unit_field("kg", "Mass of the crank, a slender rod.", ge=0)
    planet_mass: float = unit_field("kg", "Mass of the planet, a disc.", ge=0)
    initial_angle_deg: float = unit_field("deg", "Angle at the start.", 0.0)
    initial_angular_velocity: float = unit_field("rad/s", "Angular velocity at the start.", 0.0)
    formulation: Literal["consistent", "published"] = Field(
        "consistent",
        description="Equation of motion: the consistent one, or eq 26 as it is printed.",
    )

    @model_validator(mode="after")
    def _something_is_heavy(self) -> Self:
        if self.crank_mass + self.planet_mass <= 0.0:
            raise inconsistent(
                ("crank_mass",), "crank and planet have no mass; give at least one of them a mass"
            )
        return self

    @property
    def length(self) -> float:
        """L, m."""
        return self.sun_radius + self.planet_radius

    @property
    def planet_speed_ratio(self) -> float:
        """lambda: rotations of the planet per turn of the crank."""
        return self.length / self.planet_radius

    @property
    def inertia(self) -> float:
        """J, kg m^2."""
        return (2.0 * self.crank_mass + 9.0 * self.planet_mass) * self.length**2 / 6.0


class EpicyclicDrive(Params):
    """`[drive]`: a torque on the crank, or its prescribed speed."""

    torque: TimeSignal | None = unit_field("N m", "Torque on the crank; give this or speed.", None)
    speed: TimeSignal | None = unit_field(
        "rad/s",
        "Given angular velocity of the crank, whose torque is computed; or give torque.",
        None,
    )

    @model_validator(mode="after")
    def _one_of_them(self) -> Self:
        if (self.torque is None) == (self.speed is None):
            raise inconsistent((), "give one of torque and speed")
        return self


class SharedFrictionLaw(FrictionLaw):
    """The friction law of the contact that hinge and rolling friction share."""

    law: Literal["set-valued", "regularised", "published"] | None = Field(  # type: ignore[assignment]
        None, description="Friction law of the contact; set-valued if neither effect names one."
    )

    @model_validator(mode="after")
    def _law_has_its_parameters(self) -> Self:
        return self  # checked with the other effect, which may name the law


class HingeFriction(SharedFrictionLaw):
    """Dry couple between planet and crank."""

    torque_static: float = unit_field(
        "N m", "Couple that the hinge can hold, not below torque_kinetic.", ge=0
    )
    torque_kinetic: float = unit_field("N m", "Couple of the sliding hinge.", ge=0)

    @model_validator(mode="after")
    def _kinetic_not_above_static(self) -> Self:
        check_kinetic("torque_kinetic", self.torque_kinetic, "torque_static", self.torque_static)
        return self


class RollingFriction(SharedFrictionLaw):
    """Rolling friction of the planet on the sun."""

    arm: float = unit_field(
        "m", "Distance by which the normal force runs ahead of the contact.", ge=0
    )
    normal_load: Literal["weight", "radial"] = Field(
        "weight",
        description="Load of the mesh: the planet's weight, or with its centripetal force.",
    )


class EpicyclicEffects(Params):
    """`[effects]`: one table for each effect that is simulated."""

    gravity: Gravity | None = None
    hinge_friction: HingeFriction | None = None
    rolling_friction: RollingFriction | None = None
    tracer_point: TracerPoint | None = None


class EpicyclicScenario(SingleDofScenario):
    """A scenario of kind `epicyclic`."""

    CHANNELS: ClassVar[Mapping[str, Channel]] = CHANNELS

    kind: Literal["epicyclic"]
    mechanism: EpicyclicParameters
    drive: EpicyclicDrive
    effects: EpicyclicEffects = EpicyclicEffects()

    @property
    def law_of_contact(self) -> FrictionLaw:
        """The common law of hinge and rolling friction, with its transition speed."""
        named: dict[str, Any] = {}
        for effect in self.friction_effects.values():
            named |= effect.model_dump(include=set(FrictionLaw.LAW_KEYS), exclude_none=True)
        return FrictionLaw(**named)

    @property
    def law(self) -> str:
        """The friction law; empty for the published equation, a prescribed speed, no friction."""
        without = self.mechanism.formulation == "published" or self.drive.speed is not None
        return "" if without or not self.friction_effects else self.law_of_contact.law

    @model_validator(mode="after")
    def _effects_share_a_law(self) -> Self:
        for key in ("law", "transition_speed"):
            named = {
                name: getattr(effect, key)
                for name, effect in self.friction_effects.items()
                if getattr(effect, key) is not None
            }
            if len(set(named.values())) > 1:
                values = " and ".join(f"{name} {value!r}" for name, value in named.items())
                raise inconsistent(
                    ("effects", "rolling_friction", key),
                    f"hinge and rolling friction share one contact and its law, got {values}; give"
                    " it in one of them, or the same in both",
                )
        for name, effect in self.friction_effects.items():
            if effect.law and self.mechanism.formulation == "published":
                raise inconsistent(
                    ("effects", name, "law"),
                    "formulation 'published' has its friction in the equation; remove law",
                )
            laws = [e.law for e in self.friction_effects.values() if e.law]
            if effect.transition_speed is not None and REGULARISED not in laws:
                raise inconsistent(
                    ("effects", name, "transition_speed"),
                    f"law = '{(laws or [SET_VALUED])[0]}' has no transition speed; remove"
                    f" transition_speed, or use law = '{REGULARISED}'",
                )
        return self

    @model_validator(mode="after")
    def _choices_go_together(self) -> Self:
        rolling = self.effects.rolling_friction
        published = self.mechanism.formulation == "published"
        if published and rolling is not None and rolling.normal_load == "radial":
            raise inconsistent(
                ("effects", "rolling_friction", "normal_load"),
                "eq 26 as published has no radial load; use 'weight', or formulation 'consistent'",
            )
        if self.drive.speed is not None and self.mechanism.initial_angular_velocity != 0.0:
            raise inconsistent(
                ("mechanism", "initial_angular_velocity"),
                "the drive prescribes the speed; remove this key",
            )
        return self


SCENARIO = EpicyclicScenario


def build(scenario: EpicyclicScenario) -> Mechanism:
    """Return the mechanism, composed of the effects in the scenario."""
    terms, geometry = Terms(scenario), scenario.mechanism
    published = geometry.formulation == "published"
    applied_torque, stored = (
        published_equation(terms, scenario) if published else equation(terms, scenario)
    )
    contact = None if published else contact_of(terms, scenario.law_of_contact.law_of_contact())
    power_flows: dict[str, Any] = {
        "energy_input": lambda torque, angle, velocity: torque * velocity
    }
    has_friction = terms.hinge is not None or terms.rolls
    if published and has_friction:
        resistance = published_resistance(terms)
        power_flows["energy_friction"] = lambda torque, angle, velocity: (
            resistance(angle) * velocity
        )
    stored_energies = {"energy_kinetic": kinetic_energy(geometry.inertia)}
    if scenario.effects.gravity is not None:
        stored_energies["energy_potential"] = lambda angle, velocity: stored * sin(angle)
    prescribed = scenario.drive.speed is not None
    drive = signal_from(scenario.drive.speed if prescribed else scenario.drive.torque)  # type: ignore[arg-type]

    def uniform_torque(angle: Value, velocity: Value) -> Value:
        opposed = contact.kinetic_limit(0.0, angle, velocity, 1) if contact else 0.0
        return opposed - applied_torque(0.0, angle, velocity)

    def channels(trajectory: Trajectory) -> dict[str, Value]:
        angle, velocity = trajectory.position, trajectory.velocity
        found = {
            "drive_torque": trajectory.drive,
            "uniform_torque": uniform_torque(angle, velocity),
        }
        if terms.rolling is not None:
            found["normal_load"] = terms.mesh_load(angle, velocity)
        if published and has_friction:
            found["friction_torque"] = -resistance(angle)
        if scenario.effects.tracer_point is not None:
            found["tracer_x"], found["tracer_y"] = tracer_position(
                terms.length, terms.planet_speed_ratio, scenario.effects.tracer_point, angle
            )
        return found

    def quantities(trajectory: Trajectory) -> Quantities:
        found = {"uniform_torque_mean": Quantity(uniform_torque_mean(scenario, 0.0), "N m")}
        if terms.radial and trajectory.velocity.size:
            torque = uniform_torque_mean(scenario, float(trajectory.velocity[-1]))
            found["uniform_torque_mean_at_final_speed"] = Quantity(torque, "N m")
        if scenario.effects.tracer_point is not None:
            point = scenario.effects.tracer_point
            x, y = tracer_position(
                terms.length, terms.planet_speed_ratio, point, trajectory.position
            )
            paces = pace(
                terms.length,
                terms.planet_speed_ratio,
                point,
                trajectory.position,
                trajectory.velocity,
            )
            found["tracer_cusps"] = Quantity(
                count_cusps(
                    geometry.sun_radius, geometry.planet_radius, point, trajectory.position
                ),
                "1",
            )
            found["tracer_dwell_time"] = Quantity(
                longest_dwell(trajectory.time, paces, x, y, point.dwell_distance), "s"
            )
        return found

    def run_warnings(trajectory: Trajectory) -> list[str]:
        from frictionsim.simulation.run_warnings import (
            against_drive,  # imports numpy, not needed by `check`
        )

        back = (
            ""
            if prescribed
            else against_drive(trajectory.time, trajectory.drive, trajectory.position)
        )
        return [f"the crank {back}: weight or initial velocity prevailed"] if back else []

    return Mechanism(
        drive=drive,
        inertia=geometry.inertia,
        applied_torque=applied_torque,
        contact=contact,
        power_flows=power_flows,
        stored_energies=stored_energies,
        channels=channels,
        quantities=quantities,
        run_warnings=run_warnings,
        switching_surfaces=() if published else switching_surfaces(terms),
        prescribed=prescribed,
        **set_up(scenario) | ({"velocity": drive(0.0)} if prescribed else {}),
    )


simulation = simulation_of(build)


def statics(scenario: EpicyclicScenario) -> Quantities:
    """Return the torques of impending motion at the initial angle, and of uniform rotation."""
    terms, mechanism = Terms(scenario), build(scenario)
    angle = mechanism.position
    balance = -mechanism.applied_torque(0.0, angle, 0.0)
    limit = mechanism.contact.static_limit(0.0, angle) if mechanism.contact else 0.0
    other = "published" if scenario.mechanism.formulation == "consistent" else "consistent"
    changed = scenario.model_copy(
        update={"mechanism": scenario.mechanism.model_copy(update={"formulation": other})}
    )
    return {
        "torque_to_start_forward": Quantity(balance + limit, "N m"),
        "torque_to_start_backward": Quantity(balance - limit, "N m"),
        "uniform_torque_mean": Quantity(uniform_torque_mean(scenario, 0.0), "N m"),
        f"uniform_torque_mean_{other}": Quantity(uniform_torque_mean(changed, 0.0), "N m"),
        "gravity_moment": Quantity(terms.gravity_moment, "N m"),
        "inertia": Quantity(scenario.mechanism.inertia, "kg m^2"),
    }
