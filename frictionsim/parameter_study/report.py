"""A sweep as CSV: a line for each run, and of a sample with Sobol indices a second file with these.

    run [1], <key> [unit] ..., <quantity> [unit] ..., status, failure, reason, warnings
    quantity, key, sobol_first [1], ..., sobol_total_high [1], sobol_basis

Numbers have as many digits as they need to be read back exactly; a quantity that is not defined is
empty. Text that a spreadsheet would take for a formula begins with an apostrophe.
"""

import csv
from collections.abc import Iterator
from io import TextIOWrapper
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from frictionsim.io.atomic_write import replaced_atomically
from frictionsim.io.replaceable import check_replaceable, files_of_sweep_in_csv
from frictionsim.io.sweep_table import (
    RUN,
    SOBOL,
    SOBOL_BASIS,
    STATUS,
    TEXTS,
    Coordinate,
    SobolIndices,
    SweepTable,
)

RUNS_AT_ONCE = 4096
FORMULA = ("=", "+", "-", "@", "\t", "\r")


class Writable(Protocol):
    """What text can be written to."""

    def write(self, text: str, /) -> object:
        """Write text."""


def write_csv(table: SweepTable, path: Path) -> None:
    """Write a sweep as CSV, each file whole or not at all."""
    files = files_of_sweep_in_csv(path, table.sobol is not None)
    for target, kind in files.items():
        check_replaceable(target, kind)
    for target, kind in files.items():
        with (
            replaced_atomically(target, kind.word) as part,
            TextIOWrapper(part, encoding="utf-8", newline="") as file,
        ):
            if target == path:
                write_lines(table, file)
            elif table.sobol is not None:
                _write_indices(table.sobol, file)


def _write_indices(found: SobolIndices, file: Writable) -> None:
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(["quantity", "key", *(f"{name} [1]" for name in SOBOL), SOBOL_BASIS])
    for i, quantity in enumerate(found.quantities):
        for j, key in enumerate(found.keys):
            values = (found.columns[name][i, j].item() for name in SOBOL)
            cells = ["" if value != value else value for value in values]
            writer.writerow([quantity, key, *cells, found.basis[i]])


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
    numbers = np.arange(runs.start, runs.stop)
    indices = (
        dict.fromkeys(table.coordinates, numbers)
        if RUN in table.dimensions
        else dict(zip(table.dimensions, np.unravel_index(numbers, table.shape), strict=True))
    )
    for key, coordinate in table.coordinates.items():
        if isinstance(coordinate.values, list):
            yield [_text(coordinate.values[i]) for i in indices[key].tolist()]
        else:
            values = coordinate.values[indices[key]]
            # As in a file of HDF5, which has no truth values.
            yield (values.astype(np.int8) if values.dtype == np.bool_ else values).tolist()
    for values in table.values.values():
        yield ["" if value != value else value for value in values[runs.start : runs.stop].tolist()]
    words = dict(table.statuses)
    yield [words[status] for status in table.status[runs.start : runs.stop].tolist()]
    for name in TEXTS:
        yield [_text(table.texts[name].get(run, "")) for run in runs]


def _text(text: str) -> str:
    return f"'{text}" if text.startswith(FORMULA) else text
