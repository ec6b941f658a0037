"""Properties of random scenarios of the shaft mechanisms: audit, resuming, symmetry."""

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.drawn_scenarios import (
    assert_sound,
    assert_splitting_changes_nothing,
    marble_machines,
    scenarios,
    some,
)
from tests.support.scenarios import Scenario, simulate


@pytest.fixture(scope="module")
def folder() -> Any:
    with tempfile.TemporaryDirectory() as name:
        yield Path(name)


@some(80)
@given(scenarios())
def test_results_of_random_scenarios_are_sound(folder: Path, data: Scenario) -> None:
    assert_sound(data, folder)


@some(40)
@given(scenarios(), st.floats(0.0, 1.0))
def test_interrupting_random_runs_changes_nothing(
    folder: Path, data: Scenario, fraction: float
) -> None:
    assert_splitting_changes_nothing(data, fraction, folder)


@some(20)
@given(marble_machines(), st.sampled_from(["events", "rkf45"]))
def test_a_machine_without_gravity_is_symmetric(data: Scenario, backend: str) -> None:
    """Without gravity nothing but the torque has a direction."""
    data = data | {"drive": {"torque": 0.01}, "solver": {"backend": backend, "duration": 1.0}}
    data["effects"].pop("gravity", None)
    done, mirrored = simulate(data), simulate(data | {"drive": {"torque": -0.01}})
    assert np.array_equal(mirrored.channels["angle"], -done.channels["angle"])
    assert [-e.mode_to for e in mirrored.transitions] == [e.mode_to for e in done.transitions]


@pytest.mark.long
def test_thousands_of_random_scenarios_are_sound(folder: Path, tally: dict[str, int]) -> None:
    @some(3000)
    @given(scenarios())
    def all_of_them(data: Scenario) -> None:
        ended = assert_sound(data, folder)
        for name in ("random scenarios", f"random scenarios: {ended}"):
            tally[name] = tally.get(name, 0) + 1

    all_of_them()


@pytest.mark.long
def test_interrupting_hundreds_of_random_runs_changes_nothing(
    folder: Path, tally: dict[str, int]
) -> None:
    @some(1000)
    @given(scenarios(), st.floats(0.0, 1.0))
    def all_of_them(data: Scenario, fraction: float) -> None:
        assert_splitting_changes_nothing(data, fraction, folder)
        tally["split runs"] = tally.get("split runs", 0) + 1

    all_of_them()
