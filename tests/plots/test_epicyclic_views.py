"""Views of the epicyclic gear: torques that are those of the file, cusps and dwell."""

from math import pi
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_rgba

from frictionsim.results import Record
from tests.support.records import draw, shown


def gear(sun: float = 0.12, tracer: float = 0.06, angle_deg: float = 180.0, **keys: Any) -> Record:
    """Return a run at a given speed of 20 rad/s: just over a turn from the horizontal."""
    return shown(
        "epicyclic",
        mechanism__sun_radius=sun,
        mechanism__initial_angle_deg=0.0,
        drive__speed=20.0,
        drive__torque=None,
        effects__tracer_point__radius=tracer,
        effects__tracer_point__angle_deg=angle_deg,
        solver__duration=0.32,
        **keys,
    )


def line_of(record: Record, label: str) -> tuple[Any, Any]:
    ax = draw(record, "torque").axes[0]
    line = next(line for line in ax.lines if line.get_label() == label)
    return np.asarray(line.get_xdata()), np.asarray(line.get_ydata())


def test_the_torque_over_the_angle_is_that_of_the_samples() -> None:
    record = shown("epicyclic", output__interval=0.005)
    angle, torque = line_of(record, "for uniform rotation")
    np.testing.assert_array_equal(angle, record.channels["angle"])
    np.testing.assert_array_equal(torque, record.channels["uniform_torque"])


def marks(record: Record) -> tuple[Any, list[str]]:
    """Return the places of the cusps, (n, 2), and the texts of the key."""
    figure = draw(record, "path")
    lines = [line for ax in figure.axes for line in ax.lines if line.get_marker() == "D"]
    places = np.column_stack(lines[0].get_data()) if lines else np.zeros((0, 2))
    return places, [text.get_text() for text in figure.legends[0].get_texts()]


@pytest.mark.parametrize(("mesh", "angle_deg"), [("external", 180.0), ("internal", 0.0)])
@pytest.mark.parametrize("cusps", [2, 5])
def test_the_cusps_are_on_the_sun_or_ring(cusps: int, mesh: str, angle_deg: float) -> None:
    """Those of z = sun/planet cusps are at the angles 2 pi k/z, where the point is on it."""
    record = gear(0.06 * cusps, angle_deg=angle_deg, mechanism__mesh=mesh)
    places, words = marks(record)
    known = 2.0 * pi * np.arange(cusps) / cusps
    expected = 0.06 * cusps * np.column_stack([np.cos(known), np.sin(known)])
    assert places.shape == expected.shape
    for place in expected:
        assert np.min(np.hypot(*(places - place).T)) < 1e-12
    assert f"{cusps + 1} cusps" in words  # the first one twice, in just over a turn
    assert record.quantities["tracer_cusps"].value == cusps + 1


def test_the_longest_dwell_is_that_of_the_summary() -> None:
    record = gear(effects__tracer_point__dwell_distance=0.004)
    dwell = record.quantities["tracer_dwell_time"].value
    figure = draw(record, "path")
    assert f"longest dwell, {dwell:.4g} s" in marks(record)[1]
    for ax in drawings(figure):
        points = marked(ax, "cord")
        x, y = points[len(points) // 2]
        assert np.hypot(x, y) == pytest.approx(0.12, rel=1e-12)  # it dwells at a cusp
        far = np.hypot(*(points[[0, -1]] - (x, y)).T)
        assert far == pytest.approx(0.004, rel=1e-12)


def drawings(figure: Any) -> list[Any]:
    """Return the Axes of the whole and of what is enlarged."""
    return [ax for ax in figure.axes if ax.patches]


def marked(ax: Any, role: str) -> Any:
    """Return the points of a part of the path in the colour of a role, (n, 2)."""
    colour = to_rgba({"cord": "#2B2B2B", "marked": "#0072B2"}[role])
    (line,) = (
        each
        for each in ax.collections
        if len(each.get_segments()) and tuple(each.get_color()[0]) == colour
    )
    pieces = np.array(line.get_segments())
    return np.concatenate([pieces[:, 0], pieces[-1:, 1]])


@pytest.mark.parametrize(("mesh", "angle_deg"), [("external", 180.0), ("internal", 0.0)])
def test_the_swing_of_a_point_beyond_the_rim_is_marked(mesh: str, angle_deg: float) -> None:
    record = gear(0.24, 0.066, angle_deg, mechanism__mesh=mesh)
    swing = record.quantities["tracer_swing"].value
    figure, words = draw(record, "path"), marks(record)[1]
    assert f"swing, {swing:.4g} m" in words
    assert not any("cusp" in text for text in words)
    for ax in drawings(figure):
        points = marked(ax, "marked")
        assert np.hypot(*(points[-1] - points[0])) == pytest.approx(swing, rel=1e-9)
    whole, detail = drawings(figure)
    low, high = detail.get_ylim()
    assert high - low < 3.0 * max(swing, 0.005) < 0.1 * np.ptp(whole.get_ylim())
    assert "tracer point" in words
    # No point of the planet within its rim swings.
    assert not any("swing" in text for text in marks(gear(tracer=0.06))[1])
