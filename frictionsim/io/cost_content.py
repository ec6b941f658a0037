"""Reading a table of costs in HDF5, in the child process that `hdf5_reader` asks.

`hdf5_writer.write_table` documents the file.
"""

from typing import Any

import h5py

from frictionsim.io.cost_table import MAX_COLUMNS, CostTable, checked
from frictionsim.io.hdf5_structure import (
    NOT_HDF5,
    Budget,
    checked_dataset,
    checked_group,
    members,
    names_of,
    opened,
    text_of,
    texts_of,
    values_of,
)
from frictionsim.results import Column

COST, ROW = "cost", "row"


def costs(path: str) -> CostTable:
    """Return the content of a table of costs."""
    with opened(path, "table of costs", _fault) as file:
        budget = Budget(file.id.get_filesize())
        attributes = texts_of(file, budget)
        group = checked_group(dict(members(file, budget))[COST], COST)
        return checked(CostTable(attributes, _columns(group, budget)))


def _fault(error: Exception) -> str:
    if isinstance(error, OSError):
        return NOT_HDF5
    return f"it is damaged: {error}" if isinstance(error, ValueError) else "it is damaged"


def _columns(group: Any, budget: Budget) -> dict[str, Column]:
    columns: dict[str, Column] = {}
    for name, item in members(group, budget):
        if len(columns) > MAX_COLUMNS:
            raise ValueError(f"it has more than {MAX_COLUMNS} columns")
        dataset = checked_dataset(item, name)
        if name == ROW:
            continue
        words = text_of(dataset, "long_name", budget)
        if h5py.check_string_dtype(dataset.dtype) is not None:
            texts = [] if not dataset.size else list(names_of(dataset, budget))
            columns[name] = Column(name, "", words, texts)
            continue
        if dataset.ndim != 1:
            raise ValueError(f"{name} has not one number for each row")
        values = [float(value) for value in values_of(dataset, budget)]
        columns[name] = Column(name, text_of(dataset, "units", budget) or "1", words, values)
    return columns
