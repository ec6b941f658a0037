"""Belts in place: guided strings on their line, motion, patch, and marks that differ in grey."""

from functools import cache
from typing import Any

import numpy as np
import pytest
from matplotlib.collections import LineCollection
from matplotlib.text import Annotation

from frictionsim.motion.belt_path import arc_of, path_of
from frictionsim.plots import draw
from frictionsim.plots.belt_drive import BACKWARD, FORWARD, NORMAL, belt_of, force_handles, patch_of
from frictionsim.plots.belt_geometry import GuidedLine, belt_line
from frictionsim.results import Record
from frictionsim.scenario.toml_data import scenario_value
from tests.support.belt_results import FOUR, TWO, belt_run, lay
from tests.support.records import string, with_channels, with_scenario

IN_PLANE = {"belt_friction": {"mu_s": 1.0}, "contact": {}}


@cache
def by_hand(in_plane: bool = False, four: bool = True) -> Record:
    """Return a coarse belt of which the bodies lie on the ideal line."""
    effects = {"effects": IN_PLANE} if in_plane else {}
    return belt_run(FOUR if four else TWO, bodies=60, samples=41, **effects)


def length_of(line: Any) -> float:
    return float(np.hypot(*np.diff(line, axis=0).T).sum())


def drawn_belt(record: Record) -> list[Any]:
    """Return the lines of the coloured belt in the whole drive."""
    ax = draw(record, "drive").axes[0]
    collections = [
        c for c in ax.collections if isinstance(c, LineCollection) and c.get_array() is not None
    ]
    return list(collections[0].get_segments())


def test_bodies_in_the_plane_are_drawn_as_links() -> None:
    pieces = drawn_belt(by_hand(in_plane=True))
    assert {len(piece) for piece in pieces} == {2}
    _, distances, _ = lay(FOUR)
    assert sum(map(length_of, pieces)) < 0.998 * distances[-1]


def test_each_piece_has_the_tension_of_its_joint() -> None:
    record = by_hand()
    belt = belt_of(record)
    x, y = (record.channels[name][-1] for name in "xy")
    for k, piece in enumerate(belt.pieces):
        np.testing.assert_allclose(piece[0], [x[k - 1], y[k - 1]], atol=1e-5)
        np.testing.assert_allclose(piece[-1], [x[k], y[k]], atol=1e-5)
    np.testing.assert_array_equal(belt.tension, record.channels["tension"][-1])


@pytest.mark.parametrize("make", [by_hand, string])
def test_strips_of_a_guided_string_are_on_the_arc_and_fill_it(make: Any) -> None:
    record = make()
    path = path_of(record)
    ax = draw(record, "drive").axes[0]
    edges = [c for c in ax.collections if isinstance(c, LineCollection) and c.get_zorder() == 5]
    for number, collection in enumerate(edges[::2]):
        lines = collection.get_segments()
        start, stop = arc_of(path, number)
        missing = stop - start - sum(map(length_of, lines))
        # A point that is only just on the arc may have no normal force yet.
        assert -1e-6 < missing < 1.1 * path.length / record.channels["x"].shape[1]
        pulley = scenario_value(record, "mechanism", "pulleys", number)
        away = np.concatenate(lines) - np.array(pulley["center"])
        np.testing.assert_allclose(np.hypot(*away.T), pulley["radius"], rtol=1e-6)


def test_the_tension_of_a_string_is_over_its_true_length_and_arcs() -> None:
    record = string()
    ax = draw(record, "tension").axes[0]
    arc, span = np.pi * 0.027, 0.515
    shaded = sorted((p.get_x(), p.get_width()) for p in ax.patches if p.get_width() > 0)
    np.testing.assert_allclose(shaded, [(span, arc), (2 * span + arc, arc)], rtol=1e-9)
    place = np.asarray(ax.lines[0].get_xdata())
    assert place[-1] - place[0] == pytest.approx(2 * (span + arc), rel=1e-12)
    tension = np.asarray(ax.lines[0].get_ydata())
    assert sorted(tension[:-1]) == sorted(record.channels["tension"][-1])
    assert tension[-1] == tension[0]
    # A joint is halfway between its points: those of a string at one tension are evenly spaced.
    np.testing.assert_allclose(np.diff(place), np.ptp(place) / 60, rtol=0.01)


def test_a_belt_in_the_plane_has_the_line_of_its_joints() -> None:
    assert isinstance(belt_line(by_hand(), -1), GuidedLine)
    assert not isinstance(belt_line(by_hand(in_plane=True), -1), GuidedLine)
    moved = by_hand().channels["x"] + 0.01  # not on the line of its scenario
    assert not isinstance(belt_line(with_channels(by_hand(), x=moved), -1), GuidedLine)


def triangles(record: Record) -> list[float]:
    """Return where the triangles on the spans point, rad from the x axis."""
    ax = draw(record, "drive").axes[0]
    markers = [line.get_marker() for line in ax.lines]
    return [np.radians(m[2] + 90.0) for m in markers if isinstance(m, tuple)]


def arrows(record: Record) -> list[float]:
    """Return the sense in which the curved arrow in each pulley turns, +1 counter-clockwise."""
    senses = []
    for ax, pulley in zip(draw(record, "drive").axes[2:], FOUR, strict=False):
        for text in ax.texts:
            if isinstance(text, Annotation) and text.arrow_patch is not None:
                tip = np.array(text.xy) - (pulley.x, pulley.y)
                tail = np.array(text.xyann) - (pulley.x, pulley.y)
                senses.append(float(np.sign(tail[0] * tip[1] - tail[1] * tip[0])))
    return senses


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_arrows_point_where_belt_and_pulleys_move(direction: float) -> None:
    record = by_hand()
    speed = direction * record.channels["pulley_speed"]
    record = with_channels(record, pulley_speed=speed)
    assert arrows(record) == [direction, direction, -direction, direction]
    # From where the bodies are at the last two samples; the belt goes the way of its numbers.
    x, y = (record.channels[name][-2:] for name in "xy")
    path = path_of(record)
    for angle, span in zip(triangles(record), path.spans, strict=True):
        middle = 0.5 * (np.array(span.start) + np.array(span.end))
        k = int(np.argmin(np.hypot(x[0] - middle[0], y[0] - middle[1])))
        moved = direction * np.array([x[1, k] - x[0, k], y[1, k] - y[0, k]])
        assert moved @ [np.cos(angle), np.sin(angle)] == pytest.approx(np.hypot(*moved), rel=1e-3)


def test_a_drive_at_rest_has_no_arrows() -> None:
    still = np.zeros_like(by_hand().channels["pulley_speed"])
    ran = by_hand().channels["pulley_speed"] * np.linspace(1.0, 0.0, 41)[:, None]
    for speed in (still, ran):
        record = with_channels(by_hand(), pulley_speed=speed)
        assert (triangles(record), arrows(record)) == ([], [])


def with_patch(record: Record, start: float, stop: float) -> Record:
    text = record.attributes["scenario"] + (
        f"\n[effects.patch]\nfrom = {start}\nto = {stop}\nmu_s = 0.3\nmu_k = 0.25\n"
    )
    text = text.replace("[mechanism.belt]\n", "[mechanism.belt]\naxial_rigidity = 1.5e5\n")
    return with_scenario(record, text)


@pytest.mark.parametrize("in_plane", [False, True])
def test_the_patch_lies_on_its_bodies(in_plane: bool) -> None:
    record = with_patch(by_hand(in_plane, four=False), 0.3, 0.6)
    _, distances, _ = lay(TWO)
    pitch = distances[-1] / 60
    first, last = int(np.ceil(0.3 / pitch - 0.5)), int(np.ceil(0.6 / pitch - 0.5)) - 1
    patch = patch_of(record, belt_of(record))
    assert patch.words == "patch: mu_s = 0.3, mu_k = 0.25"
    assert length_of(patch.line) == pytest.approx((last + 1 - first) * pitch, rel=0.02)
    bodies = np.column_stack([record.channels[name][-1][first : last + 1] for name in "xy"])
    for body in bodies:  # where these are at the last sample: it has run on with the belt
        assert np.min(np.hypot(*(patch.line - body).T)) < 0.51 * pitch
    figure = draw(record, "drive")
    assert patch.words in [text.get_text() for text in figure.legends[0].get_texts()]
    lines = [line for line in figure.axes[0].lines if line.get_xydata().shape == patch.line.shape]
    np.testing.assert_array_equal(lines[0].get_xydata(), patch.line)


def test_without_a_patch_there_is_none() -> None:
    assert patch_of(by_hand(), belt_of(by_hand())) is None
    far = with_patch(by_hand(), 5.0, 6.0)
    assert patch_of(far, belt_of(far)) is None


def test_forces_differ_in_their_ends() -> None:
    ends = [style.get("marker") for style in (NORMAL, FORWARD, BACKWARD)]
    assert ends == [None, "o", "s"]
    assert "markerfacecolor" in BACKWARD
    record = by_hand()
    ax = draw(record, "drive").axes[2]
    drawn = {line.get_marker(): line for line in ax.lines if line.get_marker() in ("o", "s")}
    on = record.channels["pulley_index"][-1] == 0
    friction = record.channels["friction_force"][-1][on]
    largest = max(np.abs(record.channels[f"{n}_force"][-1]).max() for n in ("normal", "friction"))
    seen = friction[np.abs(friction) > 0.02 * largest]
    counts = {marker: len(line.get_xdata()) for marker, line in drawn.items()}
    expected = {"o": int((seen > 0).sum()), "s": int((seen < 0).sum())}
    assert counts == {marker: count for marker, count in expected.items() if count}
    assert counts
    named = {handle.get_label(): handle.get_marker() for handle in force_handles(True)}
    # Positive along z x n, as the channel has it.
    assert named["friction on the belt, counter-clockwise"] == "o"
    assert named["friction on the belt, clockwise"] == "s"
