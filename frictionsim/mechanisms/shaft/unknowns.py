"""The keys of a scenario of kind `shaft` for which eq 24 can be solved."""

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, NamedTuple

from pydantic import BaseModel

from frictionsim.errors import unknown as unknown_name
from frictionsim.scenario.schema import inconsistent

if TYPE_CHECKING:
    from frictionsim.mechanisms.shaft.schema import Force, ShaftScenario

UNKNOWN_KEY = ("statics", "unknown")
WEIGHT_KEYS = "mechanism.mass", "effects.eccentric_mass.mass", "effects.eccentric_mass.radius"
ANGLE_KEYS = "azimuth_deg", "initial_angle_deg", "angle_deg"


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
        raise inconsistent(UNKNOWN_KEY, _why_not(scenario, key, list(known)))
    return known[key]


def place_of(scenario: "ShaftScenario") -> tuple[float, float]:
    """Return time, s, and angle, deg, of the statics."""
    statics, start = scenario.statics, scenario.mechanism.initial_angle_deg
    if statics is None:
        return 0.0, start
    return statics.time, start if statics.angle_deg is None else statics.angle_deg


def _why_not(scenario: "ShaftScenario", key: str, known: list[str]) -> str:
    table, *rest = key.split(".")
    if table in ("forces", "couples") and rest:
        return _why_not_of_load(scenario, key, rest)
    effects = dict(scenario.effects)
    if rest and rest[-1] in ANGLE_KEYS:
        return f"eq 24 is not solved for '{key}', an angle; known: {', '.join(known)}"
    if key in WEIGHT_KEYS and effects["gravity"] is None and _exists(scenario, key.split(".")):
        return f"'{key}' does not enter eq 24: the scenario has no [effects.gravity]"
    if _exists(scenario, key.split(".")):
        return (
            f"'{key}' does not enter eq 24, the balance of the body at rest; known:"
            f" {', '.join(known)}"
        )
    if table == "effects" and len(rest) == 2 and effects.get(rest[0], scenario) is None:
        return f"'{key}' does not enter eq 24: the scenario has no [effects.{rest[0]}]"
    return unknown_name("key", key, known)


def _why_not_of_load(scenario: "ShaftScenario", key: str, rest: list[str]) -> str:
    table = key.partition(".")[0]
    loads: dict[str, Any] = {load.name: load for load in getattr(scenario, table)}
    what = table.removesuffix("s")
    if rest[0] not in loads:
        if not loads:
            return f"'{key}' does not exist: the scenario has no [[{table}]]"
        return unknown_name(what, rest[0], list(loads))
    name, of = rest[0], ".".join(rest[1:])
    if table == "couples":
        return f"eq 24 is solved for couples.{name}.size, not for '{key}'"
    force: Force = loads[name]
    if of == "cord_radius":
        return f"force '{name}' has a point and no cord_radius; use forces.{name}.distance"
    if of == "distance" and force.point is None:
        return f"force '{name}' is that of a cord and has no point; use forces.{name}.cord_radius"
    if of == "distance":
        return f"the point of force '{name}' is on the axis, so it has no direction from there"
    arm = "distance" if force.point is not None else "cord_radius"
    return f"eq 24 is solved for forces.{name}.size or forces.{name}.{arm}, not for '{key}'"


def _exists(table: Any, parts: list[str]) -> bool:
    """Return whether a table has a key."""
    if not parts:
        return not isinstance(table, BaseModel) and table is not None
    if not isinstance(table, BaseModel) or parts[0] not in type(table).model_fields:
        return False
    return _exists(getattr(table, parts[0]), parts[1:])
