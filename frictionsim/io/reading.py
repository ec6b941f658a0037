"""Read a file of this program whose kind is not known: the result of a run, or a sweep."""

from pathlib import Path

from frictionsim.io.result_reader import SWEEP_VERSION, is_unfinished_sweep, opened, read
from frictionsim.io.sweep_file import read_sweep
from frictionsim.io.sweep_journal import read_unfinished
from frictionsim.io.sweep_table import SweepTable
from frictionsim.results import Record


def read_any(path: Path) -> Record | SweepTable:
    """Read a result file, the file of a sweep or an unfinished sweep.

    Raises
    ------
    InputError
        If there is none, or it is neither.
    """
    if is_unfinished_sweep(path):
        return read_unfinished(path).table
    with opened(path) as file:
        is_sweep = SWEEP_VERSION in file.attrs
    return read_sweep(path) if is_sweep else read(path)
