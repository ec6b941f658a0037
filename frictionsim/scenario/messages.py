"""Error messages for invalid scenarios: the key, the expected and the given value."""

from typing import Any, NamedTuple, get_args, get_origin

from pydantic import BaseModel

from frictionsim.errors import closest, unknown
from frictionsim.scenario.model_fields import key_names, keys_ending_in, models_in
from frictionsim.scenario.signal_tables import FORMS_BESIDE_NUMBER, SIGNAL_TAGS, SUM, PointsTable
from frictionsim.scenario.toml_data import KeyPath

MAX_VALUE_LENGTH = 40  # characters of an invalid value in a message


class _ErrorLocation(NamedTuple):
    """The location of an error.

    Attributes
    ----------
    path : tuple of str or int
        Keys as in the TOML file.
    table : type or None
        Model of the enclosing table.
    unit : str
        Unit of the value.
    items : str
        What a list holds there: numbers, names, tables or signals.
    is_list : bool
        Whether the key takes nothing but a list of them.
    arguments : list of str
        What the points of the enclosing signal may depend on.
    """

    path: KeyPath
    table: type[BaseModel] | None
    unit: str
    items: str
    is_list: bool
    arguments: list[str]


def error_messages(errors: list[Any], model: type[BaseModel]) -> list[tuple[KeyPath, str]]:
    """Return key and message for each error; a misspelt key is not missing as well.

    Nor is that on which points depend, such as `time`, where an unknown key stands for another.
    """
    errors, misspelt = list(errors), dict[Any, list[str]]()
    for error in [e for e in errors if e["type"] == "extra_forbidden"]:
        *table, key = error["loc"]
        missing = [e for e in errors if e["type"] == "missing" and [*e["loc"][:-1]] == table]
        arguments = _location(model, error["loc"]).arguments
        if near := closest(str(key), [str(e["loc"][-1]) for e in missing]):
            misspelt[error["loc"]] = [near]
            errors.remove(next(e for e in missing if e["loc"][-1] == near))
        elif len(arguments) > 1 and (left := [e for e in missing if e["loc"][-1] in arguments]):
            near = closest(str(key), arguments)
            misspelt[error["loc"]] = [near] if near else [*arguments, "value"]
            errors.remove(left[0])
    return [error_message(e, model, misspelt.get(e["loc"])) for e in errors]


def error_message(
    error: Any, model: type[BaseModel], misspelt: list[str] | None = None
) -> tuple[KeyPath, str]:
    """Return key and message for an error of pydantic, one of `ValidationError.errors()`.

    The path is that in the TOML file, without pydantic's names of union branches. A key that is
    not known may be a missing one that is misspelt, or one of several.
    """
    location = _location(model, error["loc"])
    kind, context = error["type"], error.get("ctx", {})
    if kind == "inconsistent":
        return (*location.path, *context["where"]), context["message"]
    if kind == "extra_forbidden":
        retired = getattr(location.table, "RETIRED", {}).get(location.path[-1])
        known = misspelt or key_names(location.table)
        *tables, name = map(str, location.path)
        inner = keys_ending_in(location.table, name)
        whole = " or ".join(f"'{'.'.join([*tables, key])}'" for key in inner)
        listed = f"did you mean {whole}?" if inner and not misspelt else ""
        return location.path, retired or unknown("key", name, known, listed)
    if kind in ("value_error", "assertion_error"):  # of a validator in another package
        return location.path, str(context["error"]) or "invalid"
    expected = _expected(kind, context, location)
    if kind == "float_type" and error["loc"][-1] in FORMS_BESIDE_NUMBER:
        expected = f"{expected}, or {FORMS_BESIDE_NUMBER[error['loc'][-1]]}"
    if kind == "missing":
        if location.is_list:
            expected = f"a list of {location.items} in brackets"
        elif isinstance(location.path[-1], int):
            expected = f"a number in {location.unit}" if location.unit else "a number"
        return location.path, f"missing; expected {expected}"
    return location.path, f"expected {expected}, got {toml_text(error['input'])}"


def toml_text(value: Any) -> str:
    """Return a value as TOML, shortened, for a message."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        return "a table" if value else "an empty table"
    if isinstance(value, str):
        text = f"'{value}'"
    elif isinstance(value, list | tuple):
        text = f"a list of {len(value)}"
    else:
        text = str(value)
    return text if len(text) <= MAX_VALUE_LENGTH else text[: MAX_VALUE_LENGTH - 3] + "..."


BOUNDS = {
    "greater_than": ("gt", "above"),
    "greater_than_equal": ("ge", "of at least"),
    "less_than": ("lt", "below"),
    "less_than_equal": ("le", "of at most"),
}


def _expected(kind: str, context: dict[str, Any], location: _ErrorLocation) -> str:
    unit = location.unit
    if kind in BOUNDS:
        bound, relation = BOUNDS[kind]
        return f"a number {relation} {context[bound]:g}{unit and ' ' + unit}"
    if kind in FORMS_BESIDE_NUMBER:
        return f"a number, {FORMS_BESIDE_NUMBER[kind]}"
    if kind == "literal_error":
        return str(context["expected"])
    return {
        "missing": f"a number in {unit}" if unit else "this key or table",
        "float_type": f"a number in {unit}" if unit else "a number",
        "finite_number": f"a finite number in {unit}" if unit else "a finite number",
        "int_type": "a whole number",
        "string_type": "text in quotes",
        "bool_type": "true or false",
        "column": "the name of a column in quotes, or its number from 1",
        "string_too_short": "text of at least one character",
        "string_pattern_mismatch": "letters, digits, '_' and '-' without spaces",
        "model_type": "a table",
        "model_attributes_type": "a table",
        "tuple_type": f"a list of {location.items} in brackets",
        "too_short": _at_least(context.get("min_length", 1), location.items),
        "too_long": f"at most {context.get('max_length')} {location.items}",
    }.get(kind, f"another value ({kind.replace('_', ' ')})")


def _at_least(count: int, items: str) -> str:
    return f"at least {count} {items}" if count > 1 else f"at least one {items.removesuffix('s')}"


def _location(model: type[BaseModel], loc: KeyPath) -> _ErrorLocation:
    """Resolve the location of an error through the models."""
    path: KeyPath = ()
    unit, items = "", "numbers"
    table: type[BaseModel] | None = None
    here: type[BaseModel] | None = model
    at_signal = at_name = is_list = False
    arguments: list[str] = []
    for part in loc:
        if at_signal and isinstance(part, str):  # the tag of the signal's form, which is no key
            here, at_signal = SIGNAL_TAGS.get(part), part == SUM
            continue
        path = (*path, part)
        if isinstance(part, int) or at_name:  # an index of a list, or a name chosen by the user
            at_name = is_list = False
            continue
        table, field = here, _field(here, part)
        if field is None:
            here, unit = None, ""
            continue
        extra = field.json_schema_extra
        unit = extra["unit"] if isinstance(extra, dict) else unit
        is_list = get_origin(field.annotation) is tuple
        models = list(models_in(field.annotation))
        items = "numbers" if not _has_text(field.annotation) else "names"
        at_signal = len(models) > 1
        points = [m for m in models if issubclass(m, PointsTable)]
        arguments = list(dict.fromkeys(m.ARGUMENT[0] for m in points))
        items = "signals" if at_signal else "tables" if models else items
        at_name = get_origin(field.annotation) is dict
        here = models[0] if models else None
    return _ErrorLocation(path, table, "" if unit == "1" else str(unit), items, is_list, arguments)


def _field(model: type[BaseModel] | None, key: Any) -> Any:
    if model is None:
        return None
    for name, field in model.model_fields.items():
        if key == (field.alias or name):
            return field
    return None


def _has_text(annotation: Any) -> bool:
    """Return whether an annotation is, or contains, str."""
    return annotation is str or any(map(_has_text, get_args(annotation)))
