"""With an elementary time the creep law does not depend on the steps of the solver."""

from typing import Any

import pytest

import frictionsim as fs
from tests.support.belt_scenarios import NO_MOTION_ACROSS, pair
from tests.support.cases import slow

# Creep that matters: 5e-7 m in 1e-5 s at the transition speed.
DRAWN = [(1e-5, 1e-6, 0.6), slow(4e-5, 3e-6, 0.4)]


def heat(plane: bool, step: float, **friction: Any) -> float:
    table = {"law": "creep", "transition_speed": 0.05, "mu_s": 0.6, "mu_k": 0.4} | friction
    solver = {"solver__max_step": step, "solver__rtol": 1e-3}
    if plane:
        solver["solver__duration"] = 1e-3
    else:  # The driver turns by the transition speed at once.
        solver |= {**NO_MOTION_ACROSS, "mechanism__belt__bodies": 12}
        solver |= {"solver__duration": 2e-4, "drive__driver__torque": -20.0}
    data = pair(effects__belt_friction=table, **solver)
    done = fs.solve(data, check=False)
    assert done.status == "done"
    return float(done.dataset["energy_friction"].values[-1])


# In the plane by kernels of its own.
@pytest.mark.parametrize("plane", [False, slow(True)], ids=["guided", "in the plane"])
@pytest.mark.parametrize(("time", "creep", "mu"), DRAWN)
def test_heat_is_the_same_with_steps_of_any_length(
    time: float, creep: float, mu: float, plane: bool, request: pytest.FixtureRequest
) -> None:
    if not plane:
        request.getfixturevalue("uncompiled")
    given = {"elementary_time": time, "maximum_creep": creep, "mu_s": mu, "mu_k": 0.9 * mu}
    long, short = heat(plane, 4e-6, **given), heat(plane, 1e-6, **given)
    # rkf45 errs by the fourth power of the step; a law that takes the step itself differs by more.
    assert long == pytest.approx(short, rel=1e-5)
    del given["elementary_time"]
    assert abs(heat(plane, 4e-6, **given) - heat(plane, 1e-6, **given)) > 1e-4 * short


def test_other_laws_refuse_it_and_the_warning_ends_with_it() -> None:
    key = "effects.belt_friction.elementary_time"
    with pytest.raises(fs.ScenarioError, match="has no such parameter"):
        fs.load("belt_drive", {key: 1e-6})
    assert any(key in warning for warning in fs.load("belt_drive_published").warnings())
    assert not fs.load("belt_drive_published", {key: 1e-6}).warnings()
