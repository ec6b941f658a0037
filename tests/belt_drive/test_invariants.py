"""What holds for any belt: limits of friction, rest, mirror images.

Audits, resuming and mirror images by steps of a fixed length are in `tests/test_every_case.py`.
"""

import numpy as np
import pytest

from frictionsim.results import Record
from tests.support.belt_scenarios import pair, trio
from tests.support.cases import one_in
from tests.support.mirrors import OF_BELT
from tests.support.scenarios import Scenario, changed, simulate

BACKENDS = ["rkf45", "moreau"]


def on(backend: str, data: Scenario, **changes: object) -> Record:
    done = simulate(changed(data, solver__backend=backend, **changes))
    assert done.status == "done", done.reason
    return done


# The torque comes on in many periods of the swing, 0.012 s; bending is what stills the spans.
STICKING_BODY = pair(
    drive__driver={"torque": {"smooth_step": {"from": 0.0, "to": -8.0, "start": 0.0, "stop": 0.3}}},
    drive__driven={"speed": 0.0},
    effects__axial_damping__coefficient=15.0,
    effects__contact__damping=100.0,
    effects__bending__damping=1e-4,
    solver__duration=2.0,
    output__interval=2e-3,
)


@pytest.mark.parametrize("backend", one_in(2, BACKENDS))
def test_what_friction_holds_does_not_creep(backend: str) -> None:
    """8 N m of the 23 N m at which the driver would slip: it swings, comes to rest and stays."""
    done = on(backend, STICKING_BODY)
    late = done.time > 1.8
    angle = done.channels["pulley_angle"][late, 0]
    # What is left of the swing after 1.5 s; a regularised law would creep on by a part of its
    # transition speed: by 1e-6 m/s, for 0.2 s, over the radius, that is 2.5e-6 rad.
    assert np.ptp(angle) <= 1e-8
    assert abs(angle[-1]) > 1e-2
    sticking, pulley = done.channels["sticking"][late], done.channels["pulley_index"][late]
    assert np.array_equal(sticking == 1.0, pulley >= 0.0)
    # Roundings of the speed of a rim that swings with 1e-7 m/s, and of the sine of its angle.
    assert np.max(np.abs(done.channels["slip_velocity"][late])) <= 1e-15
    # What the torque pulls with is what friction passes on.
    friction = done.channels["friction_force"][-1] * (pulley[-1] == 0.0)
    assert np.sum(friction) * 0.08 == pytest.approx(-8.0, rel=1e-6)


@pytest.mark.parametrize("backend", BACKENDS)
def test_friction_keeps_its_limit_and_stick_has_no_slip(backend: str) -> None:
    """In midpoint steps slip is rounding; else bodies are caught in a capture time of 1e-5 s."""
    done = on(backend, pair())
    stuck, limit = done.channels["sticking"] == 1.0, 0.6 * done.channels["normal_force"]
    assert np.all(np.abs(done.channels["friction_force"]) <= limit * (1.0 + 1e-12))
    assert 0.0 < np.mean(stuck[done.channels["pulley_index"] >= 0]) < 1.0
    slip = np.abs(done.channels["slip_velocity"])
    rim = 0.08 * np.max(np.abs(done.channels["pulley_speed"]))
    assert rim > 0.5
    if backend == "moreau":
        assert np.max(slip[stuck]) <= 1e-14 * rim
        return
    assert np.median(slip[stuck]) <= 1e-8 * rim
    # Losing its slip in tau takes m s/tau, which is below the limit on both sides of what it needs.
    caught = 2.0 * limit * 1e-5 / (0.5 * 1.0 / 24)
    assert np.all(slip[stuck] <= caught[stuck])


def test_a_mirror_image_moves_as_a_mirror_image_by_steps_of_chosen_length() -> None:
    data = trio(solver__duration=0.01)
    here, there = on("rkf45", data), on("rkf45", OF_BELT.scenario(data))
    for name, expected in OF_BELT.image(here.channels).items():
        # The rest positions are found to 1e-9 of a tension; where bodies come to stick a step of a
        # chosen length amplifies that to the size of its tolerance, 1e-4 of a velocity, which is
        # some parts in a thousand of the slip.
        off = np.max(np.abs(there.channels[name] - expected))
        assert off <= 5e-3 * np.max(np.abs(expected)), name


DAMPERS = {
    "axial": {"effects__axial_damping__coefficient": 2000.0},
    "contact": {"effects__contact__damping": 400.0},
    "bending": {"effects__bending__damping": 1e-3},
}


@pytest.mark.parametrize("name", DAMPERS)
@pytest.mark.parametrize("backend", BACKENDS)
def test_the_default_step_bears_stiff_dampers(name: str, backend: str) -> None:
    done = simulate(pair(solver__backend=backend, **DAMPERS[name]))
    assert done.status == "done"
    assert done.checks["energy_balance"].ok
