"""What a run leaves, as plain data: courses over time, transitions, figures and checks.

Everything after the integration - result file, tables, JSON, pictures, comparison - sees this
and nothing of the mechanism, however many coordinates that has.
"""

from types import MappingProxyType
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    import numpy.typing as npt

    from frictionsim.quantities import Quantities

    Array = npt.NDArray[np.float64]

STICK, FORWARD, BACKWARD = 0, 1, -1


class Channel(NamedTuple):
    """A recorded course: its SI unit and what it is, for files, tables and plots.

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
    """A figure that must not exceed its limit."""

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


class Observed(NamedTuple):
    """What a simulation shows of itself once it has stopped, at its end or short of it.

    Attributes
    ----------
    time : (n,), s
    courses : dict of (n,) or (n, members of the channel's axis)
    transitions : list of Transition
    quantities : Quantities
        The figures of the summary.
    checks : dict of Check
        The audit.
    unsound : bool
        Samples that are not finite were cut off the end.
    warnings : tuple of str
        What a user should know before trusting the figures.
    sides : dict of (m,)
        Channels right before and right after each transition: `<channel>_before` and `_after`.
        Empty for a kind whose transitions have no sides.
    """

    time: "Array"
    courses: dict[str, "Array"]
    transitions: list[Transition]
    quantities: "Quantities"
    checks: dict[str, Check]
    unsound: bool
    warnings: tuple[str, ...] = ()
    sides: "Mapping[str, Array]" = MappingProxyType({})
