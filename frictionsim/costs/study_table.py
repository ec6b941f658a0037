"""The rows of a study, the table that is made of them, and the settings that it recommends."""

from collections.abc import Mapping, Sequence
from math import inf, isfinite, nan
from typing import TYPE_CHECKING, Any, NamedTuple

from frictionsim.display import error_text, short_text, study_text
from frictionsim.io.cost_table import COUNTS, RELATIVE, CostTable, Error, Row, line_of
from frictionsim.results import finite

if TYPE_CHECKING:
    from frictionsim.results import Metric

TARGET_ERRORS = (1e-2, 1e-3, 1e-4)
SECONDS_OF_REPEATS = 1.0
"""Runs of a setting are not repeated after this total time, s: the timing is accurate enough."""


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
    """The cheapest setting with an error of at most `wanted`; None if no setting is known to be."""

    wanted: float
    floor: float | None  # reference uncertainty; None if it is unknown
    row: Row | None
    tied: int  # settings that times do not tell apart; of several the evaluations decide
    timed_once: bool  # whether these have no spread

    @property
    def sentence(self) -> str:
        """The recommendation as text."""
        return _sentence([self])

    @property
    def found(self) -> str:
        """The setting as text; or why there is none."""
        if self.floor is not None and self.floor > self.wanted:
            return f"unknown, the reference uncertainty is {error_text(self.floor)}"
        if self.row is None:
            return "no setting reached it"
        row = self.row
        bodies = f"{row['bodies']:.0f} bodies, " if row.get("model") else ""
        return (
            f"{line_of(row)} with {bodies}{row['setting']},"
            f" {short_text(row['wall_seconds'])} s, error {error_text(row['error'])}"
        )


def _sentence(advices: Sequence[Advice]) -> str:
    """Return the recommendations of one setting, for one error or several, as text."""
    first = advices[0]
    goals = _listed([f"{study_text(100 * advice.wanted)} %" for advice in advices])
    text = f"for {goals}: {first.found}"
    if first.row is None:
        return text
    if max(advice.tied for advice in advices) > 1:
        why = "whose times differ by chance"
        if first.timed_once:
            why = "that are so accurate (each was timed once: times are not compared)"
        counts = _listed([*dict.fromkeys(str(advice.tied) for advice in advices)])
        text += f"; the fewest evaluations of {counts} settings {why}"
    return text + "; the reference uncertainty is unknown" * (first.floor is None)


def _listed(texts: Sequence[str]) -> str:
    return " and ".join(filter(None, (", ".join(texts[:-1]), texts[-1])))


def recommended_lines(table: CostTable) -> list[str]:
    """Return the recommendations as sentences, one for the errors of which the setting is one."""
    of_setting: dict[str, list[Advice]] = {}
    for advice in recommendations(table):
        of_setting.setdefault(advice.found, []).append(advice)
    return [*map(_sentence, of_setting.values())]


def recommendations(table: CostTable) -> list[Advice]:
    """Return the cheapest setting for each of TARGET_ERRORS.

    The fastest one; of those that are slower by no more than the spread of the repeats, that with
    the fewest evaluations. The spread of a short run that was timed once is unknown. Where the
    reference uncertainty is larger than an error, none is known.
    """
    return [_cheapest(table, wanted) for wanted in TARGET_ERRORS]


def _cheapest(table: CostTable, wanted: float) -> Advice:
    rows = [
        row
        for row in table.rows
        if row["status"] == "done" and not row.get("reason") and row["error"] <= wanted
        if table.floor <= wanted and _holds(row, table.rows, wanted)
    ]
    fastest = min(rows, key=_seconds, default=None)
    tied = [row for row in rows if fastest and _may_be_as_fast(row, fastest)]
    row = min(tied, key=lambda row: float(row["rhs_evaluations"]), default=None)
    is_known = table.uncertainty or not table.references
    timed_once = any(map(_is_timed_too_briefly, tied))
    return Advice(wanted, table.floor if is_known else None, row, len(tied), timed_once)


def _seconds(row: Row) -> float:
    return float(row["wall_seconds"])


def _is_timed_too_briefly(row: Row) -> bool:
    """Return whether it was a short run that was timed once: its spread is unknown."""
    return bool(row.get("repeats") == 1 and _seconds(row) < SECONDS_OF_REPEATS)


def _may_be_as_fast(row: Row, fastest: Row) -> bool:
    """Return whether the time of a row exceeds the least one by no more than their spread."""

    def spread(row: Row) -> float:
        if _is_timed_too_briefly(row):
            return inf
        known = row.get("wall_spread", nan)
        return known if known == known else 0.0

    return _seconds(row) - _seconds(fastest) <= max(spread(row), spread(fastest))


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
    setting = {name: row[name] for name in names}
    return {"wanted": advice.wanted, **setting, "sentence": advice.sentence}


def _error_json(absolute: float | None, relative: float) -> dict[str, float | None]:
    return {"absolute": finite(absolute), "relative": finite(relative)}
