"""The scenario of kind `epicyclic`: its tables and channels."""

from collections.abc import Mapping
from typing import Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from frictionsim.mechanisms.effects import Gravity
from frictionsim.mechanisms.single_dof import SingleDofScenario, base_channels
from frictionsim.results import Channel
from frictionsim.scenario.kinetic_friction import (
    KineticArm,
    KineticCouple,
    KineticCurve,
    check_kinetic_friction,
)
from frictionsim.scenario.methods import REGULARISED, SET_VALUED
from frictionsim.scenario.schema import FrictionLaw, Params, inconsistent, unit_field
from frictionsim.scenario.signal_tables import TimeSignal

CHANNELS = base_channels("crank") | {
    "angle": Channel("rad", "angle of the crank from the horizontal"),
    "planet_velocity": Channel("rad/s", "angular velocity of the planet"),
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

    sun_radius: float = unit_field("m", "Pitch radius of the fixed sun or ring.", gt=0)
    planet_radius: float = unit_field("m", "Pitch radius of the planet.", gt=0)
    mesh: Literal["external", "internal"] = Field(
        "external",
        description="The planet rolls on the outside of a sun, or inside a ring of sun_radius.",
    )
    crank_mass: float = unit_field("kg", "Mass of the crank, a slender rod.", ge=0)
    planet_mass: float = unit_field("kg", "Mass of the planet, a disc.", ge=0)
    initial_angle_deg: float = unit_field("deg", "Angle at the start.", 0.0)
    initial_angular_velocity: float = unit_field("rad/s", "Angular velocity at the start.", 0.0)
    formulation: Literal["consistent", "published"] = Field(
        "consistent",
        description="Equation of motion: the consistent one, or eq 26 as it is printed.",
    )

    @model_validator(mode="after")
    def _check_ring(self) -> Self:
        if self.mesh == "internal" and self.planet_radius >= self.sun_radius:
            raise inconsistent(
                ("planet_radius",),
                "a planet inside a ring is smaller than it: expected less than sun_radius ="
                f" {self.sun_radius:g} m, got {self.planet_radius:g}; or use mesh = 'external'",
            )
        return self

    @model_validator(mode="after")
    def _check_masses(self) -> Self:
        if self.crank_mass + self.planet_mass <= 0.0:
            raise inconsistent(
                ("crank_mass",), "crank and planet have no mass; give at least one of them a mass"
            )
        return self

    @property
    def length(self) -> float:
        """L, m."""
        own = self.planet_radius
        return self.sun_radius + (own if self.mesh == "external" else -own)

    @property
    def planet_speed_ratio(self) -> float:
        """Rotations of the planet per turn of the crank: lambda, inside a ring -lambda."""
        turns = self.length / self.planet_radius
        return turns if self.mesh == "external" else -turns

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
    def _check_inputs(self) -> Self:
        if (self.torque is None) == (self.speed is None):
            raise inconsistent((), "give one of torque and speed")
        return self


class SharedFrictionLaw(FrictionLaw):
    """The friction law of the contact that hinge and rolling friction share."""

    law: Literal["set-valued", "regularised", "published"] | None = Field(  # type: ignore[assignment]
        None,
        description="Friction law of the contact; set-valued if neither effect names one."
        " published: eq 30 of the paper on shafts, not the gear's own (formulation).",
    )

    @model_validator(mode="after")
    def _law_has_its_parameters(self) -> Self:
        return self  # checked with the other effect, which may name the law


class HingeFriction(SharedFrictionLaw):
    """Dry couple between planet and crank; a speed is that of the planet relative to the crank."""

    torque_static: float = unit_field(
        "N m", "Couple that the hinge can hold, not below torque_kinetic.", ge=0
    )
    torque_kinetic: KineticCouple = unit_field("N m", "Couple of the sliding hinge.")

    @model_validator(mode="after")
    def _kinetic_not_above_static(self) -> Self:
        kinetic = "torque_kinetic", self.torque_kinetic
        check_kinetic_friction(*kinetic, "torque_static", self.torque_static)
        return self


class RollingFriction(SharedFrictionLaw):
    """Rolling friction of the planet on the sun; a speed is that of the planet's rotation."""

    arm: float = unit_field(
        "m", "Distance by which the normal force runs ahead of the contact.", ge=0
    )
    arm_kinetic: KineticArm | None = unit_field(
        "m", "That distance while the planet rolls; arm if left out.", None
    )
    normal_load: Literal["weight", "radial"] = Field(
        "weight",
        description="Load of the mesh: the planet's weight, or with its centripetal force.",
    )

    @property
    def rolling_arm(self) -> float | KineticCurve:
        """The arm while it rolls, m."""
        return self.arm if self.arm_kinetic is None else self.arm_kinetic

    @model_validator(mode="after")
    def _kinetic_not_above_static(self) -> Self:
        check_kinetic_friction("arm_kinetic", self.rolling_arm, "arm", self.arm)
        return self


class TracerPoint(Params):
    """A point of the planet whose path is recorded.

    The point dwells while it passes a place nearest to the sun or ring within `dwell_distance`.
    """

    radius: float = unit_field("m", "Distance of the point from the planet's centre.", ge=0)
    angle_deg: float = unit_field(
        "deg",
        "Angle of the point where the crank is at 0; 180 is on the sun, 0 on a ring.",
        180.0,
    )
    dwell_distance: float = unit_field(
        "m", "Distance from a place within which the point dwells there.", 1e-3, gt=0
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
    PRESCRIBES: ClassVar[bool] = True

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
    def _check_laws(self) -> Self:
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
    def _check_choices(self) -> Self:
        rolling = self.effects.rolling_friction
        published = self.mechanism.formulation == "published"
        if published and rolling is not None and rolling.normal_load == "radial":
            raise inconsistent(
                ("effects", "rolling_friction", "normal_load"),
                "eq 26 as published has no radial load; use 'weight', or formulation 'consistent'",
            )
        for name, effect in self.friction_effects.items():
            for key, value in effect:
                if published and isinstance(value, KineticCurve):
                    raise inconsistent(
                        ("effects", name, key),
                        "the friction of eq 26 as published does not depend on the speed; give a"
                        " number, or use formulation 'consistent'",
                    )
        return self
