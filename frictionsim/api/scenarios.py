"""Scenarios before a run: their statics, files to start from, and kernels compiled in advance.

Less is imported than for `solve`.
"""

from collections.abc import Iterator
from json import dumps
from typing import TYPE_CHECKING, NamedTuple

from frictionsim.document import Table, as_text
from frictionsim.errors import InputError, overflow_refused, unknown
from frictionsim.reports.run_tables import Column, digits_of, quantities_table
from frictionsim.results import Quantities, StaticQuantities, defined
from frictionsim.scenario import methods
from frictionsim.scenario.kinds import KINDS, kind_names, mechanism_module
from frictionsim.scenario.loading import ScenarioSource, load
from frictionsim.scenario.origin import shipped_scenarios
from frictionsim.scenario.settings import Scenario
from frictionsim.scenario.toml_data import toml_tables

if TYPE_CHECKING:
    from pathlib import Path

    from frictionsim.scenario.overrides import Overrides
    from frictionsim.simulation.monitor import RunMonitor


def static(
    scenario: Scenario | ScenarioSource, overrides: "Overrides | None" = None
) -> StaticQuantities:
    """Return the forces and torques of impending motion; of a belt its equilibrium.

    Parameters
    ----------
    scenario, overrides
        As for `solve`.

    Returns
    -------
    dict of Quantity
        By name, each with `value` and `unit`. The attribute `notes`, a tuple of texts, explains
        them and missing values.

    Raises
    ------
    InputError, ScenarioError
        If it cannot be read, or does not describe a mechanism.
    """
    loaded = with_overrides(scenario, overrides)
    with overflow_refused():
        statics: Quantities = mechanism_module(loaded.kind).statics(loaded)
    quantities = StaticQuantities(defined(statics))
    quantities.notes = getattr(statics, "notes", ())
    return quantities


def statics_text(quantities: StaticQuantities, scenario: Scenario) -> str:
    """Return the quantities of impending motion, as the command line prints them."""
    digits = digits_of(scenario.kind, scenario.to_toml())
    return as_text([quantities_table([Column(quantities, digits)]), *quantities.notes])


def warnings_before_run(scenario: Scenario) -> list[str]:
    """Return the warnings of a scenario, with those that its equations give without a run."""
    from frictionsim.simulation.run_warnings import foreseen

    build = getattr(mechanism_module(scenario.kind), "build", None)
    duration, warnings = scenario.solver.duration, scenario.warnings()
    with overflow_refused():
        return warnings if build is None else [*warnings, *foreseen(build(scenario), duration)]


def with_overrides(source: Scenario | ScenarioSource, overrides: "Overrides | None") -> Scenario:
    """Return the scenario of a source, as for `solve`; its errors name the overrides."""
    if not isinstance(source, Scenario):
        return load(source, overrides)
    return source.replace(overrides) if overrides else source


def new(kind: str) -> str:
    """Return the text of a scenario to start from.

    Parameters
    ----------
    kind : str
        A kind of mechanism, for a commented scenario with all its keys; or the name of a shipped
        scenario, e.g. ``belt_verification`` or ``hard/jump``.

    Returns
    -------
    str
        TOML.

    Raises
    ------
    InputError
        If there is no such kind or scenario.
    """
    from frictionsim.scenario.authoring import new_scenario

    if kind in KINDS or kind in kind_names():
        return new_scenario(kind)
    shipped = shipped_scenarios()
    if kind not in shipped:
        names = list(dict.fromkeys((*kind_names(), *shipped)))
        listed = f"kinds: {', '.join(kind_names())}; 'frictionsim new --list' lists the scenarios"
        raise InputError(unknown("kind or shipped scenario", kind, names, listed))
    text = shipped[kind].read_text(encoding="utf-8")
    if "csv" in text:  # the file would not stand beside the copy
        text = load(shipped[kind]).to_toml()
    lines = text.splitlines()
    # The schema stands beside the shipped file, but not beside its copy.
    return "\n".join(line for line in lines if not line.startswith("#:schema")) + "\n"


def write_with_schema(file: "Path", text: str) -> "tuple[list[Path], list[str]]":
    """Write a scenario, and beside it its schema for editors, unless another one is there.

    Returns the files that were written, and a warning of another schema; OutputError is raised if a
    file cannot be written, or the scenario exists already.
    """
    from frictionsim.io.output_file import SCENARIO, SCHEMA, check_free, check_output, write_new
    from frictionsim.scenario.authoring import schema, schema_file

    check_free(file, SCENARIO)
    check_output(file, SCENARIO)
    kind = toml_tables(text)["kind"]
    beside, content = file.parent / schema_file(kind), f"{dumps(schema(kind), indent=2)}\n"
    files, warnings = [file], []
    if not beside.is_file():
        write_new(beside, content, SCHEMA)
        files.append(beside)
    elif beside.read_text(encoding="utf-8", errors="replace") != content:
        warnings = [
            f"{beside}: kept, but it differs from the schema of this version;"
            f" 'frictionsim schema {kind} > {beside}' replaces it"
        ]
    write_new(file, f"#:schema ./{beside.name}\n{text}", SCENARIO)
    return files, warnings


def kinds() -> tuple[str, ...]:
    """Return the kinds of mechanism: the built-in ones, then those of installed packages."""
    return kind_names()


def scenarios() -> "dict[str, Path]":
    """Return the files of the shipped scenarios by name."""
    return shipped_scenarios()


def list_of_scenarios() -> str:
    """Return the kinds and the shipped scenarios with their titles, as text."""
    kinds = Table(("kind",), [(kind,) for kind in kind_names()])
    rows = []
    for name, path in shipped_scenarios().items():
        scenario = load(path)
        rows.append((name, scenario.kind, scenario.title))
    return as_text([kinds, "", Table(("shipped scenario", "kind", "title"), rows)])


class WarmedUp(NamedTuple):
    """A combination of effects and method with compiled kernels.

    Attributes
    ----------
    scenario : str
        The name of a shipped scenario with this combination.
    backend : str
        The method.
    seconds : float, s
        Duration of the compilation; 0 if the kernels existed already.
    """

    scenario: str
    backend: str
    seconds: float


def warm_up(kind: str | None = None) -> tuple[WarmedUp, ...]:
    """Compile the kernels of the shipped belts, with each of their methods.

    Another belt compiles again if it has another set of effects. Other kinds have no kernels.

    Parameters
    ----------
    kind : str or None
        A kind of mechanism; by default all.

    Returns
    -------
    tuple of WarmedUp
        Empty for a kind without kernels or without shipped scenarios.

    Raises
    ------
    InputError
        If there is no such kind.
    """
    from frictionsim.simulation.monitor import RunMonitor

    return tuple(warming(kind, RunMonitor()))


def warming(kind: str | None, monitor: "RunMonitor") -> Iterator[WarmedUp]:
    """Compile as `warm_up` does, one combination at a time."""
    if kind is not None and kind not in KINDS and kind not in kind_names():
        raise InputError(unknown("kind", kind, list(kind_names())))
    for name, path in shipped_scenarios().items():
        if "/" in name:  # no example
            continue
        scenario = load(path)
        if kind not in (None, scenario.kind):
            continue
        for backend in methods.methods_of(scenario.pairs, scenario.law):
            if methods.METHODS[backend].scipy_class:  # they are there for comparison
                continue
            chosen = load(path, backend=backend)
            simulation = mechanism_module(chosen.kind).simulation(chosen)
            if (seconds := simulation.compile(monitor)) is not None:
                yield WarmedUp(name, backend, seconds)
