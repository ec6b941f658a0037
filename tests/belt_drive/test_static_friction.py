"""A body of a belt that is at rest on its pulley is held by the static coefficient."""

from typing import Any

import numpy as np
import pytest

from frictionsim.results import Record
from tests.support.belt_scenarios import shipped
from tests.support.cases import slow
from tests.support.scenarios import sound

by_both = pytest.mark.parametrize("backend", ["rkf45", "moreau"])
STEP, RAMP = -4.0, {"time": [0.0, 0.01], "value": [0.0, -4.0]}


def belt(backend: str, mu_k: float, **changes: Any) -> Record:
    """Run the shipped belt for 50 ms; its static friction could carry 27 N m at its start."""
    times = {"solver__duration": 0.05, "output__interval": 5e-4}
    settings = {"solver__backend": backend, "effects__belt_friction__mu_k": mu_k}
    return sound(shipped("belt_drive", **settings, **times | changes))


@pytest.mark.parametrize(
    ("mu_k", "torque", "backend"),
    [(0.0, STEP, "rkf45"), (1e-4, RAMP, "moreau"), slow(1e-4, RAMP, "rkf45")],
)
def test_a_belt_at_rest_holds_what_static_friction_can(
    mu_k: float, torque: Any, backend: str
) -> None:
    done, gripping = (belt(backend, mu, drive__driver__torque=torque) for mu in (mu_k, 1.0))
    # Where nothing slides the kinetic coefficient does not matter: what differs are the few bodies
    # that enter and leave an arc. Without any stick the driver came to -750 rad/s.
    speeds = (of.channels["pulley_speed"] for of in (done, gripping))
    assert np.max(np.abs(np.subtract(*speeds))) < 0.7
    touching = done.channels["pulley_index"] >= 0
    assert np.mean(done.channels["sticking"][touching]) > 0.9
    assert np.array_equal(done.channels["sticking"][0] == 1.0, touching[0])


@by_both
def test_a_pulley_that_turns_at_the_start_slides(backend: str) -> None:
    """Its speed jumps to 30 rad/s: the kinetic friction of 0.1 drags the belt."""
    drive = {"driver": {"speed": 30.0}, "driven": {"torque": 0.0}}
    done = belt(backend, 0.1, drive=drive, solver__duration=1e-4, output__interval=1e-5)
    on = done.channels["pulley_index"][1] == 0
    friction, normal = (done.channels[n][1][on] for n in ("friction_force", "normal_force"))
    assert np.all(done.channels["sticking"][1][on] == 0.0)
    assert friction == pytest.approx(0.1 * normal, rel=1e-9)
