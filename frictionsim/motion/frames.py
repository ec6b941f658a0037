"""The frames of a motion, and the channels of a result there.

A frame of a belt is a sample, so that it shows what the file holds. Results of one coordinate have
frames at both sides of each event as well, so that a drawing changes at the time of an event
whatever the samples are: what a contact does and how many marbles were delivered follow from the
events. Between samples channels are linear; at an event they have the values that the file records
immediately before and after it.
"""

from math import floor, log2
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy.typing as npt

    from frictionsim.motion.parts import Array, Bools, Numbers, Readout
    from frictionsim.results import Record


MAX_FRAMES = 601  # more make a file large, and a second has 30 to 60 of them
MAX_EVENTS = 300  # of a motion; one with more chatters, which no eye sees
MAX_SHOWN = 1e100  # a larger number overflows a scale


def frames_of(result: "Record", count: int = MAX_FRAMES) -> "Numbers":
    """Return the numbers of the samples that are frames, evenly spaced with those at events.

    Parameters
    ----------
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
    """Return a channel at frames, (frames,) or (frames, members of its axis)."""
    values = np.asarray(required(result, name)[frames])
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
        Number of steps that are distinguishable in a drawing of this size.
    """
    step = 2.0 ** floor(log2(max(size / steps, float(np.finfo(np.float32).tiny))))
    return np.asarray(np.round(values / step) * step, dtype=np.float32)


class Frames(NamedTuple):
    """The frames of a motion.

    Attributes
    ----------
    time : (frames,), s
        Strictly increasing.
    sample : (frames,) of int
        The last sample at or before each.
    share : (frames,)
        How far it is from that sample to the next one, from 0 to 1.
    before, after : (frames,) of int
        The event that the frame is immediately before or after; -1 for none.
    """

    time: "Array"
    sample: "Numbers"
    share: "Array"
    before: "Numbers"
    after: "Numbers"


def frames_with_events(result: "Record") -> Frames:
    """Return evenly spaced samples, and two frames at each event between the first and the last.

    The frame before an event is one rounding of the time earlier, so that times increase. Of more
    than MAX_EVENTS events the first changes of mode have frames, then the first others; state and
    count at the frames remain those after all events, but change a frame late at the other ones.
    """
    samples = frames_of(result)
    time = np.asarray(result.channels["time"], dtype=float)
    events = _event_times(result)
    changes = _changes(result)
    shown = np.concatenate([events[changes], events[~changes]])[:MAX_EVENTS]
    shown = shown[(shown >= time[0]) & (shown <= time[-1])]
    sides = np.concatenate([shown, np.nextafter(shown[shown > time[0]], -np.inf)])
    times = np.unique(np.concatenate([time[samples], sides]))
    sample = np.searchsorted(time, times, side="right") - 1
    following = np.minimum(sample + 1, len(time) - 1)
    step = time[following] - time[sample]
    share = np.divide(times - time[sample], step, out=np.zeros_like(times), where=step > 0.0)
    passed = np.searchsorted(events, times, side="right")  # the number of events so far
    ahead = np.append(events, np.inf)[passed]
    latest = np.append(events, -np.inf)[passed - 1]
    return Frames(
        times,
        sample,
        share,
        np.where(ahead == np.nextafter(times, np.inf), passed, -1),
        np.where(latest == times, passed - 1, -1),
    )


def values_at(result: "Record", name: str, frames: Frames) -> Any:
    """Return a channel at frames: linear between samples, a count that of the sample before."""
    if name == "time":
        return frames.time
    values = channel_at(result, name, frames.sample)
    if values.dtype.kind == "f" and frames.share.any():
        last = len(result.channels["time"]) - 1
        following = channel_at(result, name, np.minimum(frames.sample + 1, last))
        values = values + frames.share * (following - values)
    for side, event in (("before", frames.before), ("after", frames.after)):
        recorded = result.events.get("angle" if name == "angle" else f"{name}_{side}")
        if recorded is not None:
            at = event >= 0
            values = np.array(values)
            values[at] = np.asarray(recorded)[event[at]]
    if values.dtype.kind == "f" and not np.all(np.abs(values) <= MAX_SHOWN):
        raise InputError(
            f"cannot show this result in motion: at an event '{name}' has numbers that are not"
            f" finite or above {MAX_SHOWN:g}"
        )
    return values


def readouts_at(
    result: "Record", names: "Mapping[str, str]", frames: Frames
) -> tuple["Readout", ...]:
    """Return the numbers beside a drawing, of those channels that the result has.

    Parameters
    ----------
    names : mapping
        By channel the words for it.
    """
    from frictionsim.motion.parts import Readout

    return tuple(
        Readout(words, result.units[name], values_at(result, name, frames), name)
        for name, words in names.items()
        if name in result.channels
    )


def state_at(result: "Record", frames: Frames) -> "Numbers | None":
    """Return the mode of the contact of the channel `mode` at frames; None if it is not recorded.

    It is the mode after the last change, or that of a sample since then. The sample at an event has
    the mode before it.
    """
    if "mode" not in result.channels:
        return None
    modes = np.array(channel_at(result, "mode", frames.sample), dtype=np.int64)
    changes = _changes(result)
    if changes.any():
        changes &= result.events_of()
    event = last_event(result, frames, changes)
    changed = event >= 0
    if changed.any():
        modes[changed] = np.asarray(result.events["mode_to"])[event[changed]]
    return modes


def last_event(result: "Record", frames: Frames, chosen: "Bools") -> "Numbers":
    """Return the last of the chosen events at each frame, if it is not earlier than its sample.

    Parameters
    ----------
    chosen : (events,) of bool

    Returns
    -------
    (frames,) of int
        -1 where there is none.
    """
    numbers = np.flatnonzero(chosen)
    times = _event_times(result)[numbers]
    last = np.searchsorted(times, frames.time, side="right") - 1
    sampled = np.asarray(result.channels["time"], dtype=float)[frames.sample]
    since = np.append(times, -np.inf)[last] >= sampled
    return np.where((last >= 0) & since, np.append(numbers, -1)[last], -1)


def _event_times(result: "Record") -> "Array":
    return np.asarray(result.events["time"], dtype=float)


def _changes(result: "Record") -> "Bools":
    """Return flags of the events that change the mode of the contact, (events,)."""
    if not {"mode_from", "mode_to"} <= result.events.keys():
        return np.zeros(len(result.events["time"]), dtype=bool)
    return np.asarray(result.events["mode_from"]) != np.asarray(result.events["mode_to"])
