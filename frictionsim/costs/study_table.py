"""The rows of a study, the table that is made of them, and the settings that it recommends."""

from collections.abc import Mapping, Sequence
from math import isfinite
from typing import TYPE_CHECKING, Any, NamedTuple

from frictionsim.display import error_text, short_text, study_text
from frictionsim.io.cost_table import COUNTS, RELATIVE, CostTable, Error, Row, line_of
from frictionsim.results import finite

if TYPE_CHECKING:
    from frictionsim.results import Metric

TARGET_ERRORS = (1e-2, 1e-3, 1e-4)
# Unit and words of the columns; those without a unit are texts.
COLUMNS = {
    "law": ("", "friction law"),
    "backend": ("", "integration method"),
    "setting": ("", "setting of the method"),
    "model": ("", "model in space"),
    "bodies": ("1", "number of bodies"),
    "overrides": ("", "keys it sets"),
    "status": ("", "done or failed"),
    "reason": ("", "why it failed"),
    "error": ("1", "largest relative error"),
    "time_error": ("1", "largest relative error in time alone"),
    "below_uncertainty": ("", "errors that are below the reference uncertainty"),
    "events": ("1", "events of the run"),
    "wall_seconds": ("s", "median wall time of the solution alone"),
    "wall_spread": ("s", "largest minus least wall time of the repeats"),
    "repeats": ("1", "runs that were timed"),
    "steps": ("1", "accepted steps"),
    "rejected": ("1", "rejected steps"),
    "rhs_evaluations": ("1", "evaluations of the right-hand side"),
    "states": ("1", "length of the state vector"),
}
OF_MESHES = ("model", "bodies", "time_error")
BEFORE_MEASURES = "below_uncertainty"  # the column that those of each measure follow


def columns_of(of_meshes: bool, metrics: "Sequence[Metric]") -> dict[str, tuple[str, str]]:
    """Return the units and words of the columns of a table."""
    columns: dict[str, tuple[str, str]] = {}
    for name, unit_and_words in COLUMNS.items():
        if of_meshes or name not in OF_MESHES:
            columns[name] = unit_and_words
        for metric in metrics if name == BEFORE_MEASURES else ():
            columns[f"{metric.name}_error"] = metric.unit, f"error of {metric.name}"
            columns[metric.name + RELATIVE] = "1", f"relative error of {metric.name}"
    return columns


def greatest(errors: Mapping[str, Error]) -> float | None:
    """Return the largest relative error; None if there is none."""
    return max((error.relative for error in errors.values()), default=None)


class Advice(NamedTuple):
    """The fastest setting with an error of at most `wanted`; None if no setting is known to be."""

    wanted: float
    row: Row | None
    found: str  # the setting as text; or why there is none

    @property
    def sentence(self) -> str:
        """The recommendation as text."""
        return f"for {study_text(100 * self.wanted)} %: {self.found}"


def recommended_lines(table: CostTable) -> list[str]:
    """Return the recommendations as sentences, one for the errors of which the setting is one."""
    goals: dict[str, list[str]] = {}
    for advice in recommendations(table):
        goals.setdefault(advice.found, []).append(f"{study_text(100 * advice.wanted)} %")
    joined = (" and ".join(filter(None, (", ".join(g[:-1]), g[-1]))) for g in goals.values())
    return [f"for {goal}: {found}" for goal, found in zip(joined, goals, strict=True)]


def recommendations(table: CostTable) -> list[Advice]:
    """Return the fastest setting for each of TARGET_ERRORS.

    Where the reference uncertainty is larger than an error, none is known.
    """
    return [_fastest(table, wanted) for wanted in TARGET_ERRORS]


def _fastest(table: CostTable, wanted: float) -> Advice:
    if table.floor > wanted:
        found = f"unknown, the reference uncertainty is {error_text(table.floor)}"
        return Advice(wanted, None, found)
    rows = [
        row
        for row in table.rows
        if row["status"] == "done" and not row.get("reason") and row["error"] <= wanted
        if _holds(row, table.rows, wanted)
    ]
    if not rows:
        return Advice(wanted, None, "no setting reached it")
    row = min(rows, key=lambda row: float(row["wall_seconds"]))
    bodies = f"{row['bodies']:.0f} bodies, " if row.get("model") else ""
    found = (
        f"{line_of(row)} with {bodies}{row['setting']}, {short_text(row['wall_seconds'])} s,"
        f" error {error_text(row['error'])}"
    )
    if table.references and not table.uncertainty:
        found += "; the reference uncertainty is unknown"
    return Advice(wanted, row, found)


def _holds(row: Row, rows: list[Row], wanted: float) -> bool:
    """Return whether finer meshes of the model of a row have no larger an error either.

    On one mesh errors of opposite sign may cancel; that is no reason to trust it.
    """
    best: dict[float, float] = {}
    for other in rows:
        finer = row.get("model") and other["model"] == row["model"]
        if finer and other["bodies"] > row["bodies"] and other["error"] == other["error"]:
            bodies = other["bodies"]
            best[bodies] = min(other["error"], best.get(bodies, other["error"]))
    return all(error <= wanted for error in best.values())


SETTING = ("law", "backend", "setting", "overrides")
LISTS = ("overrides", "below_uncertainty")  # texts of names between blanks


def table_json(table: CostTable) -> dict[str, Any]:
    """Return the JSON of a table: its measures, references, settings and recommendations."""
    measures = table.measures
    return {
        "kind": table.kind,
        "status": table.status,
        "reason": table.reason,
        "measures": {name: {"unit": table.columns[f"{name}_error"][0]} for name in measures},
        "references": list(table.references),
        "floor": {name: _error_json(*error) for name, error in table.uncertainty.items()},
        "time_references": list(table.time_references),
        "settings": [_row_json(row, measures) for row in table.rows],
        "recommendations": [_advice_json(advice) for advice in recommendations(table)],
    }


def _row_json(row: Row, measures: list[str]) -> dict[str, Any]:
    columns = {name: (f"{name}_error", name + RELATIVE) for name in measures}
    of_measures = {column for pair in columns.values() for column in pair}
    others = {name: value for name, value in row.items() if name not in of_measures}
    return {
        "time_error": None,
        **{name: _value_json(name, value) for name, value in others.items()},
        "errors": {
            name: _error_json(row[absolute], row[relative])
            for name, (absolute, relative) in columns.items()
            if row[relative] == row[relative]
        },
    }


def _value_json(name: str, value: Any) -> Any:
    if isinstance(value, str):
        return value.split() if name in LISTS else value
    return int(value) if name in COUNTS and isfinite(value) else finite(value)


def _advice_json(advice: Advice) -> dict[str, Any]:
    row = dict.fromkeys(SETTING) if advice.row is None else _row_json(advice.row, [])
    names = (*SETTING, *(("model", "bodies") if row.get("model") else ()))
    return {"wanted": advice.wanted, **{n: row[n] for n in names}, "sentence": advice.sentence}


def _error_json(absolute: float | None, relative: float) -> dict[str, float | None]:
    return {"absolute": finite(absolute), "relative": finite(relative)}
