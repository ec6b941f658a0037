"""Every key of every kind says what it means, in which unit."""

import sys
from collections.abc import Iterator

import pytest

from frictionsim.scenario.kinds import KINDS
from frictionsim.scenario.signal_tables import SIGNAL_TAGS
from tests.docs.pages import DOCS

sys.path.insert(0, str(DOCS / "_ext"))
from scenario_keys import Key, keys_of, model_of, tables

MAX_MEANING = 160  # characters of a meaning, which has to fit in a table


def keys_by_place(kind: str) -> Iterator[tuple[str, Key]]:
    for found in tables(model_of(kind)):
        for key in keys_of(found.model):
            yield f"{found.header} {key.name}", key


def keys_of_signals() -> Iterator[tuple[str, Key]]:
    for tag, form in SIGNAL_TAGS.items():
        for found in tables(form):
            for key in keys_of(found.model):
                yield f"{tag} {key.name}", key


@pytest.mark.parametrize("kind", KINDS)
def test_each_key_of_a_kind_has_a_meaning(kind: str) -> None:
    for place, key in keys_by_place(kind):
        assert_meaning(place, key)


def test_each_key_of_a_signal_has_a_meaning() -> None:
    for place, key in keys_of_signals():
        assert_meaning(place, key)


def assert_meaning(place: str, key: Key) -> None:
    assert key.meaning[:1].isupper(), place
    assert key.meaning.endswith("."), place
    assert len(key.meaning) <= MAX_MEANING, place


@pytest.mark.parametrize("kind", KINDS)
def test_a_suffix_of_a_key_is_its_unit(kind: str) -> None:
    units = {"_deg": "deg", "_hz": "Hz"}
    for place, key in (*keys_by_place(kind), *keys_of_signals()):
        suffix = next((s for s in units if key.name.strip("`").endswith(s)), None)
        assert suffix is None or key.unit == units[suffix], place
