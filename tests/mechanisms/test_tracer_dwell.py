"""Dwell and cusps of the tracer point of a gear: by the path, whatever the samples."""

from math import pi
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import frictionsim as fs

TURN = 2.0 * pi


def gear(
    drive: dict[str, Any],
    duration: float,
    radii: tuple[float, float] = (0.12, 0.03),
    interval: float | None = None,
    start_deg: float = 0.0,
    **point: Any,
) -> fs.Scenario:
    return fs.load(
        {
            "kind": "epicyclic",
            "mechanism": {
                "sun_radius": radii[0],
                "planet_radius": radii[1],
                "crank_mass": 0.5,
                "planet_mass": 0.3,
                "initial_angle_deg": start_deg,
            },
            "drive": drive,
            "effects": {"tracer_point": {"radius": radii[1], "dwell_distance": 1e-3} | point},
            "solver": {"duration": duration},
            "output": {} if interval is None else {"interval": interval},
        }
    )


def value(scenario: fs.Scenario, name: str) -> float | None:
    return fs.solve(scenario).quantities[name].value


def half_angle(radii: tuple[float, float], rho: float, distance: float) -> float:
    """Return the smallest root p of |L e^(ip) - rho e^(i lambda p) - (L - rho)| = distance, rad."""
    length = sum(radii)
    turns = length / radii[1]

    def excess(p: Any) -> Any:
        place = length * np.exp(1j * p) - rho * np.exp(1j * turns * p)
        return np.abs(place - (length - rho)) - distance

    fine = np.linspace(0.0, pi, 20_001)
    first = int(np.argmax(excess(fine) > 0.0))
    return float(brentq(excess, fine[first - 1], fine[first], xtol=1e-15))


@pytest.mark.parametrize("duration", [2.0, 10.0, 100.0, 1000.0])
@pytest.mark.parametrize(
    ("radii", "rho", "distance"),
    [
        ((0.12, 0.03), 0.03, 1e-3),
        ((0.12, 0.06), 0.063, 5e-3),
        ((0.12, 0.06), 0.02, 1e-2),
        ((0.1, 0.07), 0.09, 2e-3),
    ],
)
def test_a_uniform_crank_dwells_as_long_whatever_the_samples(
    duration: float, radii: tuple[float, float], rho: float, distance: float
) -> None:
    speed = TURN if duration < 1000.0 else -TURN
    run = gear({"speed": speed}, duration, radii, radius=rho, dwell_distance=distance)
    expected = 2.0 * half_angle(radii, rho, distance) / TURN
    # Times of 1000 s are rounded to 1e-13 s, angles of 6000 rad to 1e-12 rad.
    assert value(run, "tracer_dwell_time") == pytest.approx(expected, rel=1e-9)


def test_the_dwell_of_the_case_is_known() -> None:
    for duration in (10.0, 100.0, 1000.0):
        dwell = value(gear({"speed": TURN}, duration), "tracer_dwell_time")
        assert dwell == pytest.approx(0.0183955, abs=5e-8)  # the digits that are given


@pytest.mark.parametrize(
    ("rho", "dwell"),
    [(0.054, 0.0770), (0.060, 0.0836), (0.063, 0.0814), (0.066, 0.0759), (0.072, 0.0595)],
)
def test_a_point_just_off_the_rim_dwells_longest_on_it(rho: float, dwell: float) -> None:
    run = gear({"speed": 4.0}, 5.0, (0.12, 0.06), radius=rho, dwell_distance=5e-3)
    assert value(run, "tracer_dwell_time") == pytest.approx(dwell, abs=5e-5)  # digits given


@settings(max_examples=12)
@given(
    mean=st.floats(-4.0, 4.0),
    amplitude=st.floats(1.0, 6.0),
    start_deg=st.floats(-180.0, 180.0),
    rho=st.floats(0.02, 0.08),
)
def test_the_dwell_of_an_uneven_crank_is_that_of_its_motion(
    mean: float, amplitude: float, start_deg: float, rho: float
) -> None:
    radii, distance = (0.12, 0.06), 4e-3
    drive = {"speed": {"sine": {"mean": mean, "amplitude": amplitude, "frequency_hz": 0.5}}}
    run = gear(
        drive, 6.0, radii, 0.01, start_deg, radius=rho, angle_deg=30.0, dwell_distance=distance
    )
    # phi' = m + a sin(pi t) by its integral: where it is within p of a place, one way all through.
    t = np.linspace(0.0, 6.0, 600_001)
    angle = np.radians(start_deg) + mean * t + amplitude / pi * (1.0 - np.cos(pi * t))
    p = half_angle(radii, rho, distance)
    k = np.round((2.0 * angle - np.radians(150.0)) / TURN)  # psi_0 + 2 phi = pi + 2 pi k
    off = angle - (np.radians(150.0) + TURN * k) / 2.0
    within = np.concatenate([[False], np.abs(off) <= p, [False]])
    edges = np.flatnonzero(within[1:] != within[:-1])
    longest = None
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        steps = np.sign(np.diff(angle[first:last]))
        whole = first > 0 and last < t.size and np.all(steps == steps[0])
        if whole and abs(off[first] - off[last - 1]) > p:
            longest = max(longest or 0.0, t[last] - t[first])
    dwell = value(run, "tracer_dwell_time")
    if longest is None:
        # One that turns just at the end of a passage may be either.
        assert dwell is None or dwell > 0.1
    else:
        # A fine sample at each end; the cubic polynomial between samples is far better.
        assert dwell == pytest.approx(longest, abs=2.1e-5)


def test_a_crank_that_stands_still_does_not_dwell() -> None:
    # It rests for 1 s on a place, leaves, and passes the next ones at 2 rad/s.
    speed = {"time": [0.0, 1.0, 1.5, 6.0], "value": [0.0, 0.0, 2.0, 2.0]}
    dwell = value(gear({"speed": speed}, 6.0), "tracer_dwell_time")
    assert dwell == pytest.approx(2.0 * half_angle((0.12, 0.03), 0.03, 1e-3) / 2.0, rel=1e-9)


@pytest.mark.parametrize(
    ("drive", "duration", "point"),
    [
        ({"speed": 0.0}, 1.0, {}),  # stands
        ({"speed": 0.01}, 1.0, {}),  # leaves no place
        ({"speed": TURN}, 0.25, {}),  # from one place to the next
        ({"speed": TURN}, 5.0, {"radius": 0.0}),  # has no slowest place
        ({"speed": TURN}, 5.0, {"dwell_distance": 1.0}),  # is never farther
    ],
)
def test_without_a_passage_there_is_no_dwell(
    drive: dict[str, Any], duration: float, point: dict[str, Any]
) -> None:
    assert value(gear(drive, duration, **point), "tracer_dwell_time") is None


def test_a_driven_gear_dwells_as_its_equation_says() -> None:
    scenario = fs.load("epicyclic").replace({"output.interval": 0.001})
    result = fs.solve(scenario)
    dwell = result.quantities["tracer_dwell_time"].value
    # J phi'' = M - K cos phi - M_A r1/r2 - f N lambda from breakaway on, by another integrator.
    start = float(result.quantities["breakaway_time"])
    weight = 9.81 * 1.2

    def slope(t: float, y: Any) -> list[float]:
        torque = 3.0 * min(t, 1.5) - (0.5 * 0.8 * 9.81 + weight) * 0.18 * np.cos(y[0])
        friction = 0.15 * 2.0 + 5e-4 * abs(weight * np.sin(y[0])) * 3.0
        return [y[1], (torque - friction) / 0.06696]

    p = half_angle((0.12, 0.06), 0.06, 5e-3)
    # The first place after the start, at the outermost point, is at 0 deg.
    ends = [lambda t, y, at=at: y[0] - at for at in (-p, p)]
    run = solve_ivp(
        slope, (start, 2.5), [-0.5 * pi, 0.0], events=ends, rtol=1e-10, atol=1e-12, max_step=0.01
    )
    known = float(run.t_events[1][0] - run.t_events[0][0])
    assert dwell == pytest.approx(known, rel=1e-6)
    for interval in (0.005, 0.01):  # a quarter and half of a passage
        coarse = fs.solve(scenario.replace({"output.interval": interval}))
        assert coarse.quantities["tracer_dwell_time"].value == pytest.approx(known, rel=1e-5)


@pytest.mark.parametrize("angle_deg", [180.0, 179.0, 181.0, 0.0, -47.0])
@pytest.mark.parametrize(
    ("radii", "turns", "cusps"),
    [((0.12, 0.03), 1, 4), ((0.12, 0.06), 1, 2), ((0.1, 0.1), 1, 1), ((0.12, 0.08), 2, 3)],
)
def test_a_closed_path_has_each_of_its_cusps_once(
    radii: tuple[float, float], turns: int, cusps: int, angle_deg: float
) -> None:
    for speed in (TURN, -TURN):
        run = gear({"speed": speed}, float(turns), radii, angle_deg=angle_deg)
        assert value(run, "tracer_cusps") == cusps


def test_an_open_path_has_the_cusps_at_both_of_its_ends() -> None:
    assert value(gear({"speed": TURN}, 0.5), "tracer_cusps") == 3
    assert value(gear({"speed": TURN}, 1.0, (0.12, 0.08)), "tracer_cusps") == 2
    assert value(gear({"speed": TURN}, 100.0), "tracer_cusps") == 400
