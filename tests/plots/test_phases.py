"""Names of events and sticking phases of several contacts; lines that go through the events.

As pictures and reports show them.
"""

import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.patches import Rectangle

import frictionsim as fs
from frictionsim.results import Record
from tests.support.scenarios import shipped


@cache
def solved(name: str) -> Record:
    return fs.solve(shipped(name, solver__rtol=1e-6)).record


def line_of(record: Record, channel: str) -> tuple[Any, Any]:
    """Return the samples that the line of a channel is drawn through."""
    line = fs.plot(fs.Result(record), channels=[channel]).axes[0].lines[0]
    return np.asarray(line.get_xdata()), np.asarray(line.get_ydata())


def names_of_events(name: str, folder: Path) -> list[str]:
    """Return the names of the events in the report of a run, in their order."""
    page = fs.report(fs.Result(solved(name)), folder / "a.html").read_text(encoding="utf-8")
    section = re.search(r"<caption[^>]*>Events;.*?</table>", page, re.DOTALL)
    assert section is not None
    rows = re.findall(r"<tr>(.*?)</tr>", section[0], re.DOTALL)[1:]  # without the headings
    return [re.sub("<[^>]*>", "", re.findall(r"<td[^>]*>(.*?)</td>", row)[0]) for row in rows]


@pytest.mark.parametrize("name", ["lift", "pulley_return"])
def test_sticking_phases_are_those_of_the_samples(name: str) -> None:
    record = solved(name)
    time, modes = record.channels["time"], record.channels["mode"]
    shades = fs.plot(fs.Result(record), channels=["angle"]).axes[0].patches
    phases = [shade.get_bbox() for shade in shades if isinstance(shade, Rectangle)]
    at_events = np.isin(time, record.events["time"])
    within = np.zeros(len(time), dtype=bool)
    for phase in phases:
        within |= (phase.x0 <= time) & (time <= phase.x1)
    assert phases
    assert np.array_equal(within[~at_events], modes[~at_events] == 0)


def test_what_sticks_is_the_shaft_where_the_cord_may_move_on() -> None:
    for name, words in (("lift", "the shaft sticks"), ("pulley_return", "sticking")):
        (legend,) = fs.plot(fs.Result(solved(name)), channels=["angle"]).legends
        assert legend.get_texts()[0].get_text() == words


def test_events_have_the_names_of_their_contacts(tmp_path: Path) -> None:
    assert names_of_events("lift", tmp_path) == [
        *("breakaway", "comes to rest", "breakaway"),
        *("cord: slips", "comes to rest", "cord: sticks"),
    ]
    names = names_of_events("hard/lift_slack_rope", tmp_path)
    of_rope = [name for name in names if name.startswith("car rope")]
    assert of_rope == ["car rope: slack", *4 * ["car rope: impact"], "car rope: taut"]


@pytest.fixture(scope="module")
def records() -> dict[bool, Record]:
    """A run with and without samples at its events."""
    by_sampling = {}
    for at_events in (True, False):
        data = shipped("pulley_return", solver__rtol=1e-6)
        data["output"] = {"interval": 0.3, "at_events": at_events}
        by_sampling[at_events] = fs.solve(data).record
    return by_sampling


@pytest.mark.parametrize("name", ["angle", "friction_torque"])
def test_a_line_is_the_same_without_samples_at_events(
    records: dict[bool, Record], name: str
) -> None:
    time, values = line_of(records[True], name)
    bare_time, bare = line_of(records[False], name)
    assert np.isin(records[False].events["time"], bare_time).all()
    assert np.array_equal(time, bare_time)
    assert np.array_equal(values, bare, equal_nan=True)


def test_an_event_outside_of_the_samples_adds_no_value(records: dict[bool, Record]) -> None:
    record = records[False]
    early = {name: values[:10] for name, values in record.channels.items()}  # up to 2.7 s
    time, _ = line_of(record._replace(channels=early), "angle")
    assert len(time) == 11
    none = {name: values[:0] for name, values in record.channels.items()}
    with pytest.raises(fs.InputError, match="it has no samples"):
        line_of(record._replace(channels=none), "angle")


def test_two_events_at_one_time_are_one_jump(records: dict[bool, Record]) -> None:
    record = records[True]
    first = {name: np.asarray(values)[:1] for name, values in record.events.items()}
    first["angular_velocity_before"], first["angular_velocity_after"] = np.ones(1), np.full(1, 3.0)
    twice = {name: np.repeat(values, 2, axis=0) for name, values in first.items()}
    once = line_of(record._replace(events=first), "angular_velocity")
    for curve, expected in zip(
        line_of(record._replace(events=twice), "angular_velocity"), once, strict=True
    ):
        assert np.array_equal(curve, expected, equal_nan=True)
    chain = twice | {
        "angular_velocity_before": np.array([1.0, 2.0]),
        "angular_velocity_after": np.array([2.0, 3.0]),
    }
    curve = line_of(record._replace(events=chain), "angular_velocity")[1]
    assert np.array_equal(curve, once[1], equal_nan=True)
