"""Parts of results in pictures: an instant, a window of time, channels; several over each other."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_hex

from frictionsim.display import COLOURS
from frictionsim.errors import InputError
from frictionsim.plots import draw, draw_overlay
from frictionsim.plots.overlay import Overlaid, labels_of
from frictionsim.plots.style import USUAL, Appearance
from frictionsim.plots.view import Extent, until, within
from frictionsim.results import Record
from frictionsim.simulation.stored_channel import StoredChannel
from tests.support.records import shown, with_channels

PULLEY, GEAR, BELT, FOUR = "pulley_return", "epicyclic", "two pulleys", "four pulleys"


def times(record: Record) -> Any:
    return record.channels["time"]


def test_an_instant_is_the_sample_at_or_before_it() -> None:
    record = shown(BELT)
    at = times(record)[3]
    after = 0.5 * (at + times(record)[4])
    for time in (at, after):
        part = until(record, time)
        assert part.channels["time"][-1] == at
        np.testing.assert_array_equal(part.channels["x"][-1], record.channels["x"][3])
        figure = draw(record, "drive", shown=Extent(time=time))
        assert figure.axes[0].get_title(loc="left") == f"at {at:.6g} s"
        assert f"{at:.6g} s" not in figure.get_suptitle()


def test_the_planet_is_drawn_at_an_instant_on_the_whole_path() -> None:
    whole, early = draw(shown(GEAR), "path"), draw(shown(GEAR), "path", shown=Extent(time=1.0))
    (drawn, moved) = (figure.axes[0] for figure in (whole, early))
    np.testing.assert_array_equal(drawn.lines[0].get_xdata(), moved.lines[0].get_xdata())
    assert drawn.patches[1].center != moved.patches[1].center  # type: ignore[attr-defined]
    (point,) = [line for line in moved.lines if line.get_label() == "tracer point"]
    channels = until(shown(GEAR), 1.0).channels
    assert point.get_xydata() == pytest.approx(
        np.array([[channels["tracer_x"][-1], channels["tracer_y"][-1]]])
    )
    assert "tracer point" not in [line.get_label() for line in drawn.lines]
    assert "at 1 s" in early.get_suptitle()


def test_a_window_ends_at_its_edges_between_samples() -> None:
    record = shown(PULLEY)
    low, high = 0.5 * (times(record)[10] + times(record)[11]), times(record)[200]
    part = within(record, low, high)
    assert (times(part)[0], times(part)[-1]) == (low, high)
    angles = record.channels["angle"]
    assert part.channels["angle"][0] == pytest.approx(0.5 * (angles[10] + angles[11]))
    assert part.channels["angle"][-1] == angles[200]
    assert part.channels["mode"][0] == record.channels["mode"][10]
    inside = [at for at in record.events["time"] if low <= at <= high]
    assert part.events["time"].tolist() == inside


def test_a_window_shows_sticking_events_and_scales_of_its_own() -> None:
    record = shown(PULLEY)
    breakaway, rest = record.events["time"]
    figure = draw(record, shown=Extent(window=(rest - 0.5, rest + 0.5)))
    top = figure.axes[0]
    assert top.get_xlim() == pytest.approx((rest - 0.5, rest + 0.5))
    texts = [text.get_text() for text in top.texts]
    assert f"{rest:.4g} s" in texts
    assert f"{breakaway:.4g} s" not in texts
    (shade,) = [patch for patch in top.patches if to_hex(patch.get_facecolor()) == "#e5e5e5"]
    assert shade.get_x() == pytest.approx(rest)  # type: ignore[attr-defined]
    assert figure.axes[2].get_ylim()[1] < 0.7 * record.channels["angular_velocity"].max()


def test_jumps_at_the_edges_are_those_of_the_events() -> None:
    record = shown(PULLEY)
    at = float(record.events["time"][0])
    k = int(np.flatnonzero(times(record) == at)[0])
    part = within(record, 0.5 * (times(record)[k - 1] + at), at)
    before = record.events["friction_torque_before"][0]
    first = part.channels["friction_torque"][0]
    assert first == pytest.approx(0.5 * (record.channels["friction_torque"][k - 1] + before))


class _Counting:
    """A source of a channel that counts the samples that are read."""

    def __init__(self, values: Any) -> None:
        self.values, self.read = values, 0

    def rows(self, name: str, start: int, stop: int) -> Any:
        self.read += stop - start
        return self.values[start:stop]


@pytest.mark.parametrize("cut", [lambda r: until(r, 0.2), lambda r: within(r, 0.1, 0.2)])
def test_channels_in_a_file_are_read_in_part(cut: Callable[[Record], Record]) -> None:
    record = shown(BELT)
    sources = {name: _Counting(record.channels[name]) for name in ("x", "tension")}
    stored = {
        name: StoredChannel(source, name, source.values.shape, source.values.dtype)
        for name, source in sources.items()
    }
    part = cut(with_channels(record, **stored))
    count = len(part.channels["tension"])
    assert 0 < count < len(times(record))
    assert (sources["tension"].read, sources["x"].read) == (count, 0)


def test_chosen_channels_are_drawn_instead() -> None:
    labels = [
        ax.get_ylabel() for ax in draw(shown(PULLEY), shown=Extent.of(channels="angle, mode")).axes
    ]
    assert [text.split(",")[0] for text in labels] == ["angle", "mode"]
    of_belt = draw(shown(FOUR), shown=Extent.of(channels=["pulley_torque"]))
    assert len(of_belt.axes) == 1
    assert len(of_belt.axes[0].lines) == 4


def pair() -> list[Overlaid]:
    heavy = shown(PULLEY, mechanism__load=2100.0, output__interval=0.05)
    return [Overlaid("pulley_return.h5", shown(PULLEY)), Overlaid("heavy.h5", heavy)]


def test_results_are_drawn_over_each_other_with_a_key() -> None:
    figure = draw_overlay(pair())
    for ax in figure.axes:
        one, other = [line for line in ax.lines if line.get_transform() == ax.transData]
        assert [one.get_color(), other.get_color()] == list(COLOURS[:2])
        assert one.get_linestyle() != other.get_linestyle()
        assert not ax.patches
    one, other = figure.axes[3].lines
    usual, heavy = (overlaid.record for overlaid in pair())
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
        record.events["time"].tolist() for record in (heavy, usual)
    ]


@pytest.mark.parametrize("appearance", [USUAL, Appearance.of(width="84mm", style="paper")])
def test_rows_above_panels_are_distinguished_without_colour(appearance: Appearance) -> None:
    figure = draw_overlay(pair(), appearance=appearance)
    figure.draw_without_rendering()
    ax = figure.axes[0]
    key = [text.get_text()[:2] for text in figure.legends[0].get_texts()]
    assert key[:2] == ["1:", "2:"]
    height = {}
    for number, colour in (("1", COLOURS[0]), ("2", COLOURS[1])):
        (text,) = (text for text in ax.texts if text.get_text() == number)
        assert text.get_visible()
        box = text.get_window_extent()
        bars = [x for x in ax.lines if x.get_color() == colour and not x.get_clip_on()]
        height[number] = bars[0].get_window_extent().y0
        assert box.y0 < height[number] < box.y1
        assert box.x0 >= ax.get_window_extent().x1
    assert height["1"] > height["2"]  # as in the key


def test_names_of_files_tell_results_apart_that_differ_in_more() -> None:
    several = [Overlaid("x/a.h5", shown(PULLEY)), Overlaid("y/b.h5", shown(BELT))]
    assert labels_of(several) == ["a", "b"]
    same = [Overlaid("x/a.h5", shown(BELT)), Overlaid("y/a.h5", shown(BELT))]
    assert labels_of(same) == ["x/a.h5", "y/a.h5"]


def test_each_pulley_has_a_panel_with_a_line_for_each_result() -> None:
    figure = draw_overlay([Overlaid(name, shown(BELT)) for name in ("a", "b")], "speeds")
    assert [len(ax.lines) for ax in figure.axes] == [2] * 4
    assert "driver" in figure.axes[0].get_ylabel()


def test_belts_with_other_pulleys_are_not_drawn_over_each_other() -> None:
    with pytest.raises(InputError, match="their members differ"):
        draw_overlay([Overlaid(name, shown(name)) for name in (BELT, FOUR)])
