"""The scenario of each combination is the one that single overrides give, or is refused alike."""

from math import inf, nan
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import frictionsim as fs
from frictionsim.errors import InputError
from frictionsim.simulation.combinations import Combinations
from tests.support.scenarios import SCENARIOS

MU_S = "effects.shaft_friction.mu_s"
PULLEY = fs.load(SCENARIOS / "pulley.toml")
KEYS = ["mechanism.load", "effects.shaft_friction.mu_k", "drive.force.value.1", "solver.max_step"]
GOOD = (2000.0, 0.1, 3000.0, 0.5)
SMALL_OR_LARGE = (0.0, -0.0, 1e-51, -1e-51, 5e-324, 1e50, 1.1e50, -2e50, inf, nan)
ODD = st.sampled_from([*SMALL_OR_LARGE, -1.0, 0.3, 1, True, "1", None, [1.0]])


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("pulley", {MU_S: 0.3, "drive.force.value.1": 4000.0, "drive.direction": "horizontal"}),
        ("pulley", {"effects.viscous_damping": "none"}),
        ("pulley", {"drive.force": {"time": [0.0, 1.0], "value": [0.0, 1.0]}}),
        ("hard/jump_from_csv", {"mechanism.load": 1000.0}),
        ("belt_string", {"mechanism.pulleys.0.radius": 0.1, "effects.belt_friction.mu_k": 0.1}),
        ("marble_machine", {"effects.shaft_friction.mu_s": 0.4, "drive.motor.stall_torque": 3.0}),
    ],
)
def test_a_combination_is_what_overrides_give(name: str, values: dict[str, object]) -> None:
    base = fs.load(SCENARIOS / f"{name}.toml")
    make = Combinations(base, list(values)).scenario
    overrides = {key: None if value == "none" else value for key, value in values.items()}
    assert make(list(values.values())) == base.replace(overrides)


def outcome(make: Any, values: Any) -> Any:
    """Return the scenario with all that belongs to it, or the message that refuses it."""
    try:
        scenario = make(values)
    except InputError as error:
        faults = str(error).removeprefix("overrides: ").rpartition(" is not valid: ")[2]
        return faults.replace("\noverrides: ", "; ")
    return scenario, scenario.to_toml(), scenario.mechanism.model_fields_set


def replaced(values: Any) -> Any:
    return PULLEY.replace(dict(zip(KEYS, values, strict=True)))


@given(st.lists(st.tuples(*(st.one_of(st.just(x), ODD) for x in GOOD)), max_size=4))
def test_each_is_what_replace_returns_or_refuses(rows: list[tuple[Any, ...]]) -> None:
    make = Combinations(PULLEY, KEYS).scenario
    for values in (GOOD, *rows, GOOD):
        assert outcome(make, values) == outcome(replaced, values)


def test_scenarios_that_were_made_do_not_change_with_the_next() -> None:
    combinations = Combinations(PULLEY, KEYS)
    made = [combinations.scenario((2000.0 + i, 0.1, 3000.0 + i, 0.5)) for i in range(4)]
    values = [(scenario.mechanism.load, scenario.drive.force.value[1]) for scenario in made]
    assert values == [(2000.0 + i, 3000.0 + i) for i in range(4)]


def test_files_are_looked_for_beside_the_scenario(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("t,F\n0.0,1.0\n1.0,2.0\n")
    (tmp_path / "p.toml").write_text(PULLEY.replace({"drive.force": 1.0}).to_toml())
    made = Combinations(fs.load(tmp_path / "p.toml"), ["drive.force"])
    assert made.scenario([{"csv": "a.csv"}]).drive.force.value == (1.0, 2.0)
    (tmp_path / "p.toml").write_text(
        (SCENARIOS / "pulley.toml")
        .read_text()
        .replace("time = [0.0, 0.8], value = [1832.6, 3113.75]", 'csv = "a.csv"')
    )
    make = Combinations(fs.load(tmp_path / "p.toml"), ["drive.force.value.1"]).scenario
    assert make([3100.0]).drive.force.value == (1.0, 3100.0)
