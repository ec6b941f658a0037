"""The scenario that a result holds."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from frictionsim.errors import InputError
from frictionsim.scenario.overrides import keys_and_values
from frictionsim.scenario.parsed_text import toml_tables

if TYPE_CHECKING:
    from frictionsim.results import Record


def scenario_of(result: "Record") -> dict[str, Any]:
    """Return the scenario of a result as data."""
    try:
        return toml_tables(result.attributes["scenario"])
    except ValueError as error:
        raise InputError(f"cannot read the scenario in this result: {error}") from None


def scenario_value(result: "Record", *keys: str | int) -> Any:
    """Return a value of the scenario of a result.

    Parameters
    ----------
    result : Record
    *keys : str or int
        Path of the value.
    """
    value: Any = scenario_of(result)
    for key in keys:
        try:
            value = value[key]
        except (KeyError, TypeError, IndexError):
            where = ".".join(map(str, keys))
            raise InputError(f"the scenario in this result has no {where}") from None
    return value


def differing_keys(results: "Sequence[Record]") -> dict[str, list[Any]]:
    """Return the keys, as of --set, in which the scenarios of results differ.

    Returns
    -------
    dict of list
        The value of each result; None where it has no such key.
    """
    found = [dict(keys_and_values(scenario_of(result))) for result in results]
    names = dict.fromkeys(name for values in found for name in values)
    compared = {name: [values.get(name) for values in found] for name in names}
    return {name: values for name, values in compared.items() if values != values[:1] * len(found)}
