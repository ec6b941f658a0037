"""Random scenarios of one coordinate are sound, and begin later as they began before."""

import tempfile
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.drawn_scenarios import assert_sound, scenarios
from tests.support.examples import examples
from tests.support.scenarios import Scenario, simulate
from tests.support.shaft_scenarios import delayed, shaft_scenario


@pytest.fixture(scope="module")
def folder() -> Any:
    with tempfile.TemporaryDirectory() as name:
        yield Path(name)


@examples(12)
@given(scenarios())
def test_results_of_random_scenarios_are_sound(folder: Path, data: Scenario) -> None:
    assert_sound(data, folder)


@examples(6)
@given(
    st.lists(st.floats(-20.0, 20.0), min_size=2, max_size=4),
    st.lists(st.floats(-30.0, 30.0), min_size=2, max_size=4),
    st.floats(0.01, 3.0),
)
def test_a_body_on_a_shaft_that_is_moved_later_moves_alike(
    torques: list[float], sizes: list[float], seconds: float
) -> None:
    """It rests until then: a load through the axis presses it on its shaft."""
    times = [0.1, 0.2, 0.25, 0.4]
    force = {"direction": [0.6, -0.8], "point": [0.1, 0.0]}
    data = shaft_scenario(
        [{**force, "size": {"time": [0.05, *times[: len(sizes)]], "value": [0.0, *sizes]}},
         {**force, "size": 50.0, "point": [0.0, 0.0]}],
        [{"time": [0.05, *times[: len(torques)]], "value": [0.0, *torques]}],
    )  # fmt: skip
    data["solver"] = {"duration": 0.6, "rtol": 1e-9}
    done, other = simulate(data), simulate(delayed(data, seconds))
    modes = [(e.mode_from, e.mode_to) for e in done.transitions]
    assert [(e.mode_from, e.mode_to) for e in other.transitions] == modes
    for one, two in zip(done.transitions, other.transitions, strict=True):
        assert two.time - seconds == pytest.approx(one.time, abs=1e-7)
    angle = done.channels["angle"][-1]
    assert other.channels["angle"][-1] == pytest.approx(angle, rel=1e-6, abs=1e-6)
