"""The results of a study as JSON, CSV and columns for HDF5."""

import csv
import json
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from frictionsim.io.atomic_write import write_atomically
from frictionsim.io.replaceable import COSTS, check_replaceable
from frictionsim.results import Column, finite
from frictionsim.work_precision.recommendation import recommendations

if TYPE_CHECKING:
    from frictionsim.work_precision.outcome import Row, WorkPrecision


def study_json(study: "WorkPrecision", source: str) -> dict[str, Any]:
    """Return the JSON object of a study.

    Parameters
    ----------
    study : WorkPrecision
    source : str
        Path of the scenario.
    """
    reference = study.reference
    return {
        "scenario": source,
        "overrides": study.scenario.origin.values,
        "kind": study.scenario.kind,
        "status": study.status,
        "reason": study.reason,
        "measures": {metric.name: {"unit": metric.unit} for metric in study.metrics},
        "references": list(reference.names) if reference else [],
        "floor": _errors_json(reference.floor) if reference else {},
        "time_references": list(study.time_reference.names) if study.time_reference else [],
        "settings": [
            _row_json(row) | {"below_uncertainty": study.below_uncertainty(row)}
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


def _row_json(row: "Row") -> dict[str, Any]:
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
        "events": row.events,
        "wall_seconds": row.wall_seconds,
        "wall_spread": row.wall_spread,
        "repeats": row.repeats,
        "steps": row.steps,
        "rejected": row.rejected,
        "rhs_evaluations": row.rhs_evaluations,
        "states": row.states,
    }


def _mesh_json(row: "Row") -> dict[str, Any]:
    mesh = row.setting.mesh
    return {"model": mesh.model, "bodies": mesh.bodies} if mesh else {}


def _errors_json(errors: dict[str, Any]) -> dict[str, Any]:
    return {
        name: {"absolute": finite(error.absolute), "relative": finite(error.relative)}
        for name, error in errors.items()
    }


def attributes(study: "WorkPrecision") -> dict[str, str]:
    """Return the attributes of a study beside its rows, as texts.

    `status` and `reason`; `references` and `time_references`, one per line;
    `reference_uncertainty`, JSON: the relative difference of the two references for each measure;
    `quantities`, the measures that are quantities, of a study of meshes.
    """
    reference, in_time = study.reference, study.time_reference
    floor = reference.floor if reference else {}
    wanted = [m.name for m in study.metrics if m.what == "quantity"] if study.of_meshes else []
    return {
        "status": study.status,
        "reason": study.reason,
        "references": "\n".join(reference.names) if reference else "",
        "time_references": "\n".join(in_time.names) if in_time else "",
        "reference_uncertainty": json.dumps({n: finite(e.relative) for n, e in floor.items()}),
        "quantities": " ".join(wanted),
    }


def columns(study: "WorkPrecision") -> list[Column]:
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
        table.append(Column(f"{m.name}_relative", "1", f"relative error of {m.name}", relative))
    for name, unit, long_name in (
        ("events", "1", "events of the run"),
        ("wall_seconds", "s", "median wall time of the solution alone"),
        ("wall_spread", "s", "largest minus least wall time of the repeats"),
        ("repeats", "1", "runs that were timed"),
        ("steps", "1", "accepted steps"),
        ("rejected", "1", "rejected steps"),
        ("rhs_evaluations", "1", "evaluations of the right-hand side"),
        ("states", "1", "length of the state vector"),
    ):
        values = [number(getattr(row, name)) for row in rows]
        table.append(Column(name, unit, long_name, values))
    return table


def _mesh_columns(rows: "list[Row]") -> tuple[Column, Column]:
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


def write_csv(study: "WorkPrecision", path: Path) -> None:
    """Write the table of a study as CSV, with units in the header line; whole or not at all."""
    table, text = columns(study), StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow([f"{c.name} [{c.unit}]" if c.unit else c.name for c in table])
    writer.writerows(zip(*(c.values for c in table), strict=True))
    check_replaceable(path, COSTS)
    write_atomically(text.getvalue().encode(), path, COSTS.word)
