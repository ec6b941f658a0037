"""What nothing moves, and friction that never acts, are told by `check` as by a run."""

import json
import random
from collections.abc import Callable
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


# Each with the torque of one side, N m.
BALANCES: dict[str, tuple[Any, dict[str, Any], float]] = {
    "weights on a cord": ("pulley", {"drive.force": 2224.1}, 2224.1 * 0.0508),
    "another load": ("pulley", {"drive.force": 450.0, "mechanism.load": 450.0}, 450.0 * 0.0508),
    "horizontal": (
        "pulley_horizontal",
        {"drive.force": 2224.1, "mechanism.load": 2224.1},
        2224.1 * 0.0508,
    ),
    "lever": (shaft(forces=[force("left", -0.2), force("right", 0.2)]), {}, 50.0 * 0.2),
    "over time": (
        shaft(
            forces=[
                force("left", -0.2, {"time": [0.0, 1.0], "value": [0.0, 80.0]}),
                force("right", 0.2, {"time": [0.0, 1.0], "value": [0.0, 80.0]}),
            ]
        ),
        {},
        40.0 * 0.2,  # at the end
    ),
    "couples": (
        shaft(couples=[{"name": "a", "size": 3.0}, {"name": "b", "size": -3.0}]),
        {},
        3.0,
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


PULLEY_MU = {"effects.shaft_friction.mu_s": 0.0, "effects.shaft_friction.mu_k": 0.0}
UNPRESSED: dict[str, tuple[Any, dict[str, Any]]] = {
    "coefficients of zero": ("pulley", PULLEY_MU),
    "nothing hangs": (
        "pulley",
        {"drive": {"torque": 3.0}, "mechanism.load": 0.0},
    ),
    "couples alone": (shaft(couples=[{"name": "motor", "size": 3.0}]), {}),
    "mass without gravity": (
        shaft(couples=[{"name": "a", "size": 3.0}]) | {"mechanism": {"inertia": 0.1, "mass": 40.0}},
        {},
    ),
    "gear": ("marble_machine", PULLEY_MU),
}


@pytest.fixture
def checked(told: Callable[..., tuple[str, str]]) -> Callable[..., list[str]]:
    """Return the warnings of `check`, which are those of a run."""

    def warnings(source: Any, overrides: dict[str, Any]) -> list[str]:
        scenario = fs.load(source, overrides)
        with open("case.toml", "w") as file:
            file.write(scenario.to_toml())
        (report,) = json.loads(told("check", "case.toml", "--json")[0])["scenarios"]
        found: list[str] = report["warnings"]
        assert set(found) == set(fs.solve(scenario).warnings)
        return found

    return warnings


@pytest.mark.parametrize("name", list(BALANCES))
def test_torques_that_cancel_are_in_balance(name: str, checked: Callable[..., list[str]]) -> None:
    source, overrides, torque = BALANCES[name]
    warning = checked(source, overrides)[-1]  # couples do not press the shaft
    half = f"{torque:.4g} N m"
    assert warning == f"{BALANCED}, {half} against {half}: their sum is zero"


@pytest.mark.parametrize("name", list(WITHOUT))
def test_without_a_torque_none_is_applied(name: str, checked: Callable[..., list[str]]) -> None:
    assert any(warning.endswith(NONE) for warning in checked(*WITHOUT[name]))


@pytest.mark.parametrize("name", list(UNPRESSED))
def test_friction_that_is_zero_throughout_is_told(
    name: str, checked: Callable[..., list[str]]
) -> None:
    *_, warning = checked(*UNPRESSED[name])
    assert warning.startswith("effects.shaft_friction has no effect, zero throughout")


def test_two_frictions_that_are_zero_have_no_effect(checked: Callable[..., list[str]]) -> None:
    couple = {"torque_static": 0.0, "torque_kinetic": 0.0}
    effects = {"hinge_friction": couple, "rolling_friction": {"arm": 0.0}}
    (warning,) = [w for w in checked("epicyclic", {"effects": effects}) if "no effect" in w]
    both = "effects.hinge_friction and effects.rolling_friction have no effect, zero throughout"
    assert warning.startswith(both)


def test_friction_that_acts_at_some_angle_time_or_speed_has_an_effect() -> None:
    mass = {"mass": 0.5, "radius": 0.1}
    spun = shaft(effects={"eccentric_mass": mass}) | {
        "mechanism": {"inertia": 0.1, "initial_angular_velocity": 3.0}
    }
    pulse = {"time": [0.1, 0.2, 0.3], "value": [0.0, 50.0, 0.0]}
    rolling = {"effects": {"gravity": {}, "rolling_friction": {"arm": 1e-4}}}
    for source, overrides in (
        (spun, {}),
        (shaft(forces=[force("pulse", 0.2, pulse)]), {}),
        ("epicyclic", {**rolling, "mechanism.initial_angle_deg": 0.0, "solver.duration": 0.5}),
    ):
        assert not any("no effect" in text for text in fs.solve(source, overrides).warnings)


def test_drawn_bodies_are_at_rest_if_and_only_if_nothing_is_said_to_move() -> None:
    """Two forces of which one changes, near the limit: it may give way at any time, or never."""
    moved = 0
    for seed in range(16):
        rng = random.Random(seed)
        swing = {"mean": 30.0, "amplitude": rng.uniform(0.0, 12.0), "frequency_hz": 3.0}
        forces = [force("left", -0.1, {"sine": swing}), force("right", 0.1, rng.uniform(25, 35))]
        data = shaft(forces=forces, effects={"shaft_friction": {**FRICTION, "mu_s": 0.5}})
        data["solver"] = {"duration": rng.uniform(0.1, 0.3), "rtol": 1e-6, "atol": 1e-9}
        result = fs.solve(data)
        rests = not result.dataset["angular_velocity"].any()
        assert any("nothing moves" in text for text in result.warnings) is bool(rests)
        moved += not rests
    assert 2 < moved < 14


def test_a_smoothed_law_holds_nothing() -> None:
    smoothed = {"effects.shaft_friction.law": "regularised", "solver.backend": "rkf45"}
    for force_on_cord, rests in ((2300.0, False), (2224.1, True)):
        keys = {**smoothed, "drive.force": force_on_cord, "solver.duration": 0.1}
        found = [text for text in fs.solve("pulley", keys).warnings if "nothing moves" in text]
        assert bool(found) is rests
