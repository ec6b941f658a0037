"""Channels over time with both sides of their jumps, and their values at all events, for lines."""

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from frictionsim.results import Record


def with_jumps(result: "Record", name: str) -> tuple[Any, Any]:
    """Return the samples of a channel for a line with gaps at its jumps.

    Parameters
    ----------
    result : Record
    name : str
        The channel.

    Returns
    -------
    time, values : (n,)
        With both sides of each jump, and NaN between them; and the recorded value at each other
        event that has no sample.
    """
    values = np.asarray(result.channels[name], dtype=float)
    return insert_jumps(result, name, result.channels["time"], values)


def insert_jumps(result: "Record", name: str, time: Any, values: Any) -> tuple[Any, Any]:
    """Return samples of a channel with its recorded values at events, as `with_jumps`.

    Parameters
    ----------
    result : Record
    name : str
        The channel.
    time, values : (n,) of float
        Its samples, or some of them in their order.
    """
    if name == "angle" and "angle" in result.events:
        return _with_values(result, time, values, np.asarray(result.events["angle"], dtype=float))
    sides = [result.events.get(f"{name}_{side}") for side in ("before", "after")]
    if sides[0] is None or sides[1] is None:
        return time, values
    time, values = _with_values(
        result, time, values, np.where(sides[0] == sides[1], sides[1], np.nan)
    )
    jumps = sides[0] != sides[1]
    # Of several events at one time, the side before the first and that after the last.
    at, first = np.unique(result.events["time"][jumps], return_index=True)
    last = np.append(first[1:], np.count_nonzero(jumps))[: at.size] - 1
    others = ~np.isin(time, at)  # replace the sample at a jump, which is one of its sides
    time, values = time[others], values[others]
    places = np.repeat(np.searchsorted(time, at), 3)
    gap = np.full(at.shape, np.nan)
    jump = np.stack((sides[0][jumps][first], gap, sides[1][jumps][last]), axis=1).ravel()
    return np.insert(time, places, np.repeat(at, 3)), np.insert(values, places, jump)


def _with_values(result: "Record", time: Any, values: Any, at_events: Any) -> tuple[Any, Any]:
    """Return samples with the values at those events where the result has none.

    Parameters
    ----------
    result : Record
    time, values : (n,) of float
    at_events : (events,) of float
        NaN is left out.
    """
    every = np.asarray(result.channels["time"])
    events = np.asarray(result.events["time"])
    if not len(every):
        return time, values
    within = (events > every[0]) & (events < every[-1])
    missing = within & ~np.isin(events, every) & ~np.isnan(at_events)
    places = np.searchsorted(time, events[missing])
    return np.insert(time, places, events[missing]), np.insert(values, places, at_events[missing])
