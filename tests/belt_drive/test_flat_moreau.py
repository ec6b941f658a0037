"""Midpoint steps on flat rows, against those of bodies and contacts in lists."""

from typing import Any

import numpy as np
import pytest

from frictionsim.mechanisms.belt_drive import belt as rows
from frictionsim.mechanisms.belt_drive.flat_moreau import UNSETTLED, MoreauStepper
from frictionsim.mechanisms.belt_drive.limits import deepest_contact_stiffness, max_frequency
from tests.support.belt_kernels import BeltModel, assemble, kinematics_of
from tests.support.belt_scenarios import (
    NO_MOTION_ACROSS,
    Array,
    every_effect,
    pair,
    scenario_of,
    stepped,
)
from tests.support.scenarios import Scenario

STIFF = {"coefficient": 2000.0}
FIXED: dict[str, Any] = {"solver__backend": "moreau", "solver__duration": 6e-3}
CASES = {
    "plane": pair(**FIXED),
    "every effect": every_effect(**FIXED),
    "stiff dampers": pair(effects__axial_damping=STIFF, **FIXED),
    "line": pair(mechanism__belt__bodies=61, **NO_MOTION_ACROSS, **FIXED),
    "stiff dampers on a line": pair(effects__axial_damping=STIFF, **NO_MOTION_ACROSS, **FIXED),
}


def flat_stepper(data: Scenario) -> tuple[rows.Belt, MoreauStepper, BeltModel]:
    """Return a belt at rest and its stepper."""
    scenario = scenario_of(data)
    model = assemble(scenario)
    rest = model.equilibrium
    belt = rows.belt_of(scenario, rest.body_length)
    state = rows.initial_state(belt, rest.x, rest.y, rest.angle)
    frequency, stiffness = max_frequency(belt, rest), deepest_contact_stiffness(belt, rest)
    return belt, MoreauStepper(belt, state, rest, scenario.solver, frequency, stiffness), model


def flatly(data: Scenario) -> tuple[rows.Belt, MoreauStepper, Array]:
    """Step to the end of the duration; return the state as well."""
    belt, stepper, _ = flat_stepper(data)
    stepper.start()
    end = data["solver"]["duration"]
    while stepper.t < end * (1.0 - 1e-12):
        stepper.advance(end, np.inf, 1_000_000)
    return belt, stepper, stepper.interpolate(end)


@pytest.mark.parametrize("name", CASES)
def test_steps_are_those_of_lists(name: str) -> None:
    old = stepped(CASES[name])
    belt, stepper, state = flatly(CASES[name])
    layout = old.model.system.layout
    assert stepper.statistics == old.stepper.statistics
    assert stepper.arrays()["counts"][UNSETTLED] == 0
    new_motion, old_motion = belt.kinematics(state), kinematics_of(old.state, layout)
    off = np.abs(new_motion - old_motion)[:, : belt.n].max(axis=1)
    assert off == pytest.approx(0.0, abs=1e-8 * np.abs(old_motion).max())
    # Tensions of stiff dampers on a line are known to 1e-8.
    rest = slice(layout.angles, layout.end)
    assert state[rest] == pytest.approx(old.state[rest], rel=1e-7, abs=1e-12)


@pytest.mark.parametrize("name", ["every effect", "stiff dampers", "stiff dampers on a line"])
def test_a_copy_goes_on_to_the_same_bits(name: str) -> None:
    whole, half, rest = (flat_stepper(CASES[name])[1] for _ in range(3))
    whole.start()
    whole.advance(1.0, 1.0, 50)
    half.start()
    half.advance(1.0, 1.0, 23)
    for key, array in half.arrays().items():
        rest.arrays()[key][...] = array
    rest.compile()
    rest.advance(1.0, 1.0, 27)
    for key, array in rest.arrays().items():
        assert np.array_equal(array, whole.arrays()[key]), key
