"""Parts of results in pictures: an instant, a window of time, channels; several over each other."""

import tomllib
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_hex

from frictionsim.errors import ArgumentError, InputError
from frictionsim.io import hdf5_reader, hdf5_writer
from frictionsim.plots import draw, draw_overlay
from frictionsim.plots.appearance import USUAL, Appearance
from frictionsim.plots.overlay import Overlaid, labels_of
from frictionsim.plots.style import COLOURS
from frictionsim.plots.window import Extent, extent, until, within
from frictionsim.results import Record
from frictionsim.simulation.stored_channel import StoredChannel
from tests.support.belt_results import FOUR, TWO, belt_run
from tests.support.scenarios import SCENARIOS, changed, simulate

NAMES = ("pulley_return", "epicyclic", "belt", "belt of four")


@pytest.fixture(scope="module")
def records(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Record]:
    path = tmp_path_factory.mktemp("results") / "a.h5"

    def read(run: Any) -> Record:
        hdf5_writer.write(run, path)
        return hdf5_reader.read(path)

    data = {n: tomllib.loads((SCENARIOS / f"{n}.toml").read_text()) for n in NAMES[:2]}
    heavy = changed(data["pulley_return"], mechanism__load=2100.0, output__interval=0.05)
    return {
        **{name: read(simulate(scenario)) for name, scenario in data.items()},
        "heavy": read(simulate(heavy)),
        "belt": read(belt_run(TWO)),
        "belt of four": read(belt_run(FOUR)),
    }


def times(record: Record) -> Any:
    return record.channels["time"]


# --- an instant ------------------------------------------------------------------------------


def test_an_instant_is_the_sample_at_or_before_it(records: dict[str, Record]) -> None:
    record = records["belt"]
    at = times(record)[3]
    after = 0.5 * (at + times(record)[4])
    for time in (at, after):
        part = until(record, time)
        assert part.channels["time"][-1] == at
        np.testing.assert_array_equal(part.channels["x"][-1], record.channels["x"][3])
        title = draw(record, "drive", shown=Extent(time=time)).axes[0].get_title(loc="left")
        assert f"at {at:.6g} s" in title


def test_the_planet_is_drawn_at_an_instant_on_the_whole_path(records: dict[str, Record]) -> None:
    record = records["epicyclic"]
    whole, early = draw(record, "path"), draw(record, "path", shown=Extent(time=1.0))
    (drawn, moved) = (figure.axes[0] for figure in (whole, early))
    np.testing.assert_array_equal(drawn.lines[0].get_xdata(), moved.lines[0].get_xdata())
    assert drawn.patches[1].center != moved.patches[1].center  # type: ignore[attr-defined]
    (point,) = [line for line in moved.lines if line.get_label() == "tracer point"]
    shown = until(record, 1.0).channels
    assert point.get_xydata() == pytest.approx(
        np.array([[shown["tracer_x"][-1], shown["tracer_y"][-1]]])
    )
    assert "tracer point" not in [line.get_label() for line in drawn.lines]
    assert "at 1 s" in early.get_suptitle()


@pytest.mark.parametrize("time", [-0.1, 1e3])
def test_an_instant_outside_the_run_is_refused(time: float, records: dict[str, Record]) -> None:
    with pytest.raises(ArgumentError, match=r"time: expected a time from 0 s to .* s, which this"):
        draw(records["belt"], "drive", shown=Extent(time=time))


# --- a window --------------------------------------------------------------------------------


def test_a_window_ends_at_its_edges_between_samples(records: dict[str, Record]) -> None:
    record = records["pulley_return"]
    low, high = 0.5 * (times(record)[10] + times(record)[11]), times(record)[200]
    part = within(record, low, high)
    assert (times(part)[0], times(part)[-1]) == (low, high)
    angles = record.channels["angle"]
    assert part.channels["angle"][0] == pytest.approx(0.5 * (angles[10] + angles[11]))
    assert part.channels["angle"][-1] == angles[200]
    assert part.channels["mode"][0] == record.channels["mode"][10]
    inside = [at for at in record.events["time"] if low <= at <= high]
    assert part.events["time"].tolist() == inside


def test_a_window_shows_sticking_events_and_scales_of_its_own(records: dict[str, Record]) -> None:
    record = records["pulley_return"]
    breakaway, rest = record.events["time"]
    figure = draw(record, shown=Extent(start=rest - 0.5, stop=rest + 0.5))
    top = figure.axes[0]
    assert top.get_xlim() == pytest.approx((rest - 0.5, rest + 0.5))
    texts = [text.get_text() for text in top.texts]
    assert f"{rest:.4g} s" in texts
    assert f"{breakaway:.4g} s" not in texts
    (shade,) = [patch for patch in top.patches if to_hex(patch.get_facecolor()) == "#e5e5e5"]
    assert shade.get_x() == pytest.approx(rest)  # type: ignore[attr-defined]
    speed = figure.axes[2]
    assert speed.get_ylim()[1] < 0.7 * record.channels["angular_velocity"].max()


def test_a_window_between_two_samples_is_a_straight_line(records: dict[str, Record]) -> None:
    record = records["pulley_return"]
    a, b = times(record)[30:32]
    low, high = a + 0.25 * (b - a), a + 0.75 * (b - a)
    line = draw(record, shown=Extent(start=low, stop=high)).axes[3].lines[0]
    assert line.get_xdata() == pytest.approx([low, high])
    between = np.interp([low, high], times(record), record.channels["angle"])
    assert line.get_ydata() == pytest.approx(between)


def test_jumps_at_the_edges_are_those_of_the_events(records: dict[str, Record]) -> None:
    record = records["pulley_return"]
    at = float(record.events["time"][0])
    k = int(np.flatnonzero(times(record) == at)[0])
    part = within(record, 0.5 * (times(record)[k - 1] + at), at)
    before = record.events["friction_torque_before"][0]
    first = part.channels["friction_torque"][0]
    assert first == pytest.approx(0.5 * (record.channels["friction_torque"][k - 1] + before))


@pytest.mark.parametrize(
    ("start", "stop", "message"),
    [(50.0, None, "from 50 s to 12 s shows nothing"), (None, -1.0, "samples from 0 s to 12 s")],
)
def test_windows_without_samples_are_refused(
    start: float | None, stop: float | None, message: str, records: dict[str, Record]
) -> None:
    with pytest.raises(InputError, match=message):
        draw(records["pulley_return"], shown=Extent(start=start, stop=stop))


class _Counting:
    """A source of a channel that counts the samples that are read."""

    def __init__(self, values: Any) -> None:
        self.values, self.read = values, 0

    def rows(self, name: str, start: int, stop: int) -> Any:
        self.read += stop - start
        return self.values[start:stop]

    def compressed(self, name: str, start: int, stop: int) -> None:
        return None


@pytest.mark.parametrize("cut", [lambda r: until(r, 0.2), lambda r: within(r, 0.1, 0.2)])
def test_channels_in_a_file_are_read_in_part(
    cut: Callable[[Record], Record], records: dict[str, Record]
) -> None:
    record = records["belt"]
    sources = {name: _Counting(record.channels[name]) for name in ("x", "tension")}
    stored = {
        name: StoredChannel(source, name, source.values.shape, source.values.dtype)
        for name, source in sources.items()
    }
    part = cut(record._replace(channels=record.channels | stored))
    count = len(part.channels["tension"])
    assert 0 < count < len(times(record))
    assert (sources["tension"].read, sources["x"].read) == (count, 0)


# --- channels --------------------------------------------------------------------------------


def test_chosen_channels_are_drawn_instead(records: dict[str, Record]) -> None:
    shown = extent(channels="angle, mode")
    labels = [ax.get_ylabel() for ax in draw(records["pulley_return"], shown=shown).axes]
    assert [text.split(",")[0] for text in labels] == ["angle", "mode"]
    of_belt = draw(records["belt of four"], shown=extent(channels=["pulley_torque"]))
    assert len(of_belt.axes) == 1
    assert len(of_belt.axes[0].lines) == 4


@pytest.mark.parametrize(
    ("name", "view", "shown", "message"),
    [
        ("epicyclic", None, {"channels": "angel"}, r"'angel' \(did you mean 'angle'\?\); known: "),
        ("epicyclic", None, {"channels": "time"}, "'time' is what the channels are drawn over"),
        ("belt", None, {"channels": "tension"}, r"members of the axis 'joint', a panel shows 8"),
        ("belt", "body", {"channels": "tension"}, "draws channels of its own; .* view 'speeds'"),
        ("epicyclic", None, {"time": 1.0}, "shows no single instant; .* is for the view 'path'"),
        ("epicyclic", "path", {"window": (0.0, 1.0)}, "'response' or 'torque'"),
        ("belt", "drive", {"window": (0.0, 1.0)}, "does not go over time; .* 'speeds' or 'body'"),
    ],
)
def test_what_does_not_apply_is_refused(
    name: str, view: str | None, shown: dict[str, Any], message: str, records: dict[str, Record]
) -> None:
    with pytest.raises(InputError, match=message):
        draw(records[name], view, shown=extent(**shown))


@pytest.mark.parametrize(
    ("shown", "message"),
    [
        ({"window": (2.0, 1.0)}, "whose start is before its end, got one from 2 s to 1 s"),
        ({"window": (float("nan"), 1.0)}, "from: expected a time in s, got nan"),
        ({"window": 3.0}, r"window: expected start and end in s, as \(0.5, 1.0\), got 3.0"),
        ({"time": "now"}, "time: expected a time in s, got 'now'"),
        ({"channels": " , "}, "channels: expected names of channels"),
        ({"channels": [3]}, "channels: expected names of channels"),
    ],
)
def test_invalid_parts_are_refused(shown: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        extent(**shown)


# --- several results -------------------------------------------------------------------------


def test_results_are_drawn_over_each_other_with_a_key(records: dict[str, Record]) -> None:
    pair = [Overlaid(f"{name}.h5", records[name]) for name in ("pulley_return", "heavy")]
    figure = draw_overlay(pair)
    for ax in figure.axes:
        one, other = [line for line in ax.lines if line.get_transform() == ax.transData]
        assert [one.get_color(), other.get_color()] == list(COLOURS[:2])
        assert one.get_linestyle() != other.get_linestyle()
        assert not ax.patches
    one, other = figure.axes[3].lines
    np.testing.assert_array_equal(other.get_xdata(), times(records["heavy"]))
    assert len(one.get_xdata()) > len(other.get_xdata())
    key = [text.get_text() for text in figure.legends[0].get_texts()]
    assert key[:2] == [
        "1: load = 2224.1 N, interval = 0.02 s",
        "2: load = 2100 N, interval = 0.05 s",
    ]
    assert key[2:] == ["bars: sticking", "ticks: events"]
    ticks = [line for line in figure.axes[0].lines if line.get_marker() == "|"]
    assert [list(line.get_xdata()) for line in ticks] == [
        records[name].events["time"].tolist() for name in ("heavy", "pulley_return")
    ]


@pytest.mark.parametrize("look", [USUAL, Appearance(width=3.3, style="paper")])
def test_rows_above_panels_are_told_apart_without_colour(
    look: Appearance, records: dict[str, Record]
) -> None:
    pair = [Overlaid(f"{name}.h5", records[name]) for name in ("pulley_return", "heavy")]
    figure = draw_overlay(pair, look=look)
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


def test_names_of_files_tell_results_apart_that_differ_in_more(records: dict[str, Record]) -> None:
    several = [Overlaid("x/a.h5", records["pulley_return"]), Overlaid("y/b.h5", records["belt"])]
    assert labels_of(several) == ["a", "b"]
    same = [Overlaid("x/a.h5", records["belt"]), Overlaid("y/a.h5", records["belt"])]
    assert labels_of(same) == ["x/a.h5", "y/a.h5"]


def test_each_pulley_has_a_panel_with_a_line_for_each_result(records: dict[str, Record]) -> None:
    figure = draw_overlay([Overlaid(name, records["belt"]) for name in ("a", "b")], "speeds")
    assert [len(ax.lines) for ax in figure.axes] == [2] * 4
    assert "driver" in figure.axes[0].get_ylabel()


@pytest.mark.parametrize(
    ("names", "view", "message"),
    [
        (["belt", "epicyclic"], None, "unlike kinds .* belt is of kind 'belt_drive', epicyclic of"),
        (["belt"] * 9, None, "cannot draw 9 results over each other: 8 are the most"),
        (["belt"] * 2, "drive", "the view 'drive' cannot show several .* the view 'speeds' can"),
        (["belt"] * 2, "drove", "unknown view 'drove' of kind 'belt_drive'; known: speeds"),
        (["belt", "belt of four"], None, "their members differ"),
    ],
)
def test_what_cannot_be_drawn_over_each_other_is_refused(
    names: list[str], view: str | None, message: str, records: dict[str, Record]
) -> None:
    with pytest.raises(InputError, match=message):
        draw_overlay([Overlaid(name, records[name]) for name in names], view)
