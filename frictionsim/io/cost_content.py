"""Reading a table of costs in HDF5.

`hdf5_writer.write_table` documents the file.
"""

from typing import Any

from frictionsim.io.cost_table import MAX_COLUMNS, CostTable, checked
from frictionsim.io.hdf5_structure import NOT_HDF5, CheckedFile, checked_group, holds_text, opened
from frictionsim.results import Column

COST, ROW = "cost", "row"


def costs(path: str) -> CostTable:
    """Return the content of a table of costs."""
    with opened(path, "table of costs", _fault) as file:
        attributes = file.texts_of(file.root)
        group = checked_group(dict(file.members(file.root))[COST], COST)
        return checked(CostTable(attributes, _columns(file, group)))


def _fault(error: Exception) -> str:
    if isinstance(error, OSError):
        return NOT_HDF5
    return f"it is damaged: {error}" if isinstance(error, ValueError) else "it is damaged"


def _columns(file: CheckedFile, group: Any) -> dict[str, Column]:
    columns: dict[str, Column] = {}
    for name, dataset in file.datasets(group):
        if len(columns) > MAX_COLUMNS:
            raise ValueError(f"it has more than {MAX_COLUMNS} columns")
        if name == ROW:
            continue
        words = file.text_of(dataset, "long_name")
        if holds_text(dataset):
            texts = [] if not dataset.size else list(file.names_of(dataset))
            columns[name] = Column(name, "", words, texts)
            continue
        if dataset.ndim != 1:
            raise ValueError(f"{name} has not one number for each row")
        values = [float(value) for value in file.values_of(dataset)]
        columns[name] = Column(name, file.text_of(dataset, "units") or "1", words, values)
    return columns
