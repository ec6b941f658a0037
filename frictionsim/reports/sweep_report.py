"""The report of a sweep: its summary, its quantities over its keys, its runs and its study."""

from collections.abc import Iterable, Iterator
from math import ceil, log
from typing import Any, NamedTuple

import numpy as np

from frictionsim.io.sweep_table import RUN, Coordinate, SweepTable
from frictionsim.parameter_study.block import AUDIT_FAILED, DONE, FAILED
from frictionsim.parameter_study.design import SAMPLE
from frictionsim.parameter_study.sensitivity import Indices, indices_of
from frictionsim.parameter_study.statistics import (
    extremes,
    grouped,
    independent_runs,
    is_defined,
    sample_statistics,
    sound_values,
    variation,
    varied_values,
)
from frictionsim.reports.page import page
from frictionsim.reports.study_parts import chart, head, number, short, study_section, study_table
from frictionsim.reports.tables import Number, with_unit

MAX_VALUES = 200_000  # of all keys and quantities together: two megabytes of a page
MAX_KEYS, MAX_QUANTITIES = 30, 60
MAX_FAILED = 200  # runs that are kept beside those of a thinned sweep
MAX_TEXTS, MAX_TEXT = 2000, 300  # reasons and warnings, and their characters
MAX_WITH_INDICES = 6  # quantities
MAX_BINS = 50  # of a histogram; twice the cube root of the runs (Rice) if that is less
FLAT = 1e-6  # a quantity that varies relatively less has one bin
MIN_LOG_RATIO = 10.0  # of last to first value on a logarithmic axis


class Kept(NamedTuple):
    """What of a sweep is in its page.

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
    """Return what of a sweep is in its page: all of it, if there is not too much."""
    keys, quantities = list(table.coordinates)[:MAX_KEYS], list(table.values)[:MAX_QUANTITIES]
    limit = MAX_VALUES // (len(keys) + len(quantities) + 1)
    if table.runs <= limit:
        return Kept(np.arange(table.runs), keys, quantities)
    shape = (table.runs,) if RUN in table.dimensions else table.shape
    found = extremes(table)
    special = [
        *(run for name in quantities if name in found for run in found[name][2::2]),
        *np.flatnonzero(np.isin(table.status, (FAILED, AUDIT_FAILED)))[:MAX_FAILED].tolist(),
    ]
    runs = np.union1d(_regular(shape, limit), np.array(special, dtype=np.int64))
    return Kept(runs, keys, quantities)


def _regular(shape: tuple[int, ...], limit: int) -> Any:
    """Return the numbers of runs at regular places of a grid, its edges included."""
    sizes = list(shape)
    while np.prod(sizes, dtype=np.float64) > limit:
        longest = int(np.argmax(sizes))
        sizes[longest] = max(1, int(0.9 * sizes[longest]))
    places = [
        np.unique(np.linspace(0, n - 1, size).round().astype(np.int64))
        for n, size in zip(shape, sizes, strict=True)
    ]
    return np.ravel_multi_index(np.meshgrid(*places, indexing="ij"), shape).reshape(-1)


def data_of(table: SweepTable, kept: Kept, indices: dict[str, Indices]) -> dict[str, Any]:
    """Return the data of a sweep for the scripts of its page.

    No object in it has names of a file for its keys: the scripts know arrays by a key.

    Raises
    ------
    InputError
        If the study in its file is not valid.
    """
    runs = kept.runs
    sample = _sample(table, kept) if table.attributes["design"] == SAMPLE else {}
    return {
        "design": table.attributes["design"],
        "all": table.runs,
        "runs": runs.astype(np.int32),
        "status": table.status[runs].astype(np.int32),
        "statuses": {str(n): word.replace("_", " ") for n, word in table.statuses},
        "keys": [_key(table, key, runs) for key in kept.keys],
        "quantities": [
            {
                "name": name,
                "unit": table.units[name],
                "values": table.values[name][runs],
                "log": _is_log(sound_values(table, name)),
                "varies": is_defined(table, name) and not _is_flat(sound_values(table, name)),
                "sample": sample.get(name),
                "indices": indices[name]._asdict() if name in indices else None,
            }
            for name in kept.quantities
        ],
        "reasons": _texts(table, ("failure", "reason"), runs),
        "warnings": _texts(table, ("warnings",), runs),
        "of_sample": table.attributes["design"] == SAMPLE,
    }


def _key(table: SweepTable, key: str, runs: Any) -> dict[str, Any]:
    """Return a key: its values, and which of them each run has."""
    coordinate = table.coordinates[key]
    if RUN in table.dimensions:
        places = runs
    else:
        axis = list(table.dimensions).index(key)
        places = np.unravel_index(runs, table.shape)[axis]
    values = _plain_values(coordinate)
    distinct, codes = np.unique(places, return_inverse=True)
    if isinstance(values, list):
        texts = [values[place] for place in distinct]
        named = list(dict.fromkeys(texts))
        number = {text: i for i, text in enumerate(named)}
        codes = np.array([number[text] for text in texts])[codes]
        shown: Any = [text[:MAX_TEXT] for text in named]
    else:
        shown, again = np.unique(values[distinct], return_inverse=True)
        codes = again[codes]
    return {
        "name": key,
        "unit": coordinate.unit,
        "values": shown,
        "codes": codes.astype(np.int32),
        "numeric": not isinstance(values, list),
        "log": not isinstance(values, list) and _is_log(np.asarray(values)),
    }


def _plain_values(coordinate: Coordinate) -> Any:
    """Return the values of a key: an array of numbers, or texts; true and false are texts."""
    values = coordinate.values
    if isinstance(values, list):
        return values
    if values.dtype in (np.bool_, np.int8):
        return ["true" if value else "false" for value in values.tolist()]
    return np.asarray(values, dtype=np.float64)


def _is_log(values: Any) -> bool:
    """Return whether positive numbers fill the scale of their logarithms better than their own."""
    found = np.sort(values[np.isfinite(values)])
    if found.size < 3 or found[0] <= 0.0 or found[-1] < MIN_LOG_RATIO * found[0]:
        return False
    middle = found[found.size // 2]
    place = (middle - found[0]) / (found[-1] - found[0])
    in_log = log(middle / found[0]) / log(found[-1] / found[0])
    return bool(abs(in_log - 0.5) < abs(place - 0.5))


def _is_flat(values: Any) -> bool:
    found = values[np.isfinite(values)]
    return not found.size or bool(np.ptp(found) <= FLAT * np.abs(found).max())


def _texts(table: SweepTable, names: tuple[str, ...], runs: Any) -> dict[str, str]:
    """Return texts by the place of their run among those that are kept."""
    found: dict[str, str] = {}
    for place, run in enumerate(runs.tolist()):
        parts = [table.texts[name][run] for name in names if run in table.texts[name]]
        if parts and len(found) < MAX_TEXTS:
            found[str(place)] = ": ".join(parts)[:MAX_TEXT]
    return found


def _sample(table: SweepTable, kept: Kept) -> dict[str, Any]:
    """Return what is known of a sample: of each quantity bins, statistics and Sobol indices."""
    runs = independent_runs(table, variation(table)[1])
    statistics = sample_statistics(table)
    return {
        name: {
            **_bins(sound_values(table, name)[runs]),
            **{n: v for n, v in statistics[name]._asdict().items() if n != "runs"},
            "defined": statistics[name].runs,
        }
        for name in kept.quantities
        if is_defined(table, name)
    }


def _bins(values: Any) -> dict[str, Any]:
    found = values[np.isfinite(values)]
    if _is_flat(found):
        half = 0.1 * float(np.abs(found).max()) or 1.0
        edges = np.array([found.min() - half, found.max() + half])
    else:
        count = min(MAX_BINS, ceil(2.0 * found.size ** (1.0 / 3.0)))
        # Halves: the range of extreme numbers may be infinite.
        edges = 2.0 * np.linspace(0.5 * found.min(), 0.5 * found.max(), count + 1)
    return {"edges": edges, "counts": np.histogram(found, edges)[0].astype(np.int32)}


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


def rows_to_show(table: SweepTable, kept: Kept, limit: int) -> Any:
    """Return the places among the kept runs that are in a table of so many rows."""
    count = kept.runs.size
    if count <= limit:
        return np.arange(count)
    found = extremes(table)
    wanted = [run for name in kept.quantities if name in found for run in found[name][2::2]]
    special = np.flatnonzero(np.isin(kept.runs, wanted))
    failed = np.flatnonzero(table.status[kept.runs] != DONE)[: limit // 4]
    even = np.linspace(0, count - 1, max(2, limit - special.size - failed.size)).astype(np.int64)
    return np.unique(np.concatenate((special, failed, even)))


SCRIPTS = ("data.js", "elements.js", "theme.js", "plot.js", "study.js", "sweep.js")
MAX_CELLS = 12_000  # of the table of runs
MAX_GROUPS = 50  # of reasons and warnings
MAX_PART_ROWS = 200  # of a table of the summary
MAX_STUDY = 200_000  # characters
RUN_PANEL = '<div id="run" role="status"></div>'
CAPTIONS = {"key": "Varied keys", "quantity": "Quantities of the runs that are done and sound"}


def sweep_page(found: SweepTable, parts: "Iterable[Any]", source: str) -> str:
    """Return the HTML of the report of a sweep.

    Parameters
    ----------
    found : SweepTable
    parts : iterable of str and tables with `headings` and `rows`
        Its summary.
    source : str
        Name of its file; empty if there is none.

    Raises
    ------
    InputError
        If the study in its file is not valid.
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
            study_section(
                "Chart",
                chart("A quantity over the varied keys"),
                '<div id="run" role="status"></div>',
            ),
            *_indices(indices),
            study_section("Runs", *_left_out(found, kept), _runs(found, kept)),
            *_groups("Failures", found.texts, ("failure", "reason")),
            *_groups("Warnings", found.texts, ("warnings",)),
            study_section("Study", *_study(found.attributes["study"])),
        )
    )
    return page(f"{name}: sweep", body, data_of(found, kept, indices), SCRIPTS)


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
                f'<p class="left-out">{count} of {of} {words} are in this page{more}; the summary'
                " counts all of them.</p>"
            )


def _runs(found: SweepTable, kept: Kept) -> str:
    headings = [
        ">run",
        *(f">{with_unit(key, found.coordinates[key].unit)}" for key in kept.keys),
        *(f">{with_unit(name, found.units[name])}" for name in kept.quantities),
        "outcome",
    ]
    places = rows_to_show(found, kept, MAX_CELLS // len(headings)).tolist()
    caption = f"{len(places)} of {found.runs} runs"
    if len(places) == found.runs:
        caption = f"All {found.runs} runs" if found.runs > 1 else "The run"
    words = dict(found.statuses)
    rows = [_run(found, kept, int(kept.runs[place]), words) for place in places]
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
