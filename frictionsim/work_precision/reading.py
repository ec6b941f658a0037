"""A work-precision study from the columns of its table."""

from math import isfinite
from typing import TYPE_CHECKING, Any

from frictionsim.io.cost_table import CostTable
from frictionsim.scenario.parsed_text import json_value
from frictionsim.scenario.variants import Mesh, Setting
from frictionsim.work_precision.errors import Error
from frictionsim.work_precision.outcome import Diagram, Row
from frictionsim.work_precision.recommendation import Advice, recommended
from frictionsim.work_precision.report import attributes, columns

if TYPE_CHECKING:
    from frictionsim.work_precision.outcome import WorkPrecision

RELATIVE = "_relative"
MAX_DRAWN = 1e100


def table_of(study: "WorkPrecision") -> CostTable:
    """Return the table of a study, as its file in HDF5 has it."""
    scenario = study.scenario
    about = {"title": scenario.title, "kind": scenario.kind, **attributes(study)}
    return CostTable(about, {column.name: column for column in columns(study)})


def measures_of(table: CostTable) -> list[str]:
    """Return the names of the measures whose errors a table has."""
    return [name.removesuffix(RELATIVE) for name in table.columns if name.endswith(RELATIVE)]


def floors_of(table: CostTable) -> dict[str, float]:
    """Return the reference uncertainty by measure; empty if the table does not say.

    Raises
    ------
    ValueError
        If it is not what a table has.
    """
    try:
        found = json_value(table.attributes.get("reference_uncertainty", "{}"))
        floors = {name: float(value) for name, value in found.items() if value is not None}
    except (ValueError, AttributeError, TypeError):
        raise ValueError("its reference uncertainty is damaged") from None
    if not all(isfinite(value) for value in floors.values()):
        raise ValueError("its reference uncertainty is not finite")
    return floors


def advice_of(table: CostTable) -> list[Advice]:
    """Return the recommendations of a table, which are those of its study.

    Raises
    ------
    ValueError
        If its reference uncertainty is damaged.
    """
    measures = measures_of(table)
    wanted = [n for n in table.attributes.get("quantities", "").split() if n in measures]
    return recommended(rows_of(table), floors_of(table), wanted)


def diagram_of(table: CostTable) -> Diagram:
    """Return the picture's data from a table, which are those of its study.

    Raises
    ------
    ValueError
        If its reference uncertainty is damaged.
    """
    about, floors = table.attributes, floors_of(table)
    title = about.get("title") or about.get("kind") or ""
    rows = [row for row in rows_of(table) if _is_drawable(row)]
    return Diagram(title, rows, max(floors.values(), default=0.0))


def _is_drawable(row: Row) -> bool:
    """Return whether the numbers of a row have a place on logarithmic axes."""
    work, errors = (row.wall_seconds, row.rhs_evaluations), (row.error, row.time_error)
    return all(0.0 <= value < MAX_DRAWN for value in (*work, *(e for e in errors if e is not None)))


def rows_of(table: CostTable) -> list[Row]:
    """Return the rows of a table; one without an error counts as failed."""
    measures = measures_of(table)
    return [_row(_values(table, number), measures) for number in range(table.rows)]


def _values(table: CostTable, number: int) -> dict[str, Any]:
    return {name: column.values[number] for name, column in table.columns.items()}


def _row(values: dict[str, Any], measures: list[str]) -> Row:
    def whole(name: str) -> int:
        found = values.get(name, 0.0)
        return int(found) if isinstance(found, float) and isfinite(found) else 0

    bodies = whole("bodies")
    mesh = Mesh(str(values["model"]), bodies) if values.get("model") and bodies else None
    setting = Setting(values["backend"], values["setting"], (), values.get("law", ""), mesh=mesh)
    done = values["status"] == "done" and values["error"] == values["error"]
    # `error` of the table comes first: a column that was cut out changes no recommendation.
    errors = {"error": Error(None, values["error"])} if done else {}
    for name in measures:
        relative = values[name + RELATIVE]
        if done and isinstance(relative, float) and relative == relative:
            errors[name] = Error(None, relative)
    in_time = _known(values.get("time_error"))
    return Row(
        setting=setting,
        status="done" if done else "failed",
        reason=str(values.get("reason", "")),
        wall_seconds=values["wall_seconds"],
        repeats=whole("repeats"),
        steps=whole("steps"),
        rejected=whole("rejected"),
        rhs_evaluations=whole("rhs_evaluations"),
        states=whole("states"),
        events=whole("events"),
        errors=errors,
        time_errors={} if in_time is None else {"error": Error(None, in_time)},
        wall_spread=_known(values.get("wall_spread")),
    )


def _known(value: Any) -> float | None:
    return value if isinstance(value, float) and isfinite(value) else None
