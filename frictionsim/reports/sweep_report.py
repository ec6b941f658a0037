"""The report of a sweep: its summary, its quantities over its keys, its runs and its study."""

from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

import numpy as np

from frictionsim.io.sweep_table import SweepTable
from frictionsim.parameter_study.block import DONE
from frictionsim.parameter_study.design import SAMPLE
from frictionsim.parameter_study.sensitivity import Indices, indices_of
from frictionsim.parameter_study.statistics import (
    extremes,
    grouped,
    is_defined,
    sound_values,
    varied_values,
)
from frictionsim.reports.page import page
from frictionsim.reports.study_parts import (
    STUDY_SCRIPTS,
    Picture,
    head,
    number,
    short,
    shown_pictures,
    study_section,
    study_table,
)
from frictionsim.reports.tables import Number, with_unit

MAX_KEYS, MAX_QUANTITIES = 30, 60  # columns of the table of runs
MAX_WITH_INDICES = 6  # quantities
FLAT = 1e-6  # a quantity that varies relatively less does not vary


class Kept(NamedTuple):
    """What of a sweep is in its table of runs.

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
    """Return which runs, keys and quantities are in the table of runs: all, if not too many."""
    keys, quantities = list(table.coordinates)[:MAX_KEYS], list(table.values)[:MAX_QUANTITIES]
    limit = MAX_CELLS // (len(keys) + len(quantities) + 2)
    if table.runs <= limit:
        return Kept(np.arange(table.runs), keys, quantities)
    found = extremes(table)
    special = [run for name in quantities if name in found for run in found[name][2::2]]
    failed = np.flatnonzero(table.status != DONE)[: limit // 4]
    even = np.linspace(0, table.runs - 1, max(2, limit - len(special) - failed.size))
    runs = np.unique(np.concatenate((np.array(special, int), failed, even.astype(np.int64))))
    return Kept(runs, keys, quantities)


def _is_flat(values: Any) -> bool:
    found = values[np.isfinite(values)]
    return not found.size or bool(np.ptp(found) <= FLAT * np.abs(found).max())


def indices_of_sample(table: SweepTable, kept: Kept) -> dict[str, Indices]:
    """Return the Sobol indices of the first quantities that vary, of a sample of several keys."""
    if table.attributes["design"] != SAMPLE or len(table.coordinates) < 2:
        return {}
    varying = [
        name
        for name in kept.quantities
        if is_defined(table, name) and not _is_flat(sound_values(table, name))
    ]
    return indices_of(table, varying[:MAX_WITH_INDICES])


MAX_CELLS = 12_000  # of the table of runs
MAX_GROUPS = 50  # of reasons and warnings
MAX_PART_ROWS = 200  # of a table of the summary
MAX_STUDY = 200_000  # characters
CAPTIONS = {
    "key": "Varied keys",
    "quantity": "Quantities of completed runs that passed their audit",
}


def sweep_page(
    found: SweepTable, parts: Iterable[Any], source: str, pictures: Iterable[Picture] = ()
) -> str:
    """Return the HTML of the report of a sweep.

    Parameters
    ----------
    found : SweepTable
    parts : iterable of str and tables with `headings` and `rows`
        Its summary.
    source : str
        Name of its file; empty if there is none.
    pictures : iterable of Picture
        Of its quantities over its keys.
    """
    title, *lines = parts
    # The head of the page names the file.
    summary = [part for part in lines if part != f"sweep: {source or 'none'}"]
    kept = kept_of(found)
    indices = indices_of_sample(found, kept)
    name = found.attributes["title"] or found.attributes["kind"]
    body = "\n".join(
        (
            head(str(title), f"from {source}" if source else ""),
            study_section("Summary", *map(_part, summary)),
            study_section("Pictures", *shown_pictures(pictures)),
            *_indices(indices),
            study_section("Runs", *_left_out(found, kept), _runs(found, kept)),
            *_groups("Failures", found.texts, ("failure", "reason")),
            *_groups("Warnings", found.texts, ("warnings",)),
            study_section("Study", *_study(found.attributes["study"])),
        )
    )
    return page(f"{name}: sweep", body, None, STUDY_SCRIPTS)


def _part(part: Any) -> str:
    """Return a line or a table of the summary."""
    if isinstance(part, str):
        return f"<p>{short(part, 1000)}</p>"
    caption = CAPTIONS.get(part.headings[0], part.headings[0])
    if len(part.rows) > MAX_PART_ROWS:
        caption += f"; the first {MAX_PART_ROWS} of {len(part.rows)}"
    return study_table(
        caption, part.headings, [list(map(str, row)) for row in part.rows[:MAX_PART_ROWS]]
    )


def _left_out(found: SweepTable, kept: Kept) -> Iterator[str]:
    """Yield what is not in the page, and where it is."""
    of_sweep = (
        (kept.runs.size, found.runs, "runs", ", with extremes and the first failures among them"),
        (len(kept.keys), len(found.coordinates), "varied keys", ""),
        (len(kept.quantities), len(found.values), "quantities", ""),
    )
    for count, of, words, more in of_sweep:
        if count < of:
            yield (
                f'<p class="left-out">{count} of {of} {words} are in the table{more}; the summary'
                " counts all of them.</p>"
            )


def _runs(found: SweepTable, kept: Kept) -> str:
    headings = [
        ">run",
        *(f">{with_unit(key, found.coordinates[key].unit)}" for key in kept.keys),
        *(f">{with_unit(name, found.units[name])}" for name in kept.quantities),
        "outcome",
    ]
    caption = f"{len(kept.runs)} of {found.runs} runs"
    if len(kept.runs) == found.runs:
        caption = f"All {found.runs} runs" if found.runs > 1 else "The run"
    words = dict(found.statuses)
    rows = [_run(found, kept, run, words) for run in kept.runs.tolist()]
    return study_table(caption, headings, rows, "runs")


def _run(found: SweepTable, kept: Kept, run: int, words: dict[int, str]) -> list[str | Number]:
    values = varied_values(found, run)
    outcome = words[int(found.status[run])].replace("_", " ")
    why = [found.texts[name][run] for name in ("failure", "reason") if run in found.texts[name]]
    return [
        Number(str(run), run),
        *(_cell(found, key, values[key]) for key in kept.keys),
        *(number(float(found.values[name][run])) for name in kept.quantities),
        ": ".join((outcome, *why)),
    ]


def _cell(found: SweepTable, key: str, value: Any) -> str | Number:
    if isinstance(value, str):
        return value
    values = found.coordinates[key].values
    if values.dtype.kind == "b" or values.dtype.itemsize == 1:
        return "true" if value else "false"
    return number(float(value))


def _groups(
    heading: str, texts: dict[str, dict[int, str]], names: tuple[str, ...]
) -> Iterator[str]:
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
    yield study_section(heading, study_table(caption, ("text", ">runs", ">first in run"), rows))


def _indices(found: dict[str, Indices]) -> Iterator[str]:
    """Yield the Sobol indices as tables."""
    if not found:
        return
    parts = []
    for name, each in found.items():
        if not each.first.size:
            parts.append(f"<p>{short(name)}: {short(each.basis)}</p>")
            continue
        rows = [
            (key, number(float(first), 3), number(float(total), 3))
            for key, first, total in zip(each.keys, each.first, each.total, strict=True)
        ]
        caption = f"{name}: part of its variance that each key causes ({each.basis})"
        parts.append(study_table(caption, ("key", ">first-order index", ">total index"), rows))
    note = f"<p>Of the first {MAX_WITH_INDICES} quantities that vary.</p>"
    yield study_section("Sobol indices", note, *parts)


def _study(toml: str) -> Iterator[str]:
    if len(toml) > MAX_STUDY:
        yield (
            f"<p>The first {MAX_STUDY} of {len(toml)} characters; 'frictionsim show FILE --study'"
            " prints all of them.</p>"
        )
    yield (
        "<details open><summary>In TOML, which 'frictionsim sweep' runs again</summary>"
        f'<pre tabindex="0">{short(toml[:MAX_STUDY], MAX_STUDY)}</pre></details>'
    )
