"""A study as JSON, and as the table that files hold: Row, CostTable, file, CostTable, Row."""

import json
from math import isfinite
from typing import TYPE_CHECKING, Any

from frictionsim.errors import EXIT_DONE
from frictionsim.io.cost_table import CostTable
from frictionsim.results import Column, Metric, finite
from frictionsim.scenario.toml_data import json_value
from frictionsim.scenario.variants import Mesh, Setting
from frictionsim.work_precision.outcome import (
    Error,
    Reference,
    ReferenceOutcome,
    Row,
    WorkPrecision,
)
from frictionsim.work_precision.recommendation import recommendations

if TYPE_CHECKING:
    from frictionsim.scenario.settings import Scenario

RELATIVE = "_relative"
NUMBERS = {
    "events": ("1", "events of the run"),
    "wall_seconds": ("s", "median wall time of the solution alone"),
    "wall_spread": ("s", "largest minus least wall time of the repeats"),
    "repeats": ("1", "runs that were timed"),
    "steps": ("1", "accepted steps"),
    "rejected": ("1", "rejected steps"),
    "rhs_evaluations": ("1", "evaluations of the right-hand side"),
    "states": ("1", "length of the state vector"),
}
"""Unit and description of the numbers of a `Row`, by name."""


def study_json(study: WorkPrecision, scenario: "Scenario") -> dict[str, Any]:
    """Return the JSON object of a study of a scenario."""
    reference = study.reference
    return {
        "scenario": scenario.origin.source,
        "overrides": scenario.origin.values,
        "kind": scenario.kind,
        "status": study.status,
        "reason": study.reason,
        "measures": {metric.name: {"unit": metric.unit} for metric in study.metrics},
        "references": list(reference.names) if reference else [],
        "floor": _errors_json(reference.floor) if reference else {},
        "time_references": list(study.time_reference.names) if study.time_reference else [],
        "settings": [
            _row_json(row) | {"below_uncertainty": list(study.below_uncertainty(row))}
            for row in study.rows
        ],
        "recommendations": [
            {
                "wanted": advice.wanted,
                "law": advice.row.setting.law if advice.row else None,
                "backend": advice.row.setting.backend if advice.row else None,
                "setting": advice.row.setting.label if advice.row else None,
                **(_mesh_json(advice.row) if advice.row else {}),
                "quantity": advice.metric or None,
                "overrides": list(advice.row.setting.all_overrides) if advice.row else None,
                "sentence": advice.sentence,
            }
            for advice in recommendations(study)
        ],
    }


def _row_json(row: Row) -> dict[str, Any]:
    return {
        "law": row.setting.law,
        "backend": row.setting.backend,
        "setting": row.setting.label,
        **_mesh_json(row),
        "overrides": list(row.setting.all_overrides),
        "status": row.status,
        "reason": row.reason,
        "error": finite(row.error),
        "time_error": finite(row.time_error),
        "errors": _errors_json(row.errors),
        **{name: getattr(row, name) for name in NUMBERS},
    }


def _mesh_json(row: Row) -> dict[str, Any]:
    mesh = row.setting.mesh
    return {"model": mesh.model, "bodies": mesh.bodies} if mesh else {}


def _errors_json(errors: dict[str, Any]) -> dict[str, Any]:
    return {
        name: {"absolute": finite(error.absolute), "relative": finite(error.relative)}
        for name, error in errors.items()
    }


def table_of(study: WorkPrecision) -> CostTable:
    """Return the table of a study."""
    return CostTable(_attributes(study), {column.name: column for column in _columns(study)})


def _attributes(study: WorkPrecision) -> dict[str, str]:
    """Return the attributes of a study beside its rows, as texts.

    `title` and `kind`; `status` and `reason`; `references` and `time_references`, one per line;
    `reference_uncertainty`, JSON: the relative difference of the two references for each measure;
    `quantities`, the measures that are quantities, of a study of meshes.
    """
    reference, in_time = study.reference, study.time_reference
    floor = reference.floor if reference else {}
    wanted = [m.name for m in study.metrics if m.what == "quantity"] if study.of_meshes else []
    return {
        "title": study.title,
        "kind": study.kind,
        "status": study.status,
        "reason": study.reason,
        "references": "\n".join(reference.names) if reference else "",
        "time_references": "\n".join(in_time.names) if in_time else "",
        "reference_uncertainty": json.dumps({n: finite(e.relative) for n, e in floor.items()}),
        "quantities": " ".join(wanted),
    }


def _columns(study: WorkPrecision) -> list[Column]:
    """Return the table of a study as columns; unknown values are NaN."""
    rows, nan = study.rows, float("nan")

    def number(value: float | None) -> float:
        return nan if value is None else float(value)

    table = [
        Column("law", "", "friction law", [row.setting.law for row in rows]),
        Column("backend", "", "integration method", [row.setting.backend for row in rows]),
        Column("setting", "", "setting of the method", [row.setting.label for row in rows]),
        *(_mesh_columns(rows) if study.of_meshes else ()),
        Column(
            "overrides", "", "keys it sets", [" ".join(row.setting.all_overrides) for row in rows]
        ),
        Column("status", "", "done or failed", [row.status for row in rows]),
        Column("reason", "", "why it failed", [row.reason for row in rows]),
        Column("error", "1", "largest relative error", [number(row.error) for row in rows]),
    ]
    if study.of_meshes:
        times = [number(row.time_error) for row in rows]
        table.append(Column("time_error", "1", "largest relative error in time alone", times))
    below = [" ".join(study.below_uncertainty(row)) for row in rows]
    table.append(
        Column("below_uncertainty", "", "errors that are below the reference uncertainty", below)
    )
    for m in study.metrics:
        errors = [row.errors.get(m.name) for row in rows]
        absolute = [number(e and e.absolute) for e in errors]
        relative = [number(e and e.relative) for e in errors]
        table.append(Column(f"{m.name}_error", m.unit, f"error of {m.name}", absolute))
        table.append(Column(m.name + RELATIVE, "1", f"relative error of {m.name}", relative))
    for name, (unit, long_name) in NUMBERS.items():
        values = [number(getattr(row, name)) for row in rows]
        table.append(Column(name, unit, long_name, values))
    return table


def _mesh_columns(rows: list[Row]) -> tuple[Column, Column]:
    meshes = [row.setting.mesh for row in rows]
    return (
        Column("model", "", "model in space", [mesh.model if mesh else "" for mesh in meshes]),
        Column(
            "bodies",
            "1",
            "number of bodies",
            [float(mesh.bodies) if mesh else float("nan") for mesh in meshes],
        ),
    )


def study_of(table: CostTable) -> WorkPrecision:
    """Return the study that a table was written from.

    A row without an error counts as failed, and absolute errors are left out.

    Raises
    ------
    ValueError
        If its reference uncertainty is damaged.
    """
    about = table.attributes
    names = [name.removesuffix(RELATIVE) for name in table.columns if name.endswith(RELATIVE)]
    quantities = about.get("quantities", "").split()
    floors = _floors(about.get("reference_uncertainty", "{}"))
    in_time = about.get("time_references", "").splitlines()
    return WorkPrecision(
        scenario=None,
        metrics=tuple(Metric(n, "quantity" if n in quantities else "channel") for n in names),
        reference=Reference(
            ReferenceOutcome(), tuple(about.get("references", "").splitlines()), floors
        ),
        rows=[_row(_values(table, number), names) for number in range(table.rows)],
        status=about.get("status", ""),
        reason=about.get("reason", ""),
        exit_code=EXIT_DONE,
        time_reference=Reference(ReferenceOutcome(), tuple(in_time), {}) if in_time else None,
        title=about.get("title", ""),
        kind=about.get("kind", ""),
        notes=table.notes,
    )


def _floors(text: str) -> dict[str, Error]:
    """Return the reference uncertainty by metric, of the text in a table."""
    try:
        known = {
            name: float(value) for name, value in json_value(text).items() if value is not None
        }
    except (ValueError, AttributeError, TypeError):
        raise ValueError("its reference uncertainty is damaged") from None
    if not all(map(isfinite, known.values())):
        raise ValueError("its reference uncertainty is not finite")
    return {name: Error(None, value) for name, value in known.items()}


def _values(table: CostTable, number: int) -> dict[str, Any]:
    return {name: column.values[number] for name, column in table.columns.items()}


def _row(values: dict[str, Any], metrics: list[str]) -> Row:
    def whole(name: str) -> int | None:
        value = _known(values.get(name))
        return None if value is None else int(value)

    bodies = whole("bodies")
    mesh = Mesh(str(values["model"]), bodies) if values.get("model") and bodies else None
    overrides = tuple(str(values.get("overrides", "")).split())
    law = values.get("law", "")
    done = values["status"] == "done" and values["error"] == values["error"]
    # `error` of the table comes first: a column that was cut out changes no recommendation.
    errors = {"error": Error(None, values["error"])} if done else {}
    for name in metrics:
        relative = values[name + RELATIVE]
        if done and isinstance(relative, float) and relative == relative:
            errors[name] = Error(None, relative)
    in_time = _known(values.get("time_error"))
    return Row(
        setting=Setting(values["backend"], values["setting"], overrides, law, mesh=mesh),
        status="done" if done else "failed",
        reason=str(values.get("reason", "")),
        wall_seconds=values["wall_seconds"],
        repeats=whole("repeats"),
        steps=whole("steps") or 0,
        rejected=whole("rejected"),
        rhs_evaluations=whole("rhs_evaluations") or 0,
        states=whole("states"),
        events=whole("events"),
        errors=errors,
        time_errors={} if in_time is None else {"error": Error(None, in_time)},
        wall_spread=_known(values.get("wall_spread")),
        unresolved=tuple(str(values.get("below_uncertainty", "")).split()),
    )


def _known(value: Any) -> float | None:
    return value if isinstance(value, float) and isfinite(value) else None
