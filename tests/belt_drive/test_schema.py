"""Scenarios of belts; what is refused is in `tests/messages/belts.txt`."""

from collections.abc import Callable
from pathlib import Path
from subprocess import CompletedProcess

import pytest

from frictionsim.scenario.loading import load
from tests.support.belt_scenarios import every_effect, pair, scenario_of
from tests.support.scenarios import SCENARIOS, Scenario, changed


def test_a_refused_belt_leaves_no_file(
    cli: Callable[..., "CompletedProcess[str]"], tmp_path: Path
) -> None:
    done = cli("solve", SCENARIOS / "belt_drive.toml", "--set", "mechanism.belt.bodies=20")
    assert done.returncode == 2
    assert done.stdout == ""
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("data", [pair(), every_effect()], ids=["pair", "trio"])
def test_what_a_result_holds_of_its_scenario_is_that_scenario(
    data: Scenario, tmp_path: Path
) -> None:
    path = tmp_path / "again.toml"
    path.write_text(scenario_of(data).to_toml())
    assert load(path) == scenario_of(data | {"output": {"interval": 1e-3}})


@pytest.mark.parametrize("path", sorted(SCENARIOS.glob("belt*.toml")), ids=lambda p: p.stem)
def test_shipped_belts_are_valid(path: Path) -> None:
    assert load(path).kind == "belt_drive"


def test_a_belt_has_no_damper_that_its_scenario_does_not_name() -> None:
    left_out = dict.fromkeys(
        ("effects__contact__damping", "effects__bending__damping", "effects__axial_damping")
    )
    effects = scenario_of(changed(every_effect(), **left_out)).effects
    assert (effects.contact.damping, effects.bending.damping) == (0.0, 0.0)
    assert effects.axial_damping is None
