"""The charts of reports for Plotly: channels over time that share it, and other panels.

A figure is the JSON that Plotly draws, made here. Above the channels of runs is a strip with the
events; sticking phases are shaded, events lines through all panels. Of a long channel fewer samples
are drawn, so that the line looks as one through all: of equal parts the lowest, the highest and the
first gap.
"""

from base64 import b64encode
from collections.abc import Iterator, Sequence
from contextlib import suppress
from math import log10
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.display import COLOURS, GREY, MAX_MARKS, event_colour, event_dashes, labelled
from frictionsim.errors import InputError
from frictionsim.mechanisms.belt_drive.slip import span_tensions
from frictionsim.motion.samples import scenario_in
from frictionsim.reports.html import chart_text
from frictionsim.scenario.kinds import mechanism_module
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

Json = dict[str, Any]
MAX_SAMPLES = 4000  # of a line: more than a screen has pixels side by side
MAX_LINES = len(COLOURS)  # in a panel, of one result: there are no more colours
MAX_FIRST = 6  # panels that are seen at first, of a kind that does not name any
MAX_SPAN_SAMPLES = 2001  # of the tensions of spans, evenly spread over the run
ROUNDOFF = 1e-12  # of the largest number of a unit in a result: what is smaller is 0
ENERGY = "energy_"  # what the channels begin with that are drawn together
PANEL, GAP, STRIP = 128, 30, 22  # pixels: height of a panel, between panels, of the events
MARGIN = {"l": 66, "r": 12, "t": 8, "b": 40}
SHADE, CURSOR = "rgba(128,128,128,0.22)", "#777777"
GRID, AXIS = "#e4e4e4", "#9a9a9a"
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
    """A line of a panel."""

    run: int  # number of the result in the report
    number: int  # of the line among those of its result in this panel
    label: str  # the member of the channel's axis, or the energy; empty for the only line
    time: "Array"  # (n,)
    values: "Array"
    steps: bool = False  # the value is that of the sample before, as of a count


class Panel(NamedTuple):
    """Lines of one quantity over time."""

    name: str  # of the channel or of the group of channels
    title: str  # what it is, and its unit
    first: bool  # it is seen at first
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
    wanted = [n for n in mechanism_module(kind).PANELS if n in names]
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
        names = scenario_in(record).mechanism.names
    except InputError:  # of another program, or edited
        return
    time = np.asarray(record.channels["time"], dtype=float)
    some = np.unique(np.linspace(0, len(time) - 1, min(len(time), MAX_SPAN_SAMPLES)).astype(int))
    tension, touched = (record.channels[name][some] for name in ("tension", "pulley_index"))
    if np.max(touched, initial=-1) >= len(names):
        return
    spans = span_tensions(tension, touched, len(names))
    for i, values in enumerate(spans.T):
        yield Line(run, i, f"{names[i]} to {names[(i + 1) % len(names)]}", time[some], values)


def numbers(values: Any, kind: str = "f4") -> Json:
    """Return numbers as Plotly reads them; those of 4 bytes have the digits that a screen shows."""
    shape = {"shape": ",".join(map(str, np.shape(values)))} if np.ndim(values) > 1 else {}
    data = b64encode(np.asarray(values, f"<{kind}").tobytes()).decode()
    return {"dtype": kind, "bdata": data} | shape


def domains(sizes: Sequence[float], gap: float) -> list[tuple[float, float]]:
    """Return start and end of parts side by side, relative to the whole."""
    ends = np.cumsum(sizes) + gap * np.arange(len(sizes))
    return [((e - s) / ends[-1], e / ends[-1]) for s, e in zip(sizes, ends.tolist(), strict=True)]


def heading(text: str, x: float, y: float, anchor: str = "left") -> Json:
    """Return a title of a panel, above a place relative to the whole figure."""
    place = {"x": x, "y": y, "xref": "paper", "yref": "paper", "xanchor": anchor}
    return place | {"yanchor": "bottom", "text": text, "showarrow": False, "font": {"size": 13}}


def figure_of(panels: Sequence[Panel], records: Sequence["Record"], labels: Sequence[str]) -> Json:
    """Return a figure: the events above, then a panel below the other, over one axis of time.

    Of several results each has a colour and each of its lines a dash; of one each line its colour.
    """
    marked = [record for record in records if 0 < len(record.events["time"]) <= MAX_MARKS]
    traces, named = list[Json](), set[str]()
    for row, panel in enumerate(panels, start=2):
        for line in panel.lines:
            label = " ".join(filter(None, (labels[line.run], line.label)))
            colour, dash = (line.run, line.number) if len(labels) > 1 else (line.number, 0)
            look: Json = {
                "color": COLOURS[colour % len(COLOURS)],
                "dash": DASHES[dash % len(DASHES)],
            }
            look |= {"width": 1.6, "simplify": False, "shape": "hv" if line.steps else "linear"}
            trace = {"type": "scatter", "mode": "lines", "yaxis": f"y{row}", "line": look}
            trace |= {"x": numbers(line.time, "f8"), "y": numbers(line.values)}
            trace |= {"name": chart_text(label), "legendgroup": label}
            traces.append(trace | {"showlegend": bool(label) and label not in named})
            named.add(label)
    shapes = _mark_events(traces, marked)
    if len(records) == 1:
        shapes += _shade(traces, records[0])
    heights = [STRIP if marked else 1, *[PANEL] * len(panels)]
    times = [r.channels["time"] for r in records if len(r.channels["time"])]
    ends = [float(time[i]) for time in times for i in (0, -1)]
    layout = _layout(heights, [panel.title for panel in panels], ends)
    start = layout["xaxis"]["range"][0]  # where the clock begins; the script moves this last shape
    cursor = _upright(start, {"color": CURSOR, "width": 1.5}) | {"name": "cursor"}
    return {"data": traces, "layout": layout | {"shapes": [*shapes, cursor]}}


def _upright(time: float, look: Json) -> Json:
    """Return a line through all panels."""
    place = {"x0": time, "x1": time, "y0": 0, "y1": 1, "xref": "x", "yref": "paper"}
    return place | {"type": "line", "line": look}


def _mark_events(traces: list[Json], records: Sequence["Record"]) -> list[Json]:
    """Mark events in the strip; return their lines through all panels."""
    times: dict[str, list[float]] = {}
    for record in records:
        for words, at in zip(event_labels(record), record.events["time"], strict=True):
            times.setdefault(words, []).append(float(at))
    lines = []
    for words, at in times.items():
        colour = event_colour(words)
        marker = {"color": colour, "size": 9, "symbol": "triangle-down"}
        trace = {"type": "scatter", "mode": "markers", "marker": marker, "name": chart_text(words)}
        traces.append(trace | {"x": at, "y": [0.0] * len(at)})
        dashes = " ".join(f"{dash:g}px" for dash in event_dashes(words))
        lines += [_upright(time, {"color": colour, "width": 1.2, "dash": dashes}) for time in at]
    return lines


def _shade(traces: list[Json], record: "Record") -> list[Json]:
    """Return shades of the sticking phases of a run, which the legend names."""
    areas = []
    for start, stop in sticking_phases(record):
        area = {"x0": start, "x1": stop, "y0": 0, "y1": 1, "xref": "x", "yref": "paper"}
        look = {"line": {"width": 0}, "fillcolor": SHADE, "layer": "below"}
        areas.append(area | look | {"type": "rect"})
    if areas:
        marker = {"color": SHADE, "size": 12, "symbol": "square"}
        words = f"shaded: {sticking_words(record)}"
        trace = {"type": "scatter", "mode": "markers", "marker": marker, "name": words}
        traces.append(trace | {"x": [None], "y": [None]})
    return areas


LOOK: Json = {
    "paper_bgcolor": "rgba(0,0,0,0)",
    "plot_bgcolor": "rgba(0,0,0,0)",
    "separators": ".",  # none of thousands
    "font": {"family": "system-ui, sans-serif", "size": 12},
    "modebar": {"color": AXIS, "activecolor": CURSOR},
}


def _layout(heights: Sequence[int], titles: Sequence[str], ends: list[float]) -> Json:
    start, stop = min(ends, default=0.0), max(ends, default=1.0)
    axis = {"gridcolor": GRID, "linecolor": AXIS, "showline": True}
    time = {"range": [start, stop], "minallowed": start, "maxallowed": stop, "zeroline": False}
    values = {"zerolinecolor": AXIS, "nticks": 5, "exponentformat": "power", "minexponent": 6}
    template = {
        "xaxis": axis | time | {"hoverformat": ".6g", "mirror": "all"},
        "yaxis": axis | values | {"hoverformat": ".5g"},
    }
    down = [(1.0 - end, 1.0 - begin) for begin, end in domains(heights, GAP)]
    axes: Json = {f"yaxis{row}": {"domain": of} for row, of in enumerate(down, start=1)}
    axes["yaxis"] = axes.pop("yaxis1") | {"visible": False, "fixedrange": True, "range": [-1, 1]}
    label = {"title": {"text": "time, s", "standoff": 6}, "anchor": f"y{len(heights)}"}
    where = zip(titles, down[1:], strict=True)
    height = sum(heights) + GAP * len(titles) + MARGIN["t"] + MARGIN["b"]
    legend = {"orientation": "h", "x": 0.0, "y": 1.0, "yanchor": "bottom", "traceorder": "normal"}
    return axes | {
        **LOOK,
        "template": {"layout": template},
        "xaxis": {"range": [start, stop], **label},
        "height": height,
        "margin": MARGIN,
        "legend": legend,
        "hovermode": "x",
        "annotations": [heading(chart_text(title), 0.0, top) for title, (_, top) in where],
    }


# Charts of panels side by side, each with its own axes.

BETWEEN = 70  # pixels between panels
ABOVE, BELOW, TITLE = 60, 50, 24  # of the legend, of the lowest axis, of the title of a panel
WIDE = 0.08  # between panels side by side, relative to one


class Chart:
    """A figure of panels in rows and columns, numbered from 1 along the rows."""

    def __init__(self, rows: int, columns: int, panel: int = 250, wide: float = WIDE) -> None:
        across = domains([1.0] * columns, wide)
        down = [(1.0 - b, 1.0 - a) for a, b in domains([panel] * rows, BETWEEN)]
        self._places = [(x, y) for y in down for x in across]
        self._columns = columns
        axis = {"gridcolor": GRID, "zeroline": False}
        inner = rows * (panel + BETWEEN) - BETWEEN
        self.traces: list[Json] = []
        self.layout: Json = LOOK | {
            "template": {"layout": {"xaxis": axis, "yaxis": axis}},
            "height": inner + ABOVE + BELOW,
            "margin": {"l": 80, "r": 20, "t": ABOVE, "b": BELOW},
            "legend": {"orientation": "h", "x": 0.0, "y": 1.0 + TITLE / inner, "yanchor": "bottom"},
            "annotations": [],
            "shapes": [],
        }
        self.figure = {"data": self.traces, "layout": self.layout}

    def panel(self, number: int, x: Json, y: Json, title: str = "", shared: bool = True) -> Any:
        """Give a panel its axes, of y the first of its row if `shared`; return its place."""
        name, (across, up) = _suffix(number), self._places[number - 1]
        first = number - (number - 1) % self._columns
        if shared and first != number:
            y = y | {"matches": f"y{_suffix(first)}", "showticklabels": False, "title": {}}
        self.layout[f"xaxis{name}"] = {"domain": across, "anchor": f"y{name}", **x}
        self.layout[f"yaxis{name}"] = {"domain": up, "anchor": f"x{name}", **y}
        if title:
            middle = 0.5 * sum(across)
            self.layout["annotations"].append(heading(title, middle, up[1], "center"))
        return across, up

    def add(self, number: int, kind: str, **trace: Any) -> None:
        """Add a trace to a panel."""
        name = _suffix(number)
        self.traces.append({"type": kind, "xaxis": f"x{name}", "yaxis": f"y{name}", **trace})

    def level(self, number: int, value: float, words: str, down_to: float | None = None) -> None:
        """Mark a level of a logarithmic axis by words, and a line or an area below it."""
        place: Json = {"xref": f"x{_suffix(number)} domain", "yref": f"y{_suffix(number)}"}
        ends = {"x0": 0, "x1": 1, "y0": down_to or value, "y1": value, "layer": "below"}
        look: Json = {"type": "line", "line": {"color": GREY, "width": 1, "dash": "dot"}}
        if down_to is not None:
            look = {"type": "rect", "line": {"width": 0}, "fillcolor": SHADE}
        self.layout["shapes"].append(look | place | ends)
        text = {"text": words, "showarrow": False, "font": {"size": 11}}
        at = {"x": 1.0, "y": log10(value), "xanchor": "right", "yanchor": "bottom"}
        self.layout["annotations"].append(text | place | at)


def _suffix(number: int) -> str:
    return "" if number == 1 else str(number)


def axis_title(text: str) -> Json:
    """Return the title of an axis."""
    return {"title": {"text": text, "standoff": 6}}


def wear_figure(records: Sequence["Record"], labels: Sequence[str]) -> Json | None:
    """Return the friction work along the belt at the end of runs; None without it."""
    worn = [i for i, record in enumerate(records) if "friction_work" in record.channels]
    if not worn:
        return None
    from frictionsim.motion.belt_drive import wear_of  # of belts alone

    chart = Chart(1, 1)
    across, up = map(axis_title, ("distance along the unstretched belt, m", "friction work, J/m"))
    chart.panel(1, across, up)
    for i in worn:
        look: Json = {"mode": "lines", "name": chart_text(labels[i]), "showlegend": bool(labels[i])}
        look["line"] = {"color": COLOURS[i % len(COLOURS)], "shape": "hv", "width": 1.6}
        with suppress(InputError):  # the scenario was edited
            edges, work = wear_of(records[i])
            x, y = numbers(edges, "f8"), numbers(np.append(work, work[-1]))
            chart.add(1, "scatter", x=x, y=y, **look)
    return chart.figure
