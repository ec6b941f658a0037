"""Random belt drives obey the friction law and pass their audit."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import frictionsim as fs
from tests.support.belt_scenarios import pair
from tests.support.drawn_scenarios import of_size
from tests.support.examples import examples
from tests.support.scenarios import Scenario

by_both = pytest.mark.parametrize("backend", ["moreau", "rkf45"])
DURATION = 0.01


@st.composite
def belts(draw: st.DrawFn) -> Scenario:
    """Belts on two pulleys with every effect of `pair`, so that one kernel is compiled."""
    mu_k = draw(of_size(0.05, 2.0))
    radius = draw(st.floats(0.05, 0.12))
    apart = draw(st.floats(0.26, 0.6))
    data = pair(
        mechanism__belt__bodies=draw(st.integers(24, 48)),
        mechanism__belt__mass_per_length=draw(of_size(0.1, 1.0)),
        mechanism__belt__axial_rigidity=draw(of_size(3e3, 1e5)),
        mechanism__belt__pretension=draw(of_size(30.0, 500.0)),
        effects__contact__c2=draw(of_size(1e5, 1e6)),
        effects__contact__damping=draw(of_size(1.0, 50.0)),
        effects__belt_friction__mu_k=mu_k,
        effects__belt_friction__mu_s=mu_k,
        effects__axial_damping__coefficient=draw(of_size(0.1, 20.0)),
        effects__bending__rigidity=draw(of_size(1e-3, 0.05)),
        drive__driver__torque={"time": [0.0, 0.005], "value": [0.0, draw(st.floats(-20.0, 20.0))]},
        solver__duration=DURATION,
        solver__rtol=1e-4,
        solver__max_steps=20_000,
    )
    driver, driven = data["mechanism"]["pulleys"]
    driver["radius"], driven["radius"] = radius, draw(st.floats(0.05, 0.12))
    driven["center"] = [apart, draw(st.floats(-0.1, 0.1))]
    return data


def simulated(data: Scenario, backend: str) -> fs.Result | None:
    """Run a belt; None if its parameters are invalid."""
    try:
        scenario = fs.load({**data, "solver": {**data["solver"], "backend": backend}})
    except fs.ScenarioError:
        return None
    return fs.solve(scenario)


@by_both
@examples(5)
@given(data=belts())
def test_random_belts_obey_the_friction_law_and_pass_the_audit(
    backend: str, data: Scenario
) -> None:
    result = simulated(data, backend)
    assume(result is not None and result.failure != "budget_exceeded")
    assert result is not None
    done = result.record
    assert (done.status, done.failure) in {("done", ""), ("failed", "belt_off_pulleys")}
    assert all(np.isfinite(channel).all() for channel in done.channels.values())
    is_slack = any("goes slack" in warning for warning in done.warnings)
    if done.status == "done" and not is_slack:  # whose checks may fail
        assert {name for name, check in done.checks.items() if not check.ok} == set()
    size, normal = np.abs(done.channels["friction_force"]), done.channels["normal_force"]
    mu = data["effects"]["belt_friction"]["mu_s"]
    # ... to rounding of forces and impulses.
    assert (size <= mu * normal * (1.0 + 1e-9) + 1e-9).all()
