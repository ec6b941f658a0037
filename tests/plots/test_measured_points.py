"""Measured values, or those of a digitised figure, drawn as points over a run."""

from pathlib import Path

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.errors import ArgumentError
from tests.support.records import shown

RPM = np.pi / 30.0
TIMES, SPEEDS = [0.1, 0.7, 1.9], [0.0, 12.5, 190.25]  # s, rpm


@pytest.fixture
def pulley() -> fs.Result:
    return fs.Result(shown("pulley_return"))


def test_points_are_drawn_in_the_unit_of_the_channel(pulley: fs.Result, tmp_path: Path) -> None:
    file = tmp_path / "speed.csv"
    rows = [f"{t};{n}\n" for t, n in zip(TIMES, SPEEDS, strict=True)]
    file.write_text("t [s];n [rpm]\n" + "".join(rows))
    by_unit = {"time": TIMES, "n": SPEEDS}
    for given in (
        {"data": file, "measured": {"angular_velocity": "n"}},
        {"data": str(file), "measured": "angular_velocity=2"},
        {"data": by_unit, "measured": ["angular_velocity=n"], "units": {"angular_velocity": "rpm"}},
    ):
        (ax,) = fs.plot(pulley, **given).axes
        (points,) = [line for line in ax.lines if line.get_marker() == "o"]
        assert points.get_xdata() == pytest.approx(TIMES)
        assert points.get_ydata() == pytest.approx(np.multiply(SPEEDS, RPM))
        assert points.get_label() == "angular velocity, measured"


def test_points_of_a_member_are_beside_chosen_channels() -> None:
    belt = fs.Result(shown("belt_string"))
    data = {"time": [belt.record.time[0], belt.record.time[-1]], "w": [3.0, 4.0]}
    speed, torque = fs.plot(
        belt, channels="pulley_torque", data=data, measured={"pulley_speed.driven": "w"}
    ).axes[::-1]
    (points,) = [line for line in speed.lines if line.get_marker() == "o"]
    assert list(points.get_ydata()) == [3.0, 4.0]
    assert not [line for line in torque.lines if line.get_marker() == "o"]


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"measured": "angle"}, "data: missing"),
        ({"data": {"time": TIMES}}, "measured: missing"),
        ({"data": {"time": TIMES, "x": TIMES}, "measured": "angl=x"}, "measured: unknown channel"),
        ({"data": {"time": [98.0, 99.0], "x": [0, 0]}, "measured": "angle=x"}, "data: the times"),
        ({"data": {"time": TIMES}, "measured": "angle=time"}, "'time' has the times"),
        ({"data": {"time": TIMES}, "measured": "mode=time"}, "measured: 'mode' counts"),
        (
            {"data": {"time": TIMES, "x": TIMES}, "measured": "angle=x", "view": "mechanism"},
            "measured: the view 'mechanism' does not take that",
        ),
    ],
)
def test_what_cannot_be_drawn_is_refused(pulley: fs.Result, given: dict, said: str) -> None:
    with pytest.raises(ArgumentError, match=said):
        fs.plot(pulley, **given)
