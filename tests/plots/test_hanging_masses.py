"""Views of a pulley with hanging masses: channels, phases, and closed forms of limits."""

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
CAR, COUNTERWEIGHT = "rope_tension_car", "rope_tension_counterweight"
STATIC, KINETIC = exp(0.127 * pi), exp(0.116 * pi)


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


def assert_drawn(ax: Any, record: Record, values: Any, label: str = "") -> None:
    """Compare a line with the values of all samples but those at events, where it may jump."""
    plain = ~np.isin(record.time, record.events["time"])
    np.testing.assert_array_equal(np.interp(record.time, *line(ax, label))[plain], values[plain])


@cache
def drawn(name: str = LIFT, view: str = "response") -> Figure:
    return draw(solved(name), view)


def test_the_torques_to_lift_and_to_hold_are_those_of_the_weights() -> None:
    record, ax = solved(LIFT), panel(drawn(), "drive torque")
    hold, lift = (G * (R * (M1 - M2) + sign * R_S * (M1 + M2)) for sign in (-1.0, 1.0))
    levels = {one.get_label(): one.get_ydata()[0] for one in ax.lines}
    for way, torque in (("lift", lift), ("hold", hold)):
        assert levels[f"to {way}: −{-torque:.1f} N m"] == pytest.approx(torque)  # noqa: RUF001
    assert_drawn(ax, record, record.channels["drive_torque"])


def test_tensions_and_the_range_in_which_the_cord_sticks() -> None:
    record, ax = solved(LIFT), panel(drawn(), "tension")
    car = record.channels[CAR]
    assert_drawn(ax, record, car, "car")
    assert_drawn(ax, record, record.channels[COUNTERWEIGHT], "counterweight")
    (band,) = ax.collections
    edges = band.get_paths()[0].vertices
    at_start = edges[edges[:, 0] == 0.0][:, 1]
    assert [min(at_start), max(at_start)] == pytest.approx([car[0] / STATIC, car[0] * STATIC])
    # Where the cord slips there is no such range.
    places = np.concatenate([path.vertices[:, 0] for path in band.get_paths()])
    start, end = (event.time for event in record.transitions if event.contact == "cord")
    assert {start, end} <= {*places}
    assert not np.any((places > start) & (places < end))


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


def test_the_ratio_of_the_tensions_has_its_limits_and_the_slip_its_rate() -> None:
    record, figure = solved(LIFT), drawn(view="traction")
    start, end = (event.time for event in record.transitions if event.contact == "cord")
    ax = panel(figure, "counterweight's tension")
    assert_drawn(ax, record, record.channels[COUNTERWEIGHT] / record.channels[CAR])
    levels = sorted(one.get_ydata()[0] for one in ax.lines if len(one.get_xdata()) == 2)
    assert levels == pytest.approx([1.0 / STATIC, 1.0 / KINETIC, KINETIC, STATIC])
    (legend,) = figure.legends
    texts = [text.get_text() for text in legend.get_texts()]
    assert texts[0] == f"limit of static friction: {1.0 / STATIC:.4g} and {STATIC:.4g}"
    assert texts[1] == f"limit of kinetic friction: {1.0 / KINETIC:.4g} and {KINETIC:.4g}"
    assert texts[2] == "the cord slips"
    for shaded in figure.axes:
        (span,) = shaded.patches
        assert [span.get_x(), span.get_x() + span.get_width()] == pytest.approx([start, end])
    time, speed = line(panel(figure, "speed of slip"))
    _, slip = line(panel(figure, "slip of the cord"))
    way = np.concatenate([[0.0], np.cumsum(0.5 * (speed[1:] + speed[:-1]) * np.diff(time))])
    assert way[-1] == pytest.approx(slip[-1], rel=1e-4)
    assert slip[-1] > 1.0
    still = draw(solved("hard/lift_traction_limit"), "traction")
    assert [shaded for ax in still.axes for shaded in ax.patches] == []
