"""Pictures of belt drives, from synthetic results with known tensions and forces."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.errors import InputError
from frictionsim.results import Transition
from tests.plots.test_plots import MAX_BYTES
from tests.support.belt_results import FOUR, TWO, Pulley, belt_run, lay, tension_at
from tests.support.cases import one_in
from tests.support.records import VIEWS, draw, png, shown, with_channels, without, words_of

RING = [Pulley(f"p{i}", 0.5 * np.cos(0.483 * i), 0.5 * np.sin(0.483 * i), 0.05) for i in range(13)]
FORCES = ["normal_force", "friction_force"]
NEEDED = {
    "speeds": ["pulley_speed", "pulley_torque"],
    "drive": ["x", "y", "tension", *FORCES, "pulley_index", "sticking"],
    "tension": ["x", "y", "pulley_index", "tension"],
    "body": ["pulley_speed", "tension", *FORCES, "slip_velocity", "pulley_index"],
}


@pytest.mark.parametrize("view", VIEWS["belt_drive"])
def test_each_view_requires_its_channels_only(view: str) -> None:
    record = belt_run(samples=5)
    kept = ("time", *NEEDED[view])
    others = [name for name in record.channels if name not in kept]
    draw(without(record, *others), view)
    for name in NEEDED[view]:
        with pytest.raises(InputError, match=rf"no channel {name}; the view needs .*{name}"):
            draw(without(record, name), view)


@pytest.mark.parametrize("view", one_in(3, VIEWS["belt_drive"]))
def test_pulleys_are_named_and_a_belt_without_friction_has_no_word_of_it(view: str) -> None:
    words = words_of(draw(shown("four pulleys"), view))
    assert all(pulley.name in words for pulley in FOUR)
    record = belt_run(samples=5, effects={})
    words = words_of(draw(without(record, "friction_force", "slip_velocity", "sticking"), view))
    assert "stick" not in words
    assert "friction" not in words


@pytest.mark.parametrize(
    ("view", "bodies"), one_in(4, list(zip(VIEWS["belt_drive"], [400, 1500] * 2, strict=True)))
)
def test_pictures_of_large_belts_are_small_files_with_details_of_the_first_pulleys(
    view: str, bodies: int
) -> None:
    figure = draw(belt_run(RING, bodies=bodies, samples=11), view)
    assert len(png(figure)) < MAX_BYTES
    if view == "drive":
        assert len([ax for ax in figure.axes if ax.get_title() in {p.name for p in RING}]) == 4


def test_a_body_is_chosen_by_its_number() -> None:
    assert "body 7 on driven" in words_of(draw(shown("two pulleys"), "body", body=7))
    assert "body 32 on driver" in words_of(draw(shown("two pulleys"), "body"))


def axes_of_body(touched: np.ndarray, body: int | None = None, drop: str = "") -> list[Any]:
    record = without(belt_run(bodies=6, samples=5), *drop)
    return draw(with_channels(record, pulley_index=touched), "body", body=body).axes


KINDS = np.array([[0.0, -1, -1, -1, 1, 1], [0, 0, -1, -1, 1, 1], [0, 0, -1, -1, -1, 1]])
FREE = KINDS[[0, 1, 1, 2, 2]]


def test_a_body_that_meets_no_pulley_is_drawn_with_its_place() -> None:
    axes = axes_of_body(FREE, 2)
    assert axes[0].get_title(loc="left") == (
        "body 2 meets no pulley from 0 s to 2 s: there are no forces on it, and no slip"
    )
    labels = [" ".join(ax.get_ylabel().split()) for ax in axes]
    assert labels == [
        *("pulley speed, rad/s", "tension before body 2, N"),
        *("x of body 2, m", "y of body 2, m"),
    ]
    run = belt_run(bodies=6, samples=5)
    for ax, name in zip(axes[1:], ("tension", "x", "y"), strict=True):
        np.testing.assert_allclose(ax.lines[0].get_ydata(), run.channels[name][:, 2])
    assert len(axes_of_body(FREE, 2, drop="xy")) == 2


def test_the_body_by_default_meets_a_pulley() -> None:
    axes = axes_of_body(FREE)  # the middle of the first span, body 2, meets none
    assert axes[0].get_title(loc="left") == ""
    assert "body 0" in axes[1].get_ylabel()
    assert "body 0" in axes_of_body(np.full(FREE.shape, -1.0))[1].get_ylabel()
    touched = FREE.copy()
    touched[4, 2] = 1.0
    assert "body 2" in axes_of_body(touched)[1].get_ylabel()


IN_PLANE = {"effects": {"belt_friction": {"mu_s": 1.0}, "contact": {}}}


@pytest.mark.parametrize("changes", [{}, IN_PLANE])
def test_positions_along_the_belt_start_at_the_first_pulley_and_means_are_at_positions(
    changes: dict[str, Any],
) -> None:
    bodies = 600
    _, distances, under = lay(FOUR)
    ax = draw(belt_run(FOUR, bodies=bodies, **changes), "tension").axes[0]
    pitch = distances[-1] / bodies
    place, at_end = (np.asarray(values, dtype=float) for values in ax.lines[0].get_data())
    assert np.ptp(place) == pytest.approx(distances[-1], rel=1e-3)
    label = ax.get_xlabel().replace("\n", " ")
    assert f"from {FOUR[0].name} towards {FOUR[1].name}" in label
    # The first joint is within a body of where the belt leaves the pulley.
    expected = tension_at(place[:-1], under, distances, 1.0)
    slope = 4.0 * 560.0 / distances[-1]
    assert np.max(np.abs(at_end[:-1] - expected)[2:-2]) < 2.0 * pitch * 2.0 * slope
    # The first stretch on a pulley is on the second one, where the ideal belt is.
    ends = distances[np.flatnonzero(under == 1)[[0, -1]]]
    first = min((patch for patch in ax.patches if patch.get_width() > 0), key=lambda p: p.get_x())
    assert [first.get_x(), first.get_x() + first.get_width()] == pytest.approx(ends, abs=2 * pitch)
    # The tension at a place is steady there, though each joint has run on by 0.24 m.
    steady = np.asarray(ax.lines[1].get_ydata())
    assert np.max(np.abs(steady - at_end)) < 0.02 * np.ptp(at_end)


def test_the_mean_of_the_tension_is_that_of_the_last_fifth() -> None:
    """A tension that is the time everywhere: its mean from 0.8 to 1 of 2 s is 1.8 N."""
    run = belt_run(TWO, samples=201)
    tension = np.outer(run.time, np.ones(150))
    figure = draw(with_channels(run, tension=tension), "tension")
    (line,) = (
        line
        for line in figure.axes[0].get_lines()
        if line.get_label() == "mean over the last fifth"
    )
    assert np.asarray(line.get_ydata()) == pytest.approx(1.8, rel=0.01)  # by the ends of samples


@pytest.mark.parametrize("name", ["driven", "idler", "shaft"])
def test_a_pulley_slips_and_sticks_in_picture_and_report(name: str, tmp_path: Path) -> None:
    """A name is free: that of a contact of other kinds too. The modes are those of the file."""
    pulleys = [TWO[0], TWO[1]._replace(name=name)]
    events = [Transition(0.5, name, 0, 1), Transition(0.9, name, 1, 0)]
    events += [Transition(1.2, name, 0, -1), Transition(1.5, name, -1, 1)]
    result = fs.Result(belt_run(pulleys, bodies=40, samples=41, transitions=events))
    words = [f"{name}: {what}" for what in ("slips", "sticks", "reverses")]
    legend = [t.get_text() for of in fs.plot(result).legends for t in of.get_texts()]
    page = fs.report(result, tmp_path / "a.html").read_text("utf-8")
    for text in (" ".join(legend), page):
        assert all(one in text for one in words)
        assert "breakaway" not in text.partition("<script>")[0]
        assert "comes to rest" not in text.partition('id="data"')[0].rpartition("</script>")[2]
