"""The reference of scenarios, from the models that validate them."""

from collections.abc import Iterator, Mapping, Sequence
from inspect import cleandoc
from typing import Any, NamedTuple, Union, get_origin

from markdown import table
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from frictionsim.scenario.kinds import mechanism_module
from frictionsim.scenario.kinetic_friction import KineticCurve
from frictionsim.scenario.methods import methods_of
from frictionsim.scenario.model_fields import (
    FREE_NAME,
    holds,
    models_in,
    table_keys,
    types_and_choices,
    unit_of,
)
from frictionsim.scenario.schema import TRANSITION_SPEED, FrictionLaw
from frictionsim.scenario.settings import DEFAULT_SAMPLES, Output, Scenario
from frictionsim.scenario.signal_tables import CsvSpeedTable
from frictionsim.scenario.units import SIZES

BOUNDS = {"gt": "> ", "ge": "≥ ", "lt": "< ", "le": "≤ "}
# What there is to choose from has a page of its own.
METHODS = "[How to choose](../methods.md)."
CHOICES = {"backend": METHODS, "law": METHODS}
MEANINGS = {"kind": "Kind of mechanism."}
# What is taken where a key has no default of its own.
TAKEN: Mapping[tuple[type[BaseModel], str], str] = {
    (FrictionLaw, "transition_speed"): f"{TRANSITION_SPEED:g}",
    (Output, "interval"): f"duration/{DEFAULT_SAMPLES}",
}
# The forms of a signal whose keys have a table, on the page of scenarios.
SIGNALS = {"csv": CsvSpeedTable}
HEADING = ("key", "form", "unit", "default", "range", "meaning")


class Table(NamedTuple):
    """A table of a scenario."""

    header: str  # `[effects.gravity]`; empty for the keys above the first table
    model: type[BaseModel]
    optional: bool  # it may be left out
    description: str = ""  # of the field that holds it; empty where the model's docstring says it


class Key(NamedTuple):
    """A key of a table, as words."""

    name: str
    form: str
    unit: str
    default: str
    range: str
    meaning: str


def keys(kind: str) -> str:
    """Return a section for each table of a kind, with a row for each key."""
    parts = []
    scenario = model_of(kind)
    for listed in tables(scenario):
        rows = [tuple(key) for key in keys_of(listed.model, methods_of(scenario.PAIRS))]
        if not rows:
            continue
        parts += [f"## `{listed.header}`" if listed.header else "## Top level", _about(listed)]
        parts.append(table(HEADING, rows))
    return "\n\n".join(part for part in parts if part)


def signal(form: str) -> str:
    """Return a table with a row for each key of a form of signal, as `csv`."""
    rows = [tuple(key) for key in keys_of(SIGNALS[form])]
    used = [i for i in range(len(HEADING)) if any(row[i] for row in rows)]
    return table([HEADING[i] for i in used], [[row[i] for i in used] for row in rows])


def model_of(kind: str) -> type[Scenario]:
    """Return the model of the scenarios of a kind."""
    model: type[Scenario] = mechanism_module(kind).SCENARIO
    return model


def tables(
    model: type[BaseModel], path: str = "", optional: bool = False, description: str = ""
) -> Iterator[Table]:
    """Yield the tables of a scenario, those within others after them."""
    listed = path.startswith("[")
    yield Table(f"[{path}]" if path else "", model, optional, description)
    for key in table_keys(model):
        if key.table is None:
            continue
        inner = f"{path.strip('[]')}.{key.name}".strip(".")
        if key.has_names:
            inner = f"{inner}.{FREE_NAME}"
        elif key.is_list:
            inner = f"[{inner}]"
        left_out = optional or listed or not key.field.is_required()
        yield from tables(key.table, inner, left_out, key.field.description or "")


def keys_of(model: type[BaseModel], backends: Sequence[str] = ()) -> Iterator[Key]:
    """Yield the keys of a table that are no tables themselves.

    `backends` are the methods of the kind, from which its `backend` is chosen.
    """
    for name, field, inner in table_keys(model):
        if inner is not None:
            continue
        meaning = field.description or MEANINGS.get(name)
        yield Key(
            name=f"`{name}`",
            form=_choice(backends) if name == "backend" else _form(field.annotation),
            unit=unit_of(field),
            default=_taken(model, name) or _default(field),
            range=_range(field),
            meaning=" ".join(filter(None, (meaning, CHOICES.get(name)))),
        )


def _about(listed: Table) -> str:
    """Return the first paragraph of the model's docstring, without what names the table.

    The description of the field that holds it goes before.
    """
    docstring = listed.description or cleandoc(listed.model.__doc__ or "")
    text = docstring.split("\n\n")[0].replace("\n", " ")
    if not listed.header:
        text = ""
    elif text.startswith("`["):
        text = text.partition("`: ")[2]
    optional = "May be left out." if listed.optional else ""
    return " ".join(filter(None, (text[:1].upper() + text[1:], optional)))


def _form(annotation: Any) -> str:
    choices = [a for a in types_and_choices(annotation) if isinstance(a, str)]
    if choices:
        return _choice(choices)
    models = list(models_in(annotation))
    if models and issubclass(models[0], KineticCurve):
        return f"number or [curve](../scenarios.md#friction-over-speed): {_curves(models)}"
    if len(models) > 1:
        several = " or list of them" if holds(annotation, tuple) else ""
        return f"[signal](../scenarios.md#signals){several}"
    names = {float: "number", int: "whole number", str: "text", bool: "true or false"}
    types = [names[a] for a in types_and_choices(annotation) if a in names]
    word = " or ".join(types) if types == ["text", "whole number"] else ""
    word = word or (types[0] if types else "value")
    if not holds(annotation, tuple):
        return word
    if word == "text":
        return "list of texts"
    return f"list of {len(types)} numbers" if len(types) > 1 else "list of numbers"


def _curves(models: Sequence[type[BaseModel]]) -> str:
    """Return the keys of the forms of a curve over speed."""
    points, stribeck = models
    (inner,) = models_in(stribeck.model_fields["stribeck"].annotation)
    names = [", ".join(f"`{name}`" for name in model.model_fields) for model in (points, inner)]
    return f"{names[0]}; or `stribeck` with {names[1]}"


def _choice(names: Sequence[str]) -> str:
    return ", ".join(f'`"{name}"`' for name in names).replace("\t", "\\t")


def _taken(model: type[BaseModel], name: str) -> str:
    return next((t for (of, key), t in TAKEN.items() if key == name and issubclass(model, of)), "")


def _default(field: FieldInfo) -> str:
    if field.is_required():
        return "required"
    default = field.default
    if default is None or default == "":
        return "none"
    if isinstance(default, bool):
        return "true" if default else "false"
    if isinstance(default, str):
        return f'`"{default}"`'
    return f"{default:,}".replace(",", " ") if isinstance(default, int) else _number(default)


def _range(field: FieldInfo) -> str:
    if any(issubclass(model, KineticCurve) for model in models_in(field.annotation)):
        return "≥ 0"
    if get_origin(field.annotation) is Union or not field.metadata:
        return ""
    limits = ((s, getattr(bound, n, None)) for bound in field.metadata for n, s in BOUNDS.items())
    return ", ".join(f"{sign}{_number(limit)}" for sign, limit in limits if limit is not None)


def _number(value: float) -> str:
    """Return a number as it is written by hand: 1e-5, 0.001, 9.81."""
    digits, exponent, power = f"{value:g}".partition("e")
    return f"{digits}e{int(power)}" if exponent else digits


def units() -> str:
    """Return the known units of measured numbers, by what they are of."""
    rows = [(f"`{si}`", ", ".join(f"`{unit}`" for unit in sizes)) for si, sizes in SIZES.items()]
    return table(("converted to", "known units, also `Nm`, `N·m` and the like of a product"), rows)
