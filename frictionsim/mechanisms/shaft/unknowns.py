"""The keys of a scenario of kind `shaft` for which eq 24 can be solved."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, NamedTuple

from frictionsim.scenario.schema import inconsistent

if TYPE_CHECKING:
    from frictionsim.mechanisms.shaft.schema import ShaftScenario

UNKNOWN_KEY = ("statics", "unknown")
WEIGHT_KEYS = "mechanism.mass", "effects.eccentric_mass.mass", "effects.eccentric_mass.radius"


class Unknown(NamedTuple):
    """A key for which eq 24 is solved.

    Attributes
    ----------
    key : str
    label : str
        Its name in quantities.
    unit : str
    signed : bool
        Whether the key may be below zero.
    """

    key: str
    label: str
    unit: str
    signed: bool = True

    @property
    def table(self) -> str:
        """The table of the key, without its last part."""
        return self.key.rpartition(".")[0]

    @property
    def name(self) -> str:
        """The last part of the key."""
        return self.key.rpartition(".")[2]


def unknowns_of(scenario: "ShaftScenario") -> Iterator[Unknown]:
    """Yield the keys for which eq 24 of a scenario can be solved."""
    effects = scenario.effects
    for force in scenario.forces:
        yield Unknown(f"forces.{force.name}.size", force.name, "N")
        if force.cord_radius is not None:
            key = f"forces.{force.name}.cord_radius"
            yield Unknown(key, f"{force.name}_cord_radius", "m")
        elif any(force.point or ()):
            yield Unknown(f"forces.{force.name}.distance", f"{force.name}_distance", "m")
    for couple in scenario.couples:
        yield Unknown(f"couples.{couple.name}.size", couple.name, "N m")
    if effects.shaft_friction is not None:
        yield Unknown("effects.shaft_friction.mu_s", "mu_s", "1", signed=False)
        yield Unknown("effects.shaft_friction.shaft_radius", "shaft_radius", "m", signed=False)
    if effects.gravity is not None:
        yield Unknown("mechanism.mass", "mass", "kg", signed=False)
        if scenario.mechanism.mass > 0.0 or effects.eccentric_mass is not None:
            yield Unknown("effects.gravity.g", "g", "m/s^2", signed=False)
    if effects.gravity is not None and effects.eccentric_mass is not None:
        yield Unknown("effects.eccentric_mass.mass", "eccentric_mass", "kg", signed=False)
        yield Unknown("effects.eccentric_mass.radius", "eccentric_radius", "m", signed=False)
    if effects.torsion_spring is not None:
        table = "effects.torsion_spring"
        yield Unknown(f"{table}.stiffness", "stiffness", "N m/rad", signed=False)
        yield Unknown(f"{table}.free_angle_deg", "free_angle_deg", "deg")


def unknown_of(scenario: "ShaftScenario", key: str) -> Unknown:
    """Return the unknown of a key; raises an error if eq 24 cannot be solved for it."""
    known = {unknown.key: unknown for unknown in unknowns_of(scenario)}
    if key not in known:
        if key in WEIGHT_KEYS and scenario.effects.gravity is None:
            why = f"'{key}' does not enter eq 24: the scenario has no [effects.gravity]"
            raise inconsistent(UNKNOWN_KEY, why)
        why = f"eq 24 is not solved for '{key}'; known: {', '.join(known)}"
        raise inconsistent(UNKNOWN_KEY, why)
    return known[key]


def place_of(scenario: "ShaftScenario") -> tuple[float, float]:
    """Return time, s, and angle, deg, of the statics."""
    statics, start = scenario.statics, scenario.mechanism.initial_angle_deg
    if statics is None:
        return 0.0, start
    return statics.time, start if statics.angle_deg is None else statics.angle_deg
