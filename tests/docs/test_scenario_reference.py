"""Every key of every kind has a meaning and a unit."""

import sys
from collections.abc import Iterator

import pytest

from frictionsim.scenario.kinds import KINDS
from frictionsim.scenario.methods import methods_of
from frictionsim.scenario.signal_tables import SIGNAL_TAGS
from tests.docs.pages import DOCS

sys.path.insert(0, str(DOCS / "_ext"))
from scenario_keys import Key, keys_of, model_of, tables

# Keys of a signal that are in the unit of what it drives.
IN_THE_UNIT_OF_THE_SIGNAL = {"`value`", "`mean`", "`amplitude`", "`from`", "`to`"}
MAX_MEANING = 160  # characters of a meaning, which has to fit in a table


def keys_by_place(kind: str) -> Iterator[tuple[str, Key]]:
    """Yield the keys of a kind, or of the forms of a signal."""
    groups = SIGNAL_TAGS.items() if kind == "signal" else [("", model_of(kind))]
    for tag, model in groups:
        for table in tables(model):
            for key in keys_of(table.model):
                yield f"{tag}{table.header} {key.name}", key


@pytest.mark.parametrize("kind", [*KINDS, "signal"])
def test_each_key_has_a_meaning_and_each_number_a_unit(kind: str) -> None:
    for place, key in keys_by_place(kind):
        assert key.meaning[:1].isupper(), place
        assert key.meaning.endswith("."), place
        assert len(key.meaning) <= MAX_MEANING, place
        of_signal = kind == "signal" and key.name in IN_THE_UNIT_OF_THE_SIGNAL
        assert bool(key.unit) == (is_number(key) and not of_signal), place
        for suffix, unit in (("_deg", "deg"), ("_hz", "Hz")):
            assert not key.name.strip("`").endswith(suffix) or key.unit == unit, place


def is_number(key: Key) -> bool:
    """Tell whether a key takes numbers, or a signal of them."""
    return ("number" in key.form and "text" not in key.form) or "signal" in key.form


@pytest.mark.parametrize("kind", KINDS)
def test_the_backends_of_a_kind_are_listed(kind: str) -> None:
    (table,) = (t for t in tables(model_of(kind)) if t.header == "[solver]")
    able = methods_of(model_of(kind).PAIRS)
    (backend,) = (key for key in keys_of(table.model, able) if key.name == "`backend`")
    assert backend.form == ", ".join(f'`"{name}"`' for name in able)


def test_the_reference_shows_what_is_taken_for_a_key_left_out() -> None:
    shown = {place: key.default for place, key in keys_by_place("pulley")}
    assert shown["[effects.shaft_friction] `transition_speed`"] == "0.001"
    assert shown["[output] `interval`"] == "duration/500"
