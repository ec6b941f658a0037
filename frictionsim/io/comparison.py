"""Comparison of a result file with a golden (reference) file, for continuous integration."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatch
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.errors import ArgumentError, InputError, unknown
from frictionsim.scenario.toml_data import differing_keys, toml_value
from frictionsim.simulation.stored_channel import blocks_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from frictionsim.results import Record

FLOAT_BYTES = 8
MAX_KEYS = 20  # differing keys of the scenarios in the notes
MAX_VALUE = 60  # characters of the value of a key


class ComparedChannel(NamedTuple):
    """The largest difference of one channel, relative to its tolerance.

    Difference, tolerance and time are those of the sample with the largest ratio of the two.
    """

    name: str
    difference: float | None = None
    allowed: float | None = None
    time: float | None = None  # s
    ok: bool = False
    note: str = ""  # any other mismatch, or the member of the channel's axis


@dataclass
class Comparison:
    """The rows of a comparison, the largest ratio first, and notes outside the verdict."""

    rows: list[ComparedChannel] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    @property
    def same(self) -> bool:
        """Whether everything agrees."""
        return all(row.ok for row in self.rows)


class Tolerances(NamedTuple):
    """The tolerances of a comparison; `atol` in the unit of each channel, `time` in s."""

    rtol: float
    atol: float
    time: float

    def allowed(self, expected: Any) -> Any:
        """Return the allowed differences from the expected values."""
        return self.atol + self.rtol * np.abs(expected)


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
    _check_patterns(ignore, {*result.channels, *golden.channels, "events"})
    comparison = Comparison()
    _compare_status(result, golden, comparison)
    common = _common_samples(result, golden)
    _compare_times(result, golden, common, comparison, f"{result_path} and {golden_path}")
    comparison.notes += [f"note: {text}" for text in _differing_origins(result, golden)]

    def is_compared(name: str) -> bool:
        return not any(fnmatch(name, pattern) for pattern in ignore)

    for name in sorted((result.channels.keys() | golden.channels.keys()) - {"time"}):
        if is_compared(name):
            row = _compare_channel(name, result, golden, common, tolerances)
            comparison.rows.append(row)
    if is_compared("events"):
        events = _compare_events(result, golden, tolerances.time)
        comparison.rows.append(events)
        if events.ok:  # the sides can only be compared of equal events
            comparison.rows += _compare_sides(result, golden, is_compared, tolerances)
    comparison.rows.sort(key=_tolerance_ratio, reverse=True)
    return comparison


def _differing_origins(result: "Record", golden: "Record") -> Iterator[str]:
    """Yield the differences of two results in version and keys of the scenario."""
    actual, expected = (r.attributes["frictionsim_version"] for r in (result, golden))
    if actual != expected:
        yield f"frictionsim_version: '{actual}', expected '{expected}'"
    if result.attributes["scenario"] == golden.attributes["scenario"]:
        return
    try:
        differing = differing_keys((result, golden))
    except InputError:  # another program has changed a file
        yield "the two files differ in their scenario, of which one is not valid TOML"
        return
    for key, (actual, expected) in list(differing.items())[:MAX_KEYS]:
        yield f"{key}: {_shortened(actual, expected)}, expected {_shortened(expected, actual)}"
    if len(differing) > MAX_KEYS:
        yield f"{len(differing) - MAX_KEYS} more keys of their scenarios differ"


def _shortened(value: Any, other: Any) -> str:
    """Return a value as TOML; of long lists, the first entry that differs from another list."""
    if value is None:
        return "none"
    text = toml_value(value)
    if len(text) <= MAX_VALUE:
        return text
    if isinstance(value, list) and isinstance(other, list):
        for place, (one, another) in enumerate(zip(value, other, strict=False)):
            if one != another:
                return f"a list of {len(value)} with {_shortened(one, another)} at {place}"
        return f"a list of {len(value)}"
    return f"{text[:MAX_VALUE]}..."


def _check_patterns(ignore: Sequence[str], names: set[str]) -> None:
    """Raise InputError if a pattern matches no channel, or if the patterns match all of them."""
    names = names - {"time"}
    for pattern in ignore:
        if not any(fnmatch(name, pattern) for name in names):
            raise ArgumentError("ignore", unknown("channel", pattern, sorted(names)))
    if all(any(fnmatch(name, pattern) for pattern in ignore) for name in names):
        raise ArgumentError("ignore", "nothing is left to compare")


def _tolerance_ratio(row: ComparedChannel) -> tuple[bool, float]:
    if row.difference is None or not row.allowed:
        return not row.ok, 0.0
    return not row.ok, row.difference / row.allowed


def _compare_status(result: "Record", golden: "Record", comparison: Comparison) -> None:
    statuses = result.attributes["status"], golden.attributes["status"]
    if statuses[0] != statuses[1]:
        note = f"'{statuses[0]}', expected '{statuses[1]}'"
        comparison.rows.append(ComparedChannel("status", note=note))


class _CommonSamples(NamedTuple):
    """Indices of the samples common to two results, in each of them.

    `complete`: all other samples are at events, whose times differ between the results.
    """

    result: Any
    golden: Any
    complete: bool


def _common_samples(result: "Record", golden: "Record") -> _CommonSamples:
    times, expected = result.channels["time"], golden.channels["time"]
    (places, matched), (_, golden_matched) = _nearest(times, expected), _nearest(expected, times)
    complete = bool(
        np.all(matched | np.isin(times, result.events["time"]))
        and np.all(golden_matched | np.isin(expected, golden.events["time"]))
    )
    golden_indices, result_indices = np.unique(places[matched], return_index=True)
    return _CommonSamples(np.flatnonzero(matched)[result_indices], golden_indices, complete)


def _nearest(times: Any, others: Any) -> tuple[Any, Any]:
    """Return the indices of the nearest other times, and which of them are equal to rounding."""
    places = np.zeros(times.shape, dtype=np.intp)
    if not others.size:
        return places, np.zeros(times.shape, dtype=bool)
    for shift in (0, -1):
        near = np.clip(np.searchsorted(others, times) + shift, 0, others.size - 1)
        closer = np.abs(others[near] - times) <= np.abs(others[places] - times)
        places = np.where(closer, near, places)
    return places, np.isclose(times, others[places], rtol=1e-9, atol=0.0)


def _compare_times(
    result: "Record", golden: "Record", common: _CommonSamples, comparison: Comparison, pair: str
) -> None:
    """Raise InputError if two completed runs differ in sample times; else add a row."""
    times, expected = result.channels["time"], golden.channels["time"]
    if common.complete:
        return
    counts = f"{times.size} and {expected.size} samples"
    if result.attributes["status"] == golden.attributes["status"] == "done":
        keys = "; ".join(
            text
            for text in _differing_origins(result, golden)
            if text.startswith(("solver.duration", "output."))
        )
        raise InputError(
            f"cannot compare {pair}: they are sampled at different times ({counts}); run both with"
            f" the same solver.duration and output.interval{keys and f' ({keys})'}"
        )
    note = f"different sample times, {counts}; only common samples are compared"
    comparison.rows.append(ComparedChannel("time", note=note))


def _compare_channel(
    name: str, result: "Record", golden: "Record", common: _CommonSamples, tolerances: Tolerances
) -> ComparedChannel:
    if name not in result.channels or name not in golden.channels:
        where = "the golden file" if name in result.channels else "the result"
        return ComparedChannel(name, note=f"missing in {where}")
    if result.units[name] != golden.units[name]:
        note = f"unit {result.units[name]}, expected {golden.units[name]}"
        return ComparedChannel(name, note=note)
    columns = _columns(golden, name)
    if _columns(result, name) != columns:
        note = f"{_axis(result, name)}, expected {_axis(golden, name)}"
        return ComparedChannel(name, note=note)
    time = golden.channels["time"][common.golden]
    away = np.flatnonzero(_outside_event_windows(golden.events["time"], time, tolerances.time))
    actual, expected = result.channels[name], golden.channels[name]
    worst, ratio = ComparedChannel(name, 0.0, tolerances.atol, None, True), (-1.0, 0.0)
    # In blocks, as a long channel does not fit into memory.
    for start, stop in blocks_of(len(away), FLOAT_BYTES * int(np.prod(expected.shape[1:]))):
        part = away[start:stop]
        both = actual[common.result[part]], expected[common.golden[part]]
        part_ratio, row = _worst_sample(name, *both, time[part], tolerances, columns)
        if part_ratio >= ratio:
            worst, ratio = row, part_ratio
    return worst


def _worst_sample(
    name: str,
    actual: Any,
    expected: Any,
    time: Any,
    tolerances: Tolerances,
    columns: tuple[str, tuple[str, ...]],
) -> tuple[tuple[float, float], ComparedChannel]:
    """Return the row of the largest difference, after its ratio to the tolerance and its size."""
    # Integers are compared as numbers: format version 1 has floats.
    actual, expected = (np.asarray(v, dtype=np.float64) for v in (actual, expected))
    allowed = tolerances.allowed(np.where(np.isfinite(expected), expected, 0.0))
    difference = _difference(actual, expected)
    # With a tolerance of zero the ratio is infinite, or zero if there is no difference.
    ratio = np.where(difference > 0.0, difference / allowed, 0.0)
    ratio[np.isnan(ratio)] = 1.0  # both are infinite
    order = np.lexsort((difference.ravel(), ratio.ravel()))
    sample, *member = worst = np.unravel_index(order[-1], difference.shape)
    ok = bool(difference[worst] <= allowed[worst])
    axis, names = columns
    note = f"{axis} {names[member[0]]}" if member else ""
    size, limit, at = (float(v) for v in (difference[worst], allowed[worst], time[sample]))
    return (float(ratio[worst]), size), ComparedChannel(name, size, limit, at, ok, note)


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
    cut = named if len(named) <= MAX_VALUE else f"{named[:MAX_VALUE]}..."
    return f"{len(members)} columns along {axis}: {cut}"


def _outside_event_windows(events: Any, time: Any, time_atol: float) -> Any:
    """Return a mask of the samples that are more than time_atol away from every event."""
    away = np.ones(time.shape, dtype=bool)
    for event in events:
        first, last = np.searchsorted(time, (event - time_atol, event + time_atol))
        away[first : last + 1] &= np.abs(time[first : last + 1] - event) > time_atol
    return away


def _compare_events(result: "Record", golden: "Record", time_atol: float) -> ComparedChannel:
    actual, expected = _named_events(result), _named_events(golden)
    if len(actual) != len(expected):
        note = f"{len(actual)} events, expected {len(expected)}"
        return ComparedChannel("events", note=note)
    worst = ComparedChannel("events", 0.0, time_atol, None, True)
    for (time, *what), (expected_time, *expected_what) in zip(actual, expected, strict=True):
        difference = abs(time - expected_time)
        if what != expected_what:
            note = f"{what} at {time:.9g} s, expected {expected_what}"
            return ComparedChannel("events", difference, time_atol, expected_time, False, note)
        if not difference <= (worst.difference or 0.0):  # also true if it is NaN
            worst = ComparedChannel(
                "events", difference, time_atol, expected_time, difference <= time_atol
            )
    return worst


def _named_events(result: "Record") -> list[tuple[float, str, int, int]]:
    e = result.events
    return [
        (float(time), result.contacts[int(contact)], int(mode_from), int(mode_to))
        for time, contact, mode_from, mode_to in zip(
            e["time"], e["contact"], e["mode_from"], e["mode_to"], strict=True
        )
    ]


def _compare_sides(
    result: "Record", golden: "Record", wanted: "Callable[[str], bool]", tolerances: Tolerances
) -> Iterator[ComparedChannel]:
    """Compare the channels immediately before and after the events, if both results have them.

    An event may be shifted by the tolerance of time. The change of the channel in this time, at its
    rate between the event and the next sample, is therefore allowed as well.
    """
    for name in sorted(golden.channels.keys() & result.channels.keys()):
        sides = [f"{name}_{side}" for side in ("before", "after")]
        if not (wanted(name) and all(s in r.events for s in sides for r in (result, golden))):
            continue
        worst = ComparedChannel(f"events/{name}", 0.0, tolerances.atol, None, True)
        for side, step in zip(sides, (-1, 1), strict=True):
            expected = golden.events[side]
            difference = _difference(result.events[side], expected)
            rate = _event_rate(golden, name, expected, step)
            allowed = tolerances.allowed(expected) + rate * tolerances.time
            for value, limit, at in zip(difference, allowed, golden.events["time"], strict=True):
                row = ComparedChannel(
                    worst.name, float(value), float(limit), float(at), bool(value <= limit)
                )
                worst = max(worst, row, key=_tolerance_ratio)
        yield worst


def _event_rate(golden: "Record", name: str, values: Any, step: int) -> Any:
    """Return the rate of a channel between the events and the samples before or after them."""
    time, at = golden.channels["time"], golden.events["time"]
    if step < 0:
        places = np.searchsorted(time, at, side="left") - 1
    else:
        places = np.searchsorted(time, at, side="right")
    places = np.clip(places, 0, time.size - 1)
    rates = np.abs((golden.channels[name][places] - values) / (time[places] - at))
    return np.where(np.isfinite(rates), rates, 0.0)
