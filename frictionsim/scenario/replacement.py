"""Many scenarios that differ from one in the numbers of a few keys."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from pydantic import ValidationError

from frictionsim.scenario.model_validation import MAX_NUMBER, MIN_NUMBER
from frictionsim.scenario.overrides import apply_overrides, override_text, plain
from frictionsim.scenario.settings import Origin

if TYPE_CHECKING:
    from frictionsim.scenario.settings import Scenario

Kind = TypeVar("Kind", bound="Scenario")


class NumberReplacement(Generic[Kind]):
    """What `Scenario.replace` does with numbers for the same keys again and again.

    The model validates each scenario as a whole. The limits of the magnitude are checked of the
    new numbers only: the others were checked with the first ones. Where anything is refused,
    `replace` itself says what.

    Parameters
    ----------
    scenario : Scenario
    keys : sequence of str
        With dots, as of `replace`.
    """

    def __init__(self, scenario: Kind, keys: Sequence[str]) -> None:
        self._scenario, self._keys = scenario, tuple(keys)
        self._places: list[tuple[Any, Any]] = []  # table and key in it
        self._context = {"folder": Path(scenario.origin.source).parent}

    def __call__(self, values: Sequence[float]) -> Kind:
        """Return the scenario with these values of the keys.

        Raises
        ------
        ScenarioError
            If a key is unknown or a value does not fit.
        """
        if self._places and all(map(_is_ordinary, values)):
            for (table, key), value in zip(self._places, values, strict=True):
                table[key] = value
            try:
                found = type(self._scenario).model_validate(self._data, context=self._context)
            except (ValidationError, OverflowError):
                return self._replaced(values)
            return found.with_origin(self._origin(values))
        found = self._replaced(values)
        if not self._places:
            self._find_places(values)
        return found

    def _replaced(self, values: Sequence[float]) -> Kind:
        return self._scenario.replace(dict(zip(self._keys, values, strict=True)))

    def _find_places(self, values: Sequence[float]) -> None:
        dump = self._scenario.model_dump(by_alias=True, exclude_none=True, exclude_unset=True)
        self._data = plain(dump)
        paths = apply_overrides(self._data, dict(zip(self._keys, values, strict=True)))[0]
        for *above, last in paths:
            table = self._data
            for key in above:
                table = table[key]
            self._places.append((table, last))

    def _origin(self, values: Sequence[float]) -> Origin:
        before = self._scenario.origin
        texts = (f"{k}={override_text(v)}" for k, v in zip(self._keys, values, strict=True))
        return Origin(before.source, (*before.overrides, *texts))


def _is_ordinary(value: Any) -> bool:
    """Return whether the limits of the magnitude allow a number wherever it stands."""
    return type(value) is float and (value == 0.0 or MIN_NUMBER <= abs(value) <= MAX_NUMBER)
