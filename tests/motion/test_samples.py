"""The samples that are frames of a motion, what contacts do at them, and refusals."""

from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.errors import InputError
from tests.support.motions import Body, Line, body, motion, number, record_of
from tests.support.records import guided
from tests.support.scenarios import shipped, simulate


def frames_at(times: Any, events: Any = ()) -> Any:
    """Return the times of the frames of a run with these samples."""
    record = record_of("pulley", {"time": np.asarray(times, dtype=float)}, events=events)
    record.channels["angle"] = np.asarray(times, dtype=float)
    return motion(record).time


def test_all_samples_of_a_short_run_are_frames_of_two_at_one_time_the_later() -> None:
    assert frames_at(np.arange(7.0)).tolist() == list(range(7))
    record = record_of(
        "pulley", {"time": np.array([0.0, 1.0, 1.0, 2.0]), "angle": np.array([0.0, 3.0, 4.0, 5.0])}
    )
    assert motion(record).time.tolist() == [0.0, 1.0, 2.0]
    assert body(motion(record), "pulley").angle.tolist() == [0.0, 4.0, 5.0]


def test_samples_of_a_long_run_are_spread_and_those_at_events_kept() -> None:
    times = np.linspace(0.0, 10.0, 5001)
    seen = frames_at(times, [times[1234], times[4321]])
    assert {times[1234], times[4321]} <= set(seen.tolist())
    assert 601 <= len(seen) <= 603
    assert np.diff(seen).max() < 1.01 * 10.0 / 600.0 + 0.002
    assert seen[[0, -1]].tolist() == [0.0, 10.0]


@pytest.mark.parametrize(
    ("times", "angles", "message"),
    [
        ([], [], "it has no samples"),
        ([0.0, 2.0, 1.0], [0.0, 1.0, 2.0], "its times do not increase"),
        ([0.0, np.nan], [0.0, 1.0], "its times do not increase"),
        ([0.0, 1.0], [0.0, np.nan], "'angle' has numbers that are not finite or above"),
        ([0.0, 1.0], [0.0, 1e200], "'angle' has numbers that are not finite or above"),
    ],
)
def test_what_cannot_be_drawn_is_refused(
    times: list[float], angles: list[float], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        motion(record_of("pulley", {"time": np.array(times), "angle": np.array(angles)}))


@pytest.mark.parametrize(
    ("name", "at_events"),
    [("pulley_return", True), ("marble_machine", False), ("epicyclic", True), ("shaft", False)],
)
def test_a_contact_does_what_its_events_say(name: str, at_events: bool) -> None:
    changes: dict[str, Any] = {"solver__rtol": 1e-6}
    output = {"interval": 0.037, "at_events": at_events}
    record = fs.solve(shipped(name, **changes) | {"output": output}).record
    animation = motion(record)
    modes = [e for e in record.transitions if e.mode_from != e.mode_to and e.contact != "transfer"]
    assert modes
    shown = number(animation, "contact")
    for frame, time in enumerate(animation.time):
        past = [e.mode_to for e in modes if e.time <= time]
        assert shown[frame] == (past[-1] if past else modes[0].mode_from)


@pytest.mark.parametrize(
    "name", ["pulley_return", "lift", "marble_machine", "epicyclic", "shaft", "hoist_drum", "belt"]
)
def test_a_drawn_instant_is_a_frame_of_the_motion(name: str) -> None:
    if name == "belt":
        record = simulate(guided())
    else:
        record = fs.solve(shipped(name, solver__rtol=1e-6) | {"output": {"interval": 0.03}}).record
    whole = motion(record)
    for frame in (0, len(whole.time) // 3, 2 * len(whole.time) // 3, len(whole.time) - 1):
        sample = int(np.searchsorted(record.channels["time"], whole.time[frame], "right")) - 1
        still = motion(record, sample)
        assert still.time.tolist() == [whole.time[frame]]
        assert still.reduction == pytest.approx(whole.reduction, rel=1e-12)
        seen = {one.name: one.value[frame] for one in whole.readouts}
        for one in still.readouts:
            assert one.value[0] == pytest.approx(seen.pop(one.name), abs=1e-12)
        # A gap of a rope that is taut at this instant has no number.
        assert not any(seen.values())
        bodies = [[p for p in of.parts if isinstance(p, Body)] for of in (whole, still)]
        shown = [one for one in bodies[0] if one.visible is None or one.visible[frame]]
        for one, other in zip(shown, bodies[1], strict=True):
            assert one.name == other.name or "marbles" in (one.name, other.name)
            for a, b in ((one.x, other.x), (one.y, other.y), (one.angle, other.angle)):
                assert b[0] == pytest.approx(a[frame], abs=1e-12)
        marked = [
            [p for p in of.parts if isinstance(p, Line) and p.travel is not None]
            for of in (whole, still)
        ]
        for line, other_line in zip(*marked, strict=True):
            assert line.travel is not None
            assert other_line.travel is not None
            assert other_line.travel[0] == pytest.approx(line.travel[frame], abs=1e-12)
