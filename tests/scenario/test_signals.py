"""Signals: values, derivatives, discontinuities and extrema; columns of files."""

from math import inf, pi, sin
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from frictionsim.scenario.schema import Params, unit_field
from frictionsim.scenario.signal_tables import (
    PiecewiseLinearTable,
    SpeedOrTimeSignal,
    SpeedTable,
    TimeSignal,
    signal_from,
)
from frictionsim.scenario.signals import Constant, PiecewiseLinear, Signal, Sine, SmoothStep


class Drive(Params):
    force: TimeSignal = unit_field("N", "Force.")


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


LOG = "t;n;F_N\n0,0;7;10,5\n0,5;8;20,5\n"


@pytest.mark.parametrize(
    ("text", "keys"),
    [
        (LOG, {"time": "t", "value": "F_N", "delimiter": ";", "decimal": ","}),
        (LOG, {"time": 1, "value": 3, "decimal": ","}),
        (LOG, {"value": "F_N", "decimal": ","}),
        (LOG.replace(";", "\t"), {"value": "F_N", "decimal": ","}),
        (LOG.replace(",", ".").replace(";", ","), {"time": "t", "value": "F_N"}),
        (LOG.replace(",", ".").replace(";", "  "), {"time": "t", "value": "F_N"}),
        (LOG.replace(",", ".").replace(";", "|"), {"value": 3, "delimiter": "|"}),
        ("\ufeff" + LOG, {"time": "t", "value": "F_N", "decimal": ","}),
        # As a logger writes it: lines above the names, units below them, comments, empty lines.
        (
            f"Logger 7\nserial;123\n# made by hand; t;F_N\n{LOG}".replace(
                "F_N\n", "F_N\ns;1;N\n\n"
            ),
            {"time": "t", "value": "F_N", "decimal": ","},
        ),
        # Quotes are around cells with the delimiter or an end of line in them.
        (
            't,"note, free","F_N"\n"0.0","a\n""b""",10.5\n0.5,"c, d",20.5\n',
            {"time": "t", "value": "F_N", "delimiter": ","},
        ),
        (" t ; F_N \n 0.0 ; 10.5 \n 0.5 ; 20.5 \n", {"time": "t", "value": " F_N"}),
        # The order of columns is that of the keys.
        ("F_N,t\n10.5,0.0\n20.5,0.5\n", {"time": "t", "value": "F_N"}),
        ("10.5,0.0\n20.5,0.5\n", {"time": 2, "value": 1}),
        # Two columns, of which nothing need be told but what a comma is.
        ("# s N\n\n0 10.5\n0.5\t20.5  # end\n", {}),
        ("0,0;10,5\n0,5;20,5\n", {"decimal": ","}),
        ("t;F\n-0,0;10,5\n0,5;20,5\n", {"decimal": ","}),
    ],
)
def test_columns_are_read_by_name_or_number(
    text: str, keys: dict[str, Any], tmp_path: Path
) -> None:
    (tmp_path / "log.csv").write_bytes(text.encode())
    force = signal({"csv": "log.csv", **keys}, tmp_path)
    assert isinstance(force, PiecewiseLinear)
    assert [force(t) for t in (0.0, 0.25, 0.5)] == [10.5, 15.5, 20.5]
    assert [force.next_discontinuity(t) for t in (-1.0, 0.0, 0.5)] == [0.0, 0.5, inf]


class BeltDrive(Params):
    torque: SpeedOrTimeSignal | None = unit_field("N m", None)


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


def test_a_torque_over_speed_comes_from_columns(tmp_path: Path) -> None:
    (tmp_path / "motor.csv").write_text("w;M\n-10;5\n10;-5\n")

    def torque(**keys: Any) -> Any:
        table = {"torque": {"csv": "motor.csv", **keys}}
        return BeltDrive.model_validate(table, context={"folder": tmp_path}).torque

    over_speed = torque(speed="w", value="M")
    assert isinstance(over_speed, SpeedTable)
    assert (over_speed.speed, over_speed.value) == ((-10.0, 10.0), (5.0, -5.0))
    assert torque(speed=1) == over_speed
    assert isinstance(torque(time="w", value="M"), PiecewiseLinearTable)
    assert isinstance(torque(), PiecewiseLinearTable)


signals = st.one_of(
    st.builds(
        Sine, st.floats(-10, 10), st.floats(0.1, 10), st.floats(0.01, 1000), st.floats(-10, 10)
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
