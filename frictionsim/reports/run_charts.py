"""The charts of a report of runs: channels over time, as few samples as a screen shows.

Of a long channel fewer samples are drawn, so that the line looks as one through all. They are cut
into equal parts, and of each part the lowest and the highest is kept: peaks stay, however short.
Of samples that are not finite, which are gaps in the line, enough are kept that no line is drawn
across a gap.
"""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.errors import InputError
from frictionsim.mechanisms.belt_drive.slip import span_tensions
from frictionsim.scenario.kinds import mechanism_module
from frictionsim.scenario.toml_data import scenario_value
from frictionsim.simulation.record import insert_jumps

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.reports.run_tables import ReportedRun
    from frictionsim.results import Record

    Array = npt.NDArray[np.float64]
    IndexArray = npt.NDArray[np.intp]


ENDS = 2  # the first sample and the last
PART, PART_WITH_GAPS = 2, 5  # lowest, highest; and three gaps: before, between, after
MIN_LIMIT = ENDS + PART_WITH_GAPS


def thinned(values: "Array", limit: int) -> "IndexArray":
    """Return the numbers of the samples of a channel to keep, ascending.

    Parameters
    ----------
    values : (n,)
    limit : int
        Largest number of samples to keep, at least MIN_LIMIT.

    Returns
    -------
    (m,) of int
        All of them if n is not above the limit.
    """
    if limit < MIN_LIMIT:
        raise ValueError(f"a line needs at least {MIN_LIMIT} samples, not {limit}")
    count = len(values)
    if count <= limit:
        return np.arange(count)
    gaps = ~np.isfinite(values)
    with_gaps = bool(gaps.any())
    parts = (limit - ENDS) // (PART_WITH_GAPS if with_gaps else PART)
    width = -(-count // parts)
    whole = count // width * width
    kept = [np.array([0, count - 1])]
    for start, stop in ((0, whole), (whole, count)):
        if stop > start:
            rows = slice(start, stop), (-1, min(width, stop - start))
            chosen = _kept(
                values[rows[0]].reshape(rows[1]),
                gaps[rows[0]].reshape(rows[1]) if with_gaps else None,
            )
            kept.append(chosen + start)
    return np.unique(np.concatenate(kept))


def _kept(values: "Array", gaps: Any) -> "IndexArray":
    """Return the places that are kept in parts (parts, width), counted through all of them."""
    if gaps is None:
        places = [values.argmin(axis=1), values.argmax(axis=1)]
    else:
        low = np.where(gaps, np.inf, values).argmin(axis=1)
        high = np.where(gaps, -np.inf, values).argmax(axis=1)
        places = [low, high, *_kept_gaps(gaps, np.minimum(low, high))]
    first = np.arange(len(values)) * values.shape[1]
    return np.concatenate([place + first for place in places])


def _kept_gaps(gaps: Any, extreme: "IndexArray") -> list["IndexArray"]:
    """Return the first and last gap of each part, and the first one after the first extreme.

    A part without gaps has any of its samples instead.
    """
    after = gaps & (np.arange(gaps.shape[1]) > extreme[:, np.newaxis])
    last = gaps.shape[1] - 1 - gaps[:, ::-1].argmax(axis=1)
    # Where there is none, argmax is 0, or 0 from the end: that sample would be one too many.
    places = [gaps.argmax(axis=1), after.argmax(axis=1), last]
    present = [gaps.any(axis=1), after.any(axis=1), gaps.any(axis=1)]
    return [np.where(has, place, extreme) for place, has in zip(places, present, strict=True)]


MAX_CHART_SAMPLES = 4000  # of a line: more than a screen has pixels side by side
MAX_LINES = 8  # in a chart, of one result: there are no more colours
MAX_FIRST = 6  # charts that are open at first, of a kind that does not name any
ENERGY = "energy_"  # what the channels begin with that are drawn together


class ChartLine(NamedTuple):
    """A line of a chart.

    Attributes
    ----------
    channel : str
    label : str
        For the key: the member of the channel's axis, or the energy.
    result : int
        Number of the result in the report.
    column : int
        Number of the line among those of its result.
    time, values : (n,)
        In s, and the unit of the chart; NaN is a gap.
    whole : bool
        All samples of the file are here, none was left out.
    steps : bool
        The value is that of the sample before, as of a count.
    """

    channel: str
    label: str
    result: int
    column: int
    time: "Array"
    values: "Array"
    whole: bool
    steps: bool


class Chart(NamedTuple):
    """Lines of one quantity over time.

    Attributes
    ----------
    name : str
        Of the channel or of the group of channels.
    words : str
        What it is.
    unit : str
    first : bool
        It is open at first.
    lines : tuple of ChartLine
    """

    name: str
    words: str
    unit: str
    first: bool
    lines: tuple[ChartLine, ...]


class _LineSource(NamedTuple):
    """Where the lines of a chart come from: channels of the same unit."""

    name: str
    words: str
    channels: tuple[str, ...]


def charts_of(runs: "Sequence[ReportedRun]", more: Sequence[Chart] = ()) -> list[Chart]:
    """Return the charts of runs of one kind, those that are open at first before the others.

    Channels are read one after the other: of a long run only the lines are in memory.

    Parameters
    ----------
    more : sequence of Chart
        Further ones of the kind, which are open at first.
    """
    sources: dict[tuple[str, str], list[tuple[int, _LineSource]]] = {}
    for number, run in enumerate(runs):
        if not len(run.record.channels["time"]):
            continue
        for source in _sources(run):
            key = source.name, run.record.units[source.channels[0]]
            sources.setdefault(key, []).append((number, source))
    names = _panels(runs, [name for name, _ in sources])
    charts = [
        Chart(
            name,
            parts[0][1].words,
            unit,
            name in names,
            tuple(line for number, source in parts for line in _chart_lines(runs, number, source)),
        )
        for (name, unit), parts in sources.items()
    ]
    first = sorted((chart for chart in charts if chart.first), key=lambda c: names.index(c.name))
    return [*first, *more, *(chart for chart in charts if not chart.first)]


def _panels(runs: "Sequence[ReportedRun]", names: list[str]) -> list[str]:
    """Return the names of the charts that are open at first."""
    wanted = getattr(mechanism_module(runs[0].attribute("kind")), "PANELS", ())
    return [name for name in wanted if name in names] or names[:MAX_FIRST]


def undrawn(run: "ReportedRun") -> list[str]:
    """Return the channels of a run that have too many columns for a chart over time."""
    return [name for name in run.record.axes if name != "time" and not _is_drawn(run, name)]


def _is_drawn(run: "ReportedRun", name: str) -> bool:
    axis = run.record.axes[name]
    return not axis or len(run.record.members[axis]) <= MAX_LINES


def _sources(run: "ReportedRun") -> Iterator[_LineSource]:
    record = run.record
    drawn = [n for n in record.axes if n not in ("time", "mode") and _is_drawn(run, n)]
    energies = [n for n in drawn if n.startswith(ENERGY) and not record.axes[n]]
    for name in drawn:
        if name not in energies:
            yield _LineSource(name, record.long_names[name], (name,))
    if energies and len({record.units[name] for name in energies}) == 1:
        yield _LineSource("energy", "energies", tuple(energies))
    else:
        yield from (_LineSource(name, record.long_names[name], (name,)) for name in energies)


def _chart_lines(
    runs: "Sequence[ReportedRun]", number: int, source: _LineSource
) -> Iterator[ChartLine]:
    record, column = runs[number].record, 0
    for name in source.channels:
        axis = record.axes[name]
        steps = np.dtype(record.channels[name].dtype).kind in "iu"
        if axis:
            time, columns = record.channels["time"], record.channels[name][:].T
            for label, values in zip(record.members[axis], columns, strict=True):
                yield line(name, label, (number, column), (time, values), steps)
                column += 1
        else:
            words = name.removeprefix(ENERGY) if len(source.channels) > 1 else ""
            yield _line_with_jumps(record, name, words, (number, column), steps)
            column += 1


def _line_with_jumps(
    record: "Record", name: str, label: str, place: tuple[int, int], steps: bool
) -> ChartLine:
    """Return the line of a channel without columns, with both sides of its jumps.

    It is thinned before they are inserted, which takes several times the memory of the samples.
    """
    values = np.asarray(record.channels[name], dtype=float)
    kept = thinned(values, MAX_CHART_SAMPLES)
    whole = len(kept) == len(values)
    samples = insert_jumps(record, name, record.channels["time"][kept], values[kept])
    thin = line(name, label, place, samples, steps)
    return thin._replace(whole=whole and thin.whole)


def line(
    channel: str,
    label: str,
    place: tuple[int, int],
    samples: "tuple[Array, Array]",
    steps: bool = False,
) -> ChartLine:
    """Return a line with at most MAX_CHART_SAMPLES.

    Parameters
    ----------
    place : tuple of int
        The numbers of its result and of its column.
    samples : tuple of (n,) and (n,)
        Time and values.
    """
    time, values = (np.asarray(array, dtype=float) for array in samples)
    kept = thinned(values, MAX_CHART_SAMPLES)
    return ChartLine(
        channel, label, *place, time[kept], values[kept], len(kept) == len(values), steps
    )


def chart_data(charts: Sequence[Chart], times: "TimePool") -> list[dict[str, Any]]:
    """Return charts for the scripts of a page."""
    return [
        {
            **chart._asdict(),
            "lines": [{**line._asdict(), "time": times.number(line.time)} for line in chart.lines],
        }
        for chart in charts
    ]


class TimePool:
    """The times of all lines of a page, each array once."""

    def __init__(self) -> None:
        self.arrays: list[Array] = []
        self._numbers: dict[bytes, int] = {}

    def number(self, time: "Array") -> int:
        """Return the number of an array of times in `arrays`, which holds it from now on."""
        key = np.asarray(time, dtype=float).tobytes()
        if key not in self._numbers:
            self._numbers[key] = len(self.arrays)
            self.arrays.append(time)
        return self._numbers[key]


NEEDED = ("tension", "pulley_index")
MAX_SAMPLES = 2001  # evenly spread over the run


def span_charts(runs: "Sequence[ReportedRun]") -> list[Chart]:
    """Return a chart of the mean tension of each span; none if the channels are not there."""
    lines = tuple(span for number, run in enumerate(runs) for span in _lines(run, number))
    if not lines:
        return []
    words = "mean tension of each span, between pulleys in the order of the scenario"
    return [Chart("span_tension", words, "N", True, lines)]


def _lines(run: "ReportedRun", number: int) -> list[ChartLine]:
    record = run.record
    if any(name not in record.channels for name in NEEDED) or not record.channels["time"].size:
        return []
    try:
        pulleys = scenario_value(record, "mechanism", "pulleys")
        names = [str(pulley["name"]) for pulley in pulleys]
    except (InputError, KeyError, TypeError):  # of another program, or edited
        return []
    time = record.channels["time"]
    samples = np.unique(np.linspace(0, len(time) - 1, min(len(time), MAX_SAMPLES)).astype(int))
    tension, touched = (record.channels[name][samples] for name in NEEDED)
    if np.max(touched, initial=-1) >= len(names):
        return []
    spans = span_tensions(tension, touched, len(names))
    return [
        line(
            "tension",
            f"{names[i]} to {names[(i + 1) % len(names)]}",
            (number, i),
            (time[samples], values),
        )
        for i, values in enumerate(spans.T)
    ]
