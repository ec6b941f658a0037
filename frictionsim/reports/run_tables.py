"""The tables of one run, or of several of a kind side by side, for terminal, notebook and page."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple, Self

from frictionsim.display import (
    DIGITS,
    MESH_DIGITS,
    MODE_WORDS,
    error_text,
    number_text,
    quantity_text,
    short_text,
)
from frictionsim.document import ABSENT, Block, Table
from frictionsim.errors import InputError
from frictionsim.results import Check, Quantities, Quantity, Transition
from frictionsim.scenario.kinds import KINDS, KINDS_WITH_MESH, mechanism_module
from frictionsim.scenario.origin import heading_of

if TYPE_CHECKING:
    from frictionsim.costs.error_estimate import OtherMesh
    from frictionsim.results import Record

# Belts at rest on two meshes have the same pretension to some 1e-10.
SAME_ON_MESHES = 1e-8
NO_LABEL = ("",)  # the labels of a single result
AUDIT = (">value", ">limit", "verdict")  # of a single result


class ReportedRun(NamedTuple):
    """A run as its report shows it."""

    result: Any  # a `frictionsim.Result`, of the layer above
    label: str  # its name among the runs of a comparison; empty of a single run

    @property
    def record(self) -> "Record":
        """Its record."""
        record: Record = self.result.record
        return record

    def attribute(self, name: str) -> str:
        """Return a root attribute of its file; empty if it has none of that name."""
        return self.record.attributes.get(name, "")

    @property
    def title(self) -> str:
        """The title of the scenario, or the name of its file, or the kind."""
        return heading_of(self.record.attributes)


def summary(runs: Sequence[ReportedRun]) -> Iterator[Block]:
    """Yield quantities, estimates of their errors, audit and solver statistics of runs."""
    are_alike = len({run.attribute("kind") for run in runs}) == 1
    yield quantities_table([Column.of(*run) for run in runs], are_alike)
    for run in runs:
        if run.result.errors:
            yield after_label(run, run.result.error_estimate)
    yield audit_table([run.record.checks for run in runs], [run.label for run in runs])
    yield _counts(runs)


def after_label(run: ReportedRun, text: str) -> str:
    """Return a text on a run, of several with the name of the run before it."""
    return f"{run.label}: {text}" if run.label else text


Digits = Callable[[str, float], int]
"""The number of digits of a quantity without an estimate of its error, by its name and value."""


def digits_of(kind: str, scenario: str) -> Digits:
    """Return the digits of the quantities of a kind: few where the mesh of a belt makes them.

    The scenario is in TOML.
    """
    if kind in KINDS and kind not in KINDS_WITH_MESH:
        return lambda name, value: DIGITS
    from frictionsim.scenario.toml_data import toml_tables

    try:
        depends = mechanism_module(kind).mesh_study.depends_on_mesh
        tables = toml_tables(scenario)
    except (AttributeError, InputError, ValueError):  # no mesh; no such kind here; edited
        return lambda name, value: DIGITS

    def digits(name: str, value: float) -> int:
        try:
            return MESH_DIGITS if depends(name, value, tables) else DIGITS
        except (AttributeError, KeyError, TypeError):  # the tables are not those of a belt
            return MESH_DIGITS

    return digits


class Column(NamedTuple):
    """The quantities of a result in a table."""

    quantities: Quantities
    digits: Digits  # where the estimated error does not tell them
    label: str = ""  # the name of the result; empty of a single one
    # The estimated errors; empty if they were not estimated.
    errors: Mapping[str, float | None] = {}
    other: "OtherMesh | None" = None  # the quantities on another mesh

    @classmethod
    def of(cls, result: Any, label: str = "") -> Self:
        """Return the column of a result."""
        digits = digits_of(result.kind, result.record.attributes["scenario"])
        return cls(result.quantities, digits, label, result.errors, result._other)


def quantities_table(columns: Sequence[Column], are_alike: bool = True) -> Table:
    """Return the quantities of results with their units, and the difference of two alike."""
    headings = ["quantity"]
    for one in columns:
        of = f" of {one.label}" if one.label else ""
        headings.append(f">{one.label or 'value'}")
        headings += [f">error{of}"] if one.errors else []
        headings += [f">{one.other.name}{of}"] if one.other else []
    are_subtracted = are_alike and len(columns) == 2
    if are_subtracted:
        headings.append(f">{columns[1].label} less {columns[0].label}")
    rows = []
    for name in dict.fromkeys(name for one in columns for name in one.quantities):
        compared = [one.quantities.get(name) for one in columns]
        cells = [name]
        for quantity, one in zip(compared, columns, strict=True):
            value, error = None if quantity is None else quantity.value, one.errors.get(name)
            text = quantity_text(value, error, DIGITS if value is None else one.digits(name, value))
            cells.append("" if quantity is None else text)
            cells += [error_text(error)] if one.errors else []
            cells += [_on_other_mesh(value, text, one.other.values.get(name))] if one.other else []
        cells += [_difference(*compared)] if are_subtracted else []
        units = dict.fromkeys(quantity.unit for quantity in compared if quantity is not None)
        rows.append((*cells, " or ".join(units)))  # files of several versions may have several
    return Table([*headings, "unit"], rows, "Quantities")


def _on_other_mesh(value: float | None, shown: str, other: float | None) -> str:
    """Return a quantity on another mesh, in the digits that the difference bears."""
    if other is None:
        return ""
    difference = None if value is None else abs(other - value)
    if difference is not None and difference <= SAME_ON_MESHES * abs(other):
        return shown
    return quantity_text(other, difference)


def _difference(a: Quantity | None, b: Quantity | None) -> str:
    """Return the second quantity less the first; empty if one is not defined."""
    if a is None or b is None or a.unit != b.unit or a.value is None or b.value is None:
        return ""
    return short_text(b.value - a.value)


def audit_table(results: Sequence[Mapping[str, Check]], labels: Sequence[str] = NO_LABEL) -> Table:
    """Return the checks of the self-audits of results; of several a column for each."""
    names = dict.fromkeys(name for checks in results for name in checks)
    caption = "Audit: a value above its limit is a reason not to trust the run"
    if len(results) == 1:
        rows = [(name, *_check(results[0].get(name))) for name in names]
        return Table(("audit", *AUDIT), rows, caption)
    headings = ("audit: value, limit", *(f">{label}" for label in labels))
    cells = [[_check(checks.get(name)) for checks in results] for name in names]
    together = [[f"{v}, {limit}  {verdict}" if v else "" for v, limit, verdict in c] for c in cells]
    return Table(headings, [(n, *c) for n, c in zip(names, together, strict=True)], caption)


def _check(check: Check | None) -> tuple[str, str, str]:
    if check is None:
        return "", "", ""
    return short_text(check.value), short_text(check.limit), "ok" if check.ok else "FAILED"


def _counts(runs: Sequence[ReportedRun]) -> Table:
    rows: dict[str, list[str]] = {}
    names = []
    for run in runs:
        counts = run.record.statistics
        if counts is None:
            continue
        samples, events = (len(of["time"]) for of in (run.record.channels, run.record.events))
        names.append(f">{run.label or 'run'}")
        numbers = {
            "samples": samples,
            "events": events,
            "states": counts.states,
            "steps": counts.steps,
            "rejected steps": counts.rejected,
            "evaluations of the right-hand side": counts.rhs_evaluations,
        }
        for words, number in numbers.items():
            rows.setdefault(words, []).append(str(number))
    headings = ["count", *names]
    return Table(headings, [(words, *cells) for words, cells in rows.items()], "Solver statistics")


MAX_VALUE = 120  # characters of a value in a table


def event_cells(e: Transition, digits: int = DIGITS) -> tuple[str, ...]:
    """Return contact, modes and angle of an event; without an angle there is no cell for it."""
    angle = () if e.position is None else (number_text(e.position, digits),)
    return e.contact, MODE_WORDS[e.mode_from], MODE_WORDS[e.mode_to], *angle


def differences(runs: Sequence[ReportedRun], length: int = MAX_VALUE) -> Block:
    """Return the keys in which the scenarios of several runs differ, with their values.

    `length` is the most characters of a value.
    """
    try:
        from frictionsim.scenario.toml_data import differing_keys, value_text

        differing = differing_keys([run.record.attributes["scenario"] for run in runs])
    except InputError as error:
        return str(error)
    if not differing:
        return "The scenarios are the same."
    rows = [
        (name, *(ABSENT if value is None else value_text(value, length) for value in values))
        for name, values in differing.items()
    ]
    caption = f"Keys in which the scenarios differ; {ABSENT} where there is none"
    return Table(["key", *(run.label for run in runs)], rows, caption)


def origins(runs: Sequence[ReportedRun]) -> Table:
    """Return the origin of the results: version, file, command, overrides."""
    asked = {
        "version of frictionsim": "frictionsim_version",
        "format version": "format_version",
        "scenario file": "source",
        "overrides": "overrides",
        "command": "command",
    }
    rows = [("result file", *(str(run.result.path or "") for run in runs))]
    for words, attribute in asked.items():
        values = [" ".join(run.attribute(attribute).split("\n")) for run in runs]
        if any(values):
            rows.append((words, *values))
    return Table(["property", *(run.label or "value" for run in runs)], rows, "Origin")
