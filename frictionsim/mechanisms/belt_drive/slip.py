"""The slip of a drive, of the driven rim behind the driver, and the tensions of its spans.

Tables and pictures have it from here. Speeds of rims are along the belt, in the direction in which
the scenario lists its pulleys, so that a pulley on the back of the belt, which turns the other way,
has a speed of the same sign.

A span reaches from the last body on one pulley to the first body on the next. Joint k is between
the bodies k - 1 and k, whose numbers rise in the direction in which the belt passes its pulleys.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frictionsim.simulation.averages import time_mean

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.geometry import Path

    Array = npt.NDArray[np.float64]
    Mask = npt.NDArray[np.bool_]
    Numbers = npt.NDArray[np.float64] | npt.NDArray[np.int64]

IDLE = 1e-3  # of the work in the whole run: a part of it in which pulleys do less is idle
SLOW = 1e-4  # of the waves across the belt: a rim whose mean speed is below that is at rest


def span_tensions(tension: "Array", pulley_index: "Numbers", pulleys: int) -> "Array":
    """Return the mean tension of each span in samples, N; `[:, i]` leads from pulley i to the next.

    Parameters
    ----------
    tension : (m, n), N
        Of the joint before each body.
    pulley_index : (m, n)
        The pulley that each body touches, -1 for none.
    pulleys : int

    Returns
    -------
    (m, pulleys), N
        Where no body touches a pulley, the spans on its two sides are one, and have its mean.
    """
    n, index = tension.shape[1], pulley_index.astype(np.intp)
    # Of each joint the last body on a pulley before it and the next one behind it, in two rounds.
    on, body = np.tile(index >= 0, 2), np.arange(2 * n)
    last = np.maximum.accumulate(np.where(on, body, -1), axis=1)[:, n - 1 : -1]
    following = np.minimum.accumulate(np.where(on, body, 2 * n)[:, ::-1], axis=1)[:, : n - 1 : -1]
    leaves, reaches = (np.take_along_axis(index, of % n, axis=1) for of in (last, following))
    is_free, gap = leaves != reaches, following - last
    # Where bodies touch one pulley only, or none, the longest gap is all spans.
    is_free |= ~is_free.any(axis=1, keepdims=True) & (gap == gap.max(axis=1, keepdims=True))
    passed = (reaches - leaves - 1) % pulleys + 1
    mean = np.repeat(tension.mean(axis=1)[:, None], pulleys, axis=1)
    for span in range(pulleys):
        inside = is_free & ((span - leaves) % pulleys < passed)
        count = inside.sum(axis=1)
        np.divide((tension * inside).sum(axis=1), count, out=mean[:, span], where=count > 0)
    return mean


class Ends(NamedTuple):
    """The numbers of the pulley that drives and of the one that is driven."""

    drive: int
    driven: int


def senses_of(path: "Path") -> "Array":
    """Return +1 where the belt passes a pulley counter-clockwise, else -1; (pulleys,)."""
    return np.sign([arc.wrap_angle for arc in path.arcs])


def ends_of(time: "Array", torque: "Array", speed: "Array", part: "Mask", at_rest: "Array") -> Ends:
    """Return which pulley puts in the most work and which takes out the most.

    A pulley that is free or held, which does no work in any sample, does not drive. What an idle
    drive, or one at rest, does in a part of the run is noise: then the work of the whole run
    counts, and at rest the order.

    Parameters
    ----------
    time : (n,), s
    torque, speed : (n, pulleys), N m and rad/s
    part : (n,) of bool
        The samples that the means of the summary are over.
    at_rest : (pulleys,), rad/s
        Speeds below which a pulley is at rest.
    """
    work, whole = (
        mean_power(time[of], torque[of], speed[of]) * np.ptp(time[of])
        for of in (part, np.ones_like(part))
    )
    rests = (np.abs(time_mean(time[part], speed[part])) <= at_rest).all()
    if rests or np.max(np.abs(work)) <= IDLE * np.max(np.abs(whole)):
        work = whole
    acts = np.any(torque * speed != 0.0, axis=0)
    if not acts.any():
        return Ends(0, len(work) - 1)
    drive = int(np.argmax(np.where(acts, work, -np.inf)))
    others = np.arange(len(work)) != drive
    return Ends(drive, int(np.argmin(np.where(others, work, np.inf))))


def mean_power(time: "Array", torque: "Array", speed: "Array") -> "Array":
    """Return the mean power into the drive at each pulley, (pulleys,), W, of samples (n, pulleys).

    Torques in N m, speeds in rad/s.
    """
    return np.asarray(time_mean(time, torque * speed))


def slip_percent(rims: "Array", ends: Ends, at_rest: float) -> "Array":
    """Return the slip, %; not a number where the driver is at rest.

    Parameters
    ----------
    rims : (..., pulleys), m/s
        Speeds of the rims along the belt.
    ends : Ends
    at_rest : float, m/s
        A driver that is no faster is at rest.
    """
    drive, driven = rims[..., ends.drive], rims[..., ends.driven]
    moves = np.abs(drive) > at_rest
    ratio = np.divide(driven, drive, out=np.full(np.shape(drive), np.nan), where=moves)
    return np.asarray(100.0 * (1.0 - ratio))


def speed_at_rest(tension: float, mass_per_length: float) -> float:
    """Return the speed, m/s, below which a rim is at rest: it may vibrate.

    Parameters
    ----------
    tension : float, N
        Mean of the spans.
    mass_per_length : float, kg/m
    """
    return SLOW * float(np.sqrt(abs(tension) / mass_per_length))
