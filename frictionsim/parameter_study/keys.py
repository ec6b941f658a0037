"""The keys that are varied or fitted: several that have one value, and what the models say of them.

Several keys with commas between them, as `effects.shaft_friction.mu_s,effects.shaft_friction.mu_k`,
have one value.
"""

from collections.abc import Mapping
from typing import Any, get_args

from frictionsim.scenario.model_fields import fields_along
from frictionsim.scenario.settings import Scenario

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
