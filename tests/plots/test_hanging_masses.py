"""Views of a pulley with hanging masses, against closed forms and differences of channels."""

from functools import cache
from math import atan, exp, pi, sin
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from frictionsim.results import Record
from tests.support.records import draw, shown

LIFT, SLACK_ROPE = "lift", "hard/lift_slack_rope"
M1, M2, R, G = 783.0, 1023.0, 0.265, 9.81
R_S = 0.05 * sin(atan(0.2))
STATIC, KINETIC = exp(0.127 * pi), exp(0.116 * pi)
START, END = 11.432540019, 13.631891874  # of the slip of the cord, by the independent program


def solved(name: str, **changes: Any) -> Record:
    return shown(name, solver__rtol=1e-8, **changes)


def panel(figure: Figure, label: str) -> Any:
    return next(a for a in figure.axes if a.get_ylabel().replace("\n", " ").startswith(label))


def line(ax: Any, label: str = "") -> tuple[Any, Any]:
    """Return the finite points of a line of many points."""
    (curve,) = (
        one
        for one in ax.lines
        if len(one.get_xdata()) > 100
        and (not label or one.get_label() == label)
        and one.get_linewidth() > 1.0
    )
    time, values = np.asarray(curve.get_xdata()), np.asarray(curve.get_ydata())
    return time[np.isfinite(values)], values[np.isfinite(values)]


@cache
def drawn(name: str = LIFT, view: str = "response") -> Figure:
    return draw(solved(name), view)


def test_the_torques_to_lift_and_to_hold_are_those_of_the_weights() -> None:
    ax = panel(drawn(), "drive torque")
    hold, lift = (R * (M1 - M2) + sign * R_S * (M1 + M2) for sign in (-1.0, 1.0))
    levels = {one.get_label(): one.get_ydata()[0] for one in ax.lines}
    for way, mass in (("lift", lift), ("hold", hold)):
        assert levels[f"to {way}: −{-G * mass:.1f} N m"] == pytest.approx(G * mass)  # noqa: RUF001
    # It breaks away where the torque crosses the upper one.
    time, torque = line(ax)
    assert np.interp(0.666887698, time, torque) == pytest.approx(G * lift, rel=1e-6)


def test_tensions_and_the_range_in_which_the_cord_sticks() -> None:
    ax = panel(drawn(), "tension")
    _, car = line(ax, "car")
    _, other = line(ax, "counterweight")
    assert car[0] == pytest.approx(M1 * G)
    assert other[0] == pytest.approx(M2 * G)
    (band,) = ax.collections
    edges = band.get_paths()[0].vertices
    at_start = edges[edges[:, 0] == 0.0][:, 1]
    assert min(at_start) == pytest.approx(M1 * G / STATIC)
    assert max(at_start) == pytest.approx(M1 * G * STATIC)
    # Where the cord slips there is no such range.
    places = np.concatenate([path.vertices[:, 0] for path in band.get_paths()])
    assert {*places[(places > START - 1e-3) & (places < END + 1e-3)]} != set()
    assert not np.any((places > START + 1e-6) & (places < END - 1e-6))


def test_a_slack_rope_is_the_way_of_the_car_beyond_that_of_the_rim() -> None:
    record = solved(SLACK_ROPE)
    ax = panel(drawn(SLACK_ROPE), "slack rope")
    assert [one.get_label() for one in ax.lines if len(one.get_xdata()) > 100] == ["car"]
    time, gap = line(ax, "car")
    # Free flight from the start of slack to the first impact, relative to the rim.
    speed = record.channels["car_velocity"] - 0.15 * record.channels["angular_velocity"]
    at = record.channels["time"]
    until = at <= 0.87
    steps = 0.5 * (speed[1:] + speed[:-1]) * np.diff(at)
    last = at[until][-1]
    assert np.interp(last, time, gap) == pytest.approx(steps[until[1:]].sum(), abs=5e-5)
    assert gap.max() == pytest.approx(0.0273, abs=2e-4)


def test_the_ratio_slips_at_the_limit_of_euler_and_eytelwein_with_the_rate_of_the_slip() -> None:
    figure = drawn(view="traction")
    ax = panel(figure, "counterweight's tension")
    time, ratio = line(ax)
    slips = (time > START + 1e-6) & (time < END - 1e-6)
    assert ratio[slips] == pytest.approx(KINETIC)
    assert ratio.max() == pytest.approx(STATIC, rel=1e-6)
    assert time[np.argmax(ratio)] == pytest.approx(START, abs=1e-6)
    levels = sorted(one.get_ydata()[0] for one in ax.lines if len(one.get_xdata()) == 2)
    assert levels == pytest.approx([1.0 / STATIC, 1.0 / KINETIC, KINETIC, STATIC])
    (legend,) = figure.legends
    texts = [text.get_text() for text in legend.get_texts()]
    assert texts[0] == f"limit of static friction: {1.0 / STATIC:.4g} and {STATIC:.4g}"
    assert texts[1] == f"limit of kinetic friction: {1.0 / KINETIC:.4g} and {KINETIC:.4g}"
    assert texts[2] == "the cord slips"
    for shaded in figure.axes:
        (span,) = shaded.patches
        assert span.get_x() == pytest.approx(START, abs=1e-6)
        assert span.get_x() + span.get_width() == pytest.approx(END, abs=1e-6)
    time, speed = line(panel(figure, "speed of slip"))
    _, slip = line(panel(figure, "slip of the cord"))
    way = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time))])
    assert way[-1] == pytest.approx(slip[-1], rel=1e-4)
    assert slip[-1] > 1.0
    still = draw(solved("hard/lift_traction_limit"), "traction")
    assert [shaded for ax in still.axes for shaded in ax.patches] == []
