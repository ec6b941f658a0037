"""Signals: values, derivatives, discontinuities and extrema."""

from math import inf, pi, sin
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from frictionsim.scenario.messages import error_message
from frictionsim.scenario.schema import Params, unit_field
from frictionsim.scenario.signal_tables import (
    SpeedOrTimeSignal,
    SpeedTable,
    TimeSignal,
    signal_from,
)
from frictionsim.scenario.signals import Constant, PiecewiseLinear, Signal, Sine, SmoothStep


class Drive(Params):
    force: TimeSignal


def signal(table: Any, folder: Path = Path()) -> Signal:
    return signal_from(Drive.model_validate({"force": table}, context={"folder": folder}).force)


def test_a_number_is_a_constant() -> None:
    for number in (3, 3.0):
        force = signal(number)
        assert (force(0.0), force(1e9), force.next_discontinuity(0.0)) == (3.0, 3.0, inf)


def test_points_are_interpolated_linearly_and_constant_outside() -> None:
    force = signal({"time": [1, 2, 4], "value": [10, 20, 0]})
    assert [force(t) for t in (0.0, 1.0, 1.5, 2.0, 3.0, 4.0, 9.0)] == [10, 10, 15, 20, 10, 0, 0]
    assert [force.next_discontinuity(t) for t in (0.0, 1.0, 1.5, 2.0, 4.0)] == [1, 2, 2, 4, inf]


def test_a_single_point_or_equal_values_are_a_constant() -> None:
    assert isinstance(signal({"time": [1.0], "value": [5.0]}), Constant)
    assert isinstance(signal({"time": [1.0, 2.0], "value": [5.0, 5.0]}), Constant)


def test_points_are_hit_exactly() -> None:
    times, values = [0.1, 0.30000000000000004, 0.7], [1.1, 3.3, -2.2]
    force = PiecewiseLinear(times, values)
    assert [force(t) for t in times] == values


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


@pytest.mark.parametrize(
    "text",
    ["0,1\n1,2\n", "time;force\n0;1\n1;2\n", "# s N\n\n0 1\n1\t2  # end\n", "\ufefft,F\n0,1\n1,2"],
)
def test_csv_signals_are_points(text: str, tmp_path: Path) -> None:
    (tmp_path / "force.csv").write_text(text, encoding="utf-8")
    force = signal({"csv": "force.csv"}, tmp_path)
    assert [force(t) for t in (0.0, 0.5, 1.0)] == [1.0, 1.5, 2.0]


class BeltDrive(Params):
    torque: SpeedOrTimeSignal | None = unit_field("N m", None)


class PulleyDrive(Params):
    torque: TimeSignal | None = unit_field("N m", None)


def test_a_signal_of_speed_or_time_takes_both() -> None:
    table = {"speed": [0, 10.0], "value": [5.0, 0]}
    of_speed = BeltDrive.model_validate({"torque": table}).torque
    assert isinstance(of_speed, SpeedTable)
    assert (of_speed.speed, of_speed.value) == ((0.0, 10.0), (5.0, 0.0))
    again = BeltDrive.model_validate({"torque": of_speed}).torque
    assert again == of_speed
    assert BeltDrive.model_validate(BeltDrive(torque=of_speed).model_dump()).torque == of_speed
    in_time = BeltDrive.model_validate({"torque": {"time": [0, 1], "value": [0, 5]}}).torque
    assert not isinstance(in_time, SpeedTable)
    assert signal_from(in_time)(0.5) == 2.5
    assert BeltDrive.model_validate({"torque": 3}).torque == 3.0


def faults_of(model: type[Params], table: Any) -> list[str]:
    with pytest.raises(ValidationError) as refused:
        model.model_validate({"torque": table})
    faults = [error_message(error, model) for error in refused.value.errors()]
    return [f"{'.'.join(map(str, path))}: {text}" for path, text in faults]


TIME_FORMS = "{time = [...], value = [...]}, {sine = {...}}, {smooth_step = {...}}"
ALL_FORMS = TIME_FORMS + ', {csv = "file.csv"} or {speed = [...], value = [...]}'
TIME_FORMS += ' or {csv = "file.csv"}'


@pytest.mark.parametrize(
    ("table", "fault"),
    [
        (
            {"speed": [0.0, 0.0], "value": [1.0, 2.0]},
            "torque.speed: speeds must increase from point to point, but point 2 at 0.0 rad/s"
            " follows one at 0.0 rad/s",
        ),
        (
            {"speed": [0.0], "value": [1.0, 2.0]},
            "torque.value: 2 values for 1 speeds; give one for each",
        ),
        ({"speed": [0.0], "value": []}, "torque.value: expected at least one number, got a list"),
        ({"speed": "x", "value": [1.0]}, "torque.speed: expected a list of numbers in brackets"),
        (
            {"speed": [0.0], "value": [1.0, "x"]},
            "torque.value.1: expected a number in N m, got 'x'",
        ),
        (
            {"speed": [0.0, "x"], "value": [1.0]},
            "torque.speed.1: expected a number in rad/s, got 'x'",
        ),
        ({"speed": [0.0]}, "torque.value: missing"),
        ({}, f"torque: expected a number, {ALL_FORMS}, got an empty table"),
        ("x", f"torque: expected a number in N m, or {ALL_FORMS}, got 'x'"),
    ],
)
def test_an_invalid_signal_of_speed_is_reported(table: Any, fault: str) -> None:
    (found,) = faults_of(BeltDrive, table)
    assert found.startswith(fault)


def test_a_time_signal_refuses_a_table_of_speed() -> None:
    found = faults_of(PulleyDrive, {"speed": [0.0], "value": [1.0]})
    assert any("torque.speed: unknown key 'speed'" in fault for fault in found)
    assert faults_of(PulleyDrive, {"speed": [0.0]}) == [
        f"torque: expected a number, {TIME_FORMS}, got a table"
    ]
    assert faults_of(PulleyDrive, "x") == [
        f"torque: expected a number in N m, or {TIME_FORMS}, got 'x'"
    ]


signals = st.one_of(
    st.builds(
        Sine,
        st.floats(-10, 10),
        st.floats(0.1, 10),
        st.floats(0.01, 1000),
        st.floats(-10, 10),
    ),
    st.lists(st.tuples(st.floats(0.01, 10), st.floats(-10, 10)), min_size=2, max_size=8).map(
        lambda p: PiecewiseLinear(np.cumsum([x for x, _ in p]).tolist(), [v for _, v in p])
    ),
    st.builds(
        lambda a, b, start, length: SmoothStep(a, b, start, start + length),
        st.floats(-10, 10),
        st.floats(-10, 10),
        st.floats(0, 10),
        st.floats(0.01, 10),
    ),
)


@given(signals, st.floats(0, 20))
def test_derivative_is_the_derivative(force: Signal, t: float) -> None:
    """The slope integrated over a piece, by Gauss' formula of three points, is the rise."""
    end = min(force.next_discontinuity(t), force.next_extremum(t), t + 1.0)
    half, middle = 0.5 * (end - t), 0.5 * (end + t)
    nodes = ((-(0.6**0.5), 5 / 9), (0.0, 8 / 9), (0.6**0.5, 5 / 9))
    rise = half * sum(weight * force.derivative(middle + half * x) for x, weight in nodes)
    # Exact for the cubic; of half a wave of the sine it misses 2e-3 at most.
    assert rise == pytest.approx(force(end) - force(t), rel=5e-3, abs=1e-9)


@given(signals, st.floats(0, 20))
def test_a_signal_is_monotone_up_to_its_next_extremum(force: Signal, t: float) -> None:
    turn = force.next_extremum(t)
    assert turn > t
    assert force.next_discontinuity(t) >= turn
    values = [force(x) for x in np.linspace(t, min(turn, t + 10.0), 50)]
    steps = np.diff(values)
    rounding = 1e-11  # of values up to 20 in a phase of up to 1e4
    assert np.all(steps >= -rounding) or np.all(steps <= rounding)


PIECES: dict[str, Signal] = {
    "constant": Constant(3.0),
    "points": PiecewiseLinear([0.1, 0.2, 0.5], [1.0, -2.0, 4.0]),
    "one point": PiecewiseLinear([0.1], [1.5]),
    "sine": Sine(0.2, -1.5, 30.0, 0.7),
    "smooth step": SmoothStep(1.0, -3.0, 0.2, 0.4),
}


@pytest.mark.parametrize("name", PIECES)
def test_pieces_and_harmonic_are_the_signal(name: str) -> None:
    """What compiled kernels evaluate in the place of the signal itself."""
    signal = PIECES[name]
    pieces, harmonic = signal.pieces(), signal.harmonic()
    for k in range(-20, 100):
        t = 0.00731 * k
        piece = [p for i, p in enumerate(pieces) if p.knot <= t or i == 0][-1]
        x = t - piece.knot
        value = piece.c0 + x * (piece.c1 + x * (piece.c2 + x * piece.c3))
        if harmonic is not None:
            value += harmonic.amplitude * sin(harmonic.angular_frequency * t + harmonic.phase)
        assert value == pytest.approx(signal(t), abs=1e-13)
