"""Numbers of many runs in the place of one: they are what each run alone would have, or refused."""

from math import hypot, sin
from operator import add, mul, pow, sub, truediv
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import Field, model_validator

import frictionsim as fs
from frictionsim.scenario.run_numbers import Unlike, as_run_numbers, group_runs, with_numbers
from frictionsim.scenario.schema import Params, inconsistent, unit_field
from frictionsim.scenario.settings import Scenario

NUMBERS = st.lists(st.floats(1e-3, 1e3), min_size=1, max_size=9)
LOAD, MU_S = ("mechanism", "load"), ("effects", "shaft_friction", "mu_s")


@given(NUMBERS, st.floats(0.1, 10.0), st.sampled_from([add, sub, mul, truediv, pow]))
def test_arithmetic_has_the_bits_of_each_number(values: list[float], x: float, f: Any) -> None:
    numbers = f(as_run_numbers(values), x)
    assert np.asarray(numbers).tolist() == [f(value, x) for value in values]


def test_powers_have_the_bits_of_python_where_those_of_numpy_have_others() -> None:
    values = np.random.default_rng(0).uniform(0.1, 3.0, 2000).tolist()
    for exponent in (2, 3, 0.2):
        numbers = as_run_numbers(values) ** exponent
        assert np.asarray(numbers).tolist() == [value**exponent for value in values]


@pytest.mark.parametrize(
    "take", [float, str, sin, hash, len, list, np.sin, lambda x: f"{x:g}", lambda x: hypot(1.0, x)]
)
def test_what_takes_one_number_takes_none_of_many_runs(take: Any) -> None:
    with pytest.raises(Unlike) as unlike:
        take(as_run_numbers([1.0]))
    assert unlike.value.holds is None


def test_a_condition_holds_for_all_for_none_or_divides_the_runs() -> None:
    values = as_run_numbers([1.0, 2.0, 3.0])
    assert values > 0.0
    assert not values > 3.0
    with pytest.raises(Unlike) as unlike:
        assert values > 1.5
    assert unlike.value.holds.tolist() == [False, True, True]


@given(st.lists(st.integers(0, 9), max_size=30), st.integers(1, 4))
def test_groups_take_one_way_each_and_are_not_small(values: list[int], fewest: int) -> None:
    def way(runs: Any) -> str:
        x = as_run_numbers(np.array(values)[runs])
        return "low" if x < 3.0 else "middle" if x < 6.0 else "high"

    ways = {"low": range(3), "middle": range(3, 6), "high": range(6, 10)}
    seen: list[int] = []
    for runs, branch in group_runs(way, np.arange(len(values)), fewest):
        assert len(runs) >= fewest
        assert {values[run] for run in runs} <= set(ways[branch])
        seen += runs.tolist()
    assert len(seen) == len(set(seen))
    if fewest == 1:
        assert sorted(seen) == list(range(len(values)))


def outcome(scenario: Scenario, values: dict[Any, list[float]]) -> Any:
    return with_numbers(scenario, {key: as_run_numbers(column) for key, column in values.items()})


def test_a_scenario_takes_numbers_within_bounds_and_in_order() -> None:
    pulley = fs.load("pulley")
    scenario = outcome(pulley, {LOAD: [0.0, 1e3], MU_S: [0.1, 0.3]})
    assert np.asarray(scenario.mechanism.load).tolist() == [0.0, 1e3]
    assert np.asarray(scenario.effects.shaft_friction.mu_s).tolist() == [0.1, 0.3]
    assert scenario.mechanism.inertia == pulley.mechanism.inertia
    point = outcome(pulley, {("drive", "force", "value", 1): [2e3, 3e3]})
    assert point.drive.force.value[0] == pulley.drive.force.value[0]


@pytest.mark.parametrize(
    ("key", "values", "holds"),
    [
        (LOAD, [-1.0, 0.0], [False, True]),  # at least 0
        (("mechanism", "inertia"), [1.0, 0.0], [True, False]),  # above 0
        (("solver", "rtol"), [0.5, 1.0], [True, False]),
        (MU_S, [0.05, 0.1, 0.2], [True, False, False]),  # mu_k is above the first
        (("drive", "force", "time", 1), [-1.0, 1.0], [False, True]),  # before the first point
        (LOAD, [-2.0, -1.0], None),
        (MU_S, [0.01, 0.02], None),
    ],
)
def test_it_divides_what_its_model_may_refuse(key: Any, values: list[float], holds: Any) -> None:
    with pytest.raises(Unlike) as unlike:
        outcome(fs.load("pulley"), {key: values})
    mask = unlike.value.holds
    assert (None if mask is None else mask.tolist()) == holds


class Table(Params):
    plain: float = 1.0
    even: float = Field(2.0, multiple_of=2.0)
    whole: int = 3
    none: float | None = None
    apart: float = unit_field("1", "Not 5.", 4.0)

    @model_validator(mode="after")
    def _apart(self) -> "Table":
        if self.apart == 5.0:
            raise inconsistent(("apart",), "it is 5")
        return self


class Before(Params):
    plain: float = 1.0

    @model_validator(mode="before")
    @classmethod
    def _as_given(cls, data: Any) -> Any:
        return data


@pytest.mark.parametrize(
    ("table", "key"),
    [(Table(), "even"), (Table(), "whole"), (Table(), "none"), (Table(), "x"), (Before(), "plain")],
)
def test_what_a_model_says_otherwise_is_left_to_it(table: Params, key: str) -> None:
    with pytest.raises(Unlike) as unlike:
        with_numbers(table, {(key,): as_run_numbers([1.0, 2.0])})
    assert unlike.value.holds is None


def test_validators_of_a_model_see_the_numbers() -> None:
    assert with_numbers(Table(), {("plain",): as_run_numbers([1.0, 2.0])}).apart == 4.0
    with pytest.raises(Unlike) as unlike:
        with_numbers(Table(), {("apart",): as_run_numbers([4.0, 5.0])})
    assert unlike.value.holds.tolist() == [False, True]
