"""Read a file of this program whose kind is not known: the result of a run, or a sweep."""

from pathlib import Path
from typing import TYPE_CHECKING

from frictionsim.io.result_reader import SWEEP_VERSION, is_unfinished_sweep, opened, record_in

if TYPE_CHECKING:
    from frictionsim.io.sweep_table import SweepTable
    from frictionsim.results import Record


def read_any(path: Path) -> "Record | SweepTable":
    """Read a result file, the file of a sweep or an unfinished sweep.

    Raises
    ------
    InputError
        If there is none, or it is neither.
    """
    if is_unfinished_sweep(path):
        from frictionsim.io.sweep_journal import read_unfinished

        return read_unfinished(path).table
    with opened(path) as file:
        if SWEEP_VERSION not in file.attrs:
            return record_in(file, path)
        from frictionsim.io.sweep_file import sweep_in

        return sweep_in(file, path)
