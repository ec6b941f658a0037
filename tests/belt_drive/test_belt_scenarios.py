"""Small belts that the tests of belts share, and that they are what those take them for."""

import numpy as np
import pytest

from tests.support.belt_kernels import MU_S, assemble
from tests.support.belt_scenarios import every_effect, pair, scenario_of
from tests.support.scenarios import Scenario


@pytest.mark.parametrize("data", [pair(), every_effect()], ids=["pair", "trio"])
def test_the_belts_rest_on_all_their_pulleys(data: Scenario) -> None:
    model = assemble(scenario_of(data))
    touching = np.bincount(model.rest.pulley[model.rest.pulley >= 0])
    assert len(touching) == len(data["mechanism"]["pulleys"])
    assert np.all(touching >= 3)
    # Contact damping is neither nearly absent nor in full at the depth of rest.
    depth = model.rest.normal_force.max() / data["effects"]["contact"]["c2"]
    assert 0.1e-3 < depth < 1e-3


def test_the_belt_on_three_pulleys_has_every_effect() -> None:
    scenario = scenario_of(every_effect())
    assert {name for name, effect in scenario.effects if effect is None} == {"wear"}
    belt = assemble(scenario).belt
    absent = {name for name in belt._fields if getattr(belt, name) is None}
    # Obliquity is of steps of a fixed length.
    assert absent == {"transition", "creep", "creep_time", "obliquity", "line"}
    assert np.any(belt.con[MU_S, :, : belt.n] == scenario.effects.patch.mu_s)
