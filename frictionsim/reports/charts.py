"""The charts of a report of runs: channels over time in panels that share the time, by Plotly.

Above the panels is a strip with the events; sticking phases are shaded, events lines through all
panels. Of a long channel fewer samples are drawn, so that the line looks as one through all: of
equal parts the lowest, the highest and the first gap.
"""

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.display import COLOURS, event_colour, labelled
from frictionsim.errors import InputError
from frictionsim.mechanisms.belt_drive.slip import span_tensions
from frictionsim.reports.html import chart_text
from frictionsim.scenario.kinds import mechanism_module
from frictionsim.scenario.toml_data import scenario_value
from frictionsim.simulation.record import (
    event_labels,
    insert_jumps,
    sticking_phases,
    sticking_words,
)

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.results import Record

    Array = npt.NDArray[np.float64]

MAX_SAMPLES = 4000  # of a line: more than a screen has pixels side by side
MAX_LINES = 8  # in a panel, of one result: there are no more colours
MAX_FIRST = 6  # panels that are seen at first, of a kind that does not name any
MAX_MARKS = 60  # events; marks of more would hide the lines
MAX_SPAN_SAMPLES = 2001  # of the tensions of spans, evenly spread over the run
ROUNDOFF = 1e-12  # of the largest number of a unit in a result: what is smaller is 0
ENERGY = "energy_"  # what the channels begin with that are drawn together
PANEL, GAP, STRIP = 128, 30, 22  # pixels: height of a panel, between panels, of the events
MARGIN = {"l": 66, "r": 12, "t": 8, "b": 40}
DASHES = ("solid", "dash", "dot", "dashdot", "longdash", "longdashdot", "5px 2px", "1px 3px")


def thinned(values: "Array", limit: int = MAX_SAMPLES) -> Any:
    """Return the numbers of the samples of a channel to keep, ascending: all, if not too many."""
    count = len(values)
    if count <= limit:
        return np.arange(count)
    width = -(-count // ((limit - 2) // 3))
    parts = np.pad(values, (0, -count % width), mode="edge").reshape(-1, width)
    gaps = np.isnan(parts)
    places = (
        np.where(gaps, np.inf, parts).argmin(axis=1),
        np.where(gaps, -np.inf, parts).argmax(axis=1),
        gaps.argmax(axis=1),
    )
    first = width * np.arange(len(parts))
    return np.unique(
        np.minimum(np.concatenate([[0, count], *(first + p for p in places)]), count - 1)
    )


class Line(NamedTuple):
    """A line of a panel.

    Attributes
    ----------
    run : int
        Number of the result in the report.
    number : int
        Of the line among those of its result in this panel.
    label : str
        The member of the channel's axis, or the energy; empty for the only line.
    time, values : (n,)
    steps : bool
        The value is that of the sample before, as of a count.
    """

    run: int
    number: int
    label: str
    time: "Array"
    values: "Array"
    steps: bool = False


class Panel(NamedTuple):
    """Lines of one quantity over time.

    Attributes
    ----------
    name : str
        Of the channel or of the group of channels.
    title : str
        What it is, and its unit.
    first : bool
        It is seen at first.
    lines : list of Line
    """

    name: str
    title: str
    first: bool
    lines: list[Line]


def panels_of(records: Sequence["Record"]) -> list[Panel]:
    """Return the panels of runs of one kind, those that are seen at first before the others."""
    kind = records[0].attributes["kind"]
    panels: dict[tuple[str, str], Panel] = {}
    for run, record in enumerate(records):
        if not len(record.channels["time"]):
            continue
        for name, channels in _groups(record).items():
            words = record.long_names[channels[0]].partition(",")[0]
            words = "energies" if len(channels) > 1 else words
            title = labelled(words, record.units[channels[0]])
            panel = panels.setdefault((name, title), Panel(name, title, False, []))
            panel.lines.extend(_lines(record, run, channels))
        if kind == "belt_drive":
            title = "mean tension of each span, N"
            spans = list(_spans(record, run))
            if spans:
                panel = panels.setdefault(
                    ("span_tension", title), Panel("span_tension", title, True, [])
                )
                panel.lines.extend(spans)
    names = [name for name, _ in panels]
    wanted = [n for n in getattr(mechanism_module(kind), "PANELS", ()) if n in names]
    wanted = wanted or names[:MAX_FIRST]
    drawn = [p._replace(first=p.first or p.name in wanted) for p in panels.values()]
    order = list(dict.fromkeys([*wanted, "span_tension", *names]))
    return sorted(drawn, key=lambda p: (not p.first, order.index(p.name)))


def undrawn(record: "Record") -> list[str]:
    """Return the channels of a run that have too many columns for a panel over time."""
    return [name for name in record.axes if name != "time" and not _is_drawn(record, name)]


def _is_drawn(record: "Record", name: str) -> bool:
    axis = record.axes[name]
    return not axis or len(record.members[axis]) <= MAX_LINES


def _groups(record: "Record") -> dict[str, list[str]]:
    """Return the channels of each panel; those of energies are together."""
    groups: dict[str, list[str]] = {}
    for name in record.axes:
        if name not in ("time", "mode") and _is_drawn(record, name):
            together = name.startswith(ENERGY) and not record.axes[name]
            groups.setdefault("energy" if together else name, []).append(name)
    return groups


def _lines(record: "Record", run: int, channels: list[str]) -> Iterator[Line]:
    time = np.asarray(record.channels["time"], dtype=float)
    for i, name in enumerate(channels):
        axis, stored = record.axes[name], record.channels[name]
        steps = np.dtype(stored.dtype).kind in "iu"
        values = np.asarray(stored[:], dtype=float)
        if axis:
            for j, label in enumerate(record.members[axis]):
                kept = thinned(values[:, j])
                yield Line(run, j, label, time[kept], values[kept, j], steps)
            continue
        # It is thinned before jumps are inserted, which takes several times its memory.
        kept = thinned(values)
        x, y = insert_jumps(record, name, time[kept], values[kept])
        label = name.removeprefix(ENERGY) if len(channels) > 1 else ""
        yield Line(run, i, label, x, _without_roundoff(record, name, y), steps)


def _without_roundoff(record: "Record", name: str, values: "Array") -> "Array":
    """Return values with 0 for what is roundoff beside the other channels of their unit."""
    unit = record.units[name]
    peers = [n for n, u in record.units.items() if u == unit and not record.axes.get(n)]
    sizes = [np.abs(np.asarray(record.channels[n], dtype=float)) for n in peers]
    largest = max((float(np.nanmax(s, initial=0.0)) for s in sizes), default=0.0)
    return np.where(np.abs(values) < ROUNDOFF * largest, 0.0, values)


def _spans(record: "Record", run: int) -> Iterator[Line]:
    """Yield the mean tension of each span; nothing if the channels are not there."""
    if not {"tension", "pulley_index"} <= record.channels.keys():
        return
    try:
        names = [str(each["name"]) for each in scenario_value(record, "mechanism", "pulleys")]
    except (InputError, KeyError, TypeError):  # of another program, or edited
        return
    time = np.asarray(record.channels["time"], dtype=float)
    some = np.unique(np.linspace(0, len(time) - 1, min(len(time), MAX_SPAN_SAMPLES)).astype(int))
    tension, touched = (record.channels[name][some] for name in ("tension", "pulley_index"))
    if np.max(touched, initial=-1) >= len(names):
        return
    spans = span_tensions(tension, touched, len(names))
    for i, values in enumerate(spans.T):
        yield Line(run, i, f"{names[i]} to {names[(i + 1) % len(names)]}", time[some], values)


def figure_of(panels: Sequence[Panel], records: Sequence["Record"], labels: Sequence[str]) -> Any:
    """Return a figure of Plotly: the events above, then a panel below the other.

    Of several results each has a colour and each of its lines a dash; of one each line its colour.
    """
    from plotly.graph_objects import Figure, Scatter
    from plotly.subplots import make_subplots

    marked = [record for record in records if 0 < len(record.events["time"]) <= MAX_MARKS]
    strip = STRIP if marked else 1
    height = strip + len(panels) * (PANEL + GAP)
    figure: Figure = make_subplots(
        rows=1 + len(panels),
        shared_xaxes=True,
        row_heights=[strip, *[PANEL] * len(panels)],
        vertical_spacing=GAP / height,
        subplot_titles=["", *(chart_text(panel.title) for panel in panels)],
    )
    figure.update_annotations(x=0.0, xanchor="left", font_size=13)
    several, named = len(labels) > 1, set[str]()
    for row, panel in enumerate(panels, start=2):
        for line in panel.lines:
            label = " ".join(filter(None, (labels[line.run], line.label)))
            style = (line.run, line.number) if several else (line.number, 0)
            figure.add_trace(
                Scatter(
                    x=line.time,
                    y=line.values,
                    mode="lines",
                    name=chart_text(label),
                    legendgroup=label,
                    showlegend=bool(label) and label not in named,
                    line={
                        "color": COLOURS[style[0] % len(COLOURS)],
                        "dash": DASHES[style[1] % len(DASHES)],
                        "width": 1.6,
                        "simplify": False,
                        "shape": "hv" if line.steps else "linear",
                    },
                ),
                row=row,
                col=1,
            )
            named.add(label)
    _mark_events(figure, marked)
    if len(records) == 1:
        _shade(figure, records[0])
    times = [r.channels["time"] for r in records if len(r.channels["time"])]
    ends = [float(time[i]) for time in times for i in (0, -1)]
    _lay_out(figure, 1 + len(panels), height, ends)
    start = min(ends, default=0.0)  # where the clock begins; the script moves this last shape
    look = {"color": "#777777", "width": 1.5}
    cursor = {"x0": start, "x1": start, "y0": 0, "y1": 1, "xref": "x", "yref": "paper"}
    figure.add_shape(type="line", name="cursor", line=look, **cursor)
    return figure


def _mark_events(figure: Any, records: Sequence["Record"]) -> None:
    """Mark events in the strip, and by lines through all panels; one colour for each."""
    from plotly.graph_objects import Scatter

    times: dict[str, list[float]] = {}
    for record in records:
        for words, at in zip(event_labels(record), record.events["time"], strict=True):
            times.setdefault(words, []).append(float(at))
    for words, at in times.items():
        marker = {"color": event_colour(words), "size": 9, "symbol": "triangle-down"}
        name = chart_text(words)
        trace = Scatter(x=at, y=[0.0] * len(at), mode="markers", name=name, marker=marker)
        figure.add_trace(trace, row=1, col=1)
        for time in at:
            look = {"color": event_colour(words), "width": 1.0, "dash": "4px 3px"}
            figure.add_shape(
                type="line", x0=time, x1=time, y0=0, y1=1, xref="x", yref="paper", line=look
            )


def _shade(figure: Any, record: "Record") -> None:
    """Shade the sticking phases of a run, and say so in the legend."""
    from plotly.graph_objects import Scatter

    phases = list(sticking_phases(record))
    for start, stop in phases:
        area = {"x0": start, "x1": stop, "y0": 0, "y1": 1, "xref": "x", "yref": "paper"}
        look = {"line_width": 0, "fillcolor": SHADE, "layer": "below"}
        figure.add_shape(type="rect", **area, **look)
    if phases:
        marker = {"color": SHADE, "size": 12, "symbol": "square"}
        words = f"shaded: {sticking_words(record)}"
        trace = Scatter(x=[None], y=[None], mode="markers", name=words, marker=marker)
        figure.add_trace(trace, row=1, col=1)


SHADE = "rgba(128,128,128,0.22)"
GRID, AXIS = "#e4e4e4", "#9a9a9a"


def _lay_out(figure: Any, rows: int, height: int, ends: list[float]) -> None:
    start, stop = min(ends, default=0.0), max(ends, default=1.0)
    clear = "rgba(0,0,0,0)"
    axis = {"gridcolor": GRID, "linecolor": AXIS, "showgrid": True}
    figure.update_layout(
        template={
            "layout": {
                "xaxis": axis
                | {"range": [start, stop], "minallowed": start, "maxallowed": stop}
                | {"zeroline": False, "showline": True, "hoverformat": ".6g"},
                "yaxis": axis
                | {"zerolinecolor": AXIS, "showline": True, "nticks": 5, "hoverformat": ".5g"}
                | {"exponentformat": "power", "minexponent": 6},
            }
        },
        height=height + MARGIN["t"] + MARGIN["b"],
        margin=MARGIN,
        paper_bgcolor=clear,
        plot_bgcolor=clear,
        font={"family": "system-ui, sans-serif", "size": 12},
        legend={
            "orientation": "h",
            "y": 1.0,
            "yanchor": "bottom",
            "x": 0.0,
            "traceorder": "normal",
        },
        hovermode="x",
        xaxis={"range": [start, stop], "showgrid": False, "showline": False},
        yaxis={"visible": False, "fixedrange": True, "range": [-1.0, 1.0]},
    )
    last = f"xaxis{rows}"
    figure.update_layout({last: {"title": {"text": "time, s", "standoff": 6}}})
