"""Views as figures: in a part of a figure of the caller, with jumps, of unknown kinds."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from frictionsim.errors import InputError
from frictionsim.results import OPEN, SLACK, STICK, TAUT, Record
from tests.plots.test_plots import MAX_BYTES
from tests.support.cases import one_in, slow
from tests.support.records import VIEWS, draw, drawn_views, picture, png, shown, with_channels


@pytest.mark.parametrize(("name", "view"), one_in(6, drawn_views()))
def test_every_view_is_a_small_file(name: str, view: str) -> None:
    assert 5_000 < len(png(picture(name, view))) < MAX_BYTES


def test_a_view_is_drawn_into_a_part_of_a_figure() -> None:
    figure = Figure(figsize=(12.0, 6.0), layout="constrained")
    for part in figure.subfigures(1, 2):
        assert draw(shown("epicyclic"), "torque", figure=part) is part
        assert part.get_suptitle().startswith("Epicyclic gear")
        assert part.axes[0].lines[0].get_label() == "drive"
    assert tuple(figure.get_size_inches()) == (12.0, 6.0)
    figure.draw_without_rendering()


def test_jumps_of_a_count_are_gaps() -> None:
    result = shown("marble_machine")
    name = "carried_marbles"
    counts = np.where(result.channels["time"] < 1.0, 3, 4).astype(np.int8)
    events = {key: values[:1] for key, values in result.events.items()}
    events |= {"time": np.array([1.0])}
    events |= {f"{name}_before": np.array([3]), f"{name}_after": np.array([4])}
    changed = with_channels(result, **{name: counts})._replace(events=events)
    values = np.asarray(draw(changed, channels=name).axes[0].lines[0].get_ydata(), dtype=float)
    assert np.flatnonzero(np.isnan(values)).size == 1
    assert set(values[~np.isnan(values)]) == {3.0, 4.0}


def with_engagements(count: int) -> Record:
    """Return a belt's result with events of its pulleys and spans, which have no angle."""
    modes = np.resize(np.array([STICK, 1, -1, OPEN, TAUT, SLACK], dtype=np.int8), count + 1)
    events = {
        "time": np.linspace(0.1, 1.9, count),
        "contact": np.arange(count) % 2,
        "mode_from": modes[:-1],
        "mode_to": modes[1:],
    }
    return shown("two pulleys")._replace(events=events, contacts=["driver", "driver_driven"])


@pytest.mark.parametrize("count", [12, slow(500)])
def test_events_of_pulleys_and_spans_leave_the_views_of_belts(count: int) -> None:
    for view in VIEWS["belt_drive"]:
        lines, usual = (
            [
                line.get_xydata()
                for ax in figure.axes
                for line in ax.lines
                if len(line.get_xdata()) > 2
            ]
            for figure in (draw(with_engagements(count), view), picture("two pulleys", view))
        )
        assert all(
            np.array_equal(*two, equal_nan=True) for two in zip(lines, usual, strict=True)
        ), view


def test_channels_over_time_name_events_of_pulleys_and_spans() -> None:
    engaged = with_engagements(6)
    result = shown("pulley_return")._replace(events=engaged.events, contacts=engaged.contacts)
    names = {text.get_text() for text in draw(result).legends[0].get_texts()}
    assert names >= {"driver: open", "driver_driven: taut", "driver: slack", "reverses",
                     "driver_driven: closed"}  # fmt: skip


def test_an_unknown_kind_is_refused_with_the_known_ones() -> None:
    result = shown("pulley_return")
    with pytest.raises(InputError, match="unknown kind 'clock'; known: pulley, marble_machine"):
        draw(result._replace(attributes=result.attributes | {"kind": "clock"}))
