"""A sweep: its plan, its runs, and their table."""

from collections.abc import Collection, Mapping
from contextlib import suppress
from json import dumps
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.errors import InputError
from frictionsim.io.sweep_table import (
    MAX_QUANTITIES,
    ORDER,
    RUN,
    TEXTS,
    Coordinate,
    SweepTable,
)
from frictionsim.parameter_study.block import NOT_RUN, STATUSES, RunBlock
from frictionsim.parameter_study.design import GRID, Design
from frictionsim.parameter_study.sensitivity import sobol_indices_of
from frictionsim.scenario.model_fields import description_of
from frictionsim.scenario.settings import Scenario
from frictionsim.scenario.toml_data import json_value, toml_value
from frictionsim.simulation.combinations import MIN_TOGETHER, Combinations
from frictionsim.version import __version__

if TYPE_CHECKING:
    from frictionsim.results import Array

# Of a file; writing it takes three times the memory of its columns, and reading it, too.
MAX_VALUES = 2**26


class SweepPlan(NamedTuple):
    """The scenario, the design and the files of a sweep."""

    scenario: Scenario  # to be varied
    design: Design
    series: Path | None = None  # the folder for the result of each run

    @property
    def combinations(self) -> Combinations:
        """The factory of the scenarios of the runs."""
        return Combinations(self.scenario, self.design.keys, self.design.runs)

    @property
    def together(self) -> int:
        """The fewest runs that are faster together than one after the other; 1 if none are."""
        if self.series is None and self.design.runs >= MIN_TOGETHER:
            (first,) = self.design.combinations(0, 1)
            return MIN_TOGETHER if self.combinations.form(first) is not None else 1
        return 1


class Assembly:
    """The outcomes of a sweep, assembled from its blocks in any order.

    If they are `filed`, blocks with more quantities than a file can have are refused.
    """

    def __init__(self, count: int, filed: bool = False) -> None:
        self._most = min(MAX_QUANTITIES, max(1, MAX_VALUES // count)) if filed else None
        self.status = np.full(count, NOT_RUN, dtype=np.int8)
        self._columns: dict[str, Array] = {}
        self._units: dict[str, str] = {}
        self._first: dict[str, tuple[int, int]] = {}
        self.texts: dict[str, dict[int, str]] = {name: {} for name in TEXTS}

    def add(self, block: RunBlock) -> None:
        """Add the outcomes of some runs; raise ValueError if the sweep has no such runs.

        Raises InputError, and adds nothing, if the file of the sweep could not be read again.
        """
        runs = slice(block.first, block.first + block.runs)
        if block.first < 0 or runs.stop > len(self.status):
            raise ValueError("runs that the sweep does not have")
        self._check_quantities(block.units.keys() | self._columns)
        self.status[runs] = block.status
        for position, (name, unit) in enumerate(block.units.items()):
            if name not in self._columns:
                self._columns[name] = np.full(len(self.status), np.nan)
            place = (block.first, position)
            if place < self._first.get(name, (len(self.status), 0)):
                self._first[name], self._units[name] = place, unit
            self._columns[name][runs] = block.values[position]
        for name, texts in block.texts.items():
            self.texts[name].update(texts)

    def _check_quantities(self, names: Collection[str]) -> None:
        if self._most is not None and len(names) > self._most:
            raise InputError(
                f"a file of {len(self.status)} runs can have {self._most} quantities, and this"
                " sweep has more; vary fewer values, split it, or run it without a file"
            )

    def restore(self, table: SweepTable) -> None:
        """Add the content of the file of an interrupted sweep; raise errors as `add`."""
        if len(table.status) != len(self.status):
            raise ValueError("another number of runs")
        self._check_quantities(table.values)
        places = json_value(table.attributes.get(ORDER, "{}"))
        for name, values in table.values.items():
            first, position = places[name]
            self._first[name] = int(first), int(position)
            self._units[name], self._columns[name] = table.units[name], values
        self.status[:] = table.status
        for name, texts in table.texts.items():
            self.texts[name].update(texts)

    @property
    def runs_done(self) -> int:
        """The number of runs that have an outcome."""
        return int(np.count_nonzero(self.status != NOT_RUN))

    @property
    def remaining(self) -> list[range]:
        """The runs that have no outcome yet."""
        missing = np.flatnonzero(self.status == NOT_RUN)
        parts = np.split(missing, np.flatnonzero(np.diff(missing) > 1) + 1)
        return [range(int(part[0]), int(part[-1]) + 1) for part in parts if part.size]

    def table(
        self,
        plan: SweepPlan,
        study: str,
        reason: str = "",
        attributes: Mapping[str, str] | None = None,
    ) -> SweepTable:
        """Return the table of the sweep; `study` is TOML, `reason` that of an interruption.

        The attributes are those of a resumed file, whose scenario may differ from that of the
        study file.
        """
        unfinished = bool((self.status == NOT_RUN).any())
        root = dict(attributes or attributes_of(plan, study))
        root.pop(ORDER, None)
        root["status"] = "interrupted" if unfinished else "done"
        root["reason"] = reason if unfinished else ""
        if unfinished:
            root[ORDER] = dumps(self._first)  # for `restore`
        # In the order of the runs, whatever the order of the blocks.
        names = sorted(self._columns, key=lambda name: self._first[name])
        table = SweepTable(
            attributes=root,
            dimensions=dict(zip(plan.design.dimensions, plan.design.shape, strict=True)),
            coordinates=coordinates_of(plan),
            units={name: self._units[name] for name in names},
            values={name: self._columns[name] for name in names},
            status=self.status,
            statuses=STATUSES,
            texts={name: dict(sorted(texts.items())) for name, texts in self.texts.items()},
        )
        return table if unfinished else table._replace(sobol=sobol_indices_of(table))


def attributes_of(plan: SweepPlan, study: str) -> dict[str, str]:
    """Return the attributes of the file of a sweep, without its status."""
    scenario = plan.scenario
    return {
        "frictionsim_version": __version__,
        "study": study,
        "scenario": scenario.to_toml(),
        "source": Path(scenario.origin.source).name,
        "overrides": "\n".join(scenario.origin.overrides),
        "kind": scenario.kind,
        "title": scenario.title,
        "design": plan.design.kind,
    }


def coordinates_of(plan: SweepPlan) -> dict[str, Coordinate]:
    """Return the values of the varied keys, with their units."""
    design = plan.design
    coordinates = {}
    for key, values in zip(design.keys, design.levels, strict=True):
        unit, words = description_of(type(plan.scenario), key)
        dimension = key if design.kind == GRID else RUN
        coordinates[key] = Coordinate(dimension, typed_values(values, unit), unit, words)
    return coordinates


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
