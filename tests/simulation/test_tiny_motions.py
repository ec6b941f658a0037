"""Motions of nanometres, as angles of a body, are as exact as those of metres."""

from math import degrees, exp, sqrt

import pytest

import frictionsim as fs
from tests.support.closed_forms_of_others import friction_oscillator
from tests.support.scenarios import shipped


def oscillator(
    size: float, x: float, v: float, inertia: float = 1.0, stiffness: float = 1.0
) -> fs.Scenario:
    """Return a block with dry friction on a spring, of which the friction holds it at 1 x size.

    `v` is of the natural frequency, so that the motion in these units does not depend on it.
    """
    omega = sqrt(stiffness / inertia)
    return fs.load(
        {
            "kind": "shaft",
            "mechanism": {
                "inertia": inertia,
                "initial_angle_deg": degrees(x * size),
                "initial_angular_velocity": v * size * omega,
            },
            "forces": [
                {
                    "name": "clamp",
                    "size": 100.0 * stiffness * size / 0.6,  # times the friction radius 0.006 m
                    "point": [0.0, 0.0],
                    "direction": [0.0, -1.0],
                }
            ],
            "effects": {
                "shaft_friction": {"shaft_radius": 0.01, "mu_s": 0.75, "mu_k": 0.75},
                "torsion_spring": {"stiffness": stiffness},
            },
            "solver": {"duration": 30.0 / omega},
        }
    )


@pytest.mark.parametrize(
    ("size", "x", "v", "inertia", "stiffness"),
    [
        (1e-3, 12.0, 6.0, 6.0, 6.0),
        (1e-6, -7.3, 4.0, 1e-3, 2e3),
        (1e-9, 0.0, 9.0, 50.0, 0.1),
        (1e-12, 12.0, 6.0, 1.0, 1.0),
    ],
)
def test_a_tiny_oscillator_comes_to_rest_when_and_where_it_must(
    size: float, x: float, v: float, inertia: float, stiffness: float
) -> None:
    time, place = friction_oscillator(x, v)
    omega = sqrt(stiffness / inertia)
    result = fs.solve(oscillator(size, x, v, inertia, stiffness))
    assert result.status == "done"  # and so with all checks ok
    # Steps of rtol = 1e-10, and an absolute tolerance of 1e-9 of the motion at most.
    assert float(result.quantities["last_rest_time"]) * omega == pytest.approx(time, abs=1e-7)
    assert float(result.quantities["final_angle"]) / size == pytest.approx(place, abs=1e-7)


@pytest.mark.parametrize("torque", [1e-9, 2e-13])
def test_a_tiny_torque_against_a_brake_of_speed_gives_the_speed_of_the_closed_form(
    torque: float,
) -> None:
    scenario = fs.load(
        {
            "kind": "shaft",
            "mechanism": {"inertia": 2.0},
            "couples": [{"name": "motor", "size": {"time": [0.0, 4.0], "value": [0.0, torque]}}],
            "effects": {"viscous_damping": {"coefficient": 1.0}},
            "solver": {"duration": 4.0},
        }
    )
    # w' = (a t - w)/2: w = a (t - 2 + 2 e^(-t/2)), a = torque/4
    speed = 0.25 * torque * (4.0 - 2.0 + 2.0 * exp(-2.0))
    final = float(fs.solve(scenario).quantities["final_angular_velocity"])
    assert final == pytest.approx(speed, rel=1e-8)


def tiny_pulley(size: float) -> fs.Scenario:
    """Return the shipped pulley with all its forces, and its motion, so many times smaller."""
    tables = shipped("pulley_return")
    tables["mechanism"]["load"] *= size
    force = tables["drive"]["force"]
    force["value"] = [size * value for value in force["value"]]
    return fs.load(tables)


@pytest.mark.parametrize("size", [1e-8, 1e-12])
def test_a_motion_that_the_tolerance_does_not_resolve_is_told_with_the_way_out(size: float) -> None:
    rest = fs.solve(tiny_pulley(1.0)).quantities["last_rest_time"].value
    told = fs.solve(tiny_pulley(size))
    (warning,) = [text for text in told.warnings if "no small part" in text]
    fitting = warning.rpartition("give ")[2]
    again = fs.solve(tiny_pulley(size).replace([fitting]))
    assert again.warnings == ()
    # Of a rest, rtol 1e-9 leaves some 1e-9 s.
    assert again.quantities["last_rest_time"].value == pytest.approx(rest, abs=2e-8)


def test_an_ordinary_motion_is_not_told() -> None:
    assert fs.solve(tiny_pulley(1e-4)).warnings == ()
