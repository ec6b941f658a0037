"""What a run leaves, as plain data: channels over time, transitions, quantities and checks.

Everything after the integration - result file, tables, JSON, pictures, comparison - sees this
and nothing of the mechanism, however many coordinates that has.
"""

from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    pass

from math import isfinite
from types import MappingProxyType
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    import numpy.typing as npt

    Array = npt.NDArray[np.float64]

STICK, FORWARD, BACKWARD = 0, 1, -1


class Channel(NamedTuple):
    """A recorded channel: its SI unit and what it is, for files, tables and plots.

    `axis` names what it has a value for at each time, `body` or `pulley`; empty for one value.
    """

    unit: str
    long_name: str
    axis: str = ""


class Transition(NamedTuple):
    """A contact goes over from one mode to another; `position` is None where it has none."""

    time: float
    contact: str
    mode_from: int
    mode_to: int
    position: float | None = None


class Check(NamedTuple):
    """A value that must not exceed its limit."""

    value: float
    limit: float

    @property
    def ok(self) -> bool:
        return bool(self.value <= self.limit)


def failures(checks: dict[str, Check]) -> str:
    """Return which checks failed, and by how much; empty if none."""
    return ", ".join(
        f"{name} {check.value:.3g} above {check.limit:.3g}"
        for name, check in checks.items()
        if not check.ok
    )


class SimulationResult(NamedTuple):
    """What a simulation shows of itself once it has stopped, at its end or short of it.

    Attributes
    ----------
    time : (n,), s
    channels : dict of (n,) or (n, members of the channel's axis)
    transitions : list of Transition
    quantities : Quantities
        The quantities of the summary.
    checks : dict of Check
        The audit.
    unsound : bool
        Samples that are not finite were cut off the end.
    warnings : tuple of str
        What a user should know before trusting the quantities.
    sides : dict of (m,)
        Channels right before and right after each transition: `<channel>_before` and `_after`.
        Empty for a kind whose transitions have no sides.
    """

    time: "Array"
    channels: dict[str, "Array"]
    transitions: list[Transition]
    quantities: "Quantities"
    checks: dict[str, Check]
    non_finite_tail: bool
    warnings: tuple[str, ...] = ()
    sides: "Mapping[str, Array]" = MappingProxyType({})


class Quantity(NamedTuple):
    """A number of the summary; `value` is None where the run or the scenario has none."""

    value: float | None
    unit: str


Quantities = dict[str, Quantity]


def finite(value: float | None) -> float | None:
    """Return a number as JSON has it: null for what is not finite."""
    return value if value is not None and isfinite(value) else None


def quantities_json(quantities: Quantities) -> dict[str, Any]:
    """Return quantities as JSON has them; what is not finite is null there."""
    return {name: {"value": finite(q.value), "unit": q.unit} for name, q in quantities.items()}


class Metric(NamedTuple):
    """One error of a run against a reference.

    Attributes
    ----------
    name : str
        Of a column of the table.
    what : str
        `events`    the worst difference of an event's time, over the duration; 1 where the
                    events are not the same ones
        `quantity`  the difference of a quantity of the summary, over its size or the way of `scale`
        `channel`    the mean difference of a channel, over its mean size
        `check`     a value of the run's own audit, which needs no reference
    source : str
        The quantity, the channel or the check; nothing for events.
    unit : str
        Of the absolute error.
    scale : str
        A channel whose largest change from its start is what a quantity is compared with.
    """

    name: str
    what: Literal["events", "quantity", "channel", "check"]
    source: str = ""
    unit: str = "1"
    scale: str = ""


ENERGY_BALANCE = Metric("energy_balance", "check", "energy_balance")


# Of any mechanism of one coordinate.
SINGLE_DOF_METRICS = (
    Metric("event_time", "events", unit="s"),
    Metric("final_angle", "quantity", "final_angle", "rad", scale="angle"),
    Metric("velocity_L1", "channel", "angular_velocity", "rad/s"),
    ENERGY_BALANCE,
)


class Column(NamedTuple):
    """A value of each setting, with its SI unit; text where the unit is empty."""

    name: str
    unit: str
    long_name: str
    values: list[Any]
