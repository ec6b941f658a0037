"""What the page of a sweep holds of its runs, bounded, with extremes and failures."""

from math import ceil, log
from typing import Any, NamedTuple

import numpy as np

from frictionsim.io.sweep_table import RUN, Coordinate, SweepTable
from frictionsim.parameter_study.block import AUDIT_FAILED, DONE, FAILED
from frictionsim.parameter_study.design import SAMPLE
from frictionsim.parameter_study.sensitivity import Indices, indices_of
from frictionsim.parameter_study.statistics import (
    extremes,
    independent_runs,
    is_defined,
    sample_statistics,
    sound_values,
    variation,
)

MAX_VALUES = 200_000  # of all keys and quantities together: two megabytes of a page
MAX_KEYS, MAX_QUANTITIES = 30, 60
MAX_FAILED = 200  # runs that are kept beside those of a thinned sweep
MAX_TEXTS, MAX_TEXT = 2000, 300  # reasons and warnings, and their characters
MAX_WITH_INDICES = 6  # quantities
MAX_BINS = 50  # of a histogram; twice the cube root of the runs (Rice) if that is less
FLAT = 1e-6  # a quantity that varies relatively less has one bin
MIN_LOG_RATIO = 10.0  # of last to first value on a logarithmic axis


class Kept(NamedTuple):
    """What of a sweep is in its page.

    Attributes
    ----------
    runs : (n,) of int
        Numbers of runs, in ascending order.
    keys, quantities : list of str
    """

    runs: Any
    keys: list[str]
    quantities: list[str]


def kept_of(table: SweepTable) -> Kept:
    """Return what of a sweep is in its page: all of it, if there is not too much."""
    keys, quantities = list(table.coordinates)[:MAX_KEYS], list(table.values)[:MAX_QUANTITIES]
    limit = MAX_VALUES // (len(keys) + len(quantities) + 1)
    if table.runs <= limit:
        return Kept(np.arange(table.runs), keys, quantities)
    shape = (table.runs,) if RUN in table.dimensions else table.shape
    found = extremes(table)
    special = [
        *(run for name in quantities if name in found for run in found[name][2::2]),
        *np.flatnonzero(np.isin(table.status, (FAILED, AUDIT_FAILED)))[:MAX_FAILED].tolist(),
    ]
    runs = np.union1d(_regular(shape, limit), np.array(special, dtype=np.int64))
    return Kept(runs, keys, quantities)


def _regular(shape: tuple[int, ...], limit: int) -> Any:
    """Return the numbers of runs at regular places of a grid, its edges included."""
    sizes = list(shape)
    while np.prod(sizes, dtype=np.float64) > limit:
        longest = int(np.argmax(sizes))
        sizes[longest] = max(1, int(0.9 * sizes[longest]))
    places = [
        np.unique(np.linspace(0, n - 1, size).round().astype(np.int64))
        for n, size in zip(shape, sizes, strict=True)
    ]
    return np.ravel_multi_index(np.meshgrid(*places, indexing="ij"), shape).reshape(-1)


def data_of(table: SweepTable, kept: Kept, indices: dict[str, Indices]) -> dict[str, Any]:
    """Return the data of a sweep for the scripts of its page.

    No object in it has names of a file for its keys: the scripts know arrays by a key.

    Raises
    ------
    InputError
        If the study in its file is not valid.
    """
    runs = kept.runs
    sample = _sample(table, kept) if table.attributes["design"] == SAMPLE else {}
    return {
        "design": table.attributes["design"],
        "all": table.runs,
        "runs": runs.astype(np.int32),
        "status": table.status[runs].astype(np.int32),
        "statuses": {str(n): word.replace("_", " ") for n, word in table.statuses},
        "keys": [_key(table, key, runs) for key in kept.keys],
        "quantities": [
            {
                "name": name,
                "unit": table.units[name],
                "values": table.values[name][runs],
                "log": _is_log(sound_values(table, name)),
                "varies": is_defined(table, name) and not _is_flat(sound_values(table, name)),
                "sample": sample.get(name),
                "indices": indices[name]._asdict() if name in indices else None,
            }
            for name in kept.quantities
        ],
        "reasons": _texts(table, ("failure", "reason"), runs),
        "warnings": _texts(table, ("warnings",), runs),
        "of_sample": table.attributes["design"] == SAMPLE,
    }


def _key(table: SweepTable, key: str, runs: Any) -> dict[str, Any]:
    """Return a key: its values, and which of them each run has."""
    coordinate = table.coordinates[key]
    if RUN in table.dimensions:
        places = runs
    else:
        axis = list(table.dimensions).index(key)
        places = np.unravel_index(runs, table.shape)[axis]
    values = _plain_values(coordinate)
    distinct, codes = np.unique(places, return_inverse=True)
    if isinstance(values, list):
        texts = [values[place] for place in distinct]
        named = list(dict.fromkeys(texts))
        number = {text: i for i, text in enumerate(named)}
        codes = np.array([number[text] for text in texts])[codes]
        shown: Any = [text[:MAX_TEXT] for text in named]
    else:
        shown, again = np.unique(values[distinct], return_inverse=True)
        codes = again[codes]
    return {
        "name": key,
        "unit": coordinate.unit,
        "values": shown,
        "codes": codes.astype(np.int32),
        "numeric": not isinstance(values, list),
        "log": not isinstance(values, list) and _is_log(np.asarray(values)),
    }


def _plain_values(coordinate: Coordinate) -> Any:
    """Return the values of a key: an array of numbers, or texts; true and false are texts."""
    values = coordinate.values
    if isinstance(values, list):
        return values
    if values.dtype in (np.bool_, np.int8):
        return ["true" if value else "false" for value in values.tolist()]
    return np.asarray(values, dtype=np.float64)


def _is_log(values: Any) -> bool:
    """Return whether positive numbers fill the scale of their logarithms better than their own."""
    found = np.sort(values[np.isfinite(values)])
    if found.size < 3 or found[0] <= 0.0 or found[-1] < MIN_LOG_RATIO * found[0]:
        return False
    middle = found[found.size // 2]
    place = (middle - found[0]) / (found[-1] - found[0])
    in_log = log(middle / found[0]) / log(found[-1] / found[0])
    return bool(abs(in_log - 0.5) < abs(place - 0.5))


def _is_flat(values: Any) -> bool:
    found = values[np.isfinite(values)]
    return not found.size or bool(np.ptp(found) <= FLAT * np.abs(found).max())


def _texts(table: SweepTable, names: tuple[str, ...], runs: Any) -> dict[str, str]:
    """Return texts by the place of their run among those that are kept."""
    found: dict[str, str] = {}
    for place, run in enumerate(runs.tolist()):
        parts = [table.texts[name][run] for name in names if run in table.texts[name]]
        if parts and len(found) < MAX_TEXTS:
            found[str(place)] = ": ".join(parts)[:MAX_TEXT]
    return found


def _sample(table: SweepTable, kept: Kept) -> dict[str, Any]:
    """Return what is known of a sample: of each quantity bins, statistics and Sobol indices."""
    runs = independent_runs(table, variation(table)[1])
    statistics = sample_statistics(table)
    return {
        name: {
            **_bins(sound_values(table, name)[runs]),
            **{n: v for n, v in statistics[name]._asdict().items() if n != "runs"},
            "defined": statistics[name].runs,
        }
        for name in kept.quantities
        if is_defined(table, name)
    }


def _bins(values: Any) -> dict[str, Any]:
    found = values[np.isfinite(values)]
    if _is_flat(found):
        half = 0.1 * float(np.abs(found).max()) or 1.0
        edges = np.array([found.min() - half, found.max() + half])
    else:
        count = min(MAX_BINS, ceil(2.0 * found.size ** (1.0 / 3.0)))
        # Halves: the range of extreme numbers may be infinite.
        edges = 2.0 * np.linspace(0.5 * found.min(), 0.5 * found.max(), count + 1)
    return {"edges": edges, "counts": np.histogram(found, edges)[0].astype(np.int32)}


def indices_of_sample(table: SweepTable, kept: Kept) -> dict[str, Indices]:
    """Return the Sobol indices of the first quantities that vary, of a sample of several keys."""
    if table.attributes["design"] != SAMPLE or len(table.coordinates) < 2:
        return {}
    varying = [
        name
        for name in kept.quantities
        if is_defined(table, name) and not _is_flat(sound_values(table, name))
    ]
    return indices_of(table, varying[:MAX_WITH_INDICES])


def rows_to_show(table: SweepTable, kept: Kept, limit: int) -> Any:
    """Return the places among the kept runs that are in a table of so many rows."""
    count = kept.runs.size
    if count <= limit:
        return np.arange(count)
    found = extremes(table)
    wanted = [run for name in kept.quantities if name in found for run in found[name][2::2]]
    special = np.flatnonzero(np.isin(kept.runs, wanted))
    failed = np.flatnonzero(table.status[kept.runs] != DONE)[: limit // 4]
    even = np.linspace(0, count - 1, max(2, limit - special.size - failed.size)).astype(np.int64)
    return np.unique(np.concatenate((special, failed, even)))
