"""Reports of studies, tables of costs and sweeps: objects, or files by what is in them."""

import os
from pathlib import Path
from typing import Any

from frictionsim.api.opening import SweepFile
from frictionsim.api.studies import Study
from frictionsim.errors import InputError
from frictionsim.results import HDF5_SIGNATURE


def study_html(source: Any) -> str | None:
    """Return the HTML of the report of a study, table of costs or sweep; None if it is none.

    Parameters
    ----------
    source : object
        A Study, the dataset of a sweep, or a path.

    Raises
    ------
    InputError
        If it is damaged.
    """
    if isinstance(source, Study):
        from frictionsim.reports.cost_report import cost_page
        from frictionsim.work_precision.reading import table_of as table_of_study

        return cost_page(table_of_study(source.data), "")
    if hasattr(source, "data_vars"):
        from frictionsim.api.sweep_dataset import table_of

        return _sweep_html(SweepFile(table_of(source), None))
    return _of_file(Path(source)) if isinstance(source, (str, os.PathLike)) else None


def _of_file(path: Path) -> str | None:
    from frictionsim.io.hdf5_reader import identity_of, read_costs, read_sweep

    if _is_hdf5(path):
        identity = identity_of(path)
        if identity.is_sweep:
            return _sweep_html(SweepFile(read_sweep(path), path))
        return _costs_html(read_costs(path), path) if identity.is_table else None
    from frictionsim.io.cost_table import is_costs_in_csv, read_csv
    from frictionsim.io.replaceable import SWEEP_IN_CSV

    if is_costs_in_csv(path):
        return _costs_html(read_csv(path), path)
    if path.is_file() and path.suffix == ".csv":
        words = "neither a table of 'frictionsim cost' nor a result"
        if SWEEP_IN_CSV.recognises(path):
            words = "a sweep in CSV; give its file in HDF5"
        raise InputError(f"{path}: cannot make a report: this is {words}")
    return None


def _is_hdf5(path: Path) -> bool:
    try:
        if not path.is_file():
            return False
        with path.open("rb") as file:
            return file.read(len(HDF5_SIGNATURE)) == HDF5_SIGNATURE
    except (OSError, ValueError):
        return False


def _costs_html(table: Any, path: Path) -> str:
    from frictionsim.reports.cost_report import cost_page

    return cost_page(table, str(path))


def _sweep_html(found: SweepFile) -> str:
    import numpy as np

    from frictionsim.api.sweep_tables import sweep_parts
    from frictionsim.reports.sweep_report import sweep_page

    with np.errstate(all="ignore"):  # of a file that holds extreme numbers: they are shown
        return sweep_page(found.table, sweep_parts(found.table, found.path), str(found.path or ""))
