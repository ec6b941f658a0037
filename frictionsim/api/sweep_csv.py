"""The runs of a sweep as CSV: one line each."""

import csv
from io import StringIO
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from frictionsim.io.atomic_write import replaced_atomically
from frictionsim.io.sweep_table import RUN, STATUS, TEXTS, SweepTable

LINES_AT_ONCE = 4096


def write_csv(table: SweepTable, path: Path) -> None:
    """Write the runs of a sweep; numbers have all their digits.

    Parameters
    ----------
    table : SweepTable
    path : Path

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    names = [RUN, STATUS, *_columns(table), *TEXTS]
    with replaced_atomically(path, "table") as part, part.open("wb") as file:
        lines = iter(_lines(table))
        chunk: list[Any] = [names]
        while chunk:
            text = StringIO()
            csv.writer(text, lineterminator="\n").writerows(chunk)
            file.write(text.getvalue().encode())
            chunk = list(islice(lines, LINES_AT_ONCE))


def _columns(table: SweepTable) -> dict[str, str]:
    """Return the names of keys and quantities with their units, by name."""
    units = {key: coordinate.unit for key, coordinate in table.coordinates.items()}
    return {
        f"{name} [{unit}]" if unit not in ("", "1") else name: name
        for name, unit in (units | table.units).items()
    }


def _lines(table: SweepTable) -> Any:
    meanings = dict(table.statuses)
    shape, is_grid = table.shape, RUN not in table.dimensions
    for number in range(table.runs):
        where = np.unravel_index(number, shape) if is_grid else (number,) * len(table.coordinates)
        keys = [
            _shown(coordinate.values[index])
            for coordinate, index in zip(table.coordinates.values(), where, strict=True)
        ]
        values = [_shown(column[number]) for column in table.values.values()]
        texts = [table.texts[name].get(number, "") for name in TEXTS]
        yield [number, meanings[int(table.status[number])], *keys, *values, *texts]


def _shown(value: Any) -> Any:
    """Return a value as it is written; a number that is not defined is empty."""
    if isinstance(value, float | np.floating):
        return "" if np.isnan(value) else repr(float(value))
    return value
