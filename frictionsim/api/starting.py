"""Scenarios to start from, and the kinds that there are."""

from json import dumps
from typing import TYPE_CHECKING

from frictionsim.errors import InputError, unknown
from frictionsim.io.new_file import check_new, write_new
from frictionsim.scenario.authoring import new_scenario, schema, schema_file
from frictionsim.scenario.kinds import KINDS, kind_names
from frictionsim.scenario.shipped import shipped_scenarios
from frictionsim.scenario.toml_data import toml_tables

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
    if kind in KINDS or kind in kind_names():
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


def write_with_schema(file: "Path", text: str) -> "tuple[list[Path], list[str]]":
    """Write a scenario, and beside it the schema that its first line names for editors.

    Returns
    -------
    list of Path
        The files that were written.
    list of str
        A warning if another schema is there, which is kept.

    Raises
    ------
    OutputError
        If a file cannot be written, or the scenario is there already.
    """
    check_new(file, "scenario")
    kind = toml_tables(text)["kind"]
    beside, content = file.parent / schema_file(kind), f"{dumps(schema(kind), indent=2)}\n"
    files, warnings = [file], []
    if not beside.is_file():
        write_new(beside, content, "schema")
        files.append(beside)
    elif beside.read_text(encoding="utf-8", errors="replace") != content:
        warnings = [
            f"{beside}: kept, but it differs from the schema of this version;"
            f" 'frictionsim schema {kind} > {beside}' replaces it"
        ]
    write_new(file, f"#:schema ./{beside.name}\n{text}", "scenario")
    return files, warnings


def kinds() -> tuple[str, ...]:
    """Return the kinds of mechanism: the built-in ones, then those of installed packages."""
    return kind_names()


def scenarios() -> "dict[str, Path]":
    """Return the files of the shipped scenarios by name."""
    return shipped_scenarios()


def list_of_scenarios() -> str:
    """Return the kinds and the shipped scenarios with their titles, as text."""
    from frictionsim.document import Table, as_text
    from frictionsim.scenario.loading import load

    kinds = Table(("kind",), [(kind,) for kind in kind_names()])
    rows = []
    for name, path in shipped_scenarios().items():
        scenario = load(path)
        rows.append((name, scenario.kind, scenario.title))
    return as_text([kinds, "", Table(("shipped scenario", "kind", "title"), rows)])
