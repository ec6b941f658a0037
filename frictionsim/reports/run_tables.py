"""The tables of one run, or of several of a kind side by side, for terminal, notebook and page."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from frictionsim.display import (
    DIGITS,
    MESH_DIGITS,
    MODE_WORDS,
    cut_text,
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

Errors = Mapping[str, float | None]
# Belts at rest on two meshes have the same pretension to some 1e-10.
SAME_ON_MESHES = 1e-8
ALONE = ("",)  # the labels of a single result
AUDIT = (">value", ">limit", "verdict")  # of a single result


class ReportedRun(NamedTuple):
    """A run as its report shows it.

    Attributes
    ----------
    record : Record
    path : Path or None
        Of its file.
    label : str
        Its name among the runs of a comparison; empty of a single run.
    effects : tuple of str
        The effects that were simulated.
    errors : mapping
        The estimated error by quantity; empty if they were not estimated.
    error_estimate : str
        How they were estimated.
    other_mesh : OtherMesh or None
        The quantities on another mesh, if they were sought.
    """

    record: "Record"
    path: Path | None = None
    label: str = ""
    effects: tuple[str, ...] = ()
    errors: Mapping[str, float | None] = {}
    error_estimate: str = ""
    other_mesh: "OtherMesh | None" = None

    def attribute(self, name: str) -> str:
        """Return a root attribute of its file; empty if it has none of that name."""
        return self.record.attributes.get(name, "")

    @property
    def title(self) -> str:
        """The title of the scenario, or the name of its file, or the kind."""
        return heading_of(self.record.attributes)

    @property
    def warnings(self) -> list[str]:
        """Reasons to doubt the quantities."""
        return list(filter(None, self.attribute("warnings").split("\n")))


def summary(runs: Sequence[ReportedRun]) -> Iterator[Block]:
    """Yield quantities, estimates of their errors, audit and solver statistics of runs."""
    labels = [run.label for run in runs]
    records = [run.record for run in runs]
    errors = [run.errors for run in runs]
    digits = [digits_of(run.attribute("kind"), run.attribute("scenario")) for run in runs]
    others = [run.other_mesh for run in runs]
    quantities = [record.quantities for record in records]
    are_alike = len({run.attribute("kind") for run in runs}) == 1
    yield quantities_table(quantities, errors, labels, digits, others, are_alike)
    for run in runs:
        if run.errors and run.error_estimate:
            yield after_label(run, run.error_estimate)
    yield audit_table([record.checks for record in records], labels)
    yield _counts(runs)


def after_label(run: ReportedRun, text: str) -> str:
    """Return a text on a run, of several with the name of the run before it."""
    return f"{run.label}: {text}" if run.label else text


Digits = Callable[[str, float], int]
"""The number of digits of a quantity without an estimate of its error, by its name and value."""


def digits_of(kind: str, scenario: str) -> Digits:
    """Return the digits of the quantities of a kind: few where the mesh of a belt makes them.

    Parameters
    ----------
    kind : str
    scenario : str
        As TOML.
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


def quantities_table(
    results: Sequence[Quantities],
    errors: Sequence[Errors] = ({},),
    labels: Sequence[str] = ALONE,
    digits: Sequence[Digits] = (lambda name, value: DIGITS,),
    others: "Sequence[OtherMesh | None]" = (None,),
    are_alike: bool = True,
) -> Table:
    """Return the quantities of results with their units, and the difference of two alike.

    Parameters
    ----------
    errors : sequence of mapping
        The estimated errors of each result; empty if they were not estimated.
    labels : sequence of str
        The name of each result; empty of a single one.
    digits : sequence of Digits
        Of each result, where the estimated error does not tell them.
    others : sequence of OtherMesh or None
        The quantities of each result on another mesh.
    """
    headings = ["quantity"]
    for label, known, other in zip(labels, errors, others, strict=True):
        headings.append(f">{label or 'value'}")
        headings += [f">error{_of(label)}"] if known else []
        headings += [f">{other.name}{_of(label)}"] if other else []
    are_subtracted = are_alike and len(results) == 2
    headings += [f">{labels[1]} less {labels[0]}"] if are_subtracted else []
    rows = []
    for name in dict.fromkeys(name for quantities in results for name in quantities):
        compared = [quantities.get(name) for quantities in results]
        cells = [name]
        for quantity, known, digit, other in zip(compared, errors, digits, others, strict=True):
            value = None if quantity is None else quantity.value
            count = DIGITS if value is None else digit(name, value)
            text = quantity_text(value, known.get(name), count)
            cells.append("" if quantity is None else text)
            cells += [error_text(known.get(name))] if known else []
            cells += [_on_other_mesh(value, text, other.values.get(name))] if other else []
        cells += [_difference(*compared)] if are_subtracted else []
        # Files of several versions may have several units.
        units = dict.fromkeys(quantity.unit for quantity in compared if quantity is not None)
        rows.append((*cells, " or ".join(units)))
    return Table([*headings, "unit"], rows, "Quantities")


def _on_other_mesh(value: float | None, shown: str, other: float | None) -> str:
    """Return a quantity on another mesh, in the digits that the difference bears."""
    if other is None:
        return ""
    difference = None if value is None else abs(other - value)
    if difference is not None and difference <= SAME_ON_MESHES * abs(other):
        return shown
    return quantity_text(other, difference)


def _of(label: str) -> str:
    return f" of {label}" if label else ""


def _difference(a: Quantity | None, b: Quantity | None) -> str:
    """Return the second quantity less the first; empty if one is not defined."""
    if a is None or b is None or a.unit != b.unit or a.value is None or b.value is None:
        return ""
    return short_text(b.value - a.value)


def audit_table(results: Sequence[Mapping[str, Check]], labels: Sequence[str] = ALONE) -> Table:
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
        from frictionsim.scenario.toml_data import differing_keys

        differing = differing_keys([run.record for run in runs])
    except InputError as error:
        return str(error)
    if not differing:
        return "The scenarios are the same."
    rows = [(name, *(_cell(v, length) for v in values)) for name, values in differing.items()]
    caption = f"Keys in which the scenarios differ; {ABSENT} where there is none"
    return Table(["key", *(run.label for run in runs)], rows, caption)


def _cell(value: Any, length: int) -> str:
    text = ABSENT if value is None else _value(value)
    if len(text) <= length or not isinstance(value, list):
        return cut_text(text, length)
    end = f"... {len(value)} in all]"
    return text[: length - len(end)].rpartition(" ")[0] + f" {end}"  # after a whole value


def _value(value: Any) -> str:
    if isinstance(value, list):
        return f"[{', '.join(map(_value, value))}]"
    return str(value).lower() if isinstance(value, bool) else str(value)


def origins(runs: Sequence[ReportedRun]) -> Table:
    """Return the origin of the results: version, file, command, overrides."""
    asked = {
        "version of frictionsim": "frictionsim_version",
        "format version": "format_version",
        "scenario file": "source",
        "overrides": "overrides",
        "command": "command",
    }
    rows = [("result file", *("" if run.path is None else str(run.path) for run in runs))]
    for words, attribute in asked.items():
        values = [" ".join(run.attribute(attribute).split("\n")) for run in runs]
        if any(values):
            rows.append((words, *values))
    return Table(["property", *(run.label or "value" for run in runs)], rows, "Origin")
