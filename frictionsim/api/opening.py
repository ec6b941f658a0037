"""What a file in HDF5 holds: the result of a run, or a sweep."""

from pathlib import Path
from typing import TYPE_CHECKING

from frictionsim.api import result as results
from frictionsim.errors import InputError

if TYPE_CHECKING:
    from frictionsim.io.sweep_table import SweepTable


def result_or_sweep(path: Path) -> "results.Result | SweepTable":
    """Read a file.

    Parameters
    ----------
    path : Path

    Raises
    ------
    InputError
        If it is neither the result of a run nor a sweep.
    """
    try:
        return results.open(path)
    except InputError:
        from frictionsim.io.hdf5_reader import is_sweep, read_sweep

        if not is_sweep(path):
            raise
        return read_sweep(path)
