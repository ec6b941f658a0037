"""Dampers along the belt that are stiffer than its waves: solved for together with friction."""

from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np
import pytest

from tests.support.belt_kernels import BeltModel, assemble, stepper_of
from tests.support.belt_scenarios import (
    GENTLY,
    MUCH_FRICTION,
    NO_FRICTION,
    NO_MOTION_ACROSS,
    RISING,
    SHORT,
    Disturb,
    Stepped,
    changed_step,
    distance,
    halved,
    kick,
    orders,
    pair,
    scenario_of,
    shipped,
    stepped,
)
from tests.support.cases import slow
from tests.support.drawn_belts import drawn
from tests.support.scenarios import Scenario, changed, simulate, sound


def plane(**changes: Any) -> Scenario:
    """Return two pulleys and 24 bodies; 4 b/m decays in 1e-5 s, a tenth of the period of a wave."""
    section = {"coefficient": 20.0, "basis": "section"}
    solver = {"backend": "moreau", "duration": SHORT}
    return pair(**{"effects__axial_damping": section, "solver": solver, **changes})


def string(**changes: Any) -> Scenario:
    """Return 24 points; 4 b/m decays in 5e-6 s; waves alone allow steps of 3e-4 s."""
    section = {"coefficient": 40.0, "basis": "section"}
    solver = {"backend": "moreau", "duration": END}
    data = pair(**NO_MOTION_ACROSS)
    return changed(data, **{"effects__axial_damping": section, "solver": solver, **changes})


def wave(speed: float) -> Disturb:
    """Return a kick: point velocities along a wave as long as the belt, m/s."""

    def disturb(model: BeltModel) -> None:
        first, n = model.belt.width, model.belt.n
        model.state[first : first + n] += speed * np.sin(2.0 * np.pi * np.arange(n) / n)

    return disturb


def solves_for_dampers(end: Stepped) -> bool:
    return "impulse" in end.stepper.arrays()


class Smooth(NamedTuple):
    """A load in which nothing slides, or everything does from the start; its steps, halved."""

    data: Scenario
    disturb: Disturb | None = None
    longest: float = 1e-4  # s
    steps: int = 5
    # Of the last difference a third is left of an error of second order. On a line, measured, up to
    # once it: corners where points enter an arc, and the relaxation of the adaptive method.
    left: float = 3.0


END = 6.4e-3  # s
TURNING = {"smooth_step": {"from": 0.0, "to": -10.0, "start": 0.0, "stop": END}}
SLIDING = {"driver": {"torque": 60.0}, "driven": {"torque": -80.0}}
SMOOTH = {
    "plane, no friction": Smooth(
        plane(effects__belt_friction=NO_FRICTION), kick(GENTLY), 6.4e-5, 4, 0.37
    ),
    "plane, sticking": Smooth(
        plane(effects__belt_friction=MUCH_FRICTION, drive__driver__torque=RISING),
        None,
        6.4e-5,
        4,
        0.37,
    ),
    "line, no friction": Smooth(string(effects__belt_friction=NO_FRICTION, drive={}), wave(0.1)),
    "line, sticking": Smooth(
        string(effects__belt_friction=MUCH_FRICTION, drive__driver__torque=TURNING)
    ),
    "line, sliding": Smooth(
        string(effects__belt_friction={"mu_s": 0.2, "mu_k": 0.2}, drive=SLIDING)
    ),
}


@pytest.mark.parametrize("name", SMOOTH)
def test_it_is_of_second_order(name: str) -> None:
    data, disturb, longest, steps, left = SMOOTH[name]
    ends = [stepped(changed_step(data, "step", h), disturb) for h in halved(longest, steps)]
    assert all(map(solves_for_dampers, ends))
    errors = [distance(*two) for two in pairwise(ends)]
    # The longest step is where the waves are hardly resolved.
    found = [np.log2(a / b) for a, b in pairwise(errors)]
    close = 0.35 if name.startswith("plane") else 0.3
    assert found == pytest.approx([2.0] * (steps - 2), abs=close)
    adaptive = {"duration": data["solver"]["duration"], "rtol": 1e-8}
    exact = stepped({**data, "solver": adaptive}, disturb)
    assert distance(ends[-1], exact) < left * errors[-1]


def test_through_switches_it_is_of_first_order_at_least() -> None:
    assert np.mean(orders(plane(), halved(6.4e-5, 4), "step", kick(0.2))) >= 0.9


def test_through_switches_both_methods_agree() -> None:
    """At the default step, on drives of up to 7 pulleys that start to slide."""
    for seed in (0, 3):
        data = drawn(seed, effects__axial_damping__coefficient=400.0)
        ends = [
            stepped({**data, "solver": {"backend": backend, "duration": 0.02, "rtol": 1e-5}})
            for backend in ("rkf45", "moreau")
        ]
        assert solves_for_dampers(ends[1])
        # In sizes of the states; a step that straddles a switch is off by some thousandths.
        assert distance(*ends) < 2e-2


def test_the_tension_has_the_share_of_implicit_dampers() -> None:
    runs = (
        simulate(
            shipped(
                "belt_drive",
                effects__axial_damping__basis="section",
                solver={"backend": backend, "duration": 0.01, "rtol": 1e-4},
                output={"interval": 5e-3},
            )
        )
        for backend in ("moreau", "rkf45")
    )
    # The belt is being stretched: its springs have 565.6 N of 565.7 N. The two are 1e-5 apart.
    tensions, expected = (done.channels["tension"][-1, :6] for done in runs)
    assert tensions == pytest.approx(expected, rel=2e-5)


@pytest.mark.parametrize(
    # N s/m: 4 b h/m is some 150 and 800 of 150 bodies, 1500 of few
    ("bodies", "coefficient"),
    [(150, 1e4), (150, 6e4), (40, 1.2e5)],
)
def test_a_violent_overload_keeps_its_energy(bodies: int, coefficient: float) -> None:
    """Dampers that pull harder than the springs stiffen the joints across: steps heed that."""
    done = simulate(
        shipped(
            "belt_drive",
            mechanism__belt__bodies=bodies,
            drive__driver__torque={"time": [0.0, 2e-3], "value": [0.0, -30.0]},
            effects__belt_friction={"mu_s": 0.4, "mu_k": 0.4},
            effects__axial_damping__coefficient=coefficient,
            solver__duration=8e-3,
            output__interval=1e-4,
        )
    )
    # 1e-5 to 1e-4 measured, of the little energy that there is at first; with steps for the waves
    # alone it was 0.03 to 0.3, with 0.7 of the longest up to 0.17 at 40 bodies.
    assert done.checks["energy_balance"].value < 3e-4


# --- on a line ------------------------------------------------------------------------------------


def line(
    pulleys: list[tuple[float, float, float, float]], belt: dict[str, float], damping: float
) -> Scenario:
    """Return a guided belt round pulleys: x, y, radius, inertia; damping of the section, N s."""
    keys = ("center", "radius", "inertia")
    tables = [
        {"name": f"p{i}", **dict(zip(keys, ([x, y], *own), strict=True))}
        for i, (x, y, *own) in enumerate(pulleys)
    ]
    return {
        "kind": "belt_drive",
        "mechanism": {"belt": belt, "pulleys": tables},
        "effects": {"axial_damping": {"coefficient": damping, "basis": "section"}},
        "solver": {"backend": "moreau"},
    }


def stretchy(points: int) -> Scenario:
    """Return a drive of 0.1 m and 7600 N with a damper of the section of 1 N s."""
    belt = {"mass_per_length": 0.0087242, "axial_rigidity": 7600.0, "length": 1.1938052}
    data = line(
        [(0.0, 0.0, 0.1, 0.25), (0.3136, 0.0, 0.1, 0.25)], {"bodies": points, **belt}, damping=1.0
    )
    data["drive"] = {"p0": {"speed": 12.0}, "p1": {"torque": -25.0}}
    data["effects"]["belt_friction"] = {"mu_s": 0.5, "mu_k": 0.5}
    return data


@pytest.mark.parametrize("points", [60, 240])
def test_the_default_step_is_that_of_the_waves_alone(points: int) -> None:
    steps = []
    for damping in (None, {"coefficient": 1.0, "basis": "section"}):
        scenario = scenario_of(changed(stretchy(points), effects__axial_damping=damping))
        steps.append(1.0 / stepper_of(assemble(scenario), scenario).force_per_impulse)
    assert steps[1] == steps[0]


@pytest.mark.parametrize("coefficient", [0.2, slow(20.0), 1e6])
def test_it_is_stable_for_any_damping(coefficient: float) -> None:
    data = changed(stretchy(40), effects__axial_damping__coefficient=coefficient)
    # Energies add up to the second order of a step, of which there are 16 in a period of a wave.
    assert sound(changed(data, solver__duration=0.1)).checks["energy_balance"].value < 1e-5


@pytest.mark.parametrize("points", [6, 12])
def test_a_point_in_a_short_span_has_the_friction_of_the_pulley_that_it_is_on(points: int) -> None:
    """Points between the pulleys are candidates of both, and loaded by one of them at most."""
    data = string(mechanism__belt__bodies=points, effects__axial_damping__coefficient=200.0)
    data["mechanism"]["pulleys"][1]["center"] = [0.2, 0.0]
    exact = stepped({**data, "solver": {"backend": "rkf45", "duration": END, "rtol": 1e-7}})
    end = stepped(changed_step(data, "step", 1e-5))
    assert solves_for_dampers(end)
    # In sizes of the states: the step leaves 2e-7, the friction of the other pulley 0.05.
    assert distance(end, exact) < 1e-5


def test_a_pulley_that_is_lighter_than_a_body_follows_stiff_dampers() -> None:
    """A drive in overload whose rollers weigh 0.7 of a body; in whole default steps 39 % off."""
    pulleys = [
        (0.158, 0.0184, 0.0512, 3e-5),
        (-0.0943, 0.128, 0.038, 2.1e-6),
        (-0.105, -0.119, 0.045, 5.7e-6),
    ]
    belt = {"bodies": 50, "mass_per_length": 0.096, "axial_rigidity": 1.52e5, "pretension": 186.0}
    data = line(pulleys, belt, damping=7.65)
    data["drive"] = {
        "p0": {"torque": {"time": [0.0, 0.01], "value": [0.0, 9.64]}},
        "p1": {"torque": {"speed": [-60.0, 60.0], "value": [12.0, -12.0]}},
    }
    data["effects"]["belt_friction"] = {"mu_s": 0.69, "mu_k": 0.69}
    data["solver"]["duration"], data["output"] = 0.05, {"interval": 5e-4}
    default = sound(data)
    step = 0.05 / default.statistics.steps
    fine = sound(changed(data, solver__step=0.25 * step))
    speeds, expected = (run.channels["pulley_speed"][-1] for run in (default, fine))
    # 2e-4 measured with a quarter of the step that the waves allow.
    assert speeds == pytest.approx(expected, rel=2e-3)
