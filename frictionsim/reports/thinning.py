"""Fewer samples of a long channel, so that a line through them looks as one through all.

The samples are cut into equal parts, and of each part the lowest and the highest is kept: peaks
stay, however short they are. Of samples that are not finite, which are gaps in the line, enough are
kept that no line is drawn across a gap.
"""

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

    Array = npt.NDArray[np.float64]
    Indices = npt.NDArray[np.intp]

ENDS = 2  # the first sample and the last
OF_A_PART, OF_A_PART_WITH_GAPS = 2, 5  # lowest, highest; and three gaps: before, between, after
MIN_LIMIT = ENDS + OF_A_PART_WITH_GAPS


def thinned(values: "Array", limit: int) -> "Indices":
    """Return which samples of a channel to keep, in their order.

    Parameters
    ----------
    values : (n,)
    limit : int
        At most so many are kept, of more than that; at least MIN_LIMIT.

    Returns
    -------
    (m,) of int
        All of them if n is not above the limit.
    """
    if limit < MIN_LIMIT:
        raise ValueError(f"a line needs at least {MIN_LIMIT} samples, not {limit}")
    count = len(values)
    if count <= limit:
        return np.arange(count)
    gaps = ~np.isfinite(values)
    with_gaps = bool(gaps.any())
    parts = (limit - ENDS) // (OF_A_PART_WITH_GAPS if with_gaps else OF_A_PART)
    width = -(-count // parts)
    whole = count // width * width
    kept = [np.array([0, count - 1])]
    for start, stop in ((0, whole), (whole, count)):
        if stop > start:
            rows = slice(start, stop), (-1, min(width, stop - start))
            found = _kept(
                values[rows[0]].reshape(rows[1]),
                gaps[rows[0]].reshape(rows[1]) if with_gaps else None,
            )
            kept.append(found + start)
    return np.unique(np.concatenate(kept))


def _kept(values: "Array", gaps: Any) -> "Indices":
    """Return the places that are kept in parts (parts, width), counted through all of them."""
    if gaps is None:
        places = [values.argmin(axis=1), values.argmax(axis=1)]
    else:
        low = np.where(gaps, np.inf, values).argmin(axis=1)
        high = np.where(gaps, -np.inf, values).argmax(axis=1)
        places = [low, high, *_kept_gaps(gaps, np.minimum(low, high))]
    first = np.arange(len(values)) * values.shape[1]
    return np.concatenate([place + first for place in places])


def _kept_gaps(gaps: Any, extreme: "Indices") -> list["Indices"]:
    """Return the first and last gap of each part, and the first one after the first extreme.

    A part without gaps has any of its samples instead.
    """
    after = gaps & (np.arange(gaps.shape[1]) > extreme[:, np.newaxis])
    last = gaps.shape[1] - 1 - gaps[:, ::-1].argmax(axis=1)
    # Where there is none, argmax is 0, or 0 from the end: that sample would be one too many.
    places = [gaps.argmax(axis=1), after.argmax(axis=1), last]
    found = [gaps.any(axis=1), after.any(axis=1), gaps.any(axis=1)]
    return [np.where(has, place, extreme) for place, has in zip(places, found, strict=True)]
