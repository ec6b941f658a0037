"""Names of events and sticking phases of several contacts; lines that go through the events."""

from functools import cache

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.results import Record
from frictionsim.simulation.record import event_labels, sticking_phases, sticking_words, with_jumps
from tests.support.scenarios import shipped


@cache
def solved(name: str) -> Record:
    return fs.solve(shipped(name, solver__rtol=1e-6)).record


@pytest.mark.parametrize(
    ("name", "contact", "channel"),
    [
        ("lift", None, "mode"),
        ("lift", "cord", "cord_mode"),
        ("hard/lift_slack_rope", None, "mode"),
        ("pulley_return", None, "mode"),
    ],
)
def test_sticking_phases_are_those_of_the_samples(
    name: str, contact: str | None, channel: str
) -> None:
    record = solved(name)
    time, modes = record.channels["time"], record.channels[channel]
    phases = list(sticking_phases(record, contact))
    at_events = np.isin(time, record.events["time"])
    within = np.zeros(len(time), dtype=bool)
    for start, stop in phases:
        within |= (start <= time) & (time <= stop)
    assert phases
    assert np.array_equal(within[~at_events], modes[~at_events] == 0)


def test_the_events_of_a_cord_are_not_those_of_the_shaft() -> None:
    assert event_labels(solved("lift")) == [
        *("breakaway", "comes to rest", "breakaway"),
        *("cord: slips", "comes to rest", "cord: sticks"),
    ]


def test_what_sticks_is_the_shaft_where_the_cord_may_move_on() -> None:
    words = {name: sticking_words(solved(name)) for name in ("lift", "pulley_return")}
    assert words == {"lift": "the shaft sticks", "pulley_return": "sticking"}


def test_a_rope_falls_slack_bounces_and_is_taut() -> None:
    record = solved("hard/lift_slack_rope")
    names = [
        name
        for name, event in zip(event_labels(record), record.transitions, strict=True)
        if event.contact == "car_rope"
    ]
    assert names == ["car rope: slack", *4 * ["car rope: impact"], "car rope: taut"]


def test_a_result_without_the_mode_of_the_cord_has_no_phases_of_it() -> None:
    record = solved("pulley_return")
    assert list(sticking_phases(record, "cord")) == []


@pytest.fixture(scope="module")
def records() -> dict[bool, Record]:
    """A run with and without samples at its events."""
    by_sampling = {}
    for at_events in (True, False):
        data = shipped("pulley_return", solver__rtol=1e-6)
        data["output"] = {"interval": 0.3, "at_events": at_events}
        by_sampling[at_events] = fs.solve(data).record
    return by_sampling


@pytest.mark.parametrize("name", ["angle", "angular_velocity", "drive_force", "friction_torque"])
def test_a_line_is_the_same_without_samples_at_events(
    records: dict[bool, Record], name: str
) -> None:
    time, values = with_jumps(records[True], name)
    bare_time, bare = with_jumps(records[False], name)
    assert np.isin(records[False].events["time"], bare_time).all()
    assert np.array_equal(time, bare_time)
    assert np.array_equal(values, bare, equal_nan=True)


def test_an_event_outside_of_the_samples_adds_no_value(records: dict[bool, Record]) -> None:
    record = records[False]
    early = {name: values[:10] for name, values in record.channels.items()}  # up to 2.7 s
    time, _ = with_jumps(record._replace(channels=early), "angle")
    assert len(time) == 11
    none = {name: values[:0] for name, values in record.channels.items()}
    assert len(with_jumps(record._replace(channels=none), "angle")[0]) == 0


def test_two_events_at_one_time_are_one_jump(records: dict[bool, Record]) -> None:
    record = records[True]
    first = {name: np.asarray(values)[:1] for name, values in record.events.items()}
    first["angular_velocity_before"], first["angular_velocity_after"] = np.ones(1), np.full(1, 3.0)
    twice = {name: np.repeat(values, 2, axis=0) for name, values in first.items()}
    once = with_jumps(record._replace(events=first), "angular_velocity")
    for curve, expected in zip(
        with_jumps(record._replace(events=twice), "angular_velocity"), once, strict=True
    ):
        assert np.array_equal(curve, expected, equal_nan=True)
    chain = twice | {
        "angular_velocity_before": np.array([1.0, 2.0]),
        "angular_velocity_after": np.array([2.0, 3.0]),
    }
    curve = with_jumps(record._replace(events=chain), "angular_velocity")[1]
    assert np.array_equal(curve, once[1], equal_nan=True)
