"""Comparison of a result file with a golden (reference) file, for continuous integration."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatch
from math import inf, isclose, isfinite, pi
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.display import cut_text
from frictionsim.errors import ArgumentError, InputError, unknown
from frictionsim.scenario.toml_data import MAX_VALUE, changes

if TYPE_CHECKING:
    from frictionsim.results import Record

QUANTITIES, SIDES = "quantities/", "events/"  # what the rows of quantities and events begin with
REASONS = ("status", "time")  # rows that say why others differ
SHARES = {"1": 1.0, "%": 100.0}  # scales of quantities without a dimension, by unit
TURN = 2.0 * pi  # rad: scale of an angle that is not one of the motion, such as an arc
EQUAL_TIMES = 1e-9  # relative difference of times that are the same but for rounding
MAX_KEYS = 20  # differing keys of the scenarios in the notes


class ComparedChannel(NamedTuple):
    """The largest difference of one channel, relative to its tolerance, or that of a quantity.

    Difference, tolerance, time and values are those of the sample with the largest ratio of the
    first two. A quantity has no time; its value is None where it is not defined.
    """

    name: str
    difference: float | None = None
    allowed: float | None = None
    time: float | None = None  # s
    ok: bool = False
    note: str = ""  # any other mismatch, or the member of the channel's axis
    value: float | None = None  # of the result
    expected: float | None = None  # of the golden result
    unit: str = ""  # of the values; empty where there are none


@dataclass
class Comparison:
    """The rows of a comparison, and notes outside the verdict.

    What differs stands first, and quantities before events and channels; of these, what is furthest
    above its tolerance.
    """

    rows: list[ComparedChannel] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    @property
    def same(self) -> bool:
        """Whether everything agrees."""
        return all(row.ok for row in self.rows)

    @property
    def verdict(self) -> str:
        """The verdict in words."""
        differing = sum(not row.ok for row in self.rows)
        return f"{differing} of {len(self.rows)} differ" if differing else "the files agree"

    def __repr__(self) -> str:
        return f"<frictionsim.Comparison: {self.verdict}>"


class Tolerances(NamedTuple):
    """The tolerances of a comparison; `atol` in the unit of each row, `time` in s."""

    rtol: float
    atol: float
    time: float

    def allowed(self, expected: Any) -> Any:
        """Return the allowed differences from the expected values, of infinite ones from 0."""
        sizes = np.abs(expected, dtype=np.float64)
        return self.atol + self.rtol * np.where(np.isfinite(sizes), sizes, 0.0)


@np.errstate(all="ignore")  # overflows and NaN, as files may hold any numbers
def compare_records(
    named_result: tuple[str, "Record"],
    named_golden: tuple[str, "Record"],
    tolerances: Tolerances,
    ignore: Sequence[str],
) -> Comparison:
    """Compare two results, with the names of their files; see `frictionsim.compare`."""
    (result_path, result), (golden_path, golden) = named_result, named_golden
    kinds = result.attributes["kind"], golden.attributes["kind"]
    if kinds[0] != kinds[1]:
        raise InputError(
            f"cannot compare: {result_path} is of kind '{kinds[0]}', {golden_path} of '{kinds[1]}'"
        )
    wanted = _compared_names(_names(result) | _names(golden), ignore)
    notes = list(_differing_origins(result, golden))
    *common, complete = _common_samples(result, golden)
    samples = f"{result.time.size} and {golden.time.size} samples"
    if not complete and result.status == golden.status == "done":
        keys = "; ".join(n for n in notes if n.startswith(("solver.duration", "output.")))
        raise InputError(
            f"cannot compare {result_path} and {golden_path}: they are sampled at different times"
            f" ({samples}); run both with the same solver.duration and"
            f" output.interval{keys and f' ({keys})'}"
        )
    ends = [float(r.time[-1]) if r.time.size else 0.0 for r in (result, golden)]
    ended_together = isclose(*ends, rel_tol=EQUAL_TIMES)
    rows = list(_status_rows(result, golden, [] if ended_together else ends))
    if not complete:
        note = f"different sample times, {samples}; only common samples are compared"
        rows.append(ComparedChannel("time", note=note))
    if ended_together:
        rows += _quantity_rows(result, golden, tolerances)
    for name in sorted(wanted & (result.channels.keys() | golden.channels.keys())):
        rows.append(_channel_row(name, result, golden, common, tolerances))
    events = _event_row(result, golden, tolerances.time)
    if "events" in wanted:
        rows.append(events)
        if events.ok:  # the sides can only be compared of equal events
            rows += _side_rows(result, golden, tolerances)
    rows = [row for row in rows if row.name in wanted or row.name in REASONS]
    return Comparison(sorted(rows, key=_place), [f"note: {text}" for text in notes])


def _names(record: "Record") -> set[str]:
    """Return the names of all rows that a result may have."""
    sides = (name.removesuffix("_before") for name in record.events if name.endswith("_before"))
    quantities = (QUANTITIES + name for name in record.quantities)
    return {*record.channels, *quantities, "events", *(SIDES + name for name in sides)} - {"time"}


def _compared_names(names: set[str], ignore: Sequence[str]) -> set[str]:
    """Return the names of which no pattern matches, nor what stands behind their slash."""
    left = set(names)
    for pattern in ignore:
        matched = {n for n in names if any(fnmatch(m, pattern) for m in (n, _bare(n)))}
        if not matched:
            known = names if "/" in pattern else {*map(_bare, names)}
            raise ArgumentError("ignore", unknown("channel or quantity", pattern, sorted(known)))
        left -= matched
    if not left:
        raise ArgumentError("ignore", "nothing is left to compare")
    return left


def _bare(name: str) -> str:
    return name.rpartition("/")[2]


def _differing_origins(result: "Record", golden: "Record") -> Iterator[str]:
    """Yield the differences of two results in version and keys of the scenario."""
    actual, expected = (r.attributes["frictionsim_version"] for r in (result, golden))
    if actual != expected:
        yield f"frictionsim_version: '{actual}', expected '{expected}'"
    if result.attributes["scenario"] == golden.attributes["scenario"]:
        return
    try:
        actual, expected = (r.attributes["scenario"] for r in (result, golden))
        yield from changes(actual, expected, ", expected ", MAX_KEYS)
    except InputError:  # another program has changed a file
        yield "the two files differ in their scenario, of which one is not valid TOML"


def _place(row: ComparedChannel) -> tuple[Any, ...]:
    """Return what rows are sorted by: see `Comparison`. What has no number is worst."""
    ratio = difference = inf
    if row.difference is not None and isfinite(row.difference):
        difference = row.difference
        ratio = difference / row.allowed if row.allowed else (inf if difference else 0.0)
    groups = row.name in REASONS, row.name.startswith(QUANTITIES), True
    return row.ok, groups.index(True), -ratio, -difference


def _status_rows(
    result: "Record", golden: "Record", ends: Sequence[float]
) -> Iterator[ComparedChannel]:
    """Yield a row if the runs differ in their status, or in `ends`, s, where these are given."""
    status, expected = result.status, golden.status
    note = f"'{status}', expected '{expected}'" if status != expected else f"both '{status}'"
    if ends:
        end, expected_end = (f"{time:.9g} s" for time in ends)
        note += f"; quantities are not compared: ended at {end}, expected {expected_end}"
    if ends or status != expected:
        yield ComparedChannel("status", note=note)


def _quantity_rows(
    result: "Record", golden: "Record", tolerances: Tolerances
) -> Iterator[ComparedChannel]:
    """Compare the quantities of two runs that ended at the same time.

    Those of a run that is not done may be missing.
    """
    sizes = {name: _largest(channel) for name, channel in golden.channels.items()}
    for name, either in (result.quantities | golden.quantities).items():
        actual, expected = (r.quantities.get(name) for r in (result, golden))
        row = ComparedChannel(
            QUANTITIES + name,
            value=actual.value if actual else None,
            expected=expected.value if expected else None,
            unit=either.unit,
        )
        if actual is None or expected is None:
            if result.status == golden.status == "done":
                yield row._replace(note=_missing(expected is None))
        elif actual.unit != expected.unit:
            note = f"unit {actual.unit}, expected {expected.unit}"
            yield row._replace(unit="", note=note)
        else:
            allowed = tolerances.time
            if expected.unit != "s":
                allowed = float(tolerances.allowed(_scale(name, golden, sizes)))
            difference = float(_difference(float(actual), float(expected)))
            yield row._replace(difference=difference, allowed=allowed, ok=difference <= allowed)


def _missing(in_golden: bool) -> str:
    return f"missing in {'the golden file' if in_golden else 'the result'}"


def _scale(name: str, golden: "Record", sizes: dict[str, float]) -> float:
    """Return what the relative tolerance of a quantity is relative to, at least its own size.

    A quantity may be a small difference of large numbers, and has the rounding of these: those of
    the channel that its name has in it, else of all channels of its unit; energies have that of the
    largest energy of the run.
    """
    value, unit = golden.quantities[name]
    size = abs(value) if value is not None and isfinite(value) else 0.0
    if unit in SHARES:
        return max(SHARES[unit], size)
    alike = [channel for channel in golden.channels if golden.units[channel] == unit]
    if unit == "J":
        energies = (abs(q.value) for q in golden.quantities.values() if q.unit == "J" and q.value)
        return max(*(sizes[c] for c in alike), *filter(isfinite, energies), size, 0.0)
    named = [channel for channel in alike if f"_{channel}_" in f"_{name}_"]
    nearest = [max(named, key=len)] if named else alike
    scale = max((sizes[channel] for channel in nearest), default=0.0)
    return max(size, min(scale, TURN) if unit == "rad" and not named else scale)


def _largest(channel: Any) -> float:
    """Return the largest finite size of the values of a channel."""
    sizes = np.abs(channel, dtype=np.float64)
    return float(np.max(sizes, initial=0.0, where=np.isfinite(sizes)))


def _common_samples(result: "Record", golden: "Record") -> tuple[Any, Any, bool]:
    """Return the indices of common samples in each, and whether all others are at events."""
    times, expected = result.channels["time"], golden.channels["time"]
    (places, matched), (_, golden_matched) = _nearest(times, expected), _nearest(expected, times)
    complete = bool(
        np.all(matched | np.isin(times, result.events["time"]))
        and np.all(golden_matched | np.isin(expected, golden.events["time"]))
    )
    golden_indices, result_indices = np.unique(places[matched], return_index=True)
    return np.flatnonzero(matched)[result_indices], golden_indices, complete


def _nearest(times: Any, others: Any) -> tuple[Any, Any]:
    """Return the indices of the nearest other times, and which of them are equal to rounding."""
    if not others.size:
        return np.zeros(times.shape, dtype=np.intp), np.zeros(times.shape, dtype=bool)
    places = np.searchsorted(0.5 * (others[1:] + others[:-1]), times)
    return places, np.isclose(times, others[places], rtol=EQUAL_TIMES, atol=0.0)


def _channel_row(
    name: str, result: "Record", golden: "Record", common: list[Any], tolerances: Tolerances
) -> ComparedChannel:
    if name not in result.channels or name not in golden.channels:
        return ComparedChannel(name, note=_missing(name in result.channels))
    columns = _columns(golden, name)
    note = ""
    if result.units[name] != golden.units[name]:
        note = f"unit {result.units[name]}, expected {golden.units[name]}"
    elif _columns(result, name) != columns:
        note = f"{_axis(result, name)}, expected {_axis(golden, name)}"
    if note:
        return ComparedChannel(name, note=note)
    time = golden.channels["time"][common[1]]
    away = np.flatnonzero(_outside_event_windows(golden.events["time"], time, tolerances.time))
    actual = result.channels[name][common[0][away]]
    expected = golden.channels[name][common[1][away]]
    allowed = tolerances.allowed(expected)
    return _worst(name, actual, expected, time[away], allowed, golden.units[name], columns)


def _worst(
    name: str, actual: Any, expected: Any, time: Any, allowed: Any, unit: str, axis: Any = ("", ())
) -> ComparedChannel:
    """Return the row of what is furthest above its tolerance, the last one of equals."""
    if not len(time):
        return ComparedChannel(name, 0.0, ok=True, unit=unit)
    # Integers as numbers: the difference of two of a byte may be larger than a byte.
    actual, expected = (np.asarray(v, dtype=np.float64) for v in (actual, expected))
    difference = _difference(actual, expected)
    # With a tolerance of zero the ratio is infinite, or zero if there is no difference.
    ratio = np.where(difference > 0.0, difference / allowed, 0.0)
    ratio[np.isnan(ratio)] = 1.0  # both are infinite
    order = np.lexsort((difference.ravel(), ratio.ravel()))
    sample, *member = worst = np.unravel_index(order[-1], difference.shape)
    note = f"{axis[0]} {axis[1][member[0]]}" if member else ""
    numbers = (difference[worst], allowed[worst], time[sample], actual[worst], expected[worst])
    size, limit, at, value, other = map(float, numbers)
    return ComparedChannel(name, size, limit, at, size <= limit, note, value, other, unit)


def _difference(actual: Any, expected: Any) -> Any:
    """Return the absolute difference; infinite where only one value is NaN."""
    difference = np.abs(actual - expected)
    # Equal infinities, and NaN in both, count as no difference.
    equal = (actual == expected) | (np.isnan(actual) & np.isnan(expected))
    return np.where(equal, 0.0, np.where(np.isnan(difference), np.inf, difference))


def _columns(result: "Record", name: str) -> tuple[str, tuple[str, ...]]:
    """Return the axis of a channel and the names of its members; both empty without columns."""
    axis = result.axes[name]
    return axis, result.members[axis] if axis else ()


def _axis(result: "Record", name: str) -> str:
    """Return the axis of a channel with the number and names of its members, in words."""
    axis, members = _columns(result, name)
    if not axis:
        return "one column"
    named = ", ".join(members)
    return f"{len(members)} columns along {axis}: {cut_text(named, MAX_VALUE)}"


def _outside_event_windows(events: Any, time: Any, time_atol: float) -> Any:
    """Return a mask of the samples that are more than time_atol away from every event."""
    away = np.ones(time.shape, dtype=bool)
    for event in events:
        first, last = np.searchsorted(time, (event - time_atol, event + time_atol))
        away[first : last + 1] &= np.abs(time[first : last + 1] - event) > time_atol
    return away


def _event_row(result: "Record", golden: "Record", time_atol: float) -> ComparedChannel:
    actual, expected = result.transitions, golden.transitions
    if len(actual) != len(expected):
        note = f"{len(actual)} events, expected {len(expected)}"
        return ComparedChannel("events", note=note)
    for event, wanted_event in zip(actual, expected, strict=True):
        what, wanted_what = (f"{e.contact}: {' to '.join(e.words)}" for e in (event, wanted_event))
        if what != wanted_what:
            note = f"{what} at {event.time:.9g} s, expected {wanted_what}"
            return ComparedChannel("events", note=note)
    times, wanted = (r.events["time"] for r in (result, golden))
    allowed = np.full(times.shape, time_atol)
    return _worst("events", times, wanted, wanted, allowed, "s")


def _side_rows(
    result: "Record", golden: "Record", tolerances: Tolerances
) -> Iterator[ComparedChannel]:
    """Compare the channels immediately before and after the events, if both results have them.

    An event may be shifted by the tolerance of time. The change of the channel in this time, at its
    rate between the event and the next sample, is therefore allowed as well.
    """
    time, at = golden.time, golden.events["time"]
    beside = np.searchsorted(time, at, "left") - 1, np.searchsorted(time, at, "right")
    places = np.clip(np.concatenate(beside), 0, time.size - 1)
    at = np.tile(at, 2)
    for name in (name for name in golden.channels if name in result.channels):
        sides = [f"{name}_{side}" for side in ("before", "after")]
        if all(side in r.events for side in sides for r in (result, golden)):
            actual, expected = (
                np.concatenate([r.events[side] for side in sides]) for r in (result, golden)
            )
            rates = np.abs((golden.channels[name][places] - expected) / (time[places] - at))
            rates = np.where(np.isfinite(rates), rates, 0.0)
            allowed = tolerances.allowed(expected) + rates * tolerances.time
            yield _worst(SIDES + name, actual, expected, at, allowed, golden.units[name])
