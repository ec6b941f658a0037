"""The scenario of each combination of values."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from threading import Lock
from typing import Any

from pydantic import ValidationError

from frictionsim.errors import InputError, ScenarioError
from frictionsim.scenario.model_fields import expanded, unknown_key
from frictionsim.scenario.overrides import REMOVED, REMOVED_TEXT, apply_overrides
from frictionsim.scenario.settings import Scenario
from frictionsim.scenario.toml_data import KeyPath, plain, value_text
from frictionsim.scenario.validation import ValidationFailure, validate_model

MAX_SHOWN = 60  # characters of a value in a message


class Combinations:
    """Makes the scenarios of a sweep.

    Keys are those of --set, such as `drive.force.value.1`; several separated by commas have one
    value. File names in the values are relative to a folder, by default that of the scenario.
    """

    def __init__(self, scenario: Scenario, keys: Sequence[str], folder: Path | None = None) -> None:
        self.base, self.keys = scenario, tuple(keys)
        # The position of its value in a combination, by single key.
        self._numbers = expanded({key: number for number, key in enumerate(keys)})
        for key in self._numbers:
            if key.strip() == "kind":
                fault = "vary kind: a sweep has runs of one kind; start one for each"
                raise InputError(fault, key="vary.kind")
        # Without defaults: some depend on other keys, such as output.interval on the duration.
        self._data = plain(
            scenario.model_dump(by_alias=True, exclude_none=True, exclude_unset=True)
        )
        self._folder = Path(scenario.origin.source).parent if folder is None else folder
        # For numbers: the data to change, the places of the keys in them, and those of the values.
        self._changed: dict[str, Any] = {}
        self._places: list[tuple[Any, Any, int]] = []
        self._lock = Lock()  # a worker of Dask may have several threads

    def __reduce__(self) -> tuple[Any, ...]:
        return Combinations, (self.base, self.keys, self._folder.absolute())

    def scenario(self, values: Sequence[Any]) -> Scenario:
        """Return the scenario in which the keys have these values."""
        if not all(type(value) is float for value in values):
            return self._validated(values)
        with self._lock:
            if not self._places:
                scenario = self._validated(values)
                self._find_places(values)
                return scenario
            for table, key, number in self._places:
                table[key] = values[number]
            try:
                context = {"folder": self._folder}
                return type(self.base).model_validate(self._changed, context=context)
            except (ValidationError, OverflowError):
                return self._validated(values)  # raises the error

    def _find_places(self, values: Sequence[Any]) -> None:
        self._changed = _copied(self._data)
        overrides = {key: values[number] for key, number in self._numbers.items()}
        paths = apply_overrides(self._changed, overrides)[0]
        for (*above, last), number in zip(paths, self._numbers.values(), strict=True):
            table: Any = self._changed
            for key in above:
                table = table[key]
            self._places.append((table, last, number))

    def _validated(self, values: Sequence[Any]) -> Scenario:
        overrides = {
            key: REMOVED if values[number] == REMOVED_TEXT else values[number]
            for key, number in self._numbers.items()
        }
        for key in (key for key, value in overrides.items() if value is REMOVED):
            if fault := unknown_key(type(self.base), key):
                raise InputError(f"vary: {key}: {fault}")
        data, paths = _copied(self._data), dict[KeyPath, str]()
        try:
            paths = apply_overrides(data, overrides)[0]
            return validate_model(type(self.base), data, self._folder)
        except ValidationFailure as failure:
            faults, at = failure.lines(), failure.faults[0][0]
        except ScenarioError as error:
            faults = [fault.partition(": ")[2] for fault in error.faults]
            at = tuple(faults[0].partition(": ")[0].split("."))
        values_by_key = (f"{k}={value_text(value, MAX_SHOWN)}" for k, value in overrides.items())
        raise InputError(
            f"vary: {', '.join(values_by_key)} is not valid: {'; '.join(faults)}",
            key=self._varied_key(at, paths or [tuple(key.split(".")) for key in self._numbers]),
        )

    def _varied_key(self, at: KeyPath, paths: Iterable[KeyPath]) -> str:
        """Return the key of a study, among those of some paths, that is nearest to a fault."""
        shared = [sum(path[:n] == at[:n] for n in range(1, len(path) + 1)) for path in paths]
        number = [*self._numbers.values()][shared.index(max(shared))]
        return f"vary.{self.keys[number]}" if max(shared) else "vary"


def _copied(value: Any) -> Any:
    """Return a copy of nested dicts and lists; `deepcopy` takes three times as long."""
    if isinstance(value, dict):
        return {key: _copied(inner) for key, inner in value.items()}
    return [_copied(inner) for inner in value] if isinstance(value, list) else value
