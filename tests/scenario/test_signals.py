"""Signals: values, derivatives, discontinuities and extrema."""

from math import inf, pi, sin
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import frictionsim as fs
from frictionsim.mechanisms.extension import signal_from
from tests.support.scenarios import pulley, shipped


def signal(table: Any, folder: Path = Path()) -> Any:
    """Return the force of a pulley over time, as the author of a kind gets it."""
    return signal_from(fs.load(pulley(drive__force=table), folder=folder).drive.force)


def test_points_are_interpolated_linearly_and_constant_outside() -> None:
    force = signal({"time": [1, 2, 4], "value": [10, 20, 0]})
    assert [force(t) for t in (0.0, 1.0, 1.5, 2.0, 3.0, 4.0, 9.0)] == [10, 10, 15, 20, 10, 0, 0]
    assert [force.next_discontinuity(t) for t in (0.0, 1.0, 1.5, 2.0, 4.0)] == [1, 2, 2, 4, inf]
    times, values = [0.1, 0.30000000000000004, 0.7], [1.1, 3.3, -2.2]
    force = signal({"time": times, "value": values})
    assert [force(t) for t in times] == values


@pytest.mark.parametrize(
    "table",
    [5, 5.0, {"time": [1.0], "value": [5.0]}, {"time": [1.0, 2.0], "value": [5.0, 5.0]}],
)
def test_a_number_a_single_point_and_equal_values_are_a_constant(table: Any) -> None:
    force = signal(table)
    assert [force(t) for t in (0.0, 1.0, 1.5, 9.0)] == [5.0] * 4
    assert (force.next_discontinuity(0.0), force.next_extremum(0.0)) == (inf, inf)


def test_sine_has_mean_amplitude_frequency_and_phase() -> None:
    force = signal({"sine": {"mean": 2, "amplitude": 3, "frequency_hz": 0.5, "phase_deg": 30}})
    assert force(0.0) == pytest.approx(3.5, rel=1e-15)
    assert force(1.3) == pytest.approx(2 + 3 * sin(pi * 1.3 + pi / 6), rel=1e-15)
    assert force.next_extremum(0.0) == pytest.approx(1 / 3, rel=1e-15)
    assert force.next_extremum(0.5) == pytest.approx(4 / 3, rel=1e-15)
    assert force.next_discontinuity(0.0) == inf


def test_smooth_step_is_the_cubic_and_constant_outside() -> None:
    force = signal({"smooth_step": {"from": 2, "to": 4, "start": 1, "stop": 3}})
    assert [force(t) for t in (0.0, 1.0, 2.0, 3.0, 9.0)] == [2, 2, 3, 4, 4]
    assert force(1.5) == pytest.approx(2 + 2 * (3 * 0.25**2 - 2 * 0.25**3), rel=1e-15)
    assert [force.next_discontinuity(t) for t in (0.0, 1.0, 2.0, 3.0)] == [1, 3, 3, inf]
    h = 1e-6
    for t in (1.0, 3.0):  # the slope is continuous: zero at both ends, to the order of h
        assert (force(t + h) - force(t - h)) / (2 * h) == pytest.approx(0.0, abs=1e-5)


def torque(table: Any, folder: Path = Path()) -> Any:
    """Return the torque of a belt's driver as the tables of its scenario have it."""
    data = shipped("belt_drive", drive__driver={"torque": table})
    return fs.load(data, folder=folder).to_dict()["drive"]["driver"]["torque"]


def test_a_signal_of_speed_or_time_takes_both() -> None:
    of_speed = torque({"speed": [0, 10.0], "value": [5.0, 0]})
    assert of_speed == {"speed": (0.0, 10.0), "value": (5.0, 0.0)}
    assert torque(of_speed) == of_speed
    in_time = {"time": [0, 1], "value": [0, 5]}
    assert torque(in_time) == {"time": (0.0, 1.0), "value": (0.0, 5.0)}
    loaded = fs.load(shipped("belt_drive", drive__driver={"torque": in_time}))
    assert signal_from(loaded.drive["driver"].torque)(0.5) == 2.5
    assert torque(3) == 3.0


def test_a_torque_over_speed_comes_from_columns(tmp_path: Path) -> None:
    (tmp_path / "motor.csv").write_text("w;M\n-10;5\n10;-5\n")
    read = [
        torque({"csv": "motor.csv", **keys}, tmp_path)
        for keys in ({"speed": "w", "value": "M"}, {"speed": 1}, {})
    ]
    points, values = (-10.0, 10.0), (5.0, -5.0)
    of_speed, of_time = ({name: points, "value": values} for name in ("speed", "time"))
    assert read == [of_speed, of_speed, of_time]


signals = st.one_of(
    st.fixed_dictionaries(
        {
            "mean": st.floats(-10, 10),
            "amplitude": st.floats(0.1, 10),
            "frequency_hz": st.floats(0.002, 160),
            "phase_deg": st.floats(-570, 570),
        }
    ).map(lambda sine: {"sine": sine}),
    st.lists(st.tuples(st.floats(0.01, 10), st.floats(-10, 10)), min_size=2, max_size=8).map(
        lambda p: {"time": np.cumsum([x for x, _ in p]), "value": [v for _, v in p]}
    ),
    st.builds(
        lambda a, b, start, length: {
            "smooth_step": {"from": a, "to": b, "start": start, "stop": start + length}
        },
        st.floats(-10, 10),
        st.floats(-10, 10),
        st.floats(0, 10),
        st.floats(0.01, 10),
    ),
).map(signal)


@given(signals, st.floats(0, 20))
def test_derivative_is_the_derivative(force: Any, t: float) -> None:
    """The slope integrated over a piece, by Gauss' formula of three points, is the rise."""
    end = min(force.next_discontinuity(t), force.next_extremum(t), t + 1.0)
    half, middle = 0.5 * (end - t), 0.5 * (end + t)
    nodes = ((-(0.6**0.5), 5 / 9), (0.0, 8 / 9), (0.6**0.5, 5 / 9))
    rise = half * sum(weight * force.derivative(middle + half * x) for x, weight in nodes)
    # Exact for the cubic; of half a wave of the sine it misses 2e-3 at most.
    assert rise == pytest.approx(force(end) - force(t), rel=5e-3, abs=1e-9)


def test_the_bounds_of_a_sum_hold_its_values_and_its_second_derivatives() -> None:
    sine = {"sine": {"mean": 1.0, "amplitude": 2.0, "frequency_hz": 3.0}}
    force = signal([sine, {"smooth_step": {"from": 0.0, "to": 4.0, "start": 0.0, "stop": 1.0}}])
    lowest, highest = force.extremes(0.0, 1.0)
    curvature = force.curvature(0.0, 1.0)
    for t in np.linspace(0.0, 0.99, 100):
        assert lowest <= force(t) <= highest
        assert abs(force.bend(t)[0]) <= curvature


@given(signals, st.floats(0, 20))
def test_a_signal_is_monotone_up_to_its_next_extremum(force: Any, t: float) -> None:
    turn = force.next_extremum(t)
    assert turn > t
    assert force.next_discontinuity(t) >= turn
    values = [force(x) for x in np.linspace(t, min(turn, t + 10.0), 50)]
    steps = np.diff(values)
    rounding = 1e-11  # of values up to 20 in a phase of up to 1e4
    assert np.all(steps >= -rounding) or np.all(steps <= rounding)
