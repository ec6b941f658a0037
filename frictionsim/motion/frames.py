"""The samples that are frames of a motion, and the channels of a result there.

A frame of a belt is a sample, so that it shows what the file holds. Results of one coordinate have
frames at their events as well, whether or not there is a sample: see `event_frames`.
"""

from math import floor, log2
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.errors import InputError

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.motion.parts import Array, Numbers
    from frictionsim.results import Record

MAX_FRAMES = 601  # more make a file large, and a second has 30 to 60 of them
MAX_EVENTS = 300  # of a motion; one with more chatters, which no eye sees
BYTES_AT_ONCE = 64 * 2**20  # of a channel in its file; of a larger one single samples are read
MAX_SHOWN = 1e100  # a larger number overflows a scale


def frames_of(result: "Record", count: int = MAX_FRAMES) -> "Numbers":
    """Return the numbers of the samples that are frames, evenly spaced with those at events.

    Parameters
    ----------
    result : Record
    count : int
        At most, without those at events.
    """
    time = np.asarray(required(result, "time"))
    if not len(time):
        raise InputError("cannot show this result in motion: it has no samples")
    if not np.all(np.diff(time) >= 0.0) or not np.all(np.abs(time) <= MAX_SHOWN):
        raise InputError("cannot show this result in motion: its times do not increase")
    wanted = np.linspace(time[0], time[-1], min(count, len(time)))
    if len(time) <= count:
        frames = np.arange(len(time))
    else:
        after = np.clip(np.searchsorted(time, wanted), 1, len(time) - 1)
        frames = np.where(wanted - time[after - 1] < time[after] - wanted, after - 1, after)
    at_events = np.searchsorted(time, np.asarray(result.events["time"])[:MAX_EVENTS])
    frames = np.unique(np.concatenate([frames, at_events[at_events < len(time)]]))
    # Two samples at one time are the sides of an event: the last of them is what follows it.
    later = np.diff(time[frames], append=np.inf) > 0.0
    return np.asarray(frames[later], dtype=np.int64)


def channel_at(result: "Record", name: str, frames: "Numbers") -> Any:
    """Return a channel at frames, (frames,) or (frames, members of its axis).

    Of a channel that is large and left in its file, only these samples are read.
    """
    channel = required(result, name)
    if channel.nbytes > BYTES_AT_ONCE and not isinstance(channel, np.ndarray):
        values = np.stack([channel[int(frame)] for frame in frames])
    else:
        values = np.asarray(channel[frames])
    if values.dtype.kind == "f" and not np.all(np.abs(values) <= MAX_SHOWN):
        raise InputError(
            f"cannot show this result in motion: '{name}' has numbers that are not finite or above"
            f" {MAX_SHOWN:g}"
        )
    return values


def required(result: "Record", name: str) -> Any:
    """Return a channel."""
    if name not in result.channels:
        raise InputError(
            f"cannot show this result in motion: it has no channel {name} (see output.channels)"
        )
    return result.channels[name]


def rounded(values: "Array", size: float, steps: float) -> "npt.NDArray[np.float32]":
    """Return values as multiples of a power of two, at most `size / steps`: they compress well.

    Parameters
    ----------
    values : array
    size : float
        Of what is drawn, in the unit of the values.
    steps : float
        How many steps may be told apart in a drawing of this size.
    """
    step = 2.0 ** floor(log2(max(size / steps, float(np.finfo(np.float32).tiny))))
    return np.asarray(np.round(values / step) * step, dtype=np.float32)
