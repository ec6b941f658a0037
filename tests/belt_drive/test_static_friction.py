"""A body of a belt that is at rest on its pulley is held by the static coefficient."""

from functools import cache

import numpy as np
import pytest

from frictionsim.results import Record
from frictionsim.scenario.loading import load
from frictionsim.simulation.simulate import run
from tests.support.scenarios import SCENARIOS

by_both = pytest.mark.parametrize("backend", ["rkf45", "moreau"])
STEP, RAMP = "-4.0", "{time = [0.0, 0.01], value = [0.0, -4.0]}"


@cache
def belt(backend: str, torque: str, mu_k: float, *overrides: str) -> Record:
    """Run the shipped belt for 50 ms; its static friction could carry 27 N m at its start."""
    scenario = load(
        SCENARIOS / "belt_drive.toml",
        [
            f"drive.driver.torque={torque}",
            f"effects.belt_friction.mu_k={mu_k}",
            "solver.duration=0.05",
            "output.interval=5e-4",
            *overrides,
        ],
        backend,
    )
    done = run(scenario, lambda t: None)
    assert (done.status, done.reason) == ("done", "")
    assert {name: check for name, check in done.checks.items() if not check.ok} == {}
    return done


@by_both
@pytest.mark.parametrize("torque", [STEP, RAMP], ids=["step", "ramp"])
@pytest.mark.parametrize("mu_k", [0.0, 1e-4])
def test_a_belt_at_rest_holds_what_static_friction_can(
    mu_k: float, torque: str, backend: str
) -> None:
    done, gripping = (belt(backend, torque, mu) for mu in (mu_k, 1.0))
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
    done = belt(
        backend,
        "0.0",
        0.1,
        "drive.driver={speed=30.0}",
        "drive.driven={torque=0.0}",
        "solver.duration=1e-4",
        "output.interval=1e-5",
    )
    on = done.channels["pulley_index"][1] == 0
    friction, normal = (done.channels[n][1][on] for n in ("friction_force", "normal_force"))
    assert np.all(done.channels["sticking"][1][on] == 0.0)
    assert friction == pytest.approx(0.1 * normal, rel=1e-9)
