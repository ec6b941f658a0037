"""Belts in place: guided strings on their line, motion, patch, and marks that differ in grey."""

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np
import pytest
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.text import Annotation

from frictionsim.results import Record
from tests.support.belt_results import FOUR, TWO, Pulley, belt_run, lay
from tests.support.cases import slow
from tests.support.records import draw, string, with_channels, with_scenario

IN_PLANE = {"belt_friction": {"mu_s": 1.0}, "contact": {}}


@cache
def by_hand(in_plane: bool = False, four: bool = True) -> Record:
    """Return a coarse belt of which the bodies lie on the ideal line."""
    effects = {"effects": IN_PLANE} if in_plane else {}
    return belt_run(FOUR if four else TWO, bodies=60, samples=41, **effects)


def length_of(line: Any) -> float:
    return float(np.hypot(*np.diff(line, axis=0).T).sum())


def drawn_belt(record: Record) -> LineCollection:
    """Return the coloured belt in the whole drive."""
    ax = draw(record, "drive").axes[0]
    collections = [
        c for c in ax.collections if isinstance(c, LineCollection) and c.get_array() is not None
    ]
    return collections[0]


def test_bodies_in_the_plane_are_drawn_as_links() -> None:
    pieces = drawn_belt(by_hand(in_plane=True)).get_segments()
    assert {len(piece) for piece in pieces} == {2}
    _, distances, _ = lay(FOUR)
    assert sum(map(length_of, pieces)) < 0.998 * distances[-1]


def test_each_piece_has_the_tension_of_its_joint() -> None:
    record = by_hand()
    belt = drawn_belt(record)
    x, y = (record.channels[name][-1] for name in "xy")
    pieces = belt.get_segments()
    assert len(pieces) == len(x)
    for k, piece in enumerate(pieces):
        np.testing.assert_allclose(piece[0], [x[k - 1], y[k - 1]], atol=1e-5)
        np.testing.assert_allclose(piece[-1], [x[k], y[k]], atol=1e-5)
    np.testing.assert_array_equal(belt.get_array(), record.channels["tension"][-1])


def arc_of(pulleys: Sequence[Pulley], number: int) -> float:
    """Return the length of the arc of a pulley, m, by the angle through which the belt turns."""
    line, _, under = lay(pulleys)
    pulley = pulleys[number]
    away = (line[under == number] - (pulley.x, pulley.y)) @ [1.0, 1.0j]
    return pulley.radius * float(np.ptp(np.unwrap(np.angle(away))))


@pytest.mark.parametrize(("make", "pulleys"), [(by_hand, FOUR), (string, TWO)])
def test_strips_of_a_guided_string_are_on_the_arc_and_fill_it(
    make: Any, pulleys: Sequence[Pulley]
) -> None:
    record = make()
    length = lay(pulleys)[1][-1]
    ax = draw(record, "drive").axes[0]
    edges = [c for c in ax.collections if isinstance(c, LineCollection) and c.get_zorder() == 5]
    for number, collection in enumerate(edges[::2]):
        lines = collection.get_segments()
        missing = arc_of(pulleys, number) - sum(map(length_of, lines))
        # A point that is only just on the arc may have no normal force yet.
        assert -1e-6 < missing < 1.1 * length / record.channels["x"].shape[1]
        pulley = pulleys[number]
        away = np.concatenate(lines) - (pulley.x, pulley.y)
        np.testing.assert_allclose(np.hypot(*away.T), pulley.radius, rtol=1e-6)


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
    def length(record: Record) -> float:
        return float(np.ptp(draw(record, "tension").axes[0].lines[0].get_xdata()))

    _, distances, _ = lay(FOUR)  # chords of arcs: shorter by a few millionths
    assert length(by_hand()) == pytest.approx(distances[-1], rel=1e-5)
    # Chords between 60 bodies are shorter by some thousandths.
    x, y = (by_hand().channels[name][-1] for name in "xy")
    middle = 0.5 * (np.stack([x, y]) + np.roll(np.stack([x, y]), 1, axis=1))
    chords = np.hypot(*(middle - np.roll(middle, 1, axis=1))).sum()
    assert chords < 0.998 * distances[-1]
    moved = by_hand().channels["x"] + 0.01  # not on the line of its scenario
    for record in (by_hand(in_plane=True), with_channels(by_hand(), x=moved)):
        assert length(record) == pytest.approx(chords, rel=1e-12)


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


@pytest.mark.parametrize("direction", [slow(1.0), -1.0])
def test_arrows_point_where_belt_and_pulleys_move(direction: float) -> None:
    record = by_hand()
    speed = direction * record.channels["pulley_speed"]
    record = with_channels(record, pulley_speed=speed)
    assert arrows(record) == [direction, direction, -direction, direction]
    # From where the bodies are at the last two samples; the belt goes the way of its numbers.
    x, y = (record.channels[name][-2:] for name in "xy")
    line, _, under = lay(FOUR)
    starts = np.flatnonzero(np.diff(under, prepend=0) < 0)
    ends = np.flatnonzero((under < 0) & (np.roll(under, -1) >= 0))
    for angle, start, end in zip(triangles(record), starts, ends, strict=True):
        middle = 0.5 * (line[start] + line[end])
        k = int(np.argmin(np.hypot(x[0] - middle[0], y[0] - middle[1])))
        moved = direction * np.array([x[1, k] - x[0, k], y[1, k] - y[0, k]])
        assert moved @ [np.cos(angle), np.sin(angle)] == pytest.approx(np.hypot(*moved), rel=1e-3)


def test_a_drive_at_rest_has_no_arrows() -> None:
    still = np.zeros_like(by_hand().channels["pulley_speed"])
    ran = by_hand().channels["pulley_speed"] * np.linspace(1.0, 0.0, 41)[:, None]
    for speed in (still, ran):
        record = with_channels(by_hand(), pulley_speed=speed)
        assert (triangles(record), arrows(record)) == ([], [])


def handles(figure: Figure) -> list[Any]:
    """Return the lines in the key of a picture."""
    return list(figure.legends[0].legend_handles)


def patches(figure: Figure) -> list[Any]:
    return [handle for handle in handles(figure) if handle.get_label().startswith("patch")]


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
    figure = draw(record, "drive")
    (handle,) = patches(figure)
    assert handle.get_label() == "patch: mu_s = 0.3, mu_k = 0.25"
    lines = [
        one.get_xydata()
        for one in figure.axes[0].lines
        if (one.get_color(), one.get_linestyle()) == (handle.get_color(), "--")
    ]
    (line,) = lines
    assert length_of(line) == pytest.approx((last + 1 - first) * pitch, rel=0.02)
    bodies = np.column_stack([record.channels[name][-1][first : last + 1] for name in "xy"])
    for body in bodies:  # where these are at the last sample: it has run on with the belt
        assert np.min(np.hypot(*(line - body).T)) < 0.51 * pitch


def test_without_a_patch_there_is_none() -> None:
    for record in (by_hand(), with_patch(by_hand(), 5.0, 6.0)):
        assert patches(draw(record, "drive")) == []


def test_forces_differ_in_their_ends() -> None:
    record = by_hand()
    figure = draw(record, "drive")
    ax = figure.axes[2]
    drawn = {line.get_marker(): line for line in ax.lines if line.get_marker() in ("o", "s")}
    on = record.channels["pulley_index"][-1] == 0
    friction = record.channels["friction_force"][-1][on]
    largest = max(np.abs(record.channels[f"{n}_force"][-1]).max() for n in ("normal", "friction"))
    seen = friction[np.abs(friction) > 0.02 * largest]
    counts = {marker: len(line.get_xdata()) for marker, line in drawn.items()}
    expected = {"o": int((seen > 0).sum()), "s": int((seen < 0).sum())}
    assert counts == {marker: count for marker, count in expected.items() if count}
    assert counts
    named = {handle.get_label(): handle for handle in handles(figure)}
    # Positive along z x n, as the channel has it.
    ways = [named[f"friction on the belt, {way}clockwise"] for way in ("counter-", "")]
    forces = [named["normal force"], *ways]
    assert [handle.get_marker() for handle in forces] == ["None", "o", "s"]
    assert ways[1].get_markerfacecolor() == "white"
