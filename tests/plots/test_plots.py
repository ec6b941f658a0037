"""Pictures of results: what stands in them, files that are written, options that are refused."""

import numpy as np
import pytest
from matplotlib.figure import Figure

import frictionsim as fs
from frictionsim.errors import InputError
from tests.support.cases import one_in
from tests.support.records import (
    DRAWN,
    draw,
    shown,
    views_of_record,
    with_channels,
    words_of,
)
from tests.support.scenarios import shipped

MAX_BYTES = 200_000  # of a picture, so that a page with several of them opens quickly


@pytest.mark.parametrize(
    "name",
    one_in(5, [name for name in DRAWN if name != "belt_tensioner"] + ["shaft", "hoist_drum"]),
)
def test_one_sample_is_enough_and_none_is_refused(name: str) -> None:
    record = shown(name)
    one, none = (
        record._replace(
            channels={name: values[:count] for name, values in record.channels.items()},
            events={name: values[:0] for name, values in record.events.items()},
        )
        for count in (1, 0)
    )
    for view in views_of_record(name):
        draw(one, view).draw_without_rendering()
        with pytest.raises(InputError, match="it has no samples"):
            draw(none, view)


@pytest.mark.parametrize(
    ("name", "channel", "contact"),
    [("pulley_return", "mode", "shaft"), ("lift", "mode", "shaft"), ("lift", "cord_mode", "cord")],
)
def test_a_mode_is_a_step_at_each_event_of_its_contact(
    name: str, channel: str, contact: str
) -> None:
    record = shown(name)
    (ax,) = draw(record, channels=channel).axes
    time, mode = (np.asarray(values, dtype=float) for values in ax.lines[0].get_data())
    events = record.events
    mine = events["contact"] == record.contacts.index(contact)
    mine &= events["mode_from"] != events["mode_to"]
    changes = np.diff(mode) != 0.0
    assert (
        time[1:][changes].tolist() == time[:-1][changes].tolist() == events["time"][mine].tolist()
    )
    assert "stick" in [text.get_text() for text in ax.get_yticklabels()]


def test_sticking_and_events_are_labelled() -> None:
    words = words_of(draw(shown("pulley_return"))).split("\n")
    assert {"sticking", "breakaway", "comes to rest", "0.5464 s", "5.134 s"} <= {*words}


def test_times_of_close_events_are_in_two_rows_apart_and_the_legend_has_its_own_room() -> None:
    record = shown("pulley_return")
    names = ("time", "contact", "mode_from", "mode_to")
    events = {name: np.repeat(record.events[name][:1], 4) for name in names}
    events["time"] = np.array([1.0, 1.01, 1.02, 3.0])
    figure = draw(record._replace(events=events))
    times = [(text.get_text(), text.xyann[1]) for text in figure.axes[0].texts]  # type: ignore[attr-defined]
    assert times == [("1 s", 2.0), ("1.01 s", 11.0), ("3 s", 2.0)]
    assert figure.get_figheight() > 0.8 + 1.7 * len(figure.axes)


def test_a_pulley_is_drawn_with_its_static_limits() -> None:
    figure = draw(shown("pulley"))
    words = words_of(figure)
    for expected in ("2708 N", "1827 N", "limit of static friction"):
        assert expected in words
    (legend,) = figure.legends
    black = [line for line in legend.get_lines() if line.get_color() == "black"]
    assert len({str(line._unscaled_dash_pattern) for line in black}) == len(black) == 3
    labels = [" ".join(ax.get_ylabel().split()) for ax in figure.axes]
    assert labels == ["drive force, N", "friction torque, N m", "angular velocity, rad/s",
                      "angle, rad"]  # fmt: skip
    assert figure.axes[-1].get_xlabel() == "time, s"
    pressed = words_of(draw(shown("pulley", effects__shaft_friction__mu_s=1.9, drive__force=10.0)))
    assert "limit of static friction" in pressed
    assert "to lift" not in pressed
    small = {"mechanism__load": 0.25, "drive__force": 0.25}
    assert "to lift: 0.3044 N" in words_of(draw(shown("pulley", **small)))
    free = words_of(draw(shown("pulley", effects=None)))
    assert "to lift" not in free
    assert "limit of static friction" not in free


def test_the_title_has_the_keys_that_were_set_with_their_units() -> None:
    changes = {"output.interval": 0.5, "effects.shaft_friction.law": "published"}
    result = fs.solve(shipped("pulley"), changes | {"solver.backend": "rkf45"})
    assert "interval = 0.5 s; law published; backend rkf45)" in words_of(fs.plot(result))
    doubtful = result.record._replace(attributes=result.record.attributes | {"reason": "x"})
    assert "backend rkf45; self-audit failed)" in words_of(draw(doubtful))


def test_a_view_is_drawn_into_a_part_of_a_figure() -> None:
    figure = Figure(figsize=(12.0, 6.0), layout="constrained")
    for part in figure.subfigures(1, 2):
        assert draw(shown("epicyclic"), "torque", figure=part) is part
        assert part.get_suptitle().startswith("Epicyclic gear")
        assert part.axes[0].lines[0].get_label() == "drive"
    assert tuple(figure.get_size_inches()) == (12.0, 6.0)
    figure.draw_without_rendering()


def test_an_unknown_kind_is_refused_with_the_known_ones() -> None:
    result = shown("pulley_return")
    with pytest.raises(InputError, match="unknown kind 'clock'; known: pulley, marble_machine"):
        draw(result._replace(attributes=result.attributes | {"kind": "clock"}))


def test_torques_of_marbles_have_a_second_panel_at_the_scale_of_the_load() -> None:
    record = shown("marble_machine", solver__duration=0.6, solver__rtol=1e-4)
    upper, lower = draw(record, "torque").axes
    assert np.ptp(lower.get_ylim()) < 0.5 * np.ptp(upper.get_ylim())
    assert lower.get_ylabel() == "at the scale of\nthe load, N m"
    load = record.channels["load_torque"]
    (ax,) = draw(with_channels(record, motor_torque=0.5 * load), "torque").axes  # no finer
    assert len([line for line in ax.lines if np.size(line.get_xdata()) == load.size]) == 4
    still = with_channels(record, angle=0.0 * load)  # a line could not be seen
    assert {line.get_marker() for line in draw(still, "torque").axes[0].lines[:4]} == {"o"}
