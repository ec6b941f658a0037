"""Parts of results in pictures: an instant, a window of time, channels; several over each other."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.collections import LineCollection
from matplotlib.colors import to_hex
from matplotlib.figure import Figure

import frictionsim as fs
from frictionsim.errors import InputError
from frictionsim.results import Record
from tests.support.records import draw, shown

COLOURS = ["#0072B2", "#D55E00"]  # of the first lines
PULLEY, BELT = "pulley_return", "belt_string"


def times(record: Record) -> Any:
    return record.channels["time"]


def test_an_instant_is_the_sample_at_or_before_it() -> None:
    record = shown(BELT)
    at = times(record)[200]
    bodies = np.column_stack([record.channels[name][200] for name in "xy"])
    for time in (at, 0.5 * (at + times(record)[201])):
        figure = draw(record, "drive", time=time)
        assert figure.axes[0].texts[0].get_text().split("\n")[0] == f"at {at:.6g} s"
        (belt,) = (
            one
            for one in figure.axes[1].collections
            if isinstance(one, LineCollection) and one.get_array() is not None
        )
        ends = np.array([piece[-1] for piece in belt.get_segments()])
        for body in bodies:  # those of a guided string have points of its line between them
            assert np.hypot(*(ends - body).T).min() < 1e-5


def test_a_window_has_its_samples_and_those_around_it() -> None:
    record = shown(PULLEY)
    low, high = 0.5 * (times(record)[10] + times(record)[11]), times(record)[200]
    (ax,) = draw(record, window=(low, high), channels="angle").axes
    assert ax.get_xlim() == (low, high)
    drawn = np.asarray(ax.lines[0].get_xydata(), dtype=float)
    drawn = drawn[np.isfinite(drawn[:, 1])]
    assert set(drawn[:, 0]) >= set(times(record)[10:201])
    assert (drawn[0, 0], drawn[-1, 0]) == (times(record)[10], high)
    assert drawn[-1, 1] == record.channels["angle"][200]


def test_a_window_shows_sticking_events_and_scales_of_its_own() -> None:
    record = shown(PULLEY)
    breakaway, rest = record.events["time"]
    figure = draw(record, window=(rest - 0.5, rest + 0.5))
    top = figure.axes[0]
    assert top.get_xlim() == pytest.approx((rest - 0.5, rest + 0.5))
    texts = [text.get_text() for text in top.texts]
    assert f"{rest:.4g} s" in texts
    assert f"{breakaway:.4g} s" not in texts
    (shade,) = [patch for patch in top.patches if to_hex(patch.get_facecolor()) == "#e5e5e5"]
    assert shade.get_x() == pytest.approx(rest)  # type: ignore[attr-defined]
    assert figure.axes[2].get_ylim()[1] < 0.7 * record.channels["angular_velocity"].max()


def overlay(*results: tuple[str, Record], **options: Any) -> Figure:
    """Return a picture of results over each other, each with the name of its file."""
    return fs.plot([fs.Result(record, Path(name)) for name, record in results], **options)


def pair() -> list[tuple[str, Record]]:
    heavy = shown(PULLEY, mechanism__load=2100.0, output__interval=0.05)
    return [("pulley_return.h5", shown(PULLEY)), ("heavy.h5", heavy)]


def key_of(figure: Figure) -> list[str]:
    return [text.get_text() for text in figure.legends[0].get_texts()]


def test_results_are_drawn_over_each_other_with_a_key() -> None:
    figure = overlay(*pair())
    for ax in figure.axes:
        one, other = [line for line in ax.lines if line.get_transform() == ax.transData]
        assert [one.get_color(), other.get_color()] == COLOURS
        assert one.get_linestyle() != other.get_linestyle()
        assert not ax.patches
    one, other = figure.axes[3].lines
    usual, heavy = (record for _, record in pair())
    np.testing.assert_array_equal(other.get_xdata(), times(heavy))
    assert len(one.get_xdata()) > len(other.get_xdata())
    assert [text.get_text() for text in figure.legends[0].get_texts()] == [
        "1: load = 2224.1 N, interval = 0.02 s",
        "2: load = 2100 N, interval = 0.05 s",
        "bars: sticking",
        "ticks: events",
    ]
    ticks = [line for line in figure.axes[0].lines if line.get_marker() == "|"]
    assert [list(line.get_xdata()) for line in ticks] == [
        record.events["time"].tolist() for record in (usual, heavy)
    ]


def test_names_of_files_tell_results_apart_that_differ_in_more() -> None:
    other = shown(PULLEY, mechanism__load=2100.0, mechanism__inertia=1.3, output__interval=0.05)
    several = overlay(("x/a.h5", shown(PULLEY)), ("y/b.h5", other))
    assert key_of(several)[:2] == ["1: a", "2: b"]
    same = overlay(("x/a.h5", shown(BELT)), ("y/a.h5", shown(BELT)))
    assert key_of(same)[:2] == ["x/a.h5", "y/a.h5"]


def test_belts_are_drawn_over_each_other_by_the_pulleys_that_they_have_in_common() -> None:
    one = shown(BELT)
    other = one._replace(members=one.members | {"pulley": ("driver", "fan")})
    figure = overlay(("a", one), ("b", other))
    labels = [" ".join(ax.get_ylabel().split()) for ax in figure.axes]
    assert labels == ["pulley speed, driver, rad/s", "pulley torque, driver, N m"]
    assert [len(ax.lines) for ax in figure.axes] == [2, 2]
    with pytest.raises(InputError, match="or no member of them, in common"):
        overlay(("a", one), ("b", shown("belt_tensioner")))
