"""Validation of the data of a scenario by the model of its kind."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

from frictionsim.errors import InputError
from frictionsim.scenario.kinds import kind_names, mechanism_module
from frictionsim.scenario.model_validation import ValidationFailure, validate_model

if TYPE_CHECKING:
    from frictionsim.scenario.settings import Scenario

__all__ = ["ValidationFailure", "validate"]


def validate(data: dict[str, Any], folder: Path | None) -> "Scenario":
    """Return the scenario for the data of a TOML file.

    Parameters
    ----------
    data : dict
    folder : Path or None
        Base of relative file names in the data; None if they may not refer to files.

    Raises
    ------
    ValidationFailure
        If the data is invalid.
    """
    try:
        model = _model_of(data)
    except InputError as error:
        raise ValidationFailure([(("kind",), str(error))]) from None
    return validate_model(model, data, folder)


def _model_of(data: dict[str, Any]) -> "type[Scenario]":
    """Return the model of the kind of a scenario."""
    kind = data.get("kind")
    if isinstance(kind, str):
        found: type[Scenario] = mechanism_module(kind).SCENARIO
        return found

    from frictionsim.scenario.messages import toml_text

    kinds = ", ".join(f"'{kind}'" for kind in kind_names())
    if not data:
        raise InputError(f"the scenario is empty; it starts with kind, one of {kinds}")
    if "kind" not in data and "study" in data:
        raise InputError("missing: this is a study, not a scenario; 'frictionsim sweep' runs it")
    if "kind" not in data:
        raise InputError(f"missing; expected one of {kinds}")
    raise InputError(f"expected one of {kinds}, got {toml_text(kind)}")
