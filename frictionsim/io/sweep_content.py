"""Reading the file of a sweep."""

from collections.abc import Iterator
from math import prod
from typing import Any

import numpy as np

from frictionsim.io.hdf5_structure import CheckedFile, check_version, holds_text, opened
from frictionsim.io.result_format import MAX_TEXT
from frictionsim.io.sweep_table import (
    ORDER,
    RUN,
    SOBOL,
    SOBOL_BASIS,
    SOBOL_KEY,
    SOBOL_QUANTITY,
    STATUS,
    TEXTS,
    VERSION,
    VERSION_NAME,
    Coordinate,
    SobolIndices,
    SweepTable,
)

ATTRIBUTES = (
    *("frictionsim_version", "study", "scenario", "source", "overrides"),
    *("kind", "title", "design", "status", "reason"),
)
TEXTS_AT_ONCE = 4096


def sweep(path: str) -> SweepTable:
    """Return the content of the file of a sweep."""
    with opened(path, "sweep", lambda error: "it is damaged") as file:
        check_version(file, path, "sweep", VERSION_NAME, (VERSION,))
        texts = file.texts_of(file.root)
        attributes = {name: texts[name] for name in ATTRIBUTES}
        attributes |= {ORDER: texts[ORDER]} if ORDER in texts else {}
        return _table(file, attributes, dict(file.datasets(file.root)))


def _table(file: CheckedFile, attributes: dict[str, str], datasets: dict[str, Any]) -> SweepTable:
    status = datasets.pop(STATUS)
    statuses = file.flags_of(status)
    texts = {name: _some_texts(file, datasets.pop(name), status.shape) for name in TEXTS}
    coordinates, dimensions = _coordinates(file, datasets, status)
    sobol = _indices(file, datasets, list(coordinates)) if SOBOL_BASIS in datasets else None
    values, units = {}, {}
    for name, dataset in datasets.items():
        if name == RUN or name in coordinates:
            continue
        if dataset.shape != status.shape:
            raise ValueError(f"{name} is not of the shape of the sweep")
        values[name] = np.asarray(file.values_of(dataset), dtype=np.float64).reshape(-1)
        units[name] = file.text_of(dataset, "units")
    outcome = file.values_of(status).astype(np.int8).reshape(-1)
    if not np.isin(outcome, [number for number, _ in statuses]).all():
        raise ValueError("a run has a status that there is not")
    if sobol is not None and sobol.quantities != list(values):
        raise ValueError("its Sobol indices are of other quantities")
    return SweepTable(
        attributes, dimensions, coordinates, units, values, outcome, statuses, texts, sobol
    )


def _indices(file: CheckedFile, datasets: dict[str, Any], keys: list[str]) -> SobolIndices:
    """Return the Sobol indices; remove their datasets from `datasets`."""
    names, stored_keys, basis = (
        list(_texts(file, datasets.pop(name))) for name in (SOBOL_QUANTITY, SOBOL_KEY, SOBOL_BASIS)
    )
    columns = {
        name: np.asarray(file.values_of(datasets.pop(name)), dtype=np.float64) for name in SOBOL
    }
    shape = (len(names), len(keys))
    if (
        stored_keys != keys
        or len(basis) != len(names)
        or any(c.shape != shape for c in columns.values())
    ):
        raise ValueError("its Sobol indices are not those of its keys")
    return SobolIndices(names, keys, basis, columns)


def _coordinates(
    file: CheckedFile, datasets: dict[str, Any], status: Any
) -> tuple[dict[str, Coordinate], dict[str, int]]:
    """Return the varied keys, and the lengths of the dimensions by name."""
    if RUN in datasets:
        names = file.text_of(status, "coordinates").split()
        dimensions = {RUN: int(datasets[RUN].shape[0])}
    else:
        names = [str(next(iter(dimension.keys()))) for dimension in status.dims]
        dimensions = {key: int(datasets[key].shape[0]) for key in names}
    if status.shape != tuple(dimensions.values()) or prod(status.shape) < 1:
        raise ValueError("the sweep has another shape")
    coordinates = {}
    for key in names:
        dataset = datasets[key]
        dimension = key if RUN not in datasets else RUN
        if dataset.shape != (dimensions[dimension],):
            raise ValueError(f"{key} does not have a value for each run")
        words = file.text_of(dataset, "long_name")
        if holds_text(dataset):
            coordinates[key] = Coordinate(dimension, list(_texts(file, dataset)), "", words)
        else:
            unit = file.text_of(dataset, "units")
            values = file.values_of(dataset)
            if not np.isfinite(values).all():
                raise ValueError(f"{key} has a value that is not finite")
            coordinates[key] = Coordinate(dimension, values, unit, words)
    return coordinates, dimensions


def _some_texts(file: CheckedFile, dataset: Any, shape: tuple[int, ...]) -> dict[int, str]:
    """Return the nonempty texts of a dataset by the number of the run."""
    if dataset.shape != shape:
        raise ValueError(f"{dataset.name} is not of the shape of the sweep")
    return {number: text for number, text in enumerate(_texts(file, dataset)) if text}


def _texts(file: CheckedFile, dataset: Any) -> Iterator[str]:
    """Yield the texts of a dataset in the order of the runs."""
    if not holds_text(dataset):
        raise ValueError(f"{dataset.name} does not hold text")
    name = str(dataset.name)  # once, as it takes as long as reading a text
    file.claim(dataset.nbytes, name)
    inner = prod(dataset.shape[1:])
    rows = max(1, TEXTS_AT_ONCE // inner)
    for start in range(0, dataset.shape[0], rows):
        # Texts of any length may be in a file many times: their bytes are claimed as they are read.
        texts = dataset.asstr(errors="replace")[start : start + rows].reshape(-1).tolist()
        lengths = list(map(len, texts))
        file.claim(sum(lengths), name)
        if max(lengths, default=0) > MAX_TEXT:
            raise ValueError(f"{name}: a text is too long")
        yield from texts
