"""The reports of studies: of a sweep, and of a work-precision study, with their charts for Plotly.

No line of a chart joins the two sides of a jump, and a map has its cells: nothing is drawn where no
run was.
"""

from collections.abc import Iterator, Sequence
from math import isnan
from typing import Any

import numpy as np

from frictionsim.costs.study_table import recommended_lines
from frictionsim.display import COLOURS, LINE_COLOURS, MAX_DRAWN, SYMBOLS, labelled, set_line
from frictionsim.document import Block, Cell, Document, Number, Table
from frictionsim.io.cost_table import BELOW, MIN_ERROR, TARGETS, WORK, CostTable, line_of
from frictionsim.io.sweep_table import DONE, RUN, STATUSES, SweepTable
from frictionsim.reports.charts import DASHES, Chart, Json, axis_title, numbers
from frictionsim.reports.html import (
    Html,
    chart_text,
    escaped,
    folded,
    listed,
    number,
    page,
    region,
    section,
    short,
    study_table,
)
from frictionsim.sweeps.statistics import (
    extreme_runs,
    grouped,
    is_defined,
    jumps_between,
    short_keys,
    sound_values,
    varied_values,
    varying_quantities,
)

MAX_CELLS = 12_000  # of the table of runs; more make a page slow
MAX_GROUPS = 50  # of reasons and warnings
CAPTIONS = {
    "key": "Varied keys",
    "quantity": "Quantities of completed runs that passed their audit",
}


def _study_page(
    title: str, lines: Sequence[str], sections: Sequence[Html], figure: Json | None
) -> str:
    """Return the page of a study: a heading with lines below it, and its chart."""
    top, *below = (escaped(line) for line in lines if line)
    faint = "\n".join(f'<p class="note">{line}</p>' for line in below)
    body = Html(f"<header><h1>{top}</h1>\n{faint}</header>\n{''.join(sections)}")
    return page(title, body, {"charts": {"charts": figure}} if figure else {})


def sweep_page(sweep: SweepTable, parts: Document, source: str) -> str:
    """Return the report of a sweep as HTML, from its summary and the name of its file, if any."""
    title, *lines = parts
    # The head of the page names the file, and what was set.
    in_head = (f"sweep: {source}", set_line(sweep.attributes))
    figure, note = sweep_figure(sweep)
    name = sweep.attributes["title"] or sweep.attributes["kind"]
    words = "In TOML, which 'frictionsim sweep' runs again"
    sections = (
        section("Summary", *(_part(part) for part in lines if part not in in_head)),
        _chart(figure, note),
        section("Runs", *_runs(sweep)),
        _groups("Failures", sweep, "failure", "reason"),
        _groups("Warnings", sweep, "warnings"),
        section("Study", folded(words, sweep.attributes["study"])),
    )
    heads = str(title), f"from {source}" if source else "", set_line(sweep.attributes)
    return _study_page(f"{name}: sweep", heads, sections, figure)


def _chart(figure: Any, note: str) -> Html:
    place = Html() if figure is None else region("wide", "charts", Html('<div id="charts"></div>'))
    return section("Charts", place, note or Html())


def _part(part: Block) -> Block:
    """Return a line or a table of the summary."""
    if not isinstance(part, Table):
        return part
    caption = CAPTIONS.get(part.headings[0], part.headings[0])
    return study_table(part._replace(caption=caption))


def _runs(sweep: SweepTable) -> Iterator[Block]:
    """Yield the table of runs; of many runs some, with the extremes and failures among them."""
    limit = MAX_CELLS // (len(sweep.coordinates) + len(sweep.values) + 2)
    runs, caption = np.arange(sweep.runs), f"All {sweep.runs} runs"
    if sweep.runs > limit:
        special = [run for name in sweep.values for run in extreme_runs(sound_values(sweep, name))]
        failed = np.flatnonzero(sweep.status != DONE)[: limit // 4]
        even = np.linspace(0, sweep.runs - 1, max(2, limit - len(special) - failed.size))
        runs = np.unique(np.concatenate((np.array(special, int), failed, even.astype(np.int64))))
        caption = f"{runs.size} of {sweep.runs} runs"
        yield (
            f"{caption} are in the table, with extremes and the first failures among them; the"
            " summary counts all of them."
        )
    headings = [
        ">run",
        *(f">{labelled(key, of.unit)}" for key, of in sweep.coordinates.items()),
        *(f">{labelled(name, sweep.units[name])}" for name in sweep.values),
        "outcome",
    ]
    rows = [_run(sweep, run, dict(STATUSES)) for run in runs.tolist()]
    yield study_table(Table(headings, rows, caption if sweep.runs > 1 else "The run", "runs"))


def _run(sweep: SweepTable, run: int, words: dict[int, str]) -> list[Cell]:
    outcome = words[int(sweep.status[run])].replace("_", " ")
    why = [sweep.texts[name][run] for name in ("failure", "reason") if run in sweep.texts[name]]
    return [
        Number(str(run), run),
        *(_cell(sweep, key, value) for key, value in varied_values(sweep, run).items()),
        *(number(float(values[run])) for values in sweep.values.values()),
        ": ".join((outcome, *why)),
    ]


def _cell(sweep: SweepTable, key: str, value: Any) -> Cell:
    return number(float(value)) if sweep.coordinates[key].is_number else _words(value)


def _words(value: Any) -> str:
    """Return the value of a key that is no number: a text, or true or false."""
    return value if isinstance(value, str) else "true" if value else "false"


def _groups(heading: str, sweep: SweepTable, *names: str) -> Html:
    """Return the texts of some names that runs have; those that differ in numbers only are one."""
    runs = sorted({run for name in names for run in sweep.texts[name]})
    texts = {
        run: ": ".join(sweep.texts[name][run] for name in names if run in sweep.texts[name])
        for run in runs
    }
    if names != ("warnings",):
        texts = {run: " ".join(text.split()) for run, text in texts.items()}
    groups = grouped(texts)
    rows = [(g.text, number(g.runs, 10), number(g.first_run, 10)) for g in groups[:MAX_GROUPS]]
    rest = len(groups) - len(rows)
    caption = f"In {len(runs)} runs; texts that differ in numbers only are one"
    caption += f"; {rest} more kinds are left out" if rest else ""
    headings = ("text", ">runs", ">first in run")
    return section(heading, study_table(Table(headings, rows, caption)) if runs else Html())


def cost_page(costs: CostTable, parts: Document, source: str) -> str:
    """Return the report of a cost study as HTML, from its summary and the name of its file, if any.

    The summary is a title, the references, the table of settings, those that failed, and
    recommendations, which are first here.
    """
    title = f"{costs.title or costs.kind}: error against run time"
    failed = sum(row["status"] == "failed" for row in costs.rows)
    counts = f"{len(costs.rows)} settings" + (f", {failed} failed" if failed else "")
    status = f"{': '.join(filter(None, (costs.status, costs.reason)))}, " if costs.status else ""
    lines = [
        f"kind {costs.kind}" if costs.kind else "",
        f"{status}{counts}" + (f", from {source}" if source else ""),
        *costs.notes,
    ]
    _, *blocks = parts
    advice = recommended_lines(costs)
    (table,) = (block for block in blocks if isinstance(block, Table))
    at = blocks.index(table)
    overrides = [row.get("overrides", "") for row in costs.rows]
    rows = [[*cells, keys] for cells, keys in zip(table.rows, overrides, strict=True)]
    headings, caption = (*table.headings, "keys it sets"), "All settings, one row each"
    settings = study_table(Table(headings, rows, caption, "settings"))
    figure, note = cost_figure(costs)
    sections = (
        section("What to use", listed(advice)),
        _chart(figure, note),
        section("Failed settings", listed(short(b) for b in blocks[at + 1 :] if b not in advice)),
        section("Settings", *blocks[:at], settings),
    )
    return _study_page(title, (title, *lines), sections, figure)


# Charts.

MARKS = tuple(SYMBOLS.values())
FAILED_ABOVE = 4.0  # failed settings, as a multiple of the largest error
MAX_QUANTITIES, MAX_KEYS = 12, 5  # panels; columns of a study of many keys
WHY = "or the run failed, was not run, or failed its audit; the table says which."


def cost_figure(table: CostTable) -> tuple[Json, str]:
    """Return the error against work, a line for each method, and a note on what is not drawn.

    Left against wall time, right against evaluations; of meshes right the error in time alone.
    """
    panels = table.panels
    names = {name for of in panels for name in (of.work, of.error)}
    rows = [row for row in table.rows if all(isnan(row[k]) or row[k] < MAX_DRAWN for k in names)]
    errors = [
        max(row[of.error], MIN_ERROR) for row in rows for of in panels if not isnan(row[of.error])
    ]
    chart = Chart(1, 2)
    y = {"type": "log", "exponentformat": "power"} | axis_title("largest relative error")
    for n, (work, error, title, band) in enumerate(panels, start=1):
        chart.panel(n, {"type": "log", **axis_title(WORK[work])}, y, title)
        for i, name in enumerate(dict.fromkeys(map(line_of, rows))):
            of_line = [row for row in rows if line_of(row) == name]
            done = [row for row in of_line if not isnan(row[error])]
            failed = [row for row in of_line if row["status"] == "failed" and error == "error"]
            colour = {"color": LINE_COLOURS[i % len(LINE_COLOURS)]}
            chart.add(
                n,
                "scatter",
                x=[row[work] for row in done],
                y=[max(row[error], MIN_ERROR) for row in done],
                mode="markers" if table.of_meshes else "lines+markers",
                name=chart_text(name),
                legendgroup=name,
                showlegend=n == 1 and bool(done),
                text=[chart_text(row["setting"]) for row in done],
                line=colour | {"dash": DASHES[i % len(DASHES)], "width": 1.4},
                marker=colour | {"symbol": MARKS[i % len(MARKS)], "size": 8},
            )
            if failed:
                chart.add(
                    n,
                    "scatter",
                    x=[row[work] for row in failed],
                    y=[FAILED_ABOVE * max(errors, default=1.0)] * len(failed),
                    mode="markers",
                    name=f"{chart_text(name)}: {len(failed)} failed",
                    legendgroup=f"{name}, failed",
                    showlegend=n == 1,
                    text=[chart_text(row.get("reason", "")) for row in failed],
                    marker=colour | {"symbol": "x", "size": 10},
                )
        if band > 0.0:
            below = min([band, *errors]) / 10.0
            chart.level(n, band, BELOW, below)
        for target, words in TARGETS.items():
            chart.level(n, target, words)
    omitted = len(table.rows) - len(rows)
    words = f"{omitted} settings have numbers that no axis shows; the table has them."
    return chart.figure, words if omitted else ""


def sweep_figure(table: SweepTable) -> tuple[Json | None, str]:
    """Return the quantities that vary over the keys, and a note on those that are left out.

    Over one key they are curves, over two numbers maps; else each is a row with the points of all
    runs over each key. None if no quantity is defined.
    """
    defined = [name for name in table.values if is_defined(table, name)]
    sound = {name: sound_values(table, name) for name in defined}
    drawable = [n for n in defined if np.nanmax(np.abs(_finite(sound[n]))) < MAX_DRAWN]
    varying = [name for name in varying_quantities(table) if name in drawable]
    drawn = (varying or drawable)[:MAX_QUANTITIES]
    others = [name for name in defined if name not in drawn]
    notes = [f"Without a picture: {', '.join(others)}; the table has them."] if others else []
    if not drawn:
        return None, " ".join(notes)
    keys = [key for key, of in table.coordinates.items() if len(set(np.array(of.values))) > 1]
    keys = keys or list(table.coordinates)
    grid = RUN not in table.dimensions
    if grid and len(keys) == 2 and all(table.coordinates[key].is_number for key in keys):
        empty = [name for name in drawn if not np.isfinite(sound[name]).all()]
        if empty:
            notes.insert(0, f"An empty cell: {', '.join(empty)} not defined in that run, {WHY}")
        return _maps(table, drawn, keys), " ".join(notes)
    return _points(table, drawn, keys, joined=grid and len(keys) == 1), " ".join(notes)


def _finite(values: Any) -> Any:
    return values[np.isfinite(values)]


def _label(table: SweepTable, name: str) -> str:
    if name in table.values:
        return chart_text(labelled(name, table.units[name]))
    keys = list(table.coordinates)
    unit = table.coordinates[name].unit or "1"
    return chart_text(labelled(short_keys(keys)[keys.index(name)], unit))


def _maps(table: SweepTable, names: Sequence[str], keys: list[str]) -> Json:
    """Return a map of each quantity over two keys, a cell for each run."""
    columns = min(2, len(names))
    chart = Chart(-(-len(names) // columns), columns, wide=0.4)
    values_of = [np.asarray(table.coordinates[key].values, dtype=float) for key in keys]
    # Plotly makes the edges of cells from neighbours: of values in disorder they would overlap.
    orders = [np.argsort(values, kind="stable") for values in values_of]
    x, y = (numbers(values[order], "f8") for values, order in zip(values_of, orders, strict=True))
    place = [list(table.dimensions).index(key) for key in keys]
    across, up = (axis_title(_label(table, key)) for key in keys)
    for n, name in enumerate(names, start=1):
        values = np.moveaxis(sound_values(table, name).reshape(table.shape), place, (0, 1))
        (_, right), (low, high) = chart.panel(n, across, up, _label(table, name), shared=False)
        bar = {"x": right + 0.005, "y": 0.5 * (low + high), "len": high - low, "thickness": 12}
        image = numbers(values.reshape(table.shape[place[0]], -1)[np.ix_(*orders)].T, "f8")
        chart.add(n, "heatmap", x=x, y=y, z=image, colorscale="Cividis", colorbar=bar)
    return chart.figure


def _points(table: SweepTable, names: Sequence[str], keys: list[str], joined: bool) -> Json:
    """Return the quantities over each key, a point for each run; joined over one key of a grid."""
    keys = keys[:MAX_KEYS]
    chart = Chart(len(names), len(keys), panel=170)
    runs = [varied_values(table, run) for run in range(table.runs)]
    marker = {"color": COLOURS[0], "size": 7 if table.runs < 100 else 4}
    look = {"marker": marker, "line": {"width": 1.4}, "showlegend": False}
    for row, name in enumerate(names):
        values = sound_values(table, name)
        for column, key in enumerate(keys, start=1):
            n, mode, y = row * len(keys) + column, "markers", values
            is_number = table.coordinates[key].is_number
            x: Any = [
                float(run[key]) if is_number else chart_text(_words(run[key])) for run in runs
            ]
            if joined and is_number:
                places, mode = np.asarray(x), "lines+markers"
                order = np.argsort(places, kind="stable")
                at = 1 + np.flatnonzero(jumps_between(places[order], values[order]))
                x = numbers(np.insert(places[order], at, np.nan), "f8")
                y = np.insert(values[order], at, np.nan)
            chart.panel(n, axis_title(_label(table, key)), axis_title(_label(table, name)))
            chart.add(n, "scatter", x=x, y=numbers(y, "f8"), mode=mode, **look)
    return chart.figure
