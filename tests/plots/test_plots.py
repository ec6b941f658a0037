"""Pictures of results: what stands in them, files that are written, options that are refused."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from matplotlib.lines import Line2D

import frictionsim as fs
from frictionsim.errors import InputError
from frictionsim.results import Record
from tests.support.cases import one_in
from tests.support.records import (
    DRAWN,
    draw,
    png,
    shown,
    views_of_record,
    with_scenario,
    words_of,
)
from tests.support.scenarios import frictionsim, pulley, shipped, simulate, with_method

MAX_BYTES = 200_000  # of a picture, so that a page with several of them opens quickly


def test_view_all_draws_each_view_that_has_channels_into_its_own_file(
    told: Callable, here: Path
) -> None:
    gear = shipped("epicyclic", solver__duration=0.3, effects__tracer_point=None)
    fs.Result(simulate(gear)).save(here / "gear.h5")
    out, err = told("plot", "gear.h5", "--view", "all")
    assert out.split() == [
        f"gear-{view}.png" for view in ("response", "friction", "torque", "mechanism")
    ]
    assert all((here / name).is_file() for name in out.split())
    assert "view skipped: cannot draw the view 'path'" in err
    out, err = told("plot", "gear.h5", "--view", "path", code=2)
    assert (out, "effects.tracer_point" in err) == ("", True)
    assert not (here / "gear.png").exists()


@pytest.mark.parametrize(
    "name", one_in(5, [name for name in DRAWN if name != "four pulleys"] + ["shaft", "hoist_drum"])
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


def test_a_pulley_is_drawn_with_its_static_limits() -> None:
    figure = draw(shown("pulley"))
    words = words_of(figure)
    for expected in ("2707.7 N", "1826.9 N", "limit of static friction"):
        assert expected in words
    labels = [" ".join(ax.get_ylabel().split()) for ax in figure.axes]
    assert labels == ["drive force, N", "friction torque, N m", "angular velocity, rad/s",
                      "angle, rad"]  # fmt: skip
    assert figure.axes[-1].get_xlabel() == "time, s"
    pressed = words_of(draw(shown("pulley", effects__shaft_friction__mu_s=1.9, drive__force=10.0)))
    assert "limit of static friction" in pressed
    assert "to lift" not in pressed
    free = words_of(draw(shown("pulley", effects=None)))
    assert "to lift" not in free
    assert "limit of static friction" not in free


@pytest.mark.slow
def test_many_events_are_not_marked() -> None:
    sine = {"sine": {"mean": 2200.0, "amplitude": 600.0, "frequency_hz": 1.0}}
    figure = draw(simulate(pulley(drive__force=sine, solver__duration=60.0)))
    assert "events, not marked" in words_of(figure)
    assert len(png(figure)) < MAX_BYTES


def test_missing_scenario_values_are_reported() -> None:
    with pytest.raises(InputError, match=r"in this result has no mechanism\.gear_ratio"):
        draw(with_scenario(shown("marble_machine"), ""), "torque")
    with pytest.raises(InputError, match="cannot read the scenario in this result"):
        draw(with_scenario(shown("epicyclic"), "a = "), "path")


def with_events(record: Record, *events: tuple[float, str, int, int]) -> Record:
    """Return a record with other events: time, contact, and the modes before and after."""
    columns = list(zip(*events, strict=True))
    names = list(dict.fromkeys(columns[1]))
    table = {
        "time": np.array(columns[0]),
        "contact": np.array([names.index(name) for name in columns[1]]),
        "mode_from": np.array(columns[2]),
        "mode_to": np.array(columns[3]),
    }
    return record._replace(events=table, contacts=names)


def test_each_event_of_an_end_stop_looks_different() -> None:
    """Nor like that of any other contact."""
    events = [(0.1, "shaft", 0, 1), (0.2, "shaft", 1, -1), (0.3, "shaft", -1, 0)]
    events += [(0.4, "stop", 1, -1), (0.5, "stop", 1, 0), (0.6, "stop", 0, 1)]
    figure = draw(with_events(shown("swing_door"), *events))
    handles = figure.legends[0].legend_handles
    looks = {
        str(one.get_label()): (one.get_color(), one._dash_pattern)  # type: ignore[union-attr]
        for one in handles
        if isinstance(one, Line2D)
    }
    assert {"stop: impact", "stop: comes to rest", "stop: left"} <= looks.keys()
    assert len(looks) == len(set(map(str, looks.values()))) == 7  # and the limit of friction


def test_the_title_names_another_law_than_the_set_valued() -> None:
    published = simulate(with_method(pulley(solver__duration=0.1), "published", "rkf45"))
    assert "law published; backend rkf45" in words_of(draw(published))
    assert "law" not in words_of(draw(shown("pulley")))


def test_the_title_has_the_keys_that_were_set_with_their_units() -> None:
    result = fs.solve(shipped("pulley"), {"output.interval": 0.5, "mechanism.load": 2300.0})
    assert "interval = 0.5 s; load = 2300.0 N; backend events" in words_of(fs.plot(result))


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="a folder that nobody can write to")
def test_without_a_home_only_the_name_of_the_picture_is_said(
    here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fs.Result(simulate(pulley())).save(here / "a.h5")
    monkeypatch.setenv("HOME", "/proc/none")
    for name in ("MPLCONFIGDIR", "XDG_CONFIG_HOME", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("MPL_IGNORE_SYSTEM_FONTS", "1")  # their list, which is not kept, takes long
    done = frictionsim("plot", "a.h5", cwd=here)
    assert (done.returncode, done.stdout, done.stderr) == (0, "a.png\n", "")
