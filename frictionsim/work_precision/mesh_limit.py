"""The limit of ever finer meshes, extrapolated from two of them."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, NamedTuple

from frictionsim.results import Quantity

if TYPE_CHECKING:
    from frictionsim.results import Array, Check, Metric, Record, Transition

# A belt of fine bodies converges with the square of their length.
ORDER = 2


class Extrapolated(NamedTuple):
    """What two runs are extrapolated to; see `frictionsim.work_precision.errors.Comparable`."""

    channels: "dict[str, Array]"
    transitions: "list[Transition]"
    quantities: dict[str, Quantity]
    checks: "dict[str, Check]"


def extrapolated(fine: "Record", coarse: "Record", metrics: "Iterable[Metric]") -> Extrapolated:
    """Return the limit of two runs on meshes of ratio 2, by Richardson.

    Parameters
    ----------
    fine, coarse : Record
        Sampled at the same times.
    metrics : iterable of Metric
        Only their channels are extrapolated, and all quantities that both runs have.

    Returns
    -------
    Extrapolated
        Its events and checks are those of the fine run.
    """
    share = 1.0 / (2**ORDER - 1)
    channels = {
        name: fine.channels[name] + share * (fine.channels[name] - coarse.channels[name])
        for name in (metric.source for metric in metrics if metric.what == "channel")
    }
    quantities = {}
    for name, quantity in fine.quantities.items():
        other = coarse.quantities.get(name)
        if quantity.value is not None and other is not None and other.value is not None:
            value = quantity.value + share * (quantity.value - other.value)
            quantities[name] = Quantity(value, quantity.unit)
    return Extrapolated(channels, fine.transitions, quantities, fine.checks)
