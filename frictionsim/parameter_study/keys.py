"""What the models of a scenario say of a key that is varied."""

from typing import Any, get_args

from frictionsim.scenario.model_fields import fields_along
from frictionsim.scenario.settings import Scenario

PURE_NUMBER = "1"


def description_of(model: type[Scenario], key: str) -> tuple[str, str]:
    """Return unit and description of a key; the unit is empty if it is no number with a unit.

    Parameters
    ----------
    model : type
        Of the kind of the scenario.
    key : str
        As of --set; of an entry of a list the unit is that of the list.
    """
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
