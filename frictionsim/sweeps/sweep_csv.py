"""A sweep as CSV: a line for each run, and for a sample with Sobol indices a second file.

    run [1], <key> [unit] ..., <quantity> [unit] ..., status, failure, reason, warnings
    quantity, key, sobol_first [1], ..., sobol_total_high [1], sobol_basis

Numbers have as many digits as they need to be read back exactly; an undefined quantity is empty.
Text that a spreadsheet would interpret as a formula begins with an apostrophe.
"""

import csv
from collections.abc import Iterator
from io import TextIOWrapper
from pathlib import Path
from typing import Any

import numpy as np

from frictionsim.io.output_file import (
    SOBOL_IN_CSV,
    SWEEP_IN_CSV,
    Kind,
    check_replaceable,
    replacing,
)
from frictionsim.io.result_csv import Writable
from frictionsim.io.sweep_table import (
    RUN,
    SOBOL,
    SOBOL_BASIS,
    STATUS,
    STATUSES,
    TEXTS,
    Coordinate,
    SweepTable,
)

RUNS_AT_ONCE = 4096  # of a table in CSV
FORMULA = ("=", "+", "-", "@", "\t", "\r")


def files_of_sweep_in_csv(path: Path, with_indices: bool) -> dict[Path, Kind]:
    """Return the CSV files of a sweep: NAME.csv, and NAME.sobol.csv for indices."""
    files = {path: SWEEP_IN_CSV}
    return files | {path.with_suffix(".sobol.csv"): SOBOL_IN_CSV} if with_indices else files


def write_csv(table: SweepTable, path: Path) -> None:
    """Write a sweep as CSV, each file atomically."""
    files = files_of_sweep_in_csv(path, table.sobol is not None)
    for target, kind in files.items():
        check_replaceable(target, kind)
    for target, kind in files.items():
        with replacing(target, kind) as part:
            text = TextIOWrapper(part, encoding="utf-8", newline="")
            (write_lines if target == path else _write_indices)(table, text)
            text.detach()  # which writes the rest, and closes nothing


def _write_indices(table: SweepTable, file: Writable) -> None:
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(["quantity", "key", *(f"{name} [1]" for name in SOBOL), SOBOL_BASIS])
    for quantity, (basis, values) in (table.sobol or {}).items():
        for key, column in zip(table.coordinates, values.T.tolist(), strict=True):
            cells = ["" if value != value else value for value in column]
            writer.writerow([quantity, key, *cells, basis])


def write_lines(table: SweepTable, file: Writable) -> None:
    """Write the heading and a line for each run."""
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(
        [
            f"{RUN} [1]",
            *(_heading(key, coordinate) for key, coordinate in table.coordinates.items()),
            *(f"{name} [{table.units[name]}]" for name in table.values),
            *(STATUS, *TEXTS),
        ]
    )
    for start in range(0, table.runs, RUNS_AT_ONCE):
        runs = range(start, min(start + RUNS_AT_ONCE, table.runs))
        writer.writerows(zip(*_columns(table, runs), strict=True))


def _heading(key: str, coordinate: Coordinate) -> str:
    return key if isinstance(coordinate.values, list) else f"{key} [{coordinate.unit or '1'}]"


def _columns(table: SweepTable, runs: range) -> Iterator[list[Any]]:
    """Yield the cells of some runs, column by column."""
    yield list(runs)
    indices = table.places(np.arange(runs.start, runs.stop))
    for key, coordinate in table.coordinates.items():
        if isinstance(coordinate.values, list):
            yield [_text(coordinate.values[i]) for i in indices[key].tolist()]
        else:
            yield coordinate.stored[indices[key]].tolist()
    for values in table.values.values():
        yield ["" if value != value else value for value in values[runs.start : runs.stop].tolist()]
    words = dict(STATUSES)
    yield [words[status] for status in table.status[runs.start : runs.stop].tolist()]
    for name in TEXTS:
        yield [_text(table.texts[name].get(run, "")) for run in runs]


def _text(text: str) -> str:
    return f"'{text}" if text.startswith(FORMULA) else text
