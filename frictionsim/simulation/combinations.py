"""The scenario of each combination of values."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from itertools import chain
from pathlib import Path
from threading import Lock
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from pydantic import ValidationError

from frictionsim.errors import InputError, ScenarioError
from frictionsim.scenario.model_fields import expanded
from frictionsim.scenario.model_validation import (
    MAX_NUMBER,
    MIN_NUMBER,
    ValidationFailure,
    validate_model,
)
from frictionsim.scenario.overrides import REMOVED, REMOVED_TEXT, apply_overrides
from frictionsim.scenario.settings import Scenario
from frictionsim.scenario.toml_data import KeyPath, plain, toml_value

if TYPE_CHECKING:
    from frictionsim.simulation.many_runs import RunForm

GroupResult = TypeVar("GroupResult")

MIN_TOGETHER = 50  # fewer runs are faster alone
# Runs of a sweep from which loading compiled code, or compiling it, saves time over Python.
RUNS_THAT_PAY, RUNS_THAT_PAY_COMPILING = 200, 3000
MAX_SHOWN = 60  # characters of a value in a message


class Combinations:
    """Makes the scenarios of a sweep; `runs` is their number.

    Keys are those of --set, such as `drive.force.value.1`; several separated by commas have one
    value.
    """

    def __init__(self, scenario: Scenario, keys: Sequence[str], runs: int = 1) -> None:
        self.base, self.keys, self._runs = scenario, tuple(keys), runs
        # The position of its value in a combination, by single key.
        self._numbers = expanded({key: number for number, key in enumerate(keys)})
        for key in self._numbers:
            if key.strip() == "kind":
                raise InputError("vary kind: a sweep has runs of one kind; start one for each")
        # Without defaults: some depend on other keys, such as output.interval on the duration.
        self._data = plain(
            scenario.model_dump(by_alias=True, exclude_none=True, exclude_unset=True)
        )
        self._folder = Path(scenario.origin.source).parent
        # For numbers: the data to change, the places of the keys in them, and those of the values.
        self._changed: dict[str, Any] = {}
        self._places: list[tuple[Any, Any, int]] = []
        self._paths: dict[KeyPath, int] = {}
        self._lock = Lock()  # a worker of Dask may have several threads

    def __reduce__(self) -> tuple[Any, ...]:
        return Combinations, (self.base, self.keys, self._runs)

    def form(self, values: Sequence[Any]) -> "RunForm | None":
        """Return the form of the runs that can run together with one; None if it must run alone."""
        if self._runs < RUNS_THAT_PAY:
            return None
        try:
            scenario = self.scenario(values)
        except InputError:
            return None
        # A run warns of requested channels that it lacks, and runs together have no channels.
        if scenario.needs_samples or scenario.output.channels is not None:
            return None
        from frictionsim.simulation.many_runs import form_of_runs

        form = form_of_runs(scenario)
        if form is None:
            return None
        pays = self._runs >= RUNS_THAT_PAY_COMPILING or form.kernel.is_at_hand
        return form if pays else None

    def check(self, values: Sequence[Sequence[Any]]) -> None:
        """Check combinations; raise InputError for the first that is not valid."""
        valid = np.zeros(len(values), dtype=bool)
        for runs, _ in self.groups(values, lambda *_: None):
            valid[runs] = True
        for number in np.flatnonzero(~valid).tolist():
            self.scenario(values[number])

    def groups(
        self,
        values: Sequence[Sequence[Any]],
        function: "Callable[[RunForm, Scenario], GroupResult]",
        fewest: int | None = None,
    ) -> Iterator[tuple[Any, GroupResult]]:
        """Yield groups of combinations, by their indices, with the result of a function of each.

        The function takes the form of the runs and a valid scenario with the numbers of all of
        them; see `group_runs`. Combinations that must be checked, or run, alone are omitted, and
        groups of less than the fewest, by default MIN_TOGETHER.
        """
        fewest = MIN_TOGETHER if fewest is None else fewest
        numbers = _numbers(values) if len(values) >= fewest else None
        if numbers is None:
            return
        runs = np.flatnonzero(_is_ordinary(numbers).all(axis=1))
        if len(runs) < fewest:
            return
        first = numbers[runs[0]].tolist()
        form = self.form(first)
        if form is None:
            return
        from frictionsim.scenario.run_numbers import as_run_numbers, group_runs, with_numbers

        template = self.scenario(first)

        def evaluate(chosen: Any) -> GroupResult:
            arrays = {path: as_run_numbers(numbers[chosen, i]) for path, i in self._paths.items()}
            return function(form, with_numbers(template, arrays))

        yield from group_runs(evaluate, runs, fewest)

    def scenario(self, values: Sequence[Any]) -> Scenario:
        """Return the scenario in which the keys have these values."""
        if not all(type(value) is float and _is_ordinary(value) for value in values):
            return self._validated(values)
        with self._lock:
            if not self._places:
                scenario = self._validated(values)
                self._find_places(values)
                return scenario
            for table, key, number in self._places:
                table[key] = values[number]
            try:
                # The limits of magnitude of all other numbers were checked the first time.
                context = {"folder": self._folder}
                return type(self.base).model_validate(self._changed, context=context)
            except (ValidationError, OverflowError):
                return self._validated(values)  # raises the error

    def _find_places(self, values: Sequence[Any]) -> None:
        self._changed = _copied(self._data)
        overrides = {key: values[number] for key, number in self._numbers.items()}
        paths = apply_overrides(self._changed, overrides)[0]
        self._paths = dict(zip(paths, self._numbers.values(), strict=True))
        for (*above, last), number in self._paths.items():
            table: Any = self._changed
            for key in above:
                table = table[key]
            self._places.append((table, last, number))

    def _validated(self, values: Sequence[Any]) -> Scenario:
        overrides = {
            key: REMOVED if values[number] == REMOVED_TEXT else values[number]
            for key, number in self._numbers.items()
        }
        data = _copied(self._data)
        try:
            apply_overrides(data, overrides)
            return validate_model(type(self.base), data, self._folder)
        except ValidationFailure as failure:
            faults = failure.lines()
        except ScenarioError as error:
            faults = [fault.partition(": ")[2] for fault in error.faults]
        raise InputError(f"vary: {combination_text(overrides)} is not valid: {'; '.join(faults)}")


def _is_ordinary(value: Any) -> Any:
    """Return whether numbers are within the limits of magnitude."""
    return (value == 0.0) | ((abs(value) >= MIN_NUMBER) & (abs(value) <= MAX_NUMBER))


def _numbers(values: Sequence[Sequence[Any]]) -> Any:
    """Return combinations as an array, (runs, keys); None if not all values are numbers."""
    if not set(map(type, chain.from_iterable(values))) <= {float, int}:
        return None
    with suppress(OverflowError):
        return np.array(values, dtype=float)
    return None


def combination_text(values: dict[str, Any]) -> str:
    """Return a combination of values for a message."""
    parts = []
    for key, value in values.items():
        text = REMOVED_TEXT if value is REMOVED else toml_value(value)
        parts.append(f"{key}={text if len(text) <= MAX_SHOWN else text[:MAX_SHOWN] + '...'}")
    return ", ".join(parts)


def _copied(value: Any) -> Any:
    """Return a copy of nested dicts and lists; `deepcopy` takes three times as long."""
    if isinstance(value, dict):
        return {key: _copied(inner) for key, inner in value.items()}
    if isinstance(value, list):
        return [_copied(inner) if isinstance(inner, list | dict) else inner for inner in value]
    return value
