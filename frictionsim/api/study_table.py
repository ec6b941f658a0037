"""The table of a work-precision study."""

from typing import TYPE_CHECKING

from frictionsim.api.tables import Cells, Parts
from frictionsim.work_precision.recommendation import recommendations

if TYPE_CHECKING:
    from frictionsim.work_precision.outcome import Row, Study


def study_parts(study: "Study") -> Parts:
    """Yield the reference uncertainty, the table and the recommendations of a study."""
    scenario = study.scenario
    yield f"{scenario.title or scenario.kind}: error against run time ({study.status})"
    yield from _reference_lines(study)
    names = [metric.name for metric in study.metrics]
    of_mesh, in_time = (["model", ">bodies"], [">in time"]) if study.of_meshes else ([], [])
    headings = [
        *(*of_mesh, "law", "method", "setting", ">error", *in_time),
        *(f">{name}" for name in names),
        *(">events", ">ms", ">spread", ">steps", ">rejected", ">rhs", ""),
    ]
    yield Cells(headings, [_cells(study, row, names) for row in study.rows])
    yield from (advice.sentence for advice in recommendations(study))


def _reference_lines(study: "Study") -> list[str]:
    reference = study.reference
    if reference is None:
        return []
    lines = [f"reference: {' and '.join(reference.names)}"]
    if reference.floor:
        parts = ", ".join(f"{name} {e.relative:.1e}" for name, e in reference.floor.items())
        lines.append(
            f"reference uncertainty: {study.floor:.1e}, the difference of the references ({parts});"
            " smaller errors cannot be resolved"
        )
    elif len(reference.names) == 1:
        lines.append("reference uncertainty: unknown, the second reference failed")
    if study.time_reference is not None:
        lines.append(
            f"`in time`: error against {' and '.join(study.time_reference.names)}, which differ by"
            f" {study.time_reference.uncertainty:.1e}"
        )
    return [
        *lines,
        "errors are relative, `error` is the largest; * below the reference uncertainty; spread:"
        " largest minus least ms of the repeats; rhs: evaluations of the right-hand side",
    ]


def _cells(study: "Study", row: "Row", names: list[str]) -> list[str]:
    below, of_meshes = study.below_uncertainty(row), study.of_meshes

    def marked(name: str, error: float | None) -> str:
        return "" if error is None else f"{error:.1e}{'*' if name in below else ''}"

    mesh = row.setting.mesh
    spread = row.wall_spread
    return [
        *((mesh.model, str(mesh.bodies)) if mesh else ("", "") if of_meshes else ()),
        row.setting.law,
        row.setting.backend,
        row.setting.label,
        marked("error", row.error) or "failed",
        *((marked("time_error", row.time_error),) if of_meshes else ()),
        *(marked(n, row.errors[n].relative if n in row.errors else None) for n in names),
        str(row.events),
        f"{1e3 * row.wall_seconds:.3g}",
        "" if spread is None else f"{1e3 * spread:.2g}",
        str(row.steps),
        "" if row.rejected is None else str(row.rejected),
        str(row.rhs_evaluations),
        row.reason,
    ]
