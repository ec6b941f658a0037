"""The JSON schema of scenarios, for editors and other programs, from the models that check them."""

from collections.abc import Iterator
from typing import Any

from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from frictionsim.scenario.kinds import mechanism_module, sound_kinds
from frictionsim.scenario.methods import methods_of
from frictionsim.scenario.settings import Scenario

DRAFT = "https://json-schema.org/draft/2020-12/schema"
DEFINITIONS = "#/$defs/{model}"


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
        return {"$schema": DRAFT, **_of_kind(kind, DEFINITIONS)}
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
        "$defs": {of: _of_kind(of, f"#/$defs/{of}/$defs/{{model}}") for of in kinds},
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


def _of_kind(kind: str, ref_template: str) -> dict[str, Any]:
    model: type[Scenario] = mechanism_module(kind).SCENARIO
    made = model.model_json_schema(
        by_alias=True, mode="validation", ref_template=ref_template, schema_generator=_TomlSchema
    )
    definitions = made.pop("$defs")
    for table in (made, *definitions.values()):
        _describe(table)
    made["title"] = f"Scenario of a {kind.replace('_', ' ')}"
    made["properties"]["kind"]["description"] = "Kind of mechanism."
    _key(made, definitions, "solver", "backend")["enum"] = list(methods_of(model.PAIRS))
    _key(made, definitions, "output", "channels")["items"]["enum"] = list(model.CHANNELS)
    return {**made, "$defs": definitions}


def _key(
    made: dict[str, Any], definitions: dict[str, Any], table: str, name: str
) -> dict[str, Any]:
    """Return the schema of a key in a table of the scenario."""
    definition = made["properties"][table]["$ref"].rpartition("/")[2]
    key: dict[str, Any] = definitions[definition]["properties"][name]
    return key


def _describe(table: dict[str, Any]) -> None:
    """Shorten the description of a table, add units to those of its keys, and drop dead keys."""
    table.pop("title", None)  # the name of a class
    if "description" in table:
        table["description"] = table["description"].split("\n\n")[0].replace("\n", " ")
    properties = table.get("properties", {})
    for name in list(_dead(properties)):
        del properties[name]
    for key in properties.values():
        unit = key.get("unit", "1")
        if unit != "1":
            key["description"] = f"{key.get('description', '')} Unit: {unit}.".strip()


def _dead(properties: dict[str, Any]) -> Iterator[str]:
    """Yield the keys that take nothing; they are there for an error that says why."""
    return (name for name, key in properties.items() if key.get("type") == "null")
