"""Dwell, swing and cusps of the tracer point of a gear: by the path, whatever the samples."""

from math import pi
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq, minimize_scalar

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


def test_a_crank_that_rests_within_a_passage_does_not_dwell_there() -> None:
    """It turns by an eighth to a cusp, rests there for a second, and turns on by an eighth."""
    slow = 2.0 * (0.25 * pi - 0.7)  # s, of a speed that falls from 1 rad/s to rest, or rises
    times = [0.0, 0.7, 0.7 + slow, 1.7 + slow, 1.7 + 2.0 * slow, 2.4 + 2.0 * slow]
    speed = {"time": times, "value": [1.0, 1.0, 0.0, 0.0, 1.0, 1.0]}
    rests = gear({"speed": speed}, times[-1], start_deg=-45.0)
    assert value(rests, "tracer_dwell_time") is None
    passes = gear({"speed": 1.0}, 0.5 * pi, start_deg=-45.0)
    assert value(passes, "tracer_dwell_time") is not None


@pytest.mark.parametrize(
    ("duration", "radii", "rho", "distance"),
    [
        (2.0, (0.12, 0.03), 0.03, 1e-3),
        (10.0, (0.12, 0.06), 0.063, 5e-3),
        (100.0, (0.12, 0.06), 0.02, 1e-2),
        (1000.0, (0.1, 0.07), 0.09, 2e-3),
        (1000.0, (0.12, 0.03), 0.03, 1e-3),
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


@pytest.mark.parametrize(
    ("rho", "dwell", "swing"),
    [
        (0.060, 0.0836, 0.0),
        (0.063, 0.0814, 1.309e-3),
        (0.072, 0.0595, 9.798e-3),
    ],
)
def test_a_point_beyond_the_rim_swings_while_it_dwells(
    rho: float, dwell: float, swing: float
) -> None:
    run = fs.load("epicyclic_dwell", {"effects.tracer_point.radius": rho})
    values = {name: each.value for name, each in fs.solve(run).quantities.items()}
    assert values["tracer_dwell_time"] == pytest.approx(dwell, abs=5.1e-5)  # digits given
    assert values["tracer_swing"] == pytest.approx(swing, abs=5.1e-7)
    # At a uniform speed the angle is the time, and both are exact but for roundings.
    assert values["tracer_dwell_angle"] == pytest.approx(4.0 * values["tracer_dwell_time"])
    static = fs.static(run)
    for name in ("tracer_swing", "tracer_dwell_angle"):
        assert static[name].value == values[name]
    # lambda = 3: L cos p = rho 3 (4 cos^3 p - 3 cos p) has cos^2 p = (L/(3 rho) + 3)/4.
    cosine = np.sqrt(min((0.18 / (3.0 * rho) + 3.0) / 4.0, 1.0))
    sine = np.sqrt(1.0 - cosine**2)
    known = 2.0 * abs(0.18 * sine - rho * (3.0 * sine - 4.0 * sine**3))
    assert values["tracer_swing"] == pytest.approx(known, rel=1e-12, abs=1e-17)


@pytest.mark.parametrize("mesh", ["external", "internal"])
def test_swing_and_dwell_angle_are_those_of_the_path(mesh: str) -> None:
    """Over 40 drawn gears: of the path from the place of least speed on, where y first returns."""
    rng, swings = np.random.default_rng(8), 0
    for _ in range(40):
        sun = rng.uniform(0.05, 0.3)
        planet = sun * rng.uniform(0.1, 0.9 if mesh == "internal" else 2.0)
        rho, distance = planet * rng.uniform(0.8, 1.6), planet * rng.uniform(0.02, 0.5)
        data = gear({"speed": 1.0}, 1.0, (sun, planet), radius=rho, dwell_distance=distance)
        static = fs.static(data.replace({"mechanism.mesh": mesh}))
        length = sun - planet if mesh == "internal" else sun + planet
        # The point is on the x axis at first, on the side of the sun or ring.
        side, turns = (1.0, -length / planet) if mesh == "internal" else (-1.0, length / planet)

        def place(p: Any, L: float = length, r: float = side * rho, turns: float = turns) -> Any:
            return L * np.exp(1j * p) + r * np.exp(1j * turns * p)

        p = np.linspace(0.0, TURN, 20_001)
        far = np.abs(place(p) - place(0.0)) - distance
        beyond = np.flatnonzero(far > 0.0)
        if beyond.size:
            at = int(beyond[0])
            ends = p[at - 1], p[at]
            end = brentq(lambda x, d: abs(place(x) - place(0.0)) - d, *ends, args=(distance,))
            assert static["tracer_dwell_angle"].value == pytest.approx(2.0 * end, rel=1e-9)
        else:
            assert static["tracer_dwell_angle"].value is None
        turned = np.flatnonzero(np.diff(place(p).imag) > 0.0)
        if rho <= planet or not turned.size:
            assert static["tracer_swing"].value == (0.0 if rho <= planet else None)
            continue
        at, swings = int(turned[0]), swings + 1
        lowest = minimize_scalar(
            lambda x: place(x).imag, bounds=(p[max(at - 1, 0)], p[at + 1]), method="bounded"
        )
        # The place of an extremum is found to 1e-5 of an interval of 3e-4.
        known = -2.0 * float(lowest.fun)
        assert static["tracer_swing"].value == pytest.approx(known, rel=1e-9, abs=1e-15)
    assert swings > 20


def test_a_swing_or_dwell_of_more_than_a_turn_either_way_is_none() -> None:
    # L = 1 mm, lambda = 1/119: its swing ends after 2.99 turns, and in one it goes 7 mm at most.
    keys = {"mechanism.mesh": "internal", "mechanism.planet_radius": 0.119}
    point = {"effects.tracer_point.radius": 0.12, "effects.tracer_point.angle_deg": 0.0}
    run = fs.load("epicyclic_dwell", keys | point)
    p = np.linspace(0.0, TURN, 10_001)
    assert np.all(1e-3 * np.cos(p) < 0.12 / 119.0 * np.cos(p / 119.0))  # dy/dp keeps its sign
    static = fs.static(run)
    assert static["tracer_swing"].value is None
    path = 1e-3 * np.exp(1j * p) + 0.12 * np.exp(-1j * p / 119.0)
    farthest = np.abs(path - path[0]).max()
    for share, has_one in ((1.01, False), (0.99, True)):
        static = fs.static(run.replace({"effects.tracer_point.dwell_distance": share * farthest}))
        assert (static["tracer_dwell_angle"].value is not None) == has_one


@settings(max_examples=6)
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
    assume(longest is not None)  # else there may be one that turns just at the end of a passage
    # A fine sample at each end; the cubic polynomial between samples is far better.
    assert value(run, "tracer_dwell_time") == pytest.approx(longest, abs=2.1e-5)


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


@pytest.mark.parametrize(
    ("radii", "turns", "cusps", "angle_deg"),
    [((0.12, 0.03), 1, 4, 180.0), ((0.12, 0.06), 1, 2, 179.0), ((0.1, 0.1), -1, 1, -47.0),
     ((0.12, 0.08), 2, 3, 181.0), ((0.12, 0.08), -2, 3, 0.0)],
)  # fmt: skip
def test_a_closed_path_has_each_of_its_cusps_once(
    radii: tuple[float, float], turns: int, cusps: int, angle_deg: float
) -> None:
    speed = TURN if turns > 0 else -TURN
    run = gear({"speed": speed}, abs(float(turns)), radii, angle_deg=angle_deg)
    assert value(run, "tracer_cusps") == cusps


def test_an_open_path_has_the_cusps_at_both_of_its_ends() -> None:
    assert value(gear({"speed": TURN}, 0.5), "tracer_cusps") == 3
    assert value(gear({"speed": TURN}, 1.0, (0.12, 0.08)), "tracer_cusps") == 2
    assert value(gear({"speed": TURN}, 100.0), "tracer_cusps") == 400


def test_a_point_within_the_rim_has_no_cusps() -> None:
    assert value(gear({"speed": TURN}, 1.0, radius=0.02), "tracer_cusps") is None
