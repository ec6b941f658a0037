"""Damping of the section, stiffer than the waves: solved for together with friction."""

from itertools import pairwise

import numpy as np
import pytest

from tests.support.belt_scenarios import (
    GENTLY,
    MUCH_FRICTION,
    NO_FRICTION,
    RISING,
    SHORT,
    Stepped,
    distance,
    halved,
    kick,
    orders,
    pair,
    shipped,
    stepped,
)
from tests.support.scenarios import Scenario, simulate

# b/l a joint is 480 N s/m: 4 b/m decays in 1e-5 s, in a tenth of the period of a wave.
SECTION = {"coefficient": 20.0, "basis": "section"}


def solves_for_dampers(end: Stepped) -> bool:
    return "impulse" in end.stepper.arrays()


def damped(**changes: object) -> Scenario:
    return pair(effects__axial_damping=SECTION, **changes)


SMOOTH = {
    "without friction": (damped(effects__belt_friction=NO_FRICTION), kick(GENTLY)),
    "sticking": (damped(effects__belt_friction=MUCH_FRICTION, drive__driver__torque=RISING), None),
}


@pytest.mark.parametrize("name", SMOOTH)
def test_the_implicit_solution_is_of_second_order(name: str) -> None:
    data, disturb = SMOOTH[name]
    data = {**data, "solver": {"backend": "moreau", "duration": SHORT}}
    steps = halved(6.4e-5, 4)
    ends = [stepped({**data, "solver": {**data["solver"], "step": h}}, disturb) for h in steps]
    assert all(solves_for_dampers(end) for end in ends)
    errors = [distance(*two) for two in pairwise(ends)]
    # The longest step is where the waves are hardly resolved.
    assert [np.log2(a / b) for a, b in pairwise(errors)] == pytest.approx([2.0, 2.0], abs=0.35)
    exact = stepped({**data, "solver": {"duration": SHORT, "rtol": 1e-8}}, disturb)
    # A third of the last difference is left of an error of second order.
    assert distance(ends[-1], exact) == pytest.approx(errors[-1] / 3.0, rel=0.1)


def test_through_switches_it_is_of_first_order_at_least() -> None:
    data = {**damped(), "solver": {"backend": "moreau", "duration": SHORT}}
    slopes = orders(data, halved(6.4e-5, 4), "step", kick(0.2))
    assert np.mean(slopes) >= 0.9


def published(backend: str) -> Scenario:
    """Return the drive with damping of the section, of which explicit steps would decay by 40."""
    return shipped(
        "belt_drive",
        effects__axial_damping__basis="section",
        solver={"backend": backend, "duration": 0.01, "rtol": 1e-4},
        output={"interval": 5e-3},
    )


def test_the_tension_has_the_share_of_implicit_dampers() -> None:
    runs = (simulate(published(backend)) for backend in ("moreau", "rkf45"))
    # The belt is being stretched: its springs have 565.6 N of 565.7 N. The two are 1e-5 apart.
    tensions, expected = (done.channels["tension"][-1, :6] for done in runs)
    assert tensions == pytest.approx(expected, rel=2e-5)


def test_it_is_stable_at_the_default_step_and_its_energies_add_up() -> None:
    """With dampers a thousand times as stiff, for many steps."""
    done = simulate(
        damped(
            effects__axial_damping__coefficient=2e4, solver__backend="moreau", solver__duration=0.1
        )
    )
    assert done.status == "done"
    assert np.max(done.channels["tension"]) < 500.0
    assert np.max(np.abs(done.channels["pulley_speed"])) < 50.0
    assert done.checks["energy_balance"].ok


@pytest.mark.parametrize(
    # N s/m: 4 b h/m is some 150 and 800 of 150 bodies, 1500 of few
    ("bodies", "coefficient"),
    [(150, 1e4), (150, 6e4), (60, 1.2e5), (40, 1.2e5)],
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
