"""Views of a pulley with hanging masses, against closed forms and differences of channels."""

from functools import cache
from math import atan, exp, pi, sin
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

import frictionsim as fs
from frictionsim.results import SLACK, STICK, Record
from tests.support.records import draw, shown, with_channels
from tests.support.scenarios import pulley

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


def test_the_panels_of_a_lift() -> None:
    labels = [ax.get_ylabel().replace("\n", " ") for ax in drawn().axes]
    assert labels == [
        *("drive torque, N m", "tension of the rope, N", "friction torque, N m"),
        *("velocity, m/s", "height above the start, m", "slip of the cord, m"),
    ]
    labels = [ax.get_ylabel() for ax in drawn(SLACK_ROPE).axes]
    assert labels[-1] == "slack rope, m"
    assert len(labels) == 6


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


def test_the_last_rest_is_that_of_the_car_which_slides_on_while_the_sheave_sticks() -> None:
    record = solved(LIFT)
    stuck = [e.time for e in record.transitions if e.contact == "shaft" and e.mode_to == STICK]
    assert START < stuck[-1] < END
    assert record.quantities["last_rest_time"].value == pytest.approx(END, abs=1e-6)
    (legend,) = drawn().legends
    texts = [text.get_text() for text in [*drawn().axes[0].texts, *legend.get_texts()]]
    assert texts.count("the shaft sticks") == 1
    assert not {"stick", "sticking"} & {*texts}


def test_friction_is_within_its_limit_of_the_tensions() -> None:
    figure = drawn()
    ax = panel(figure, "friction torque")
    time, torque = line(ax)
    upper = max(
        (one for one in ax.lines if one.get_linestyle() == "--"),
        key=lambda one: float(np.max(one.get_ydata())),
    )
    assert upper.get_ydata()[0] == pytest.approx(R_S * (M1 + M2) * G)
    limit = np.interp(time, upper.get_xdata(), upper.get_ydata())
    assert np.all(np.abs(torque) <= limit * 1.01)


def test_speeds_are_the_rates_of_height_and_angle() -> None:
    record = solved(LIFT)
    ax = panel(drawn(), "velocity")
    time = record.channels["time"]
    middle = 0.5 * (time[1:] + time[:-1])
    for label, way in (
        ("car", record.channels["car_position"]),
        ("rim of the pulley", R * record.channels["angle"]),
    ):
        seen = np.interp(middle, *line(ax, label))
        assert seen == pytest.approx(np.diff(way) / np.diff(time), abs=8e-3)


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


def test_both_sides_of_an_impact_are_drawn() -> None:
    record = solved(SLACK_ROPE, effects__shaft_friction=None)
    impact = next(e for e in record.transitions if e.mode_from == e.mode_to == SLACK)
    ax = panel(draw(record), "velocity")
    time, speed = line(ax, "rim of the pulley")
    drawn = speed[time == impact.time][[0, -1]]
    number = list(record.events["time"]).index(impact.time)
    sides = [record.events[f"angular_velocity_{side}"][number] for side in ("before", "after")]
    assert drawn == pytest.approx(0.15 * np.array(sides), rel=1e-12)
    assert sides[1] < sides[0]


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


def test_a_window_shows_its_part_of_the_slip_and_times_of_its_beginning_and_end_alone() -> None:
    start, end = f"{START:.4g} s", f"{END:.4g} s"
    # Where the window ends nothing happens.
    for low, high, times in ((None, None, [start, end]), (12.0, 13.0, []), (12.0, None, [end])):
        ax = draw(solved(LIFT), "traction", window=(low, high)).axes[0]
        assert [text.get_text() for text in ax.texts] == times
        (span,) = ax.patches
        assert span.get_x() == pytest.approx(START)
        assert span.get_x() + span.get_width() == pytest.approx(END)


@pytest.mark.parametrize("drive", ["drive_torque", "drive_force"])
def test_a_drive_that_is_zero_throughout_has_no_panel(drive: str) -> None:
    record = solved(LIFT)
    torque = record.channels["drive_torque"]

    def panels(values: Any) -> list[str]:
        units = record.units | {drive: record.units["drive_torque"]}
        figure = draw(with_channels(record, **{drive: values})._replace(units=units))
        return [ax.get_ylabel().replace("\n", " ").split(",")[0] for ax in figure.axes]

    words = drive.replace("_", " ")
    assert words not in panels(0.0 * torque)
    assert words in panels(torque)
    assert "friction torque" in panels(0.0 * torque)


def test_a_cord_that_cannot_slip_has_no_view_of_its_traction(told: Any, here: Path) -> None:
    fs.Result(solved(SLACK_ROPE)).save(here / "a.h5")
    assert (
        told("plot", "a.h5", "--view", "all")[0]
        == "a-response.png\na-friction.png\na-mechanism.png\n"
    )


def test_limits_are_drawn_with_a_chosen_channel_and_without_masses() -> None:
    (ax,) = draw(solved(LIFT), channels="drive_torque").axes
    assert len([one for one in ax.lines if one.get_label().startswith("to ")]) == 2

    data = pulley(
        drive__force=None,
        drive__torque={"time": [0.0, 1.0], "value": [0.0, 200.0]},
        solver__duration=1.0,
        solver__rtol=1e-6,
    )
    ax = panel(draw(fs.solve(data).record), "drive torque")
    geometry, journal = data["mechanism"], data["effects"]["shaft_friction"]
    radius = journal["shaft_radius"] * sin(atan(journal["mu_s"]))
    wanted = geometry["load"] * (geometry["cord_radius"] + radius)
    assert f"to lift: {wanted:.1f} N m" in {one.get_label() for one in ax.lines}
