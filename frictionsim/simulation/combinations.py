"""The scenario of each combination of values."""

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

from frictionsim.errors import InputError, ScenarioError
from frictionsim.scenario.model_fields import expanded, unknown_key
from frictionsim.scenario.overrides import REMOVED, REMOVED_TEXT, apply_overrides
from frictionsim.scenario.settings import Scenario
from frictionsim.scenario.toml_data import KeyPath, tables_of, value_text
from frictionsim.scenario.validation import ValidationFailure, validate_model


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
        self._data = tables_of(scenario)
        self._folder = Path(scenario.origin.source).parent if folder is None else folder

    def __reduce__(self) -> tuple[Any, ...]:
        return Combinations, (self.base, self.keys, self._folder.absolute())

    def scenario(self, values: Sequence[Any]) -> Scenario:
        """Return the scenario in which the keys have these values."""
        overrides = {
            key: REMOVED if values[number] == REMOVED_TEXT else values[number]
            for key, number in self._numbers.items()
        }
        for key in (key for key, value in overrides.items() if value is REMOVED):
            if fault := unknown_key(type(self.base), key):
                raise InputError(f"vary: {key}: {fault}")
        # A copy: a worker of Dask may have several threads.
        data, paths = _copied(self._data), dict[KeyPath, str]()
        try:
            paths = apply_overrides(data, overrides)[0]
            return validate_model(type(self.base), data, self._folder)
        except ValidationFailure as failure:
            faults, at = failure.lines(), failure.faults[0][0]
        except ScenarioError as error:
            faults = [fault.partition(": ")[2] for fault in error.faults]
            at = tuple(faults[0].partition(": ")[0].split("."))
        values_by_key = (f"{k}={value_text(value)}" for k, value in overrides.items())
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
