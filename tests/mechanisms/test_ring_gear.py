"""A planet inside a ring: Lagrange's equations by another program, curves that are known, cusps."""

from math import pi, radians, sin
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from tests.support.cases import one_in
from tests.support.problems import cases

RING = 0.12


def ring(planet: float, **changes: Any) -> fs.Scenario:
    """Return the shipped ring with another planet, turned uniformly, from the level crank."""
    plain = {
        "drive.torque": None,
        "drive.speed": 2.0 * pi,
        "mechanism.planet_radius": planet,
        "mechanism.initial_angle_deg": 0.0,
        "effects.tracer_point.radius": planet,
        "solver.duration": 1.0,
        "output.interval": 1e-4,
    }
    return fs.load("epicyclic_ring", plain | {k.replace("__", "."): v for k, v in changes.items()})


@pytest.mark.parametrize("case", one_in(9, cases("epicyclic_ring")))
def test_motion_is_that_of_lagrange_s_equations(case: dict[str, Any]) -> None:
    done = fs.solve(case["scenario"], {"solver.rtol": 1e-12, "solver.atol": 1e-14})
    assert {name for name, check in done.audit.items() if not check.ok} == set()
    events = [(e.mode_from, e.mode_to) for e in done.record.transitions]
    assert events == [(before, after) for _, before, after, _ in case["events"]]
    channels, quantities = done.record.channels, done.quantities
    seen, known = [channels[name][-1] for name in ("angle", "angular_velocity")], case["final"]
    # Some thousand steps of 1e-12, and what they amplify: at worst 6e-11 of the larger number.
    assert seen == pytest.approx(known, rel=1e-9, abs=1e-9)
    for event, (time, _, _, angle) in zip(done.record.transitions, case["events"], strict=True):
        assert (event.time, event.position) == pytest.approx((time, angle), rel=1e-9, abs=1e-9)
    works = quantities["energy_input"].value, quantities["energy_friction"].value
    assert works == pytest.approx((case["work"], case["heat"]), rel=1e-9, abs=1e-9)
    ratio = fs.static(case["scenario"])["planet_speed_ratio"].value
    assert ratio == pytest.approx(case["turns"], rel=1e-14)  # roundings


def path_length(x: Any, y: Any) -> float:
    """Return the length of a path from its samples, without their error of order h^2."""
    chords, long = (np.sum(np.hypot(np.diff(x[::k]), np.diff(y[::k]))) for k in (1, 2))
    return float((4.0 * chords - long) / 3.0)


def test_a_planet_of_half_the_ring_draws_a_straight_line() -> None:
    done = fs.solve(ring(0.06))
    x, y = (done.record.channels[name] for name in ("tracer_x", "tracer_y"))
    assert np.abs(y).max() < 1e-15
    assert np.ptp(x) == pytest.approx(0.24, abs=1e-15)
    # A sample is at each end.
    assert path_length(x, y) == pytest.approx(2.0 * 0.24, rel=1e-12)
    static = fs.static(ring(0.06))
    assert static["inertia"].value == pytest.approx(0.00744, rel=1e-14)
    assert static["planet_speed_ratio"].value == -1.0
    channels = done.record.channels
    assert np.array_equal(channels["planet_velocity"], -channels["angular_velocity"])


@pytest.mark.parametrize(
    ("planet", "cusps", "length"), [(0.04, 3, 16.0 * 0.04), (0.03, 4, 6.0 * RING)]
)
def test_deltoid_and_astroid_have_their_length_and_cusps(
    planet: float, cusps: int, length: float
) -> None:
    done = fs.solve(ring(planet))
    x, y = (done.record.channels[name] for name in ("tracer_x", "tracer_y"))
    # Where a cusp is between two samples the error is of their distance squared, 1e-7.
    assert path_length(x, y) == pytest.approx(length, rel=1e-7)
    assert done.quantities["tracer_cusps"].value == cusps
    if cusps == 4:  # x^(2/3) + y^(2/3) = r1^(2/3)
        assert np.cbrt(x * x) + np.cbrt(y * y) == pytest.approx(np.cbrt(RING**2), rel=1e-9)
    distance = np.hypot(x, y)
    assert distance.max() == pytest.approx(RING, rel=1e-15)
    assert distance.min() == pytest.approx(RING - 2.0 * planet, rel=1e-6)  # h^2 of the samples


@pytest.mark.parametrize(("planet", "degrees"), [(0.05, 200.0), (0.09, 20.0), (0.03, 310.0)])
def test_the_published_equation_keeps_its_form_in_a_ring(planet: float, degrees: float) -> None:
    changes = {"mechanism.formulation": "published", "mechanism.initial_angle_deg": degrees}
    static = fs.static(ring(planet, **changes))
    length, phi = RING - planet, radians(degrees)
    turns = length / planet
    weights = (0.5 * 0.8 + 2.0 * 1.2) * 9.81 * length
    rolling = 5e-4 * 1.2 * 9.81 * turns
    eq_28 = weights * np.cos(phi) + 0.15 * turns + rolling * sin(phi)
    assert static["uniform_torque_at_start"].value == pytest.approx(eq_28, rel=1e-13)
    most = 0.15 * turns + np.hypot(weights, rolling)
    assert static["uniform_torque_max"].value == pytest.approx(most, rel=1e-13)


@pytest.mark.parametrize("planet", [0.12, 0.13])
def test_a_planet_does_not_fill_its_ring(planet: float) -> None:
    with pytest.raises(fs.ScenarioError, match="smaller than it: expected less than sun_radius"):
        fs.load("epicyclic_ring", {"mechanism.planet_radius": planet})
    fs.load("epicyclic_ring", {"mechanism.planet_radius": planet, "mechanism.mesh": "external"})
