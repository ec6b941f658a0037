"""A body at rest whose torques cancel is in balance; one without any has no torque."""

from typing import Any

import pytest

import frictionsim as fs

BALANCED, NONE = "nothing moves: the applied torques are in balance", "no torque is applied"
FRICTION = {"shaft_radius": 0.02, "mu_s": 0.3, "mu_k": 0.2}


def force(name: str, x: float, size: Any = 50.0, down: float = -1.0) -> dict[str, Any]:
    return {"name": name, "size": size, "point": [x, 0.0], "direction": [0.0, down]}


def shaft(**tables: Any) -> dict[str, Any]:
    mechanism = {"inertia": 0.1}
    effects = {"shaft_friction": FRICTION, **tables.pop("effects", {})}
    return {"kind": "shaft", "mechanism": mechanism, "effects": effects, **tables} | {
        "solver": {"duration": 0.5}
    }


BALANCES = {
    "weights on a cord": ("pulley", {"drive.force": 2224.1}),
    "another load": ("pulley", {"drive.force": 450.0, "mechanism.load": 450.0}),
    "horizontal": ("pulley_horizontal", {"drive.force": 2224.1, "mechanism.load": 2224.1}),
    "lever": (shaft(forces=[force("left", -0.2), force("right", 0.2)]), {}),
    "over time": (
        shaft(
            forces=[
                force("left", -0.2, {"time": [0.0, 1.0], "value": [0.0, 80.0]}),
                force("right", 0.2, {"time": [0.0, 1.0], "value": [0.0, 80.0]}),
            ]
        ),
        {},
    ),
    "couples": (
        shaft(couples=[{"name": "a", "size": 3.0}, {"name": "b", "size": -3.0}]),
        {},
    ),
}
WITHOUT = {
    "no load": (shaft(forces=[force("none", 0.2, 0.0)]), {}),
    "through the axis": (shaft(forces=[force("clamp", 0.0)]), {}),
    "weight on the axis": (
        shaft(effects={"gravity": {}}) | {"mechanism": {"inertia": 0.1, "mass": 3.0}},
        {},
    ),
}


@pytest.mark.parametrize("name", list(BALANCES))
def test_torques_that_cancel_are_in_balance(name: str) -> None:
    source, overrides = BALANCES[name]
    *_, warning = fs.solve(source, overrides).warnings  # couples do not press the shaft
    assert warning.startswith(BALANCED)


@pytest.mark.parametrize("name", list(WITHOUT))
def test_without_a_torque_none_is_applied(name: str) -> None:
    source, overrides = WITHOUT[name]
    assert any(warning.endswith(NONE) for warning in fs.solve(source, overrides).warnings)
