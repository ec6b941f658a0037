"""Statics of scenarios from Python; what it imports is less than what `solve` needs."""

from typing import TYPE_CHECKING

from frictionsim.api.result_base import quantities_table
from frictionsim.document import as_text
from frictionsim.errors import overflow_refused
from frictionsim.results import Quantities, StaticQuantities, defined
from frictionsim.scenario.kinds import mechanism_module
from frictionsim.scenario.loading import ScenarioSource, load
from frictionsim.scenario.settings import Scenario

if TYPE_CHECKING:
    from frictionsim.scenario.overrides import Overrides


def static(
    scenario: Scenario | ScenarioSource, overrides: "Overrides | None" = None
) -> StaticQuantities:
    """Return the forces and torques of impending motion; of a belt its equilibrium.

    Parameters
    ----------
    scenario, overrides
        As of `solve`.

    Returns
    -------
    dict of Quantity
        By name, each with `value` and `unit`. Its attribute `notes`, a tuple of texts, says what
        they mean, and why a value is none.

    Raises
    ------
    InputError, ScenarioError
    """
    loaded = with_overrides(scenario, overrides)
    with overflow_refused():
        found: Quantities = mechanism_module(loaded.kind).statics(loaded)
    quantities = StaticQuantities(defined(found))
    quantities.notes = getattr(found, "notes", ())
    return quantities


def statics_text(quantities: StaticQuantities) -> str:
    """Return the quantities of impending motion, as the command line prints them."""
    return as_text([quantities_table(quantities), *quantities.notes])


def with_overrides(source: Scenario | ScenarioSource, overrides: "Overrides | None") -> Scenario:
    """Return the scenario of a source, as of `solve`; errors of it name the overrides."""
    if not isinstance(source, Scenario):
        return load(source, overrides)
    return source.replace(overrides) if overrides else source
