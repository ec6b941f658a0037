"""Channels over time with both sides of their jumps, for lines."""

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
        With both sides of each jump, and NaN between them.
    """
    values = np.asarray(result.channels[name], dtype=float)
    return insert_jumps(result, name, result.channels["time"], values)


def insert_jumps(result: "Record", name: str, time: Any, values: Any) -> tuple[Any, Any]:
    """Return samples of a channel with both sides of its jumps, as `with_jumps`.

    Parameters
    ----------
    result : Record
    name : str
        The channel.
    time, values : (n,) of float
        Its samples, or some of them in their order.
    """
    sides = [result.events.get(f"{name}_{side}") for side in ("before", "after")]
    if sides[0] is None or sides[1] is None:
        return time, values
    jumps = sides[0] != sides[1]
    at = result.events["time"][jumps]
    others = ~np.isin(time, at)  # replace the sample at a jump, which is one of its sides
    time, values = time[others], values[others]
    places = np.repeat(np.searchsorted(time, at), 3)
    gap = np.full(at.shape, np.nan)
    jump = np.stack((sides[0][jumps], gap, sides[1][jumps]), axis=1).ravel()
    return np.insert(time, places, np.repeat(at, 3)), np.insert(values, places, jump)
