"""The results of a run as plain data: channels over time, transitions, quantities and checks.

Everything after the integration (result file, tables, JSON, pictures, comparison) uses these
types only and is independent of the mechanism.
"""

from math import isfinite
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, NoReturn

from frictionsim.errors import (
    EXIT_AUDIT_FAILED,
    EXIT_DONE,
    exit_code_of_interruption,
    failure_class,
    unknown,
)

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    import numpy.typing as npt

    Array = npt.NDArray[np.float64]

STICK, FORWARD, BACKWARD = 0, 1, -1
# A pulley that no body touches; a span of a belt, or a rope, with and without tension.
OPEN, TAUT, SLACK = 2, 3, 4

Flags = tuple[tuple[int, str], ...]
"""The meanings of the values of an integer channel: (value, meaning in one word) each."""

MODES: Flags = (
    (BACKWARD, "sliding_backward"),
    (STICK, "stick"),
    (FORWARD, "sliding_forward"),
    (OPEN, "open"),
    (TAUT, "taut"),
    (SLACK, "slack"),
)

OTHER_MODES = {"cord": "cord_mode"}
"""By contact the channel of its mode, where it is not `mode`."""

HDF5_SIGNATURE = b"\x89HDF\r\n\x1a\n"  # what a file of results begins with


class Channel(NamedTuple):
    """Unit and description of a recorded channel."""

    unit: str  # SI
    long_name: str
    axis: str = ""  # of its columns, `body` or `pulley`; empty without columns
    integer: bool = False  # a count, an index or a mode
    flags: Flags = ()  # the meanings of these integers; empty for a count


class Transition(NamedTuple):
    """A change of a contact's mode."""

    time: float  # s
    contact: str
    mode_from: int  # 0 sticking, +1 and -1 sliding; the others are in MODES
    mode_to: int
    position: float | None = None  # rad; None of a belt

    @property
    def words(self) -> tuple[str, str]:
        """The modes before and after in the words of a result file, see MODES."""
        names = dict(MODES)
        return names[self.mode_from], names[self.mode_to]


class Check(NamedTuple):
    """A check of the audit: its `value` and the `limit` that this must not exceed."""

    value: float
    limit: float

    @property
    def ok(self) -> bool:
        """True if the value does not exceed the limit."""
        return bool(self.value <= self.limit)


def failures(checks: dict[str, Check]) -> str:
    """Return the failed checks with value and limit as text; empty if all passed."""
    return ", ".join(
        f"{name} {check.value:.3g} above {check.limit:.3g}"
        for name, check in checks.items()
        if not check.ok
    )


class SimulationResult(NamedTuple):
    """The data of a simulation that has stopped, at its end or before.

    Attributes
    ----------
    channels : mapping of (n,) or (n, members of the channel's axis), including `time`, s
    transitions : list of Transition
    quantities : Quantities
        Of the summary.
    checks : dict of Check
        Of the audit.
    non_finite_tail : bool
        Non-finite samples were removed from the end.
    warnings : tuple of str
        Reasons to doubt the quantities.
    sides : dict of (m,)
        Channels immediately before and after each transition, `<channel>_before` and `_after`; of
        belts there are none.
    """

    channels: "Mapping[str, Array]"
    transitions: list[Transition]
    quantities: "Quantities"
    checks: dict[str, Check]
    non_finite_tail: bool
    warnings: tuple[str, ...] = ()
    sides: "Mapping[str, Array]" = MappingProxyType({})

    @property
    def time(self) -> "Array":
        """The times of the samples, (n,), s."""
        return self.channels["time"]


class Quantity(NamedTuple):
    """A number of the summary: `value` and `unit`; the value is None where it is not defined.

    ``float(quantity)`` is nan then. ``f"{quantity:.3g}"`` is the value in that format with its
    unit. There is no arithmetic and no order: they would lose the unit.
    """

    value: float | None
    unit: str

    def __float__(self) -> float:
        return float("nan") if self.value is None else float(self.value)

    def __format__(self, form: str) -> str:
        return f"{'none' if self.value is None else format(self.value, form)} {self.unit}"


def _no_arithmetic(quantity: Quantity, other: object) -> NoReturn:
    raise TypeError("a quantity has a value and a unit: calculate with quantity.value")


# Those of a tuple would join two quantities, repeat one, or compare values of unlike units.
for _operator in ("add", "radd", "mul", "rmul", "lt", "le", "gt", "ge"):
    setattr(Quantity, f"__{_operator}__", _no_arithmetic)


Quantities = dict[str, Quantity]


class NamedQuantities(dict[str, Quantity]):
    """Quantities by name; the KeyError of an unknown one names the closest, or all."""

    def __missing__(self, name: str) -> NoReturn:
        raise KeyError(unknown("quantity", name, list(self)))


class StaticQuantities(NamedQuantities):
    """The quantities of statics, and what is to be said about them."""

    notes: tuple[str, ...] = ()  # sentences: whether the body rests; why a value is none


class SolverStatistics(NamedTuple):
    """Statistics of a run, including the parts before an interruption.

    Evaluations of the right-hand side are those of steps, not of samples and of the search for
    events. `wall_seconds` does not include `compile_seconds`, which is 0 if no kernel was compiled.
    Both are None if the run was read from a file, which does not hold them.
    """

    steps: int
    rejected: int
    rhs_evaluations: int
    states: int
    wall_seconds: float | None
    compile_seconds: float | None = 0.0


def finite(value: float | None) -> float | None:
    """Return a number for JSON: None if it is not finite."""
    return value if value is not None and isfinite(value) else None


def quantities_json(quantities: Quantities) -> dict[str, Any]:
    """Return quantities for JSON; non-finite values become None."""
    return {name: {"value": finite(q.value), "unit": q.unit} for name, q in quantities.items()}


class Metric(NamedTuple):
    """An error measure of a run against a reference.

    Attributes
    ----------
    name : str
        Of the column in the table.
    what : str
        `events`    largest difference of event times, relative to the duration; 1 if the
                    sequences of events differ
        `quantity`  difference of a quantity, relative to its magnitude or to the range of `scale`
        `channel`   mean absolute difference of a channel, relative to its mean magnitude
        `check`     value of a check of the run's audit, which needs no reference
    source : str
        Name of the quantity, channel or check; empty for events.
    unit : str
        Of the absolute error.
    scale : str
        Channel whose largest change from its start scales the error of a quantity.
    """

    name: str
    what: Literal["events", "quantity", "channel", "check"]
    source: str = ""
    unit: str = "1"
    scale: str = ""


ENERGY_BALANCE = Metric("energy_balance", "check", "energy_balance")


# For every mechanism of one coordinate.
SINGLE_DOF_METRICS = (
    Metric("event_time", "events", unit="s"),
    Metric("final_angle", "quantity", "final_angle", "rad", scale="angle"),
    Metric("velocity_L1", "channel", "angular_velocity", "rad/s"),
    ENERGY_BALANCE,
)


class Record(NamedTuple):
    """The results of a run, just solved or read from its file.

    Tables, pictures and comparisons are made of it.
    """

    attributes: dict[str, str]  # the root attributes, see `frictionsim.io.result_writer`
    # (n,) or (n, k), including `time`; integers in integer channels. Those of a large file are read
    # when they are wanted.
    channels: "Mapping[str, Any]"
    units: dict[str, str]
    long_names: dict[str, str]
    axes: dict[str, str]  # of the columns of each channel; empty for a channel of shape (n,)
    members: dict[str, tuple[str, ...]]  # of each axis, by their names or numbers
    events: dict[str, Any]  # arrays (m,), including `time`
    contacts: list[str]  # the names that the indices `events["contact"]` refer to
    flags: dict[str, Flags] = {}  # noqa: RUF012  never changed; meanings of integers
    quantities: Quantities = {}  # noqa: RUF012
    checks: dict[str, Check] = {}  # noqa: RUF012
    statistics: SolverStatistics | None = None  # None of a run that was made elsewhere
    checkpoint: dict[str, Any] | None = None  # the state to resume from, of a run just solved

    @property
    def time(self) -> "Array":
        """The times of the samples, (n,), s."""
        return self.channels["time"]

    @property
    def status(self) -> str:
        """`done`, `failed` or `interrupted`."""
        return self.attributes["status"]

    @property
    def reason(self) -> str:
        """Why the run stopped, or which checks of its audit failed; empty for a sound run."""
        return self.attributes["reason"]

    @property
    def failure(self) -> str:
        """The kind of failure, as `chattering`; empty if not failed."""
        return self.attributes.get("failure", "")

    @property
    def warnings(self) -> tuple[str, ...]:
        """Reasons to doubt the quantities: of the scenario, then of the run."""
        return tuple(filter(None, self.attributes.get("warnings", "").split("\n")))

    @property
    def exit_code(self) -> int:
        """The exit code of the command line for this run."""
        if self.status == "interrupted":
            return exit_code_of_interruption(self.reason)
        if self.status != "done":
            return failure_class(self.failure).exit_code
        return EXIT_AUDIT_FAILED if failures(self.checks) else EXIT_DONE

    @property
    def transitions(self) -> list[Transition]:
        """The events as transitions."""
        e = self.events
        angles = e["angle"].tolist() if "angle" in e else [None] * len(e["time"])
        return [
            Transition(time, self.contacts[int(contact)], int(mode_from), int(mode_to), angle)
            for time, contact, mode_from, mode_to, angle in zip(
                *(e[name].tolist() for name in ("time", "contact", "mode_from", "mode_to")),
                angles,
                strict=True,
            )
        ]

    def events_of(self, contact: str | None = None) -> "npt.NDArray[np.bool_]":
        """Return which events are of a contact, (events,), or change the channel `mode`.

        An impact on an end stop changes it as well.
        """
        import numpy as np

        names = np.array([*self.contacts, ""])[np.asarray(self.events["contact"], dtype=int)]
        if contact is not None:
            return np.asarray(names == contact)
        engaged = np.isin(self.events["mode_from"], (OPEN, TAUT, SLACK))
        return ~engaged & ~np.isin(names, list(OTHER_MODES))

    def of_event(self, name: str) -> Channel:
        """Return unit and description of an array of the events."""
        fixed = {
            "time": Channel("s", "time of the event"),
            "contact": Channel(
                "1", "contact that changes its mode", flags=tuple(enumerate(self.contacts))
            ),
            "mode_from": Channel("1", "mode before the event", flags=MODES),
            "mode_to": Channel("1", "mode after the event", flags=MODES),
            "angle": Channel("rad", "angle at the event"),
        }
        if name in fixed:
            return fixed[name]
        channel, _, side = name.rpartition("_")
        words = f"{self.long_names[channel]}, immediately {side} the event"
        return Channel(self.units[channel], words, flags=self.flags.get(channel, ()))


def defined(quantities: Quantities) -> Quantities:
    """Return the quantities; those that are not finite are None, as in a file."""
    return {
        name: q if q.value is None or isfinite(q.value) else q._replace(value=None)
        for name, q in quantities.items()
    }
