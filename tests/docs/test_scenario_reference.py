"""Every key of every kind has a meaning and a unit."""

import sys
from collections.abc import Iterator
from typing import Any

import pytest

import frictionsim as fs
from tests.docs.pages import DOCS

sys.path.insert(0, str(DOCS / "_ext"))
from scenario_keys import Key, keys, keys_of, model_of, tables

# Keys of a signal, by the table that has them, in the unit of what it drives.
IN_THE_UNIT_OF_THE_SIGNAL = {
    *(("PiecewiseLinearTable", "value"), ("SpeedTable", "value"), ("AngleTable", "value")),
    *(("SineParameters", "mean"), ("SineParameters", "amplitude")),
    *(("SmoothStepParameters", "from"), ("SmoothStepParameters", "to")),
}
MAX_MEANING = 160  # characters of a meaning, which has to fit in a table


def keys_by_table(kind: str) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Yield table, name and schema of the keys of a kind, also of the signals it takes."""
    made = fs.schema(kind)
    for table, described in {"": made, **made["$defs"]}.items():
        for name, key in described.get("properties", {}).items():
            yield table, name, key


@pytest.mark.parametrize("kind", fs.kinds())
def test_each_key_has_a_meaning_and_each_number_a_unit(kind: str) -> None:
    tables_of = fs.schema(kind)["$defs"]
    for table, name, key in keys_by_table(kind):
        place = f"{table}.{name}"
        if "description" not in key:  # that of a table is its own
            taken = str(key.get("$ref") or key.get("items") or key.get("additionalProperties"))
            own = [of.get("description") for at, of in tables_of.items() if f"/{at}" in taken]
            assert any(own), place
            continue
        meaning = key["description"].removesuffix(f" Unit: {key.get('unit')}.")
        assert meaning[:1].isupper(), place
        assert meaning.endswith("."), place
        assert len(meaning) <= MAX_MEANING, place
        of_signal = (table, name) in IN_THE_UNIT_OF_THE_SIGNAL
        assert bool(key.get("unit")) == (is_number(key) and not of_signal), place
        for suffix, unit in (("_deg", "deg"), ("_hz", "Hz")):
            assert not name.endswith(suffix) or key["unit"] == unit, place


def is_number(key: dict[str, Any]) -> bool:
    """Tell whether a key takes numbers, or a signal of them, and no text in their place."""
    forms = [form for of in ("oneOf", "anyOf") for form in key.get(of, ())] or [key]
    types = {form.get("type") for form in [*forms, *(form.get("items", {}) for form in forms)]}
    return bool(types & {"number", "integer"}) and "string" not in types


@pytest.mark.parametrize("kind", fs.kinds())
def test_the_backends_of_a_kind_are_listed(kind: str) -> None:
    settings = (table["properties"] for table in fs.schema(kind)["$defs"].values())
    (able,) = (table["backend"]["enum"] for table in settings if "backend" in table)
    listed = ", ".join(f'`"{name}"`' for name in able)
    assert f"| `backend` | {listed} |" in keys(kind)


def test_the_reference_shows_what_is_taken_for_a_key_left_out() -> None:
    shown: dict[str, Key] = {}
    for table in tables(model_of("pulley")):
        shown |= {f"{table.header} {key.name}": key for key in keys_of(table.model)}
    assert shown["[effects.shaft_friction] `transition_speed`"].default == "0.001"
    assert shown["[output] `interval`"].default == "duration/500"
