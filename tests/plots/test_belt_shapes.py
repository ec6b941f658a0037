"""Places along belts: of guided strings on their line, of others through their joints."""

from functools import cache

import numpy as np
import pytest

from frictionsim.results import Record
from tests.support.belt_results import FOUR, belt_run, lay
from tests.support.records import draw, string, with_channels

IN_PLANE = {"belt_friction": {"mu_s": 1.0}, "contact": {}}


@cache
def by_hand(in_plane: bool = False) -> Record:
    """Return a coarse belt of which the bodies lie on the ideal line."""
    effects = {"effects": IN_PLANE} if in_plane else {}
    return belt_run(FOUR, bodies=60, samples=41, **effects)


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
