"""Scenarios to start from, and the JSON schema of scenarios, both made from their models."""

import tomllib
from collections.abc import Iterator, Mapping
from textwrap import wrap
from typing import Any, NamedTuple

from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from frictionsim.errors import InputError
from frictionsim.scenario.kinds import mechanism_module, sound_kinds
from frictionsim.scenario.kinetic_friction import FORMS_OF_FRICTION, KineticCurve
from frictionsim.scenario.methods import LAWS, laws_of, methods_of
from frictionsim.scenario.model_fields import (
    FREE_NAME,
    LAST,
    TableKey,
    key_names,
    models_in,
    table_keys,
    table_model,
    types_and_choices,
    unit_of,
)
from frictionsim.scenario.origin import shipped_scenarios
from frictionsim.scenario.settings import Scenario
from frictionsim.scenario.signal_tables import AngleTable, SpeedTable, forms_of
from frictionsim.scenario.toml_data import toml_value

WIDTH = 100  # characters of a line, where words can be wrapped
MAX_COLUMN = 34  # of the comments beside keys
MIN_COMMENT = 40  # characters; a comment with less room goes below its key
DRAFT = "https://json-schema.org/draft/2020-12/schema"
DEFINITIONS = "#/$defs/{model}"


class _AsWritten(float):
    """A number that is written as it was read: 2.4e-4."""

    def __init__(self, text: str) -> None:
        self.text = text

    def __repr__(self) -> str:
        return self.text


def new_scenario(kind: str) -> str:
    """Return the text of a commented scenario of a kind, in TOML, which is valid as it is.

    Its values are those of the shipped scenario of that name, or of the text `EXAMPLE` in the
    module of the kind. Other keys and effects are comments, with their defaults.
    """
    module, shipped = mechanism_module(kind), shipped_scenarios()
    if (own := getattr(module, "EXAMPLE", None)) is not None:
        texts = [own]
    elif kind in shipped:
        texts = [path.read_text("utf-8") for path in (shipped[kind], *shipped.values())]
    else:
        raise InputError(
            f"there is no example of kind '{kind}' to start from: its module defines none as"
            " EXAMPLE"
        )
    examples = [tomllib.loads(text, parse_float=_AsWritten) for text in texts]
    examples = [example for example in examples if example["kind"] == kind]
    template = _Template(examples, _choices(module.SCENARIO))
    lines = [*_heading(kind, module.SCENARIO), *template.table((), module.SCENARIO, examples[0])]
    return "\n".join(lines).rstrip("\n") + "\n"


def schema_file(kind: str) -> str:
    """Return the name of the schema of a kind beside the scenarios of a user."""
    return f"{kind}.schema.json"


def _heading(kind: str, model: type[Scenario]) -> Iterator[str]:
    """Yield the lines above the first key: how to use this file, and the choices in it."""
    file, effects = schema_file(kind), table_model(model.model_fields["effects"].annotation)
    yield from _prose(
        f"The line `#:schema ./{file}` at the top of a file has editors complete and check it;"
        f" `frictionsim schema {kind} > {file}` writes that schema."
    )
    yield "#"
    yield from _prose(
        "All values are in SI units, or in the unit that a key ends with. Keys that are commented"
        " out may be left out; a value there is the default, one without a value has none. A table"
        " [effects.NAME] that is left out is an effect that is not simulated; one that is commented"
        " out is an example."
    )
    yield from _prose(f"A signal is a number, or {forms_of([*_models_below(model)])}.")
    if any(issubclass(each, KineticCurve) for each in _models_below(model)):
        yield from _prose(f"A curve is kinetic friction over the speed, {FORMS_OF_FRICTION}.")
    yield "#"
    yield from _prose(f"Effects: {', '.join(key_names(effects))}.")
    yield "#"
    yield "# Friction laws (effects.NAME.law), and the backends for each (solver.backend):"
    for law in laws_of(model.PAIRS):
        yield f"#   {law}: {LAWS.get(law, '')}".rstrip(": ")
        yield f"#     {', '.join(methods_of(model.PAIRS, law))}"
    yield ""


def _models_below(model: type[BaseModel]) -> Iterator[type[BaseModel]]:
    for field in model.model_fields.values():
        for inner in models_in(field.annotation):
            yield inner
            yield from _models_below(inner)


def _choices(model: type[Scenario]) -> dict[str, list[str]]:
    """Return the allowed values of keys whose models do not have them, by key."""
    return {"backend": list(methods_of(model.PAIRS)), "channels": list(model.CHANNELS)}


def _prose(text: str) -> list[str]:
    return [f"# {line}" for line in wrap(text, WIDTH - 2, break_on_hyphens=False)]


class _Template(NamedTuple):
    """Writes tables with the values of examples: of the first, and what it lacks of the others."""

    examples: list[dict[str, Any]]
    choices: dict[str, list[str]]

    def table(
        self,
        path: tuple[str, ...],
        model: type[BaseModel],
        values: Mapping[str, Any],
        header: str = "",
        about: str = "",
    ) -> Iterator[str]:
        """Yield the lines of a table, and of the tables in it, with an empty line after each."""
        keys = list(table_keys(model))
        rows = [self._row(key, values) for key in keys if key.table is None]
        if header and (rows or not keys):
            if about and len(header) + len(about) + 6 <= WIDTH:  # two more where commented out
                header, about = f"{header}  # {about}", ""
            yield from (header, *_prose(about))
        yield from _commented(sorted(rows, key=lambda row: row[0].startswith("# ")))
        if rows or not keys:
            yield ""
        for key in keys:
            if key.table is None:
                continue
            lines = self._tables((*path, key.name), key, key.table, values.get(key.name))
            left_out = key.name not in values and key.name not in LAST
            yield from ((f"# {line}" if line and left_out else line).rstrip() for line in lines)

    def _tables(
        self, path: tuple[str, ...], key: TableKey, model: type[BaseModel], value: Any
    ) -> Iterator[str]:
        """Yield the lines of the tables that a key holds: one, one for each name, or a list."""
        about, dotted = _about(key, model), ".".join(path)
        if key.has_names:
            for name, table in (value or {FREE_NAME: {}}).items():
                yield from self.table((*path, name), model, table, f"[{dotted}.{name}]", about)
        elif key.is_list:
            for table in value or [{}]:
                yield from self.table(path, model, table, f"[[{dotted}]]", about)
        else:
            value = self._example(path) if value is None else value
            yield from self.table(path, model, value, f"[{dotted}]", about)

    def _example(self, path: tuple[str, ...]) -> dict[str, Any]:
        """Return a table of the first example that has it; empty if none has."""
        for table in self.examples:
            for key in path:
                table = table.get(key, {}) if isinstance(table, dict) else {}
            if table and isinstance(table, dict):
                return table
        return {}

    def _row(self, key: TableKey, values: Mapping[str, Any]) -> tuple[str, str]:
        """Return a key with its value, commented out if it may be left out, and its meaning."""
        name, field = key.name, key.field
        value = values.get(name, None if field.is_required() else field.default)
        text = f"{name} = {'' if value is None else toml_value(value)}".rstrip()
        optional = name not in values and not field.is_required()
        return f"# {text}" if optional else text, self._meaning(key)

    def _meaning(self, key: TableKey) -> str:
        """Return unit, meaning and choices of a key."""
        if key.name == "kind":
            return "Kind of mechanism."
        unit, models = unit_of(key.field), list(models_in(key.field.annotation))
        signal = "signal" if len(models) > 1 else ""
        if models and issubclass(models[0], KineticCurve):
            signal = "number or curve"
        if SpeedTable in models and AngleTable not in models:  # the heading has all forms of both
            signal += " or {speed = [...], value = [...]}"
        if signal and key.is_list:
            signal += ", or a list of them, which add"
        values = types_and_choices(key.field.annotation)
        choices = self.choices.get(key.name) or [v for v in values if isinstance(v, str)]
        before = ", ".join(part for part in ("" if unit == "1" else unit, signal) if part)
        after = f"{'Any' if key.is_list else 'One'} of {', '.join(map(toml_value, choices))}."
        parts = (before and f"{before}:", key.field.description or "", after if choices else "")
        return " ".join(part for part in parts if part)


def _commented(rows: list[tuple[str, str]]) -> Iterator[str]:
    """Yield the lines of keys with their meanings beside them, or below long ones."""
    column = min(max((len(key) for key, _ in rows), default=0) + 2, MAX_COLUMN)
    for key, meaning in rows:
        mark = "# " if key.startswith("# ") else ""
        indent, start = mark.ljust(column), f"{key}  ".ljust(column)
        if WIDTH - len(start) < MIN_COMMENT:
            yield key
            start = indent
        first, *rest = wrap(meaning, WIDTH - len(start) - 2, break_on_hyphens=False) or [""]
        yield f"{start}# {first}".rstrip("# ")
        for line in wrap(" ".join(rest), WIDTH - column - 2):
            yield f"{indent}# {line}"


def _about(key: TableKey, model: type[BaseModel]) -> str:
    """Return the description of a table: that of its key, or the docstring of its model."""
    text = " ".join((key.field.description or model.__doc__ or "").split("\n\n")[0].split())
    text = text.partition("`: ")[2] if text.startswith("`[") else text
    return text[:1].upper() + text[1:]


def schema(kind: str | None = None) -> dict[str, Any]:
    """Return the JSON schema of the scenarios of a kind of mechanism.

    It has description, unit and default of each key, and refuses unknown keys. What must go
    together, such as law and method, or mu_k and mu_s, is checked when a scenario is loaded.

    Parameters
    ----------
    kind : str, optional
        Without it, the schema is that of all kinds, and the key `kind` decides.

    Returns
    -------
    dict
        A schema of draft 2020-12.

    Raises
    ------
    InputError
        If there is no such kind.
    """
    if kind is not None:
        return {"$schema": DRAFT, **_kind_schema(kind, DEFINITIONS)}
    kinds = list(sound_kinds())
    choices: dict[str, Any] = {"enum": kinds, "description": "Kind of mechanism."}
    return {
        "$schema": DRAFT,
        "title": "Scenario of frictionsim",
        "type": "object",
        "required": ["kind"],
        "properties": {"kind": choices},
        "allOf": [
            {
                "if": {"required": ["kind"], "properties": {"kind": {"const": of}}},
                "then": {"$ref": f"#/$defs/{of}"},
            }
            for of in kinds
        ],
        # Kinds may have models of one name, so that each keeps its own definitions.
        "$defs": {of: _kind_schema(of, f"#/$defs/{of}/$defs/{{model}}") for of in kinds},
    }


class _TomlSchema(GenerateJsonSchema):
    """Schemas of tables in TOML, which has no null: an optional key is left out."""

    def nullable_schema(self, schema: core_schema.NullableSchema) -> JsonSchemaValue:
        return self.generate_inner(schema["schema"])

    def default_schema(self, schema: core_schema.WithDefaultSchema) -> JsonSchemaValue:
        default = schema.get("default")
        if default is None or isinstance(default, BaseModel):
            return self.generate_inner(schema["schema"])
        return super().default_schema(schema)

    def tuple_schema(self, schema: core_schema.TupleSchema) -> JsonSchemaValue:
        made = super().tuple_schema(schema)
        items = made.get("prefixItems", [])
        if items and all(item == items[0] for item in items):
            # Programs that know an older draft read `items` only.
            made["items"] = made.pop("prefixItems")[0]
        return made

    def field_title_should_be_set(self, schema: Any) -> bool:
        return False


def _kind_schema(kind: str, ref_template: str) -> dict[str, Any]:
    model: type[Scenario] = mechanism_module(kind).SCENARIO
    made = model.model_json_schema(
        by_alias=True, mode="validation", ref_template=ref_template, schema_generator=_TomlSchema
    )
    definitions = made.pop("$defs")
    for table in (made, *definitions.values()):
        _describe(table, _choices(model))
    made["title"] = f"Scenario of a {kind.replace('_', ' ')}"
    made["properties"]["kind"]["description"] = "Kind of mechanism."
    return {**made, "$defs": definitions}


def _describe(table: dict[str, Any], choices: Mapping[str, list[str]]) -> None:
    """Shorten the description of a table, and complete those of its keys with unit and choices.

    Keys that take nothing are left out: they are there for an error that says why.
    """
    table.pop("title", None)  # the name of a class
    if "description" in table:
        table["description"] = table["description"].split("\n\n")[0].replace("\n", " ")
    if "properties" not in table:
        return
    properties = table["properties"]
    table["properties"] = {n: key for n, key in properties.items() if key.get("type") != "null"}
    for name, key in table["properties"].items():
        unit = key.get("unit", "1")
        if unit != "1":
            key["description"] = f"{key.get('description', '')} Unit: {unit}.".strip()
        if name in choices:
            key.get("items", key)["enum"] = choices[name]
