"""The warning of a torque that friction cannot balance, against the capstan equation."""

from math import asin, exp, pi
from typing import Any

import pytest

import frictionsim as fs

DISTANCE = 0.515  # m, between the axes of the shipped drive
TORQUE = "drive.driver.torque"


def overloads(overrides: dict[str, Any]) -> list[str]:
    warnings = fs.load("belt_drive", overrides).warnings()
    return [warning for warning in warnings if "no load keeps the speed steady" in warning]


def limit_of(tension: float, radius: float, other: float, mu: float) -> float:
    """Return the torque, N m, at which T1/T2 = e^(mu phi) with (T1 + T2)/2 the pretension."""
    ratio = exp(mu * (pi + 2.0 * asin((radius - other) / DISTANCE)))
    return 2.0 * radius * tension * (ratio - 1.0) / (ratio + 1.0)


@pytest.mark.parametrize("share", [-1.0 - 1e-9, -1.0 + 1e-9, 0.2, 5.0])
@pytest.mark.parametrize(
    ("tension", "radii", "mu"), [(50.0, (0.02, 0.06), 1.0), (1000.0, (0.05, 0.03), 0.05)]
)
def test_a_torque_is_told_from_the_capstan_limit_on(
    tension: float, radii: tuple[float, float], mu: float, share: float
) -> None:
    scenario = {
        "mechanism.belt.pretension": tension,
        "mechanism.pulleys.driver.radius": radii[0],
        "mechanism.pulleys.driven.radius": radii[1],
        "effects.belt_friction.mu_k": 0.05,
        "effects.belt_friction.mu_s": mu,
        TORQUE: share * limit_of(tension, *radii, mu),
    }
    assert len(overloads(scenario)) == (abs(share) > 1.0)


@pytest.mark.parametrize(
    ("torque", "is_told"),
    [
        ({"time": [0.0, 0.1], "value": [0.0, 60.0]}, True),
        ([{"time": [0.0, 0.1], "value": [0.0, 30.0]}, 30.0], True),
        ([{"time": [0.0, 0.1], "value": [0.0, 30.0]}, -30.0], False),
        ({"smooth_step": {"from": 60.0, "to": 0.0, "start": 0.0, "stop": 0.1}}, False),
        ({"time": [0.0, 100.0], "value": [60.0, 60.0]}, True),
        ({"time": [0.0, 100.0], "value": [60.0, 61.0]}, False),  # it changes up to the end
        ({"sine": {"mean": 60.0, "amplitude": 1.0, "frequency_hz": 1.0}}, False),
        ({"speed": [-1.0, 1.0], "value": [60.0, 60.0]}, False),
    ],
)
def test_only_a_torque_that_stays_is_told(torque: Any, is_told: bool) -> None:
    assert len(overloads({TORQUE: torque})) == is_told


def test_the_limit_is_that_of_static_whose_length_gives_the_pretension() -> None:
    rest = fs.static("belt_drive")
    length = {
        "mechanism.belt.pretension": None,
        "mechanism.belt.length": rest["path_length"].value / (1.0 + 555.0 / 1.52e5),
    }
    limit = rest["torque_limit_driver"].value
    assert overloads({**length, TORQUE: 0.999 * limit}) == []
    (warning,) = overloads({**length, TORQUE: 1.001 * limit})
    assert f"is beyond {limit:.4g} N m, what friction balances at a pretension of 555 N" in warning


def test_a_pulley_has_its_own_friction_and_a_load_is_told_too() -> None:
    own = {"effects.belt_friction.pulleys.driven": {"mu_s": 0.1, "mu_k": 0.1}}
    (warning,) = overloads({**own, TORQUE: 10.0, "drive.driven.torque": -10.0})
    assert warning.startswith("drive.driven.torque = -10 N m is beyond ")
    assert overloads({"effects.belt_friction": None, TORQUE: 60.0}) == []
