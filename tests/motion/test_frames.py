"""The samples that are frames of a motion, and refusals."""

from typing import Any

import numpy as np
import pytest

from frictionsim.errors import InputError
from frictionsim.motion import motion_of
from frictionsim.motion.frames import channel_at, frames_of, rounded
from frictionsim.results import Record
from tests.support.motions import record_of


def with_times(times: Any, events: Any = ()) -> Record:
    return record_of("pulley", {"time": np.asarray(times, dtype=float)}, events=events)


def test_all_samples_of_a_short_run_are_frames_of_two_at_one_time_the_later() -> None:
    assert frames_of(with_times(np.arange(7.0))).tolist() == list(range(7))
    assert frames_of(with_times([0.0, 1.0, 1.0, 2.0])).tolist() == [0, 2, 3]


def test_samples_of_a_long_run_are_spread_and_those_at_events_kept() -> None:
    times = np.linspace(0.0, 10.0, 5001)
    samples = frames_of(with_times(times, [times[1234], times[4321]]), 11)
    assert {1234, 4321} <= set(samples.tolist())
    assert len(samples) == 13
    assert np.diff(times[samples]).max() < 1.01


def test_one_sample_is_a_motion() -> None:
    assert frames_of(with_times([0.5])).tolist() == [0]


@pytest.mark.parametrize(
    ("times", "angles", "message"),
    [
        ([], [], "it has no samples"),
        *(
            (times, times, "its times do not increase")
            for times in ([0.0, 2.0, 1.0], [0.0, np.nan], [0.0, 1e300])
        ),
        *(
            ([0.0, 1.0, 2.0], [0.0, wrong, 1.0], "'angle' has numbers that are not finite or above")
            for wrong in (np.nan, np.inf, 1e200)
        ),
    ],
)
def test_what_cannot_be_drawn_is_refused(
    times: list[float], angles: list[float], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        motion_of(record_of("pulley", {"time": np.array(times), "angle": np.array(angles)}))


class InItsFile:
    """A channel that stays in a file and counts the samples read."""

    def __init__(self, values: Any) -> None:
        self.values, self.shape, self.nbytes, self.read = values, values.shape, values.nbytes, 0

    def __getitem__(self, key: Any) -> Any:
        part = self.values[key]
        self.read += 1 if isinstance(key, int) else len(part)
        return part


def test_of_a_large_channel_only_the_frames_are_read() -> None:
    times, channel = np.arange(2000.0), InItsFile(np.random.default_rng(1).random((2000, 3)))
    result = record_of("belt_drive", {"time": times, "x": channel})
    chosen = frames_of(result, 20)
    assert np.array_equal(channel_at(result, "x", chosen), channel.values[chosen])
    assert channel.read == len(chosen) == 20


def test_rounding_is_as_fine_as_a_drawing_needs() -> None:
    values = np.random.default_rng(2).uniform(-0.5, 0.5, 1000)
    coarse = rounded(values, 1.0, 40_000.0)
    assert 0.0 < np.abs(coarse - values).max() <= 0.5 / 40_000.0
    assert coarse.dtype == np.float32
    assert np.array_equal(rounded(np.full(3, 7.0), 0.0, 250.0), np.full(3, 7.0))
