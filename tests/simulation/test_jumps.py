"""Lines of channels over time go through what the file records at events."""

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.results import Record
from frictionsim.simulation.record import with_jumps
from tests.support.motions import scenario

pytestmark = pytest.mark.quick


@pytest.fixture(scope="module")
def records() -> dict[bool, Record]:
    """A run with and without samples at its events."""
    found = {}
    for at_events in (True, False):
        data = scenario("pulley_return", solver__rtol=1e-6)
        data["output"] = {"interval": 0.3, "at_events": at_events}
        found[at_events] = fs.solve(data).record
    return found


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
    for found, expected in zip(
        with_jumps(record._replace(events=twice), "angular_velocity"), once, strict=True
    ):
        assert np.array_equal(found, expected, equal_nan=True)
    chain = twice | {
        "angular_velocity_before": np.array([1.0, 2.0]),
        "angular_velocity_after": np.array([2.0, 3.0]),
    }
    found = with_jumps(record._replace(events=chain), "angular_velocity")[1]
    assert np.array_equal(found, once[1], equal_nan=True)
