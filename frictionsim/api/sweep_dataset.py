"""The table of a sweep from its dataset."""

from typing import Any

import numpy as np

from frictionsim.errors import InputError
from frictionsim.io.sweep_table import (
    NAMES_OF_SOBOL,
    RUN,
    STATUS,
    TEXTS,
    Coordinate,
    SweepTable,
)

ATTRIBUTES = ("study", "scenario", "source", "kind", "title", "design", "status", "reason")


def table_of(dataset: Any) -> SweepTable:
    """Return the table of a dataset of `sweep` or `open_sweep`, or of a part of one.

    Parameters
    ----------
    dataset : xarray.Dataset
        Keys of a grid to which one value was given (`sel`, `isel`) are no longer varied.

    Raises
    ------
    InputError
        If it is no dataset of a sweep.
    """
    attributes = {str(name): str(text) for name, text in dataset.attrs.items()}
    missing = [name for name in ATTRIBUTES if name not in attributes]
    missing += [name for name in (STATUS, *TEXTS) if name not in dataset.data_vars]
    if missing:
        raise InputError(
            "expected a dataset as fs.sweep and fs.open_sweep return it; this one has no"
            f" '{missing[0]}', which a reduction as mean() leaves out"
        )
    status = dataset[STATUS]
    dimensions = {
        str(name): int(size) for name, size in zip(status.dims, status.shape, strict=True)
    }
    if not dimensions or status.size == 0:
        raise InputError("expected a dataset of several runs, got one run or none of a sweep")
    coordinates = {
        str(key): _coordinate(str(key), values)
        for key, values in dataset.coords.items()
        if key not in (RUN, *NAMES_OF_SOBOL) and values.ndim == 1
    }
    others = {STATUS, *TEXTS, *NAMES_OF_SOBOL}
    names = [str(n) for n in dataset.data_vars if n not in others]
    for name in (*names, *TEXTS):
        if dataset[name].dims != status.dims:
            raise InputError(f"'{name}' of this dataset does not have a value for each run")
    flags = zip(status.attrs["flag_values"], status.attrs["flag_meanings"].split(), strict=True)
    texts = {name: dataset[name].values.reshape(-1).tolist() for name in TEXTS}
    return SweepTable(
        attributes=attributes,
        dimensions=dimensions,
        coordinates=coordinates,
        units={name: str(dataset[name].attrs.get("units", "1")) for name in names},
        values={n: np.asarray(dataset[n].values, dtype=np.float64).reshape(-1) for n in names},
        status=np.asarray(status.values, dtype=np.int8).reshape(-1),
        statuses=tuple((int(number), word) for number, word in flags),
        texts={name: {i: t for i, t in enumerate(found) if t} for name, found in texts.items()},
    )


def _coordinate(key: str, found: Any) -> Coordinate:
    values, words = found.values, str(found.attrs.get("long_name", key))
    dimension = str(found.dims[0])
    if values.dtype.kind in "OUST":
        return Coordinate(dimension, [str(value) for value in values], "", words)
    return Coordinate(dimension, values, str(found.attrs.get("units", "1")), words)
