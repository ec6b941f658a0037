"""Read a file of this program whose kind is not known: the result of a run, or a sweep."""

from pathlib import Path

from frictionsim.io.result_reader import SWEEP_VERSION, is_unfinished_sweep, opened, record_in
from frictionsim.io.sweep_file import table_of
from frictionsim.io.sweep_journal import read_unfinished
from frictionsim.io.sweep_table import SweepTable
from frictionsim.results import Record


def read_any(path: Path) -> Record | SweepTable:
    """Read a result file, the file of a sweep or an unfinished sweep, opened once.

    Raises
    ------
    InputError
        If there is none, or it is neither.
    """
    if is_unfinished_sweep(path):
        return read_unfinished(path).table
    with opened(path) as file:
        return table_of(file, path) if SWEEP_VERSION in file.attrs else record_in(file, path)
