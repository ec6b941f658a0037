"""The keys that are varied or fitted: several that have one value, and what the models say of them.

Several keys with commas between them, as `effects.shaft_friction.mu_s,effects.shaft_friction.mu_k`,
have one value.

Units of measured data: what a number in one unit is in that of a channel.
"""

from collections.abc import Mapping
from math import pi
from typing import Any, get_args

from frictionsim.errors import InputError
from frictionsim.scenario.model_fields import fields_along
from frictionsim.scenario.settings import Scenario

# The SI unit of each unit, and how many of it one is.
UNITS: dict[str, tuple[str, float]] = {
    "1": ("1", 1.0),
    "%": ("1", 0.01),
    "s": ("s", 1.0),
    "ms": ("s", 1e-3),
    "us": ("s", 1e-6),
    "min": ("s", 60.0),
    "h": ("s", 3600.0),
    "rad": ("rad", 1.0),
    "deg": ("rad", pi / 180.0),
    "rev": ("rad", 2.0 * pi),
    "rad/s": ("rad/s", 1.0),
    "deg/s": ("rad/s", pi / 180.0),
    "rev/s": ("rad/s", 2.0 * pi),
    "rpm": ("rad/s", pi / 30.0),
    "1/min": ("rad/s", pi / 30.0),
    "rad/s^2": ("rad/s^2", 1.0),
    "deg/s^2": ("rad/s^2", pi / 180.0),
    "m": ("m", 1.0),
    "mm": ("m", 1e-3),
    "cm": ("m", 1e-2),
    "um": ("m", 1e-6),
    "in": ("m", 0.0254),
    "m/s": ("m/s", 1.0),
    "mm/s": ("m/s", 1e-3),
    "km/h": ("m/s", 1.0 / 3.6),
    "N": ("N", 1.0),
    "mN": ("N", 1e-3),
    "kN": ("N", 1e3),
    "lbf": ("N", 4.4482216152605),
    "N m": ("N m", 1.0),
    "mN m": ("N m", 1e-3),
    "kN m": ("N m", 1e3),
    "gf cm": ("N m", 9.80665e-5),
    "lbf ft": ("N m", 1.3558179483314004),
    "J": ("J", 1.0),
    "mJ": ("J", 1e-3),
    "kJ": ("J", 1e3),
    "W": ("W", 1.0),
    "mW": ("W", 1e-3),
    "kW": ("W", 1e3),
}


def factor(unit: str, own: str) -> float:
    """Return how many of the unit `own` one `unit` is.

    Parameters
    ----------
    unit : str
        Of the data.
    own : str
        Of the channel or quantity.
    """
    if unit == own:
        return 1.0
    si, size = UNITS.get(own, (own, 1.0))
    fitting = [name for name, (of, _) in UNITS.items() if of == si]
    if unit not in fitting:
        known = f"one of {', '.join(fitting)}" if fitting else f"'{own}'"
        raise InputError(f"expected {known}, got '{unit}'")
    return UNITS[unit][1] / size


PURE_NUMBER = "1"


def names_in(key: str) -> list[str]:
    """Return the single keys of a text that has one, or several with commas between them."""
    return key.split(",")


def expanded(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return values by single key, for values of which some are of several keys."""
    return {name: value for key, value in values.items() for name in names_in(key)}


def description_of(model: type[Scenario], key: str) -> tuple[str, str]:
    """Return unit and description of a key; the unit is empty if it is no number with a unit.

    Parameters
    ----------
    model : type
        Of the kind of the scenario.
    key : str
        As of --set; of an entry of a list the unit is that of the list. Several keys have the unit
        that all of them have, if there is one, and the description of the first.
    """
    found = [_description_of_one(model, name) for name in names_in(key)]
    unit, words = found[0]
    return unit if all(other == unit for other, _ in found) else "", words


def _description_of_one(model: type[Scenario], key: str) -> tuple[str, str]:
    unit, words = "", ""
    for fields in fields_along(model, key):
        if not fields:
            break
        extra: Any = fields[0].json_schema_extra
        if isinstance(extra, dict) and "unit" in extra:
            unit, words = str(extra["unit"]), fields[0].description or key
        else:
            words = fields[0].description or words
            unit = PURE_NUMBER if _is_whole(fields[0].annotation) else unit
    return unit, words or key


def _is_whole(annotation: Any) -> bool:
    """Return whether a key holds a whole number."""
    return annotation is int or int in get_args(annotation)
