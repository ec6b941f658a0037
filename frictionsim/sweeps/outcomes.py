"""A sweep before and after its runs: its header, the block of some runs, and the table of all."""

from collections.abc import Iterable, Sequence
from contextlib import suppress
from typing import Any

import numpy as np

from frictionsim.io.sweep_file import ATTRIBUTES
from frictionsim.io.sweep_table import (
    AUDIT_FAILED,
    DONE,
    FAILED,
    RUN,
    TEXTS,
    Coordinate,
    RunBlock,
    SweepHeader,
    SweepTable,
    table_of,
)
from frictionsim.scenario.model_fields import description_of
from frictionsim.scenario.settings import Scenario
from frictionsim.scenario.toml_data import toml_value
from frictionsim.simulation.record import scenario_attributes
from frictionsim.simulation.simulate import RunSummary
from frictionsim.sweeps.design import GRID, Design
from frictionsim.sweeps.statistics import indices_of, sampling_of


def header_of(scenario: Scenario, design: Design, study: str) -> SweepHeader:
    """Return what a sweep is before its runs; `study` is in TOML."""
    known = scenario_attributes(scenario) | {"study": study, "design": design.kind}
    attributes = {name: known[name] for name in ATTRIBUTES if name in known}
    coordinates = {}
    for key, values in zip(design.keys, design.levels, strict=True):
        unit, words = description_of(type(scenario), key)
        dimension = key if design.kind == GRID else RUN
        coordinates[key] = Coordinate(dimension, _typed(values, unit), unit, words)
    dimensions = dict(zip(design.dimensions, design.shape, strict=True))
    return SweepHeader(attributes, dimensions, coordinates)


def _typed(values: Any, unit: str) -> Any:
    """Return values of a key as an array of numbers, or as a list of text."""
    if isinstance(values, np.ndarray):
        return values
    kinds = {type(value) for value in values}
    if kinds == {bool}:
        return np.array(values, dtype=np.bool_)
    if kinds <= {int, float}:
        with suppress(OverflowError):  # larger integers are text
            return np.array(values, dtype=np.int64 if kinds == {int} and not unit else np.float64)
    return [value if isinstance(value, str) else toml_value(value) for value in values]


def block_of(first: int, runs: Sequence[RunSummary]) -> RunBlock:
    """Return the block of consecutive runs, from the first on.

    The quantities of a failed one are those up to its end.
    """
    units: dict[str, str] = {}
    for run in runs:
        for name, quantity in run.quantities.items():
            units.setdefault(name, quantity.unit)
    rows = {name: row for row, name in enumerate(units)}
    status, values = np.empty(len(runs), dtype=np.int8), np.full((len(units), len(runs)), np.nan)
    texts: dict[str, dict[int, str]] = {name: {} for name in TEXTS}
    for number, run in enumerate(runs):
        status[number] = DONE if run.is_sound else AUDIT_FAILED
        if run.status != "done":
            status[number] = FAILED
        for name, quantity in run.quantities.items():
            if quantity.value is not None:
                values[rows[name], number] = quantity.value
        # Warnings about sampling are not of the runs of a sweep.
        warnings = "\n".join(w for w in run.warnings if not w.startswith("output.interval"))
        for name, text in zip(TEXTS, (run.failure, run.reason, warnings), strict=True):
            if text:
                texts[name][first + number] = text
    values[~np.isfinite(values)] = np.nan
    return RunBlock(first, status, units, values, texts)


def completed(header: SweepHeader, blocks: Iterable[RunBlock]) -> SweepTable:
    """Return the sweep whose runs are all done, with the Sobol indices of a sample for them."""
    outcome = {"status": "done", "reason": ""}
    table = table_of(header._replace(attributes=header.attributes | outcome), blocks)
    sampling = sampling_of(table)
    if sampling is None or not sampling.indices:
        return table
    return table._replace(sobol=indices_of(table, table.values))
