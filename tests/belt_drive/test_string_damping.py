"""Dampers along a guided belt that are stiffer than its waves, in steps of a fixed length."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from tests.support.belt_kernels import BeltModel, assemble, stepper_of
from tests.support.belt_scenarios import (
    NO_MOTION_ACROSS,
    Disturb,
    changed_step,
    distance,
    halved,
    pair,
    scenario_of,
    stepped,
)
from tests.support.cases import slow
from tests.support.drawn_belts import drawn
from tests.support.scenarios import Scenario, changed, sound

END = 6.4e-3  # s
# b/l a joint is 960 N s/m: 4 b/m decays in 5e-6 s; waves alone allow steps of 3e-4 s.
SECTION = {"coefficient": 40.0, "basis": "section"}


def string(**changes: Any) -> Scenario:
    """Return two pulleys of 24 points with a damper that is far stiffer than the waves."""
    damped = {"effects__axial_damping": SECTION, "solver": {"backend": "moreau", "duration": END}}
    return pair(**NO_MOTION_ACROSS, **{**damped, **changes})


def wave(speed: float) -> Disturb:
    """Return a kick: point velocities along a wave as long as the belt, m/s."""

    def disturb(model: BeltModel) -> None:
        first, n = model.belt.width, model.belt.n
        model.state[first : first + n] += speed * np.sin(2.0 * np.pi * np.arange(n) / n)

    return disturb


def solves_for_dampers(stepper: Any) -> bool:
    return "impulse" in stepper.arrays()


# Loads that are smooth: nothing slides, or everything does from the start.
TURNING = {"smooth_step": {"from": 0.0, "to": -10.0, "start": 0.0, "stop": END}}
SMOOTH: dict[str, tuple[Scenario, Disturb | None]] = {
    "no friction": (string(effects__belt_friction={"mu_s": 0.0, "mu_k": 0.0}, drive={}), wave(0.1)),
    "sticking": (
        string(effects__belt_friction={"mu_s": 50.0, "mu_k": 50.0}, drive__driver__torque=TURNING),
        None,
    ),
    "sliding": (
        string(
            effects__belt_friction={"mu_s": 0.3, "mu_k": 0.3},
            drive={"driver": {"speed": 20.0}, "driven": {"speed": -20.0}},
        ),
        None,
    ),
    "sliding, free pulleys": (
        string(
            effects__belt_friction={"mu_s": 0.2, "mu_k": 0.2},
            drive={"driver": {"torque": 60.0}, "driven": {"torque": -80.0}},
        ),
        None,
    ),
}


@pytest.mark.parametrize("name", SMOOTH)
def test_it_is_of_second_order(name: str) -> None:
    data, disturb = SMOOTH[name]
    ends = [stepped(changed_step(data, "step", h), disturb) for h in halved(1e-4, 5)]
    assert all(solves_for_dampers(end.stepper) for end in ends)
    errors = [distance(*two) for two in pairwise(ends)]
    # Points that enter and leave an arc make the corners that the last digits are off by.
    assert [np.log2(a / b) for a, b in pairwise(errors)] == pytest.approx([2.0] * 3, abs=0.3)
    # A third of the last difference is left; the rest, measured up to once it, are corners, the
    # tolerance, and the relaxation time in which the adaptive method lets a slip end.
    exact = stepped(
        {**data, "solver": {"backend": "rkf45", "duration": END, "rtol": 1e-8}}, disturb
    )
    assert distance(ends[-1], exact) < 3.0 * errors[-1]


def test_through_switches_both_methods_agree() -> None:
    """At the default step, on drives of up to 7 pulleys that start to slide."""
    for seed in range(4):
        data = drawn(seed, effects__axial_damping__coefficient=400.0)
        ends = [
            stepped({**data, "solver": {"backend": backend, "duration": 0.02, "rtol": 1e-5}})
            for backend in ("rkf45", "moreau")
        ]
        assert solves_for_dampers(ends[1].stepper)
        # In sizes of the states; a step that straddles a switch is off by some thousandths.
        assert distance(*ends) < 2e-2


def stretchy(points: int) -> Scenario:
    """Return a drive of 0.1 m and 7600 N with a damper of the section of 1 N s."""
    belt = {"mass_per_length": 0.0087242, "axial_rigidity": 7600.0, "length": 1.1938052}
    pulleys = {
        name: {"name": name, "center": [x, 0.0], "radius": 0.1, "inertia": 0.25}
        for name, x in (("driver", 0.0), ("driven", 0.3136))
    }
    return {
        "kind": "belt_drive",
        "mechanism": {"belt": {"bodies": points, **belt}, "pulleys": list(pulleys.values())},
        "drive": {"driver": {"speed": 12.0}, "driven": {"torque": -25.0}},
        "effects": {
            "belt_friction": {"mu_s": 0.5, "mu_k": 0.5},
            "axial_damping": {"coefficient": 1.0, "basis": "section"},
        },
        "solver": {"backend": "moreau", "duration": 3.0},
    }


@pytest.mark.parametrize(("points", "most"), [(60, 200_000), (240, 700_000)])
def test_the_default_step_is_that_of_the_waves_alone(points: int, most: int) -> None:
    inverse_steps = []
    for damping in (None, {"coefficient": 1.0, "basis": "section"}):
        scenario = scenario_of(changed(stretchy(points), effects__axial_damping=damping))
        stepper = stepper_of(assemble(scenario), scenario)
        inverse_steps.append(stepper.force_per_impulse)  # one over the length of a step
    assert inverse_steps[1] == inverse_steps[0]
    assert 3.0 * inverse_steps[1] < most


@pytest.mark.parametrize("coefficient", [0.2, slow(20.0), slow(2e4), 1e6])
def test_it_is_stable_for_any_damping(coefficient: float) -> None:
    done = sound(
        changed(stretchy(40), effects__axial_damping__coefficient=coefficient, solver__duration=0.1)
    )
    # Energies add up to the second order of a step, of which there are 16 in a period of a wave.
    assert done.checks["energy_balance"].value < 1e-5


@pytest.mark.parametrize("points", [6, 8, 12])
def test_a_point_in_a_short_span_has_the_friction_of_the_pulley_that_it_is_on(points: int) -> None:
    """Points between the pulleys are candidates of both, and loaded by one of them at most."""
    data = string(
        mechanism__belt__bodies=points,
        mechanism__pulleys=[
            {"name": "driver", "center": [0.0, 0.0], "radius": 0.08, "inertia": 2e-3},
            {"name": "driven", "center": [0.2, 0.0], "radius": 0.08, "inertia": 2e-3},
        ],
        effects__axial_damping__coefficient=200.0,
    )
    exact = stepped({**data, "solver": {"backend": "rkf45", "duration": END, "rtol": 1e-7}})
    end = stepped(changed_step(data, "step", 1e-5))
    assert solves_for_dampers(end.stepper)
    # In sizes of the states: the step leaves 2e-7, the friction of the other pulley 0.05.
    assert distance(end, exact) < 1e-5


def test_a_pulley_that_is_lighter_than_a_body_follows_stiff_dampers() -> None:
    """A drive in overload whose rollers weigh 0.7 of a body; in whole default steps 39 % off."""
    places = [
        (0.158, 0.0184, 0.0512, 3e-5),
        (-0.0943, 0.128, 0.038, 2.1e-6),
        (-0.105, -0.119, 0.045, 5.7e-6),
    ]
    rolls = [
        {"name": f"p{i}", "center": [x, y], "radius": radius, "inertia": inertia}
        for i, (x, y, radius, inertia) in enumerate(places)
    ]
    data = {
        "kind": "belt_drive",
        "mechanism": {
            "belt": {
                "bodies": 50,
                "mass_per_length": 0.096,
                "axial_rigidity": 1.52e5,
                "pretension": 186.0,
            },
            "pulleys": rolls,
        },
        "drive": {
            "p0": {"torque": {"time": [0.0, 0.01], "value": [0.0, 9.64]}},
            "p1": {"torque": {"speed": [-60.0, 60.0], "value": [12.0, -12.0]}},
        },
        "effects": {
            "belt_friction": {"mu_s": 0.69, "mu_k": 0.69},
            "axial_damping": {"coefficient": 7.65, "basis": "section"},
        },
        "solver": {"backend": "moreau", "duration": 0.05},
        "output": {"interval": 5e-4},
    }
    default = sound(data)
    step = 0.05 / default.statistics.steps
    fine = sound(changed(data, solver__step=0.25 * step))
    speeds, expected = (run.channels["pulley_speed"][-1] for run in (default, fine))
    # 2e-4 measured with a quarter of the step that the waves allow.
    assert speeds == pytest.approx(expected, rel=2e-3)
