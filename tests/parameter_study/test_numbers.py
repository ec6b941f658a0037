"""Scenarios that differ in the numbers of a few keys, made one after the other."""

from math import inf, nan
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from hypothesis import given
from hypothesis import strategies as st

from frictionsim.errors import InputError
from frictionsim.parameter_study.combinations import Combinations
from frictionsim.scenario.loading import load
from tests.support.scenarios import SCENARIOS, pulley

pytestmark = pytest.mark.quick

PULLEY = load(SCENARIOS / "pulley.toml")
KEYS = ["mechanism.load", "effects.shaft_friction.mu_k", "drive.force.value.1", "solver.max_step"]
GOOD = (2000.0, 0.1, 3000.0, 0.5)
SMALL_OR_LARGE = (0.0, -0.0, 1e-51, -1e-51, 5e-324, 1e50, 1.1e50, -2e50, inf, nan)
ODD = st.sampled_from([*SMALL_OR_LARGE, -1.0, 0.3, 1, True, "1", None, [1.0]])


def outcome(make: Any, values: Any) -> Any:
    """Return the scenario with all that belongs to it, or the message that refuses it."""
    try:
        found = make(values)
    except InputError as error:
        faults = str(error).removeprefix("overrides: ").rpartition(" is not valid: ")[2]
        return faults.replace("\noverrides: ", "; ")
    return found, found.to_toml(), found.mechanism.model_fields_set


def replaced(values: Any) -> Any:
    return PULLEY.replace(dict(zip(KEYS, values, strict=True)))


@given(st.lists(st.tuples(*(st.one_of(st.just(x), ODD) for x in GOOD)), max_size=4))
def test_each_is_what_replace_returns_or_refuses(rows: list[tuple[Any, ...]]) -> None:
    make = Combinations(PULLEY, KEYS).scenario
    for values in (GOOD, *rows, GOOD):
        assert outcome(make, values) == outcome(replaced, values)


def test_the_first_may_be_refused() -> None:
    make = Combinations(PULLEY, ["mechanism.load"]).scenario
    for value in (1e60, 1e60, 100.0, 200.0, -1.0):
        expected = outcome(lambda v: PULLEY.replace({"mechanism.load": v[0]}), (value,))
        assert outcome(make, (value,)) == expected


def test_scenarios_that_were_made_do_not_change_with_the_next() -> None:
    make = Combinations(PULLEY, KEYS).scenario
    made = [make((2000.0 + i, 0.1, 3000.0, 0.5)) for i in range(4)]
    assert [scenario.mechanism.load for scenario in made] == [2000.0, 2001.0, 2002.0, 2003.0]


@pytest.mark.parametrize(
    ("name", "key"),
    [
        ("belt_drive", "mechanism.belt.mass_per_length"),
        ("epicyclic", "effects.gravity.g"),
        ("marble_machine", "drive.motor.stall_torque"),
    ],
)
def test_other_kinds(name: str, key: str) -> None:
    scenario = load(SCENARIOS / f"{name}.toml")
    value: Any = scenario.to_dict()
    for part in key.split("."):
        value = value[part]
    make = Combinations(scenario, [key]).scenario
    for factor in (1.0, 1.0001, 1.0002):
        assert make([factor * value]) == scenario.replace({key: factor * value})


def test_files_are_looked_for_beside_the_scenario(tmp_path: Path) -> None:
    (tmp_path / "force.csv").write_text("0,1800\n1,3000\n")
    data = pulley(drive__force={"csv": "force.csv"})
    (tmp_path / "p.toml").write_text(tomli_w.dumps(data))
    scenario = load(tmp_path / "p.toml")
    make = Combinations(scenario, ["drive.force.value.1"]).scenario
    assert make([3100.0]).drive.force.value == make([3100.0]).drive.force.value == (1800.0, 3100.0)
