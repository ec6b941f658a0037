"""The errors of a run against a reference, by metric."""

from collections.abc import Iterable
from math import inf
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from frictionsim.results import Array, Check, Metric, Quantity, Transition

# Missing or incomparable data count as 100 % error.
TOTAL_ERROR = 1.0


class Comparable(Protocol):
    """A run or an exact solution."""

    @property
    def channels(self) -> "Mapping[str, Array]": ...

    @property
    def transitions(self) -> "Sequence[Transition]": ...

    @property
    def quantities(self) -> "Mapping[str, Quantity]": ...

    @property
    def checks(self) -> "Mapping[str, Check]": ...


class Error(NamedTuple):
    """An absolute error, None if undefined, and a relative error."""

    absolute: float | None
    relative: float


def metric_errors(
    metrics: "Iterable[Metric]", found: Comparable, reference: Comparable, duration: float
) -> dict[str, Error]:
    """Return the error for each metric, by name.

    Parameters
    ----------
    metrics : iterable of Metric
    found, reference : Comparable
        Sampled at the same times.
    duration : float, s
        Scale of the errors of event times.
    """
    return {metric.name: _error(metric, found, reference, duration) for metric in metrics}


def max_relative_error(errors: "Mapping[str, Error]") -> float:
    """Return the largest relative error."""
    return max((error.relative for error in errors.values()), default=0.0)


def _error(metric: "Metric", found: Comparable, reference: Comparable, duration: float) -> Error:
    if metric.what == "events":
        return _of_events(found.transitions, reference.transitions, duration)
    if metric.what == "check":
        value = found.checks[metric.source].value
        return Error(value, value)
    if metric.what == "channel":
        return _of_channel(found.channels.get(metric.source), reference.channels[metric.source])
    return _of_quantity(metric, found, reference)


def _of_events(
    found: "Sequence[Transition]", expected: "Sequence[Transition]", duration: float
) -> Error:
    same = [(e.contact, e.mode_from, e.mode_to) for e in found] == [
        (e.contact, e.mode_from, e.mode_to) for e in expected
    ]
    if not same:
        return Error(None, TOTAL_ERROR)
    worst = max((abs(a.time - b.time) for a, b in zip(found, expected, strict=True)), default=0.0)
    return Error(worst, worst / duration)


def _of_channel(found: "Array | None", expected: "Array") -> Error:
    if found is None or found.shape != expected.shape:
        return Error(None, TOTAL_ERROR)
    return _scaled(float(np.mean(np.abs(found - expected))), float(np.mean(np.abs(expected))))


def _of_quantity(metric: "Metric", found: Comparable, reference: Comparable) -> Error:
    values = [
        side.quantities[metric.source].value if metric.source in side.quantities else None
        for side in (found, reference)
    ]
    if values[0] is None or values[1] is None:
        return Error(None, TOTAL_ERROR) if values[0] is not values[1] else Error(0.0, 0.0)
    scale = abs(values[1])
    if metric.scale:
        channel = reference.channels[metric.scale]
        scale = float(np.max(np.abs(channel - channel[0])))
    return _scaled(abs(values[0] - values[1]), scale)


def _scaled(error: float, scale: float) -> Error:
    if error == 0.0:
        return Error(0.0, 0.0)
    return Error(error, error / scale if scale > 0.0 else inf)
