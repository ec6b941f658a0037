"""Scenarios of belts; what is refused is in `tests/messages/belts.txt`."""

from pathlib import Path

import pytest

import frictionsim as fs
from tests.support.belt_scenarios import every_effect, pair, scenario_of
from tests.support.scenarios import Scenario, changed


@pytest.mark.parametrize("data", [pair(), every_effect()], ids=["pair", "trio"])
def test_what_a_result_holds_of_its_scenario_is_that_scenario(
    data: Scenario, tmp_path: Path
) -> None:
    path = tmp_path / "again.toml"
    path.write_text(scenario_of(data).to_toml())
    assert fs.load(path) == scenario_of(data | {"output": {"interval": 1e-3}})


def test_a_belt_has_no_damper_that_its_scenario_does_not_name() -> None:
    left_out = dict.fromkeys(
        ("effects__contact__damping", "effects__bending__damping", "effects__axial_damping")
    )
    effects = scenario_of(changed(every_effect(), **left_out)).effects
    assert (effects.contact.damping, effects.bending.damping) == (0.0, 0.0)
    assert effects.axial_damping is None
