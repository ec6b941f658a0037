"""Tables over speed and angle whose features are narrower than a step, against closed forms."""

from math import hypot, log, pi, radians, sqrt
from typing import Any

import pytest

from frictionsim.results import failures
from tests.support.scenarios import Scenario, simulate

WIDTHS = [0.4, 0.1, 1e-2, 1e-3, 1e-4, 1e-6]
SPEED, DRIVE, DEPTH = 5.0, 10.0, 9.0


def body(size: Any, backend: str, rtol: float, **effects: Any) -> Scenario:
    return {
        "kind": "shaft",
        "mechanism": {"inertia": 1.0, "mass": 10.0},
        "couples": [{"name": "drive", "size": DRIVE}, {"name": "notch", "size": size}],
        "effects": {"gravity": {}, **effects},
        "solver": {"backend": backend, "duration": 1.0, "rtol": rtol},
    }


@pytest.mark.parametrize("backend", ["events", "rkf45"])
@pytest.mark.parametrize("rtol", [1e-6, 1e-11])
@pytest.mark.parametrize("mu_k", [None, 0.2])
@pytest.mark.parametrize("width", WIDTHS)
def test_a_narrow_notch_over_the_speed_is_not_passed_over(
    width: float, mu_k: float | None, rtol: float, backend: str
) -> None:
    """A - 9 N m at 5 rad/s, A far from it: the passage of both flanks takes 2 d ln(A/(A - 9))/9."""
    size = {"speed": [SPEED - width, SPEED, SPEED + width], "value": [0.0, -DEPTH, 0.0]}
    torque, effects = DRIVE, {}
    if mu_k is not None:
        effects["shaft_friction"] = {"shaft_radius": 0.02, "mu_s": 0.25, "mu_k": mu_k}
        torque -= 0.02 * mu_k / hypot(1.0, mu_k) * 98.1
    run = simulate(body(size, backend, rtol, **effects))
    assert failures(run.checks) == ""
    passed = (SPEED - width) / torque + 2.0 * width * log(torque / (torque - DEPTH)) / DEPTH
    found = run.quantities["final_angular_velocity"].value
    # Each flank has an error of some tolerances of a speed of 5 rad/s.
    exact = SPEED + width + torque * (1.0 - passed)
    assert found == pytest.approx(exact, abs=1e3 * rtol * SPEED + 1e-13)


@pytest.mark.parametrize("backend", ["events", "rkf45"])
@pytest.mark.parametrize("rtol", [1e-6, 1e-11])
@pytest.mark.parametrize("width", [40.0, 1.0, 0.1, 1e-3])
def test_a_narrow_detent_over_the_angle_is_not_passed_over(
    width: float, rtol: float, backend: str
) -> None:
    """It takes the energy of its triangle, and the way of the drive is that of the angle."""
    depth = min(500.0, 0.8 * DRIVE * (90.0 - width) / width)  # the body passes it
    size = {"angle_deg": [90.0 - width, 90.0, 90.0 + width], "value": [0.0, -depth, 0.0]}
    data = body(size, backend, rtol)
    data["solver"]["duration"] = 1.5 * sqrt(2.0 * pi / DRIVE)
    run = simulate(data)
    assert failures(run.checks) == ""
    angle, speed = (float(run.channels[name][-1]) for name in ("angle", "angular_velocity"))
    assert angle > radians(90.0 + width)
    energy = DRIVE * angle - depth * radians(width)
    assert 0.5 * speed**2 == pytest.approx(energy, rel=1e3 * rtol + 1e-13)
