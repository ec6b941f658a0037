"""The times of the frames of a motion, and the samples at them."""

from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.errors import InputError

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.results import Record

    Array = npt.NDArray[np.float64]

MAX_FRAMES = 601  # more make a file large, and a second has 30 to 60 of them


def frame_times(result: "Record", count: int = MAX_FRAMES) -> "Array":
    """Return times (frames,) in s: evenly spaced from the first sample to the last.

    Raises
    ------
    InputError
        If the result has no samples.
    """
    time = result.channels["time"]
    if not time.size:
        raise InputError("cannot show this result in motion: it has no samples")
    if time[-1] <= time[0]:
        return np.asarray(time[:1], dtype=float)
    return np.linspace(time[0], time[-1], count)


def channel_at(result: "Record", name: str, times: "Array") -> "Array":
    """Return a channel (n,) at times, linear between the samples.

    Raises
    ------
    InputError
        If the result has no such channel.
    """
    return np.interp(times, result.channels["time"], required(result, name))


def state_at(result: "Record", name: str, times: "Array") -> Any:
    """Return an integer channel (n,) at times, that of the sample before.

    Raises
    ------
    InputError
        If the result has no such channel.
    """
    values, time = required(result, name), result.channels["time"]
    return values[np.maximum(np.searchsorted(time, times, side="right") - 1, 0)]


def required(result: "Record", name: str) -> Any:
    """Return a channel.

    Raises
    ------
    InputError
        If the result has no such channel.
    """
    if name not in result.channels:
        raise InputError(
            f"cannot show this result in motion: it has no channel {name} (see output.channels)"
        )
    return result.channels[name]
