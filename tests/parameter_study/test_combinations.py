"""The scenario of each combination is the one that single overrides give."""

from pathlib import Path

import pytest

import frictionsim as fs
from frictionsim.errors import InputError
from frictionsim.parameter_study.combinations import Combinations
from tests.support.scenarios import SCENARIOS

pytestmark = pytest.mark.quick

MU_S = "effects.shaft_friction.mu_s"


@pytest.mark.parametrize(
    ("name", "values"),
    [
        ("pulley", {MU_S: 0.3, "drive.force.value.1": 4000.0, "drive.direction": "horizontal"}),
        ("pulley", {"solver.duration": 5.0, "solver.rtol": 1e-7}),
        ("pulley", {"effects.viscous_damping": "none"}),
        ("pulley", {"drive.force": {"time": [0.0, 1.0], "value": [0.0, 1.0]}}),
        ("hard/jump_from_csv", {"mechanism.load": 1000.0}),
        ("belt_string", {"mechanism.pulleys.0.radius": 0.1, "effects.belt_friction.mu_k": 0.1}),
        ("marble_machine", {"effects.shaft_friction.mu_s": 0.4}),
    ],
)
def test_a_combination_is_what_overrides_give(name: str, values: dict[str, object]) -> None:
    base = fs.load(SCENARIOS / f"{name}.toml")
    found = Combinations(base, list(values)).scenario(list(values.values()))
    overrides = {key: None if value == "none" else value for key, value in values.items()}
    assert found == base.replace(overrides)


def test_combinations_do_not_change_each_other() -> None:
    base = fs.load(SCENARIOS / "pulley.toml")
    made = Combinations(base, ["drive.force.value.1"])
    first, second = made.scenario([1.0]), made.scenario([2.0])
    assert first.drive.force.value[1] == 1.0
    assert second.drive.force.value[1] == 2.0
    assert made.base == base


@pytest.mark.parametrize(
    ("keys", "values", "message"),
    [
        ([MU_S], [0.05], f"vary: {MU_S}=0.05 is not valid: effects.shaft_friction.mu_k: 0.1 is"),
        (["mechanism.laod"], [1.0], "unknown key 'laod' (did you mean 'load'?)"),
        (["mechanism.load.x"], [1.0], "'mechanism.load' is a value and has no keys"),
        (["drive.force.value.7"], [1.0], "is a list of 2; give an index from 0"),
        (["mechanism.load"], ["heavy"], "expected a number in N, got 'heavy'"),
        (["mechanism.load"], [[1.0] * 40], "... is not valid: mechanism.load: expected a number"),
    ],
)
def test_an_invalid_combination_is_named(
    keys: list[str], values: list[object], message: str
) -> None:
    made = Combinations(fs.load(SCENARIOS / "pulley.toml"), keys)
    with pytest.raises(InputError) as caught:
        made.scenario(values)
    assert str(caught.value).startswith(f"vary: {keys[0]}=")
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_the_kind_is_not_varied() -> None:
    base = fs.load(SCENARIOS / "pulley.toml")
    with pytest.raises(InputError, match="a sweep has runs of one kind; start one for each"):
        Combinations(base, ["kind"])


def test_values_may_be_files_beside_the_scenario(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / f"{name}.csv").write_text("t,F\n0.0,1.0\n1.0,2.0\n")
    base = fs.load(SCENARIOS / "pulley.toml")
    text = base.to_toml()
    (tmp_path / "p.toml").write_text(text)
    made = Combinations(fs.load(tmp_path / "p.toml"), ["drive.force"])
    found = [made.scenario([{"csv": f"{name}.csv"}]) for name in ("a", "b")]
    assert [scenario.drive.force.value for scenario in found] == [(1.0, 2.0)] * 2
