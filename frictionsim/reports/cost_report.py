"""The report of a work-precision study: what accuracy costs in time."""

from collections.abc import Iterator
from pathlib import Path

from frictionsim.document import Cell, Number, Picture, Table
from frictionsim.reports.html import Html, listed, number, picture, section, short, study_table
from frictionsim.reports.page import study_page
from frictionsim.work_precision.outcome import Row, WorkPrecision
from frictionsim.work_precision.recommendation import recommendations

COUNTS = ("events", "steps", "rejected", "rhs_evaluations", "states", "repeats")
MAX_ROWS = 1000  # in the page; a study has some hundred
MAX_METRICS = 40
MAX_NOTES = 10


def cost_page(study: WorkPrecision, source: str, diagram: Picture) -> str:
    """Return the HTML of the report of a study.

    Parameters
    ----------
    source : str
        Name of its file; empty if there is none.
    diagram : Picture
    """
    title = f"{study.title or study.kind or Path(source).name}: error against run time"
    lines = [
        f"kind {study.kind}" if study.kind else "",
        f"{_status(study)}{len(study.rows)} settings" + (f", from {source}" if source else ""),
        *study.notes[:MAX_NOTES],
    ]
    advice = [each.worded() for each in recommendations(study)]
    sections = (
        section("What to use", listed(map(short, advice)), *_references(study)),
        section("Diagram", picture(diagram)),
        section("Settings", *_limits(study), _settings(study)),
        *_failures(study.rows),
    )
    return study_page(title, (title, *lines), sections)


def _status(study: WorkPrecision) -> str:
    if not study.status:
        return ""
    return f"{study.status}{': ' if study.reason else ''}{study.reason}, "


def _references(study: WorkPrecision) -> Iterator[str]:
    """Yield the references of the errors, and the smallest errors that they resolve."""
    reference = study.reference
    if reference is not None and reference.names:
        yield f"Errors are those against {short(' and '.join(reference.names), 1000)}."
    if reference is not None and reference.floor:
        parts = ", ".join(f"{name} {e.relative:.1e}" for name, e in reference.floor.items())
        yield (
            f"The references differ by {study.floor:.1e} ({short(parts, 2000)});"
            " smaller errors cannot be resolved."
        )
    else:
        yield (
            "The table does not hold the reference uncertainty: the errors may not be resolved"
            " so finely."
        )


def _limits(study: WorkPrecision) -> Iterator[str]:
    rows, metrics = len(study.rows), len(study.metrics)
    if rows > MAX_ROWS:
        yield f"The first {MAX_ROWS} of {rows} rows are shown."
    if any(map(study.below_uncertainty, study.rows)):
        yield "* below the reference uncertainty: an error that is not resolved."
    if metrics > MAX_METRICS:
        yield f"The first {MAX_METRICS} of {metrics} measures are shown."


def _settings(study: WorkPrecision) -> Html:
    """Return the table of settings, without the columns that an older file lacks."""
    rows, metrics = study.rows[:MAX_ROWS], [m.name for m in study.metrics[:MAX_METRICS]]
    with_time = any(row.time_error is not None for row in rows)
    with_spread = any(row.wall_spread is not None for row in rows)
    counts = [name for name in COUNTS if any(getattr(row, name) is not None for row in rows)]
    headings = [
        *("law, method", "setting", *((">bodies",) if study.of_meshes else ()), "outcome"),
        *(">error", *((">error in time",) if with_time else ())),
        *(f">{name}, relative" for name in metrics),
        *(">wall time, s", *((">its spread, s",) if with_spread else ())),
        *(f">{name.replace('_', ' ')}" for name in counts),
        "keys it sets",
    ]

    def cells(row: Row) -> list[Cell]:
        unresolved = study.below_uncertainty(row)

        def error(name: str, value: float | None) -> Number:
            cell = _number(value, 4)
            return cell._replace(shown=f"{cell.shown}*") if name in unresolved else cell

        bodies = row.setting.mesh.bodies if row.setting.mesh else 0
        errors = {name: row.errors[name].relative for name in metrics if name in row.errors}
        return [
            *(row.setting.line, row.setting.label),
            *((Number(str(bodies or ""), bodies),) if study.of_meshes else ()),
            f"{row.status}{': ' if row.reason else ''}{row.reason}",
            error("error", row.error),
            *((error("time_error", row.time_error),) if with_time else ()),
            *(error(name, errors.get(name)) for name in metrics),
            _number(row.wall_seconds, 4),
            *((_number(row.wall_spread, 4),) if with_spread else ()),
            *(_number(getattr(row, name), 10) for name in counts),
            " ".join(row.setting.all_overrides),
        ]

    caption = "All settings, one row each"
    return study_table(Table(headings, list(map(cells, rows)), caption, "settings"))


def _number(value: float | None, digits: int) -> Number:
    return number(float("nan") if value is None else float(value), digits)


def _failures(rows: list[Row]) -> Iterator[Html]:
    failed = [row for row in rows if row.status != "done"]
    if failed:
        cells = [(row.setting.name, row.reason) for row in failed[:MAX_ROWS]]
        caption = f"{len(failed)} of {len(rows)} settings failed"
        yield section("Failed settings", study_table(Table(("setting", "reason"), cells, caption)))
