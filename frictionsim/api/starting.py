"""Scenarios to start from, and the kinds that there are."""

from typing import TYPE_CHECKING

from frictionsim.errors import InputError, unknown
from frictionsim.scenario.kinds import kind_names
from frictionsim.scenario.shipped import shipped_scenarios
from frictionsim.scenario.templates import new_scenario

if TYPE_CHECKING:
    from pathlib import Path


def new(kind: str) -> str:
    """Return the text of a scenario to start from.

    Parameters
    ----------
    kind : str
        A kind of mechanism, for a commented scenario with all its keys; or the name of a shipped
        scenario, as ``belt_verification`` or ``hard/jump``.

    Returns
    -------
    str
        TOML.

    Raises
    ------
    InputError
        If there is no such kind or scenario.
    """
    if kind in kind_names():
        return new_scenario(kind)
    shipped = shipped_scenarios()
    if kind not in shipped:
        raise InputError(
            unknown(
                "kind or shipped scenario", kind, list(dict.fromkeys((*kind_names(), *shipped)))
            )
        )
    text = shipped[kind].read_text(encoding="utf-8")
    if "csv" in text:  # the file would not stand beside the copy
        from frictionsim.scenario.loading import load

        text = load(shipped[kind]).to_toml()
    lines = text.splitlines()
    # The schema stands beside the shipped file, but not beside its copy.
    return "\n".join(line for line in lines if not line.startswith("#:schema")) + "\n"


def kinds() -> tuple[str, ...]:
    """Return the kinds of mechanism: the built-in ones, then those of installed packages."""
    return kind_names()


def scenarios() -> "dict[str, Path]":
    """Return the files of the shipped scenarios by name."""
    return shipped_scenarios()


def list_of_scenarios() -> str:
    """Return the kinds and the shipped scenarios with their titles, as text."""
    from frictionsim.api.tables import Cells, as_text
    from frictionsim.scenario.loading import load

    kinds = Cells(("kind",), [(kind,) for kind in kind_names()])
    rows = []
    for name, path in shipped_scenarios().items():
        scenario = load(path)
        rows.append((name, scenario.kind, scenario.title))
    return as_text(iter([kinds, "", Cells(("shipped scenario", "kind", "title"), rows)]))
