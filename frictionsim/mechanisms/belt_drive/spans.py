"""The tension of the spans of a belt, from what touches which pulley.

A span reaches from the last body on one pulley to the first body on the next. Joint k is between
the bodies k - 1 and k, whose numbers rise in the direction in which the belt passes its pulleys.
"""

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

    Array = npt.NDArray[np.float64]


def span_tensions(tension: "Array", pulley_index: "Array", pulleys: int) -> "Array":
    """Return the mean tension of each span, N; `[i]` leads from pulley i to the next one.

    Parameters
    ----------
    tension : (n,), N
        Of the joint before each body.
    pulley_index : (n,)
        The pulley that each body touches, -1 for none.
    pulleys : int

    Returns
    -------
    (pulleys,), N
        Where no body touches a pulley, the spans on its two sides are one, and have its mean.
    """
    bodies = len(tension)
    touching = np.flatnonzero(pulley_index >= 0)
    if not touching.size:
        return np.full(pulleys, tension.mean())
    leaves = pulley_index[touching].astype(np.intp)
    reaches = np.roll(leaves, -1)
    joints = (np.roll(touching, -1) - touching) % bodies
    joints[joints == 0] = bodies  # a single body touches
    gaps = np.flatnonzero(leaves != reaches)
    if not gaps.size:  # one pulley only: bodies may lift off between others
        gaps = np.array([np.argmax(joints)])
    before = np.concatenate([[0.0], np.cumsum(np.concatenate([tension, tension]))])
    force, count = np.zeros(pulleys), np.zeros(pulleys)
    for gap in gaps:
        first = touching[gap] + 1
        passed = (reaches[gap] - leaves[gap] - 1) % pulleys + 1
        spans = (leaves[gap] + np.arange(passed)) % pulleys
        force[spans] += before[first + joints[gap]] - before[first]
        count[spans] += joints[gap]
    return np.divide(force, count, out=np.full(pulleys, tension.mean()), where=count > 0.0)
