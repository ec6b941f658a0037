"""Kernels as plain Python: the same numbers as compiled."""

from typing import Any

import numpy as np
import pytest

from tests.support.belt_kernels import assemble, stepper_of
from tests.support.belt_scenarios import COMPILED, STEPS, scenario_of
from tests.support.scenarios import Scenario


def ends(data: Scenario) -> dict[str, Any]:
    """Return all that the next step depends on after a few steps from a start with some motion."""
    scenario = scenario_of(data)
    model = assemble(scenario)
    width, n = model.belt.width, model.belt.n
    model.state[3 * width : 3 * width + n] = 0.05 * np.sin(np.arange(n))
    stepper = stepper_of(model, scenario)
    stepper.start()
    stepper.advance(1.0, 1.0, STEPS)
    inside = stepper.interpolate(0.3 * stepper.t)
    arrays = {name: np.array(array) for name, array in stepper.arrays().items()}
    return {**arrays, "inside": inside, "work": list(stepper.statistics)}


@pytest.mark.parametrize("name", COMPILED)
def test_compiled_as_plain(name: str, request: pytest.FixtureRequest) -> None:
    compiled = ends(COMPILED[name])
    request.getfixturevalue("uncompiled")
    plain = ends(COMPILED[name])
    assert compiled.keys() == plain.keys()
    assert compiled["work"] == plain["work"]
    # A rounding may decide on a further pass of dampers, which changes nothing else.
    for key in compiled.keys() - {"work", "counts"}:
        array, expected = compiled[key], plain[key]
        # Compiled sums are reordered: rounding of positions, 1e-16 m, which the stiffness of a
        # joint over the mass of a body, 1e8/s^2, and an exact stick, 1e5/s, make much of: 2e-8. The
        # estimate of the error, in the clock, is a difference and shows more of it.
        close = 1e-6 if key == "clock" else 1e-7
        size = np.max(np.abs(expected), axis=-1, keepdims=True, initial=1e-300)
        assert np.all(np.abs(array - expected) <= close * size), key
