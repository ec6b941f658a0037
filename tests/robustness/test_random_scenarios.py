"""Random scenarios of one coordinate are sound."""

import tempfile
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given

from tests.support.drawn_scenarios import assert_sound, scenarios
from tests.support.scenarios import Scenario


@pytest.fixture(scope="module")
def folder() -> Any:
    with tempfile.TemporaryDirectory() as name:
        yield Path(name)


@given(scenarios())
def test_results_of_random_scenarios_are_sound(folder: Path, data: Scenario) -> None:
    assert_sound(data, folder)
