"""Means over time of samples that may be unevenly spaced."""

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

    Array = npt.NDArray[np.float64]

ROUNDING = 1e-9  # relative to the duration
LAST_PART = 0.2  # fraction of the run for the means in summaries and pictures
STARTING = 0.05  # fraction of the run, at its start, that no mean is over
# Of belts: where these are not over whole periods they are weighted, see `smooth_mean`.
WEIGHTED = ("drive_speed", "driven_speed", "slip_percent")
BATCHES = 8
MIN_SMOOTH = 5  # samples, for weights to mean something


def words_of(quantity: str) -> str:
    """Return the description of a quantity of the summaries of runs."""
    mean = ", weighted mean or mean over whole periods" if quantity in WEIGHTED else ""
    return quantity.replace("_", " ") + mean


def last_part(time: "Array") -> "npt.NDArray[np.bool_]":
    """Return which samples are in the last fifth of a run."""
    return np.asarray(time >= time[-1] - (LAST_PART + ROUNDING) * (time[-1] - time[0]))


def last_periods(time: "Array", to_go: "Array") -> int:
    """Return how many whole periods the means of a motion are over, ending with the run.

    Those that fit in the last fifth; else one, if it fits after the start; else none. `to_go` has
    the periods from each sample to the end.
    """
    fit = int(np.max(to_go[last_part(time)]) + ROUNDING)
    return fit or min(1, fitting_periods(time, to_go))


def fitting_periods(time: "Array", to_go: "Array") -> int:
    """Return how many whole periods, ending with the run, fit after its start."""
    later = time >= time[0] + STARTING * (time[-1] - time[0])
    return int(np.max(to_go[later]) + ROUNDING)


def last_seconds(time: "Array", duration: float) -> "npt.NDArray[np.bool_]":
    """Return which samples are in the last seconds of a run."""
    return np.asarray(time >= time[-1] - duration - ROUNDING * (time[-1] - time[0]))


def time_mean(time: "Array", values: "Array") -> Any:
    """Return the mean over time, (n,) in s, of values (n, ...) by the trapezoidal rule."""
    if len(time) < 2 or time[-1] == time[0]:
        return values.mean(axis=0)
    return np.tensordot(np.diff(time), 0.5 * (values[1:] + values[:-1]), 1) / (time[-1] - time[0])


def smooth_mean(time: "Array", values: "Array") -> Any:
    """Return a mean over time that is weighted by sin^2, rising from zero and falling to zero.

    The plain mean of a ripple of amplitude a and frequency f over a time T is off by up to
    a/(pi f T): parts of a period are left over. With these weights, of Hann, it is off by
    a/(pi (f T)^3). The mean of what changes linearly is the same.
    """
    if len(time) < MIN_SMOOTH or time[-1] == time[0]:
        return time_mean(time, values)
    part = (time - time[0]) / (time[-1] - time[0])
    weight = np.sin(np.pi * part) ** 2
    shape = (-1,) + (1,) * (values.ndim - 1)
    return time_mean(time, weight.reshape(shape) * values) / time_mean(time, weight)


def standard_error(values: "Array") -> Any:
    """Return the standard error of the mean of values (n, ...) by the method of batch means.

    Neighbouring samples are correlated; the means of long batches are nearly independent.
    Infinite for a single sample.
    """
    batches = min(BATCHES, len(values))
    if batches < 2:
        return np.full(values.shape[1:], np.inf)
    means = np.array([batch.mean(axis=0) for batch in np.array_split(values, batches)])
    return means.std(axis=0, ddof=1) / np.sqrt(batches)
