"""The reports of studies: of a sweep, and of a work-precision study."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from frictionsim.display import labelled, set_line
from frictionsim.document import Block, Cell, Document, Number, Table
from frictionsim.io.cost_table import CostTable
from frictionsim.io.sweep_table import DONE, STATUSES, SweepTable
from frictionsim.reports.html import (
    Html,
    folded,
    listed,
    number,
    region,
    section,
    short,
    study_table,
)
from frictionsim.reports.page import study_page
from frictionsim.reports.study_charts import cost_figure, sweep_figure
from frictionsim.sweeps.statistics import (
    extreme_runs,
    grouped,
    sound_values,
    varied_values,
)

MAX_KEYS, MAX_QUANTITIES = 30, 60  # columns of the table of runs


class Kept(NamedTuple):
    """The part of a sweep in the table of runs.

    Attributes
    ----------
    runs : (n,) of int
        Numbers of runs, in ascending order.
    keys, quantities : list of str
    """

    runs: Any
    keys: list[str]
    quantities: list[str]


def kept_of(table: SweepTable) -> Kept:
    """Return the runs, keys and quantities of the table of runs: all, if not too many."""
    keys, quantities = list(table.coordinates)[:MAX_KEYS], list(table.values)[:MAX_QUANTITIES]
    limit = MAX_CELLS // (len(keys) + len(quantities) + 2)
    if table.runs <= limit:
        return Kept(np.arange(table.runs), keys, quantities)
    special = [run for name in quantities for run in extreme_runs(sound_values(table, name))]
    failed = np.flatnonzero(table.status != DONE)[: limit // 4]
    even = np.linspace(0, table.runs - 1, max(2, limit - len(special) - failed.size))
    runs = np.unique(np.concatenate((np.array(special, int), failed, even.astype(np.int64))))
    return Kept(runs, keys, quantities)


MAX_CELLS = 12_000  # of the table of runs
MAX_GROUPS = 50  # of reasons and warnings
MAX_PART_ROWS = 200  # of a table of the summary
MAX_STUDY = 200_000  # characters
CAPTIONS = {
    "key": "Varied keys",
    "quantity": "Quantities of completed runs that passed their audit",
}


def sweep_page(sweep: SweepTable, parts: Document, source: str) -> str:
    """Return the HTML of the report of a sweep.

    Parameters
    ----------
    parts : Document
        Its summary.
    source : str
        Name of its file; empty if there is none.
    """
    title, *lines = parts
    # The head of the page names the file, and what was set.
    told = (f"sweep: {source}", set_line(sweep.attributes))
    summary = [part for part in lines if part not in told]
    kept = kept_of(sweep)
    figure, note = sweep_figure(sweep)
    name = sweep.attributes["title"] or sweep.attributes["kind"]
    sections = (
        section("Summary", *map(_part, summary)),
        _chart(figure, note),
        section("Runs", *_left_out(sweep, kept), _runs(sweep, kept)),
        *_groups("Failures", sweep.texts, ("failure", "reason")),
        *_groups("Warnings", sweep.texts, ("warnings",)),
        section("Study", *_study(sweep.attributes["study"])),
    )
    heads = str(title), f"from {source}" if source else "", set_line(sweep.attributes)
    return study_page(f"{name}: sweep", heads, sections, figure)


def _chart(figure: Any, note: str) -> Html:
    place = Html() if figure is None else region("wide", "charts", Html('<div id="charts"></div>'))
    return section("Charts", place, short(note, 1000) if note else Html())


def _part(part: Block) -> Block:
    """Return a line or a table of the summary."""
    if isinstance(part, str):
        return short(part, 1000)
    if not isinstance(part, Table):
        return part
    caption = CAPTIONS.get(part.headings[0], part.headings[0])
    if len(part.rows) > MAX_PART_ROWS:
        caption += f"; the first {MAX_PART_ROWS} of {len(part.rows)}"
    return study_table(part._replace(rows=part.rows[:MAX_PART_ROWS], caption=caption))


def _left_out(sweep: SweepTable, kept: Kept) -> Iterator[str]:
    """Yield how much of the sweep is in the page."""
    counts = (
        (kept.runs.size, sweep.runs, "runs", ", with extremes and the first failures among them"),
        (len(kept.keys), len(sweep.coordinates), "varied keys", ""),
        (len(kept.quantities), len(sweep.values), "quantities", ""),
    )
    for count, of, words, more in counts:
        if count < of:
            yield (
                f"{count} of {of} {words} are in the table{more}; the summary counts all of them."
            )


def _runs(sweep: SweepTable, kept: Kept) -> Html:
    headings = [
        ">run",
        *(f">{labelled(key, sweep.coordinates[key].unit)}" for key in kept.keys),
        *(f">{labelled(name, sweep.units[name])}" for name in kept.quantities),
        "outcome",
    ]
    caption = f"{len(kept.runs)} of {sweep.runs} runs"
    if len(kept.runs) == sweep.runs:
        caption = f"All {sweep.runs} runs" if sweep.runs > 1 else "The run"
    words = dict(STATUSES)
    rows = [_run(sweep, kept, run, words) for run in kept.runs.tolist()]
    return study_table(Table(headings, rows, caption, "runs"))


def _run(sweep: SweepTable, kept: Kept, run: int, words: dict[int, str]) -> list[Cell]:
    values = varied_values(sweep, run)
    outcome = words[int(sweep.status[run])].replace("_", " ")
    why = [sweep.texts[name][run] for name in ("failure", "reason") if run in sweep.texts[name]]
    return [
        Number(str(run), run),
        *(_cell(sweep, key, values[key]) for key in kept.keys),
        *(number(float(sweep.values[name][run])) for name in kept.quantities),
        ": ".join((outcome, *why)),
    ]


def _cell(sweep: SweepTable, key: str, value: Any) -> Cell:
    if isinstance(value, str):
        return value
    values = sweep.coordinates[key].values
    if values.dtype.kind == "b" or values.dtype.itemsize == 1:
        return "true" if value else "false"
    return number(float(value))


def _groups(
    heading: str, texts: dict[str, dict[int, str]], names: tuple[str, ...]
) -> Iterator[Html]:
    runs = sorted({run for name in names for run in texts[name]})
    if not runs:
        return
    joined = {
        run: ": ".join(texts[name][run] for name in names if run in texts[name]) for run in runs
    }
    one_line = "warnings" not in names
    groups = grouped({r: " ".join(t.split()) if one_line else t for r, t in joined.items()})
    rows = [
        (each.text, number(each.runs, 10), number(each.first_run, 10))
        for each in groups[:MAX_GROUPS]
    ]
    rest = len(groups) - len(rows)
    caption = f"In {len(runs)} runs; texts that differ in numbers only are one"
    if rest:
        caption += f"; {rest} more kinds are left out"
    headings = ("text", ">runs", ">first in run")
    yield section(heading, study_table(Table(headings, rows, caption)))


def _study(toml: str) -> Iterator[str]:
    if len(toml) > MAX_STUDY:
        yield (
            f"The first {MAX_STUDY} of {len(toml)} characters; 'frictionsim show FILE --study'"
            " prints all of them."
        )
    yield folded("In TOML, which 'frictionsim sweep' runs again", toml[:MAX_STUDY])


MAX_CELLS_OF_COSTS = 40_000  # in the page; a study has some hundred rows of twenty
MAX_NOTES, MAX_LINE = 10, 2000


def cost_page(costs: CostTable, parts: Document, source: str) -> str:
    """Return the HTML of the report of a cost study.

    Parameters
    ----------
    parts : Document
        Its summary: a title, its references, the table of its settings, its recommendations.
    source : str
        Name of its file; empty if there is none.
    """
    title = f"{costs.title or costs.kind}: error against run time"
    failed = sum(row["status"] == "failed" for row in costs.rows)
    counts = f"{len(costs.rows)} settings" + (f", {failed} failed" if failed else "")
    ending = f"{': '.join(filter(None, (costs.status, costs.reason)))}, " if costs.status else ""
    lines = [
        f"kind {costs.kind}" if costs.kind else "",
        f"{ending}{counts}" + (f", from {source}" if source else ""),
        *costs.notes[:MAX_NOTES],
    ]
    _, *blocks = parts
    (table,) = (block for block in blocks if isinstance(block, Table))
    figure, note = cost_figure(costs)
    before, after = blocks[: blocks.index(table)], blocks[blocks.index(table) + 1 :]
    sections = (
        section("What to use", listed(map(short, after))),
        _chart(figure, note),
        section("Settings", *(short(line, MAX_LINE) for line in before), *_settings(costs, table)),
    )
    return study_page(title, (title, *lines), sections, figure)


def _settings(costs: CostTable, table: Table) -> Iterator[Block]:
    """Yield the table of settings, with the keys that each sets."""
    count = min(len(table.rows), MAX_CELLS_OF_COSTS // (len(table.headings) + 1))
    if count < len(table.rows):
        yield f"The first {count} of {len(table.rows)} rows are shown."
    overrides = [row.get("overrides", "") for row in costs.rows[:count]]
    rows = [[*cells, keys] for cells, keys in zip(table.rows, overrides, strict=False)]
    headings = (*table.headings, "keys it sets")
    yield study_table(Table(headings, rows, "All settings, one row each", "settings"))
