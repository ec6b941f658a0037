"""A sweep before and after its runs: its plan, the outcome of a run, and the table of all."""

from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from frictionsim.io.sweep_journal import planned_table
from frictionsim.io.sweep_table import NOT_RUN, RUN, TEXTS, Coordinate, RunBlock, SweepTable
from frictionsim.results import Quantities
from frictionsim.scenario.model_fields import description_of
from frictionsim.scenario.settings import Scenario
from frictionsim.scenario.toml_data import toml_value
from frictionsim.sweeps.design import GRID, Design
from frictionsim.sweeps.sensitivity import sobol_indices_of
from frictionsim.version import __version__


class SweepPlan(NamedTuple):
    """The scenario, the design and the files of a sweep."""

    scenario: Scenario  # to be varied
    design: Design
    series: Path | None = None  # the folder for the result of each run

    def table(self, study: str) -> SweepTable:
        """Return the sweep before its runs; `study` is in TOML."""
        design, scenario = self.design, self.scenario
        attributes = {
            "frictionsim_version": __version__,
            "study": study,
            "scenario": scenario.to_toml(),
            "source": Path(scenario.origin.source).name,
            "overrides": "\n".join(scenario.origin.overrides),
            "kind": scenario.kind,
            "title": scenario.title,
            "design": design.kind,
        }
        coordinates = {}
        for key, values in zip(design.keys, design.levels, strict=True):
            unit, words = description_of(type(scenario), key)
            dimension = key if design.kind == GRID else RUN
            coordinates[key] = Coordinate(dimension, typed_values(values, unit), unit, words)
        dimensions = dict(zip(design.dimensions, design.shape, strict=True))
        return planned_table(attributes, dimensions, coordinates)


def typed_values(values: Any, unit: str) -> Any:
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


class RunOutcome(NamedTuple):
    """The outcome of a run; the quantities of a failed one are those up to its end."""

    status: int  # DONE, FAILED or AUDIT_FAILED
    quantities: Quantities
    failure: str = ""  # as in a result file, and the reason; empty if done
    reason: str = ""
    warnings: str = ""  # one per line


def block_of(first: int, outcomes: Iterable[RunOutcome]) -> RunBlock:
    """Return the block of the outcomes of consecutive runs, from the first on."""
    outcomes = list(outcomes)
    units: dict[str, str] = {}
    for outcome in outcomes:
        for name, quantity in outcome.quantities.items():
            units.setdefault(name, quantity.unit)
    rows = {name: row for row, name in enumerate(units)}
    values = np.full((len(units), len(outcomes)), np.nan)
    texts: dict[str, dict[int, str]] = {name: {} for name in TEXTS}
    for number, outcome in enumerate(outcomes):
        for name, quantity in outcome.quantities.items():
            if quantity.value is not None:
                values[rows[name], number] = quantity.value
        for name in TEXTS:
            if text := getattr(outcome, name):
                texts[name][first + number] = text
    values[~np.isfinite(values)] = np.nan
    status = np.array([outcome.status for outcome in outcomes], dtype=np.int8)
    return RunBlock(first, status, units, values, texts)


def remaining_runs(table: SweepTable) -> list[range]:
    """Return the runs that have no outcome yet, in ascending order."""
    missing = np.flatnonzero(table.status == NOT_RUN)
    parts = np.split(missing, np.flatnonzero(np.diff(missing) > 1) + 1)
    return [range(int(part[0]), int(part[-1]) + 1) for part in parts if part.size]


def completed(table: SweepTable) -> SweepTable:
    """Return a sweep whose runs are all done with its status, and with indices of a sample."""
    done = table._replace(attributes=table.attributes | {"status": "done", "reason": ""})
    return done._replace(sobol=sobol_indices_of(done))
