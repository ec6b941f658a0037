"""Charts over time: which channels are drawn together, and the samples of their lines."""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.reports.thinning import thinned
from frictionsim.scenario.kinds import mechanism_module
from frictionsim.simulation.jumps import insert_jumps

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.reports.reported_run import ReportedRun
    from frictionsim.results import Record

    Array = npt.NDArray[np.float64]

MAX_SAMPLES = 4000  # of a line: more than a screen has pixels side by side
MAX_LINES = 8  # in a chart, of one result: there are no more colours
MAX_FIRST = 6  # charts that are open at first, of a kind that does not name any
ENERGY = "energy_"  # what the channels begin with that are drawn together


class Line(NamedTuple):
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
    lines : tuple of Line
    """

    name: str
    words: str
    unit: str
    first: bool
    lines: tuple[Line, ...]


class _Source(NamedTuple):
    """Where the lines of a chart come from: channels of the same unit."""

    name: str
    words: str
    channels: tuple[str, ...]


def charts_of(runs: "Sequence[ReportedRun]", more: Sequence[Chart] = ()) -> list[Chart]:
    """Return the charts of runs of one kind, those that are open at first before the others.

    Channels are read one after the other: of a long run only the lines are in memory.

    Parameters
    ----------
    runs : sequence of ReportedRun
    more : sequence of Chart
        Further ones of the kind, which are open at first.
    """
    sources: dict[tuple[str, str], list[tuple[int, _Source]]] = {}
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
            found[0][1].words,
            unit,
            name in names,
            tuple(line for number, source in found for line in _lines(runs, number, source)),
        )
        for (name, unit), found in sources.items()
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


def _sources(run: "ReportedRun") -> Iterator[_Source]:
    record = run.record
    drawn = [n for n in record.axes if n not in ("time", "mode") and _is_drawn(run, n)]
    energies = [n for n in drawn if n.startswith(ENERGY) and not record.axes[n]]
    for name in drawn:
        if name not in energies:
            yield _Source(name, record.long_names[name], (name,))
    if energies and len({record.units[name] for name in energies}) == 1:
        yield _Source("energy", "energies", tuple(energies))
    else:
        yield from (_Source(name, record.long_names[name], (name,)) for name in energies)


def _lines(runs: "Sequence[ReportedRun]", number: int, source: _Source) -> Iterator[Line]:
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
) -> Line:
    """Return the line of a channel without columns, with both sides of its jumps.

    It is thinned before they are inserted, which takes several times the memory of the samples.
    """
    values = np.asarray(record.channels[name], dtype=float)
    kept = thinned(values, MAX_SAMPLES)
    whole = len(kept) == len(values)
    samples = insert_jumps(record, name, record.channels["time"][kept], values[kept])
    found = line(name, label, place, samples, steps)
    return found._replace(whole=whole and found.whole)


def line(
    channel: str,
    label: str,
    place: tuple[int, int],
    samples: "tuple[Array, Array]",
    steps: bool = False,
) -> Line:
    """Return a line with at most MAX_SAMPLES.

    Parameters
    ----------
    channel, label : str
    place : tuple of int
        The numbers of its result and of its column.
    samples : tuple of (n,) and (n,)
        Time and values.
    steps : bool
    """
    time, values = (np.asarray(array, dtype=float) for array in samples)
    kept = thinned(values, MAX_SAMPLES)
    return Line(channel, label, *place, time[kept], values[kept], len(kept) == len(values), steps)


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
