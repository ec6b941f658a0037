"""Names of events and sticking phases where a mechanism has several contacts."""

from functools import cache

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.results import Record
from frictionsim.simulation.record import event_names, sticking_phases
from tests.support.scenarios import shipped

pytestmark = pytest.mark.quick


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
    assert event_names(solved("lift")) == [
        *("breakaway", "comes to rest", "breakaway"),
        *("cord: slips", "comes to rest", "cord: sticks"),
    ]


def test_a_rope_falls_slack_bounces_and_is_taut() -> None:
    record = solved("hard/lift_slack_rope")
    names = [
        name
        for name, event in zip(event_names(record), record.transitions, strict=True)
        if event.contact == "car_rope"
    ]
    assert names == ["car rope: slack", *4 * ["car rope: impact"], "car rope: taut"]


def test_a_result_without_the_mode_of_the_cord_has_no_phases_of_it() -> None:
    record = solved("pulley_return")
    assert list(sticking_phases(record, "cord")) == []
