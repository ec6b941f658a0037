"""The slip of a drive: by how much the rim of the driven pulley is slower than that of the driver.

Tables and pictures have it from here. Speeds of rims are along the belt, in the direction in which
the scenario lists its pulleys, so that a pulley on the back of the belt, which turns the other way,
has a speed of the same sign.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frictionsim.simulation.averages import time_mean

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.geometry import Path

    Array = npt.NDArray[np.float64]

SLOW = 1e-4  # of the waves across the belt: a rim whose mean speed is below that is at rest


class Ends(NamedTuple):
    """The numbers of the pulley that drives and of the one that is driven."""

    drive: int
    driven: int


def senses_of(path: "Path") -> "Array":
    """Return +1 where the belt passes a pulley counter-clockwise, else -1; (pulleys,)."""
    return np.sign([arc.wrap_angle for arc in path.arcs])


def ends_of(power: "Array") -> Ends:
    """Return which pulley puts in the most power and which takes out the most.

    Parameters
    ----------
    power : (pulleys,), W
        Means, positive into the drive.
    """
    drive, driven = int(np.argmax(power)), int(np.argmin(power))
    return Ends(0, len(power) - 1) if drive == driven else Ends(drive, driven)


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
