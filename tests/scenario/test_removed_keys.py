"""Keys that are taken out by `none` have to be known, though what is not there is not validated."""

from collections.abc import Callable
from typing import Any

import pytest

import frictionsim as fs

Told = Callable[..., tuple[str, str]]


@pytest.mark.parametrize(
    ("key", "said"),
    [
        ("effects.shaft_fricton", "(did you mean 'shaft_friction'?)"),
        ("effects.viscous_damping.coeff", "(did you mean 'coefficient'?)"),
        ("nope", "; known: kind, title, solver, output, mechanism, drive, effects"),
    ],
)
def test_an_unknown_key_is_not_taken_out_in_silence(key: str, said: str, told: Told) -> None:
    wanted = f"{key}: unknown key '{key.rpartition('.')[2]}'"
    _, stderr = told("check", "pulley", "--set", f"{key}=none", code=2)
    assert stderr == f"frictionsim: --set: {wanted}{'' if said[0] == ';' else ' '}{said}\n"
    for run in (
        lambda: fs.load("pulley", {key: None}),
        lambda: fs.sweep("pulley", {key: ["none"]}),
    ):
        with pytest.raises(fs.FrictionsimError) as raised:
            run()
        assert wanted in str(raised.value)


@pytest.mark.parametrize("value", ["1", "none"])
def test_a_key_of_a_table_without_keys_is_told_so(value: str, told: Told) -> None:
    given = ("--set", "effects.wear={}", "--set", f"effects.wear.x={value}")
    _, stderr = told("check", "belt_string", *given, code=2)
    assert stderr.endswith("effects.wear.x: unknown key 'x'; this table has no keys\n")


@pytest.mark.parametrize(
    ("name", "overrides"),
    [
        ("pulley", {"effects.viscous_damping": None, "effects.hanging_masses": None}),
        ("belt_drive", {"effects.patch": None, "effects.belt_friction.pulleys.driver": None}),
        ("belt_drive", {"drive.driven": None, "solver.step": None}),
    ],
)
def test_known_keys_are_taken_out_where_they_are_not(name: str, overrides: dict[str, Any]) -> None:
    fs.load(name, overrides)
