"""The fastest waves of belts, and the steps that are stable."""

import numpy as np
import pytest

from frictionsim.errors import InputError
from tests.support.belt_kernels import assemble, rkf45, stepper_of
from tests.support.belt_scenarios import NO_FRICTION, kick, pair, scenario_of, shipped, stepped
from tests.support.belt_waves import waves
from tests.support.cases import one_in
from tests.support.scenarios import changed, simulate

STILL = {"effects__belt_friction": NO_FRICTION, "drive__driver__torque": 0.0}
BELTS = {
    "pair": pair(**STILL),
    "slack": pair(mechanism__belt__pretension=1.0, **STILL),
    "tight": pair(mechanism__belt__pretension=2000.0, **STILL),
    "of stiff contacts": pair(effects__contact__c2=1e8, **STILL),
    "stiff in bending": pair(effects__bending__rigidity=2.0, **STILL),
    "published": shipped("belt_drive", mechanism__belt__bodies=60, **STILL),
}


@pytest.mark.usefixtures("uncompiled")
@pytest.mark.parametrize("name", one_in(2, BELTS))
def test_the_fastest_frequency_is_a_close_bound(name: str) -> None:
    model = assemble(scenario_of(BELTS[name]))
    frequency = model.max_frequency
    highest = np.max(waves(model)[0])
    # It allows for contacts and tensions twice as high as at rest, which counts where it is tight.
    assert highest * 0.999 <= frequency <= highest * (1.12 if name == "tight" else 1.03)


def energy_at(step: float) -> float:
    """Return the kinetic energy that a kick leaves after 400 steps, over that of the kick."""
    data = changed(BELTS["pair"], solver={"backend": "moreau", "duration": 400 * step})
    data["effects"]["contact"]["damping"] = 1e-6
    data["effects"]["axial_damping"]["coefficient"] = 1e-6
    scenario = scenario_of(data)
    model = assemble(scenario)
    kick(1e-6)(model)
    stepper = stepper_of(model, scenario)
    # A scenario may not ask for a step that is too long.
    stepper._plan = stepper._plan._replace(h=step)
    stepper.start()
    stepper.advance(400 * step * (1.0 - 1e-12), np.inf, 400)
    state, width, n = stepper.interpolate(400 * step), model.belt.width, 24
    velocities = state[3 * width : 5 * width].reshape(2, width)[:, :n]
    return float(np.sum(velocities**2)) / (1e-12 * 24)


@pytest.mark.usefixtures("uncompiled")
def test_the_limit_of_the_step_is_that_of_stability() -> None:
    model = assemble(scenario_of(BELTS["pair"]))
    highest = float(np.max(waves(model)[0]))
    limit = 2.0 / model.max_frequency
    assert limit <= 2.0 / highest
    assert energy_at(0.99 * limit) < 10.0
    # A hundredth beyond 2/omega the highest wave grows by exp(0.28) in each step.
    assert energy_at(1.01 * 2.0 / highest) > 1e10


def test_a_step_beyond_the_limit_is_refused_with_the_limit() -> None:
    limit = 2.0 / assemble(scenario_of(pair())).max_frequency
    data = pair(solver={"backend": "moreau", "step": 0.98 * limit, "duration": 0.01})
    assert simulate(data).status == "done"
    with pytest.raises(InputError, match=f"'moreau' is stable below {limit:.4g} s here"):
        simulate(changed(data, solver__step=1.02 * limit))


def test_a_step_of_rkf45_stays_within_its_region_of_stability() -> None:
    """It never has to be rejected because the waves make it unstable."""
    end = stepped(pair(solver__rtol=1e-2, solver__duration=0.1), kick(1e-3))
    steps, rejected, _ = end.stepper.statistics
    assert rejected <= 0.01 * steps
    assert isinstance(end.stepper, rkf45.RKF45Stepper)
    tau = 1.0 / end.model.belt.inv_tau
    assert end.stepper._max_step == pytest.approx(1.95 * tau, rel=1e-2)
