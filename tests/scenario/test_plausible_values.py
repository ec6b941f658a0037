"""Warnings about values that look like a slip of a unit, and keys without effect."""

import re
from collections.abc import Iterator, Mapping, Sequence
from math import cos, pi
from pathlib import Path
from typing import Any

import pytest

import frictionsim as fs
from tests.support.scenarios import SCENARIOS

KINDS = fs.kinds()
MU, RADIUS = "effects.shaft_friction.mu_s", "mechanism.cord_radius"


def asked(scenario: fs.Scenario) -> list[str]:
    """Return the warnings that ask whether another value was meant."""
    return [warning for warning in scenario.warnings() if "did you mean" in warning]


def values(kind: str) -> dict[str, Any]:
    """Return the radii and coefficients of the shipped scenario of a kind."""
    return {
        key: value
        for key, value in keys_and_values(fs.load(kind).to_dict())
        if re.search(r"radius$|\.mu_[sk]$", key) and isinstance(value, float)
    }


def keys_and_values(table: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the values of a scenario with their keys; entries of lists by their names."""
    for key, value in table.items():
        if isinstance(value, Mapping):
            yield from keys_and_values(value, f"{path}{key}.")
        elif isinstance(value, Sequence) and value and isinstance(value[0], Mapping):
            yield from keys_and_values({row["name"]: row for row in value}, f"{path}{key}.")
        else:
            yield path + key, value


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "belt_drive"])
def test_millimetres_are_suggested_as_metres_in_every_kind(kind: str) -> None:
    radii = {key: value for key, value in values(kind).items() if key.endswith("radius")}
    large = {key: 1000.0 * value for key, value in radii.items() if abs(value) > 0.005}
    assert large
    words = "%s = %g m is a radius above 5 m; did you mean %.6g, for %g mm?"
    assert sorted(asked(fs.load(kind, large))) == sorted(
        words % (key, value, radii[key], value) for key, value in large.items()
    )


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "epicyclic"])
def test_percent_are_suggested_as_coefficients(kind: str) -> None:
    coefficients = {key: 0.25 for key in values(kind) if not key.endswith("radius")}
    assert coefficients
    percent = {key: 100.0 * value for key, value in coefficients.items()}
    assert asked(fs.load(kind, coefficients)) == []
    assert sorted(asked(fs.load(kind, percent))) == sorted(
        f"{key} = 25 is a coefficient of friction above 2; did you mean 0.25?" for key in percent
    )


@pytest.mark.parametrize(
    ("overrides", "count"),
    [
        ({MU: 2.0, RADIUS: 5.0}, 0),
        ({MU: 2.001, RADIUS: 5.0}, 1),
        ({MU: 2.0, RADIUS: 5.001}, 1),
        ({MU: 20, "effects.shaft_friction.mu_k": 10, RADIUS: 50.8}, 3),
    ],
)
def test_the_limits_themselves_are_plausible(overrides: dict[str, float], count: int) -> None:
    assert len(asked(fs.load("pulley", overrides))) == count


@pytest.mark.parametrize("path", sorted(SCENARIOS.rglob("*.toml")), ids=lambda path: path.stem)
def test_no_shipped_scenario_is_asked(path: Path) -> None:
    # One is about a pulley with the inertia of a mountain.
    assert len(asked(fs.load(path))) == (path.stem == "huge_inertia")


@pytest.mark.parametrize(
    ("key", "value", "words"),
    [
        ("effects.gravity.g", 981.0, "981 m/s^2 is above 30 m/s^2; did you mean 9.81?"),
        ("mechanism.inertia", 3500.0, "of 2.71e+06 kg with the radius 0.0508 m; did you mean"),
    ],
)
def test_other_slips_of_a_unit_are_asked_about(key: str, value: float, words: str) -> None:
    kind = "shaft" if "gravity" in key else "pulley"
    (warning,) = asked(fs.load(kind, {key: value}))
    assert warning.startswith(f"{key} = {value:g}")
    assert words in warning


def test_a_duration_in_milliseconds_is_asked_about() -> None:
    drive = {"drive.force": {"time": [0.0, 2.0], "value": [0.0, 450.0]}}
    (warning,) = fs.load("pulley", {**drive, "solver.duration": 8000.0}).warnings()
    assert warning.startswith("solver.duration = 8000 s is more than 1000 times as long")
    assert fs.load("pulley", {**drive, "solver.duration": 2000.0}).warnings() == []
    sine = {"drive.force": {"sine": {"amplitude": 450.0, "frequency_hz": 0.01}}}
    warnings = fs.load("pulley", {**sine, "solver.duration": 8000.0}).warnings()
    assert not any("duration" in warning for warning in warnings)


@pytest.mark.parametrize(("points", "share"), [(80, 0.09), (80, 0.11), (12, 0.13)])
def test_samples_of_a_wave_have_the_period_of_the_wave(points: int, share: float) -> None:
    """However many points a table has of it; of the places of two peaks each errs by a point."""
    period = 1.3
    times = [i * period / points for i in range(3 * points + 1)]
    force = [2000.0 - 500.0 * cos(2.0 * pi * t / period) for t in times]
    wave = {"drive.force": {"time": times, "value": force}, "solver.duration": times[-1]}
    warnings = fs.load("pulley", {**wave, "output.interval": share * period}).warnings()
    told = [warning for warning in warnings if "tenth of the period of drive.force" in warning]
    assert len(told) == (share > 0.1)
    for warning in told:
        found = float(warning.partition("drive.force, ")[2].split()[0])
        assert found == pytest.approx(period, abs=2.0 * period / points)


def test_a_cord_on_the_other_side_has_a_radius_too() -> None:
    (force, *_) = fs.load("shaft").to_dict()["forces"]
    key = f"forces.{force['name']}"
    turned = {k: v for k, v in force.items() if k not in ("point", "cord_radius", "frame")}
    (warning,) = asked(fs.load("shaft", {key: turned | {"cord_radius": -50.8}}))
    assert warning.startswith(f"{key}.cord_radius = -50.8 m is a radius above 5 m; did you mean -0")


def test_a_mass_without_weight_is_told() -> None:
    friction = {"shaft_radius": 0.02, "mu_s": 0.2, "mu_k": 0.2}
    body: dict[str, Any] = {
        "kind": "shaft",
        "mechanism": {"inertia": 0.1, "mass": 40.0},
        "couples": [{"name": "motor", "size": 3.0}],
        "effects": {"shaft_friction": friction},
    }
    (told,) = fs.load(body).warnings()
    assert told.startswith("mechanism.mass has no effect")
    assert fs.load(body, {"effects.gravity.g": 9.81}).warnings() == []
