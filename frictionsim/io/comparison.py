"""Comparison of a result file with a golden (reference) file, for continuous integration."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatch
from functools import lru_cache
from math import inf, isclose, isfinite, pi
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.errors import ArgumentError, InputError, unknown
from frictionsim.scenario.toml_data import differing_keys, toml_value

if TYPE_CHECKING:
    from collections.abc import Callable

    from frictionsim.results import Record

QUANTITIES = "quantities/"  # what the rows of quantities begin with
SHARES = {"1": 1.0, "%": 100.0}  # scales of quantities without a dimension, by unit
TURN = 2.0 * pi  # rad: scale of an angle that is not one of the motion, such as an arc
EQUAL_TIMES = 1e-9  # relative difference of times that are the same but for rounding
MAX_KEYS = 20  # differing keys of the scenarios in the notes
MAX_VALUE = 60  # characters of the value of a key


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
    _check_patterns(ignore, _names(result) | _names(golden))
    comparison = Comparison()
    ends = [float(r.time[-1]) if r.time.size else 0.0 for r in (result, golden)]
    ended_together = isclose(*ends, rel_tol=EQUAL_TIMES)
    comparison.rows += _compare_status(result, golden, [] if ended_together else ends)
    common = _common_samples(result, golden)
    _compare_times(result, golden, common, comparison, f"{result_path} and {golden_path}")
    comparison.notes += [f"note: {text}" for text in _differing_origins(result, golden)]

    def is_compared(name: str) -> bool:
        return not _is_ignored(name, ignore)

    if ended_together:
        comparison.rows += _compare_quantities(result, golden, is_compared, tolerances)
    for name in sorted((result.channels.keys() | golden.channels.keys()) - {"time"}):
        if is_compared(name):
            row = _compare_channel(name, result, golden, common, tolerances)
            comparison.rows.append(row)
    if is_compared("events"):
        events = _compare_events(result, golden, tolerances.time)
        comparison.rows.append(events)
        if events.ok:  # the sides can only be compared of equal events
            comparison.rows += _compare_sides(result, golden, is_compared, tolerances)
    comparison.rows.sort(key=_place)
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
        yield f"{key}: {_shortened(actual)}, expected {_shortened(expected)}"
    if len(differing) > MAX_KEYS:
        yield f"{len(differing) - MAX_KEYS} more keys of their scenarios differ"


def _shortened(value: Any) -> str:
    """Return a value as TOML, shortened."""
    text = "none" if value is None else toml_value(value)
    if len(text) <= MAX_VALUE:
        return text
    return f"a list of {len(value)}" if isinstance(value, list) else f"{text[:MAX_VALUE]}..."


def _names(record: "Record") -> set[str]:
    """Return the names of all rows that a result may have."""
    sides = (name.removesuffix("_before") for name in record.events if name.endswith("_before"))
    return (
        {*record.channels, "events", *(f"events/{name}" for name in sides)}
        | {QUANTITIES + name for name in record.quantities}
    ) - {"time"}


def _is_ignored(name: str, patterns: Sequence[str]) -> bool:
    """Return whether a pattern matches the name of a row, or what stands behind its slash."""
    names = name, name.rpartition("/")[2]
    return any(fnmatch(one, pattern) for one in names for pattern in patterns)


def _check_patterns(ignore: Sequence[str], names: set[str]) -> None:
    """Raise ArgumentError if a pattern matches no row, or if the patterns match all of them."""
    for pattern in ignore:
        if not any(_is_ignored(name, [pattern]) for name in names):
            known = names if "/" in pattern else {name.rpartition("/")[2] for name in names}
            raise ArgumentError("ignore", unknown("channel or quantity", pattern, sorted(known)))
    if all(_is_ignored(name, ignore) for name in names):
        raise ArgumentError("ignore", "nothing is left to compare")


def _place(row: ComparedChannel) -> tuple[bool, int, float, float]:
    """Return what rows are sorted by: see `Comparison`. What has no number is worst."""
    _, ratio, difference = _tolerance_ratio(row)
    # Status and times say why others differ.
    groups = row.name in ("status", "time"), row.name.startswith(QUANTITIES), True
    return row.ok, groups.index(True), -ratio, -difference


def _tolerance_ratio(row: ComparedChannel) -> tuple[bool, float, float]:
    """Return what is largest of the worst row: whether it differs, by how much, absolutely."""
    if row.difference is None or not isfinite(row.difference):
        return not row.ok, inf, inf
    ratio = row.difference / row.allowed if row.allowed else (inf if row.difference else 0.0)
    return not row.ok, ratio, row.difference


def _compare_status(
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


def _compare_quantities(
    result: "Record", golden: "Record", wanted: "Callable[[str], bool]", tolerances: Tolerances
) -> Iterator[ComparedChannel]:
    """Compare the quantities of two runs that ended at the same time.

    Those of a run that is not done may be missing.
    """
    largest = lru_cache(maxsize=None)(lambda name: _largest(golden.channels[name]))
    for name, either in (result.quantities | golden.quantities).items():
        actual, expected = (r.quantities.get(name) for r in (result, golden))
        row = ComparedChannel(
            QUANTITIES + name,
            value=actual.value if actual else None,
            expected=expected.value if expected else None,
            unit=either.unit,
        )
        if not wanted(row.name):
            continue
        if actual is None or expected is None:
            if result.status == golden.status == "done":
                where = "the golden file" if expected is None else "the result"
                yield row._replace(note=f"missing in {where}")
            continue
        if actual.unit != expected.unit:
            note = f"unit {actual.unit}, expected {expected.unit}"
            yield row._replace(unit="", note=note)
            continue
        allowed = tolerances.time
        if expected.unit != "s":
            allowed = float(tolerances.allowed(_scale(name, golden, largest)))
        difference = float(_difference(float(actual), float(expected)))
        yield row._replace(difference=difference, allowed=allowed, ok=difference <= allowed)


def _scale(name: str, golden: "Record", largest: "Callable[[str], float]") -> float:
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
        return max(*map(largest, alike), *filter(isfinite, energies), size, 0.0)
    named = [channel for channel in alike if f"_{channel}_" in f"_{name}_"]
    scale = max(map(largest, [max(named, key=len)] if named else alike), default=0.0)
    return max(size, min(scale, TURN) if unit == "rad" and not named else scale)


def _largest(channel: Any) -> float:
    """Return the largest finite size of the values of a channel."""
    sizes = np.abs(channel, dtype=np.float64)
    return float(np.max(sizes, initial=0.0, where=np.isfinite(sizes)))


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
    return places, np.isclose(times, others[places], rtol=EQUAL_TIMES, atol=0.0)


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
    axis, members = columns = _columns(golden, name)
    if _columns(result, name) != columns:
        note = f"{_axis(result, name)}, expected {_axis(golden, name)}"
        return ComparedChannel(name, note=note)
    time = golden.channels["time"][common.golden]
    away = np.flatnonzero(_outside_event_windows(golden.events["time"], time, tolerances.time))
    actual = result.channels[name][common.result[away]]
    expected = golden.channels[name][common.golden[away]]
    allowed = tolerances.allowed(expected)
    row, *member = _worst(name, actual, expected, time[away], allowed, golden.units[name])
    return row._replace(note=f"{axis} {members[member[0]]}" if member else "")


def _worst(
    name: str, actual: Any, expected: Any, time: Any, allowed: Any, unit: str
) -> tuple[Any, ...]:
    """Return the row of what is furthest above its tolerance, and the number of its member.

    Of equal ones it is the last.
    """
    if not len(time):
        return (ComparedChannel(name, 0.0, ok=True, unit=unit),)
    # Integers as numbers: the difference of two of a byte may be larger than a byte.
    actual, expected = (np.asarray(v, dtype=np.float64) for v in (actual, expected))
    difference = _difference(actual, expected)
    # With a tolerance of zero the ratio is infinite, or zero if there is no difference.
    ratio = np.where(difference > 0.0, difference / allowed, 0.0)
    ratio[np.isnan(ratio)] = 1.0  # both are infinite
    order = np.lexsort((difference.ravel(), ratio.ravel()))
    sample, *member = worst = np.unravel_index(order[-1], difference.shape)
    numbers = (difference[worst], allowed[worst], time[sample], actual[worst], expected[worst])
    size, limit, at, value, other = map(float, numbers)
    return ComparedChannel(name, size, limit, at, size <= limit, "", value, other, unit), *member


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
    actual, expected = result.transitions, golden.transitions
    if len(actual) != len(expected):
        note = f"{len(actual)} events, expected {len(expected)}"
        return ComparedChannel("events", note=note)
    for event, wanted_event in zip(actual, expected, strict=True):
        what, wanted_what = ([e.contact, e.mode_from, e.mode_to] for e in (event, wanted_event))
        if what != wanted_what:
            note = f"{what} at {event.time:.9g} s, expected {wanted_what}"
            return ComparedChannel("events", note=note)
    times, wanted = (r.events["time"] for r in (result, golden))
    allowed = np.full(times.shape, time_atol)
    row: ComparedChannel = _worst("events", times, wanted, wanted, allowed, "s")[0]
    return row


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
        actual, expected = (np.concatenate([r.events[s] for s in sides]) for r in (result, golden))
        steps = zip(sides, (-1, 1), strict=True)
        rates = [_event_rate(golden, name, golden.events[side], step) for side, step in steps]
        allowed = tolerances.allowed(expected) + np.concatenate(rates) * tolerances.time
        time, unit = np.tile(golden.events["time"], 2), golden.units[name]
        yield _worst(f"events/{name}", actual, expected, time, allowed, unit)[0]


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
