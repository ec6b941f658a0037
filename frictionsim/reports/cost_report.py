"""The report of a work-precision study: what accuracy costs in time."""

from collections.abc import Iterator
from pathlib import Path

from frictionsim.io.cost_table import CostTable
from frictionsim.reports.page import page
from frictionsim.reports.study_parts import (
    STUDY_SCRIPTS,
    Picture,
    head,
    number,
    short,
    shown_pictures,
    study_section,
    study_table,
)
from frictionsim.reports.tables import Number
from frictionsim.work_precision.outcome import Row
from frictionsim.work_precision.reading import RELATIVE, advice_of, floors_of, measures_of, rows_of

BELOW = "below_uncertainty"
COUNTS = ("events", "steps", "rejected", "rhs_evaluations", "states", "repeats")
MAX_ROWS = 1000  # in the page; a study has some hundred
MAX_MEASURES = 40
MAX_NOTES = 10


def cost_page(found: CostTable, source: str, picture: Picture) -> str:
    """Return the HTML of the report of a table of costs.

    Parameters
    ----------
    found : CostTable
    source : str
        Name of its file; empty if there is none.
    picture : Picture
        Its diagram.

    Raises
    ------
    ValueError
        If the table is damaged.
    """
    advice, floors = [each.worded() for each in advice_of(found)], floors_of(found)
    about = found.attributes
    title = (
        f"{about.get('title') or about.get('kind') or Path(source).name}: error against run time"
    )
    rows = rows_of(found)
    measures = measures_of(found)[:MAX_MEASURES]
    lines = [
        f"kind {about['kind']}" if about.get("kind") else "",
        f"{_status(about)}{len(rows)} settings" + (f", from {source}" if source else ""),
        *found.notes[:MAX_NOTES],
    ]
    body = "\n".join(
        (
            head(title, *lines),
            study_section("What to use", _advice(advice), *_references(found, floors)),
            study_section("Diagram", *shown_pictures([picture])),
            study_section("Settings", *_limits(found, len(rows)), _settings(found, rows, measures)),
            *_failures(rows),
        )
    )
    return page(title, body, None, STUDY_SCRIPTS)


def _status(about: dict[str, str]) -> str:
    if not about.get("status"):
        return ""
    return f"{about['status']}{': ' if about.get('reason') else ''}{about.get('reason', '')}, "


def _advice(sentences: list[str]) -> str:
    return f"<ul>{''.join(f'<li>{short(sentence)}</li>' for sentence in sentences)}</ul>"


def _references(found: CostTable, floors: dict[str, float]) -> Iterator[str]:
    """Yield what the errors are of, and what they cannot resolve."""
    names = found.attributes.get("references", "").splitlines()
    if names:
        yield f"<p>Errors are those against {short(' and '.join(names), 1000)}.</p>"
    if floors:
        parts = ", ".join(f"{name} {value:.1e}" for name, value in floors.items())
        yield (
            f"<p>The references differ by {max(floors.values()):.1e} ({short(parts, 2000)});"
            " smaller errors cannot be resolved.</p>"
        )
    else:
        yield (
            "<p>The table does not hold the reference uncertainty: the errors may not be resolved"
            " so finely.</p>"
        )


def _limits(found: CostTable, rows: int) -> Iterator[str]:
    measures = len(measures_of(found))
    if rows > MAX_ROWS:
        yield f"<p>The first {MAX_ROWS} of {rows} rows are shown.</p>"
    if BELOW in found.columns:
        yield "<p>* below the reference uncertainty: an error that is not resolved.</p>"
    if measures > MAX_MEASURES:
        yield f"<p>The first {MAX_MEASURES} of {measures} measures are shown.</p>"


def _settings(found: CostTable, rows: list[Row], measures: list[str]) -> str:
    of_meshes = any(row.setting.mesh for row in rows)
    in_time = [">error in time"] if "time_error" in found.columns else []
    headings = [
        *("law, method", "setting", *((">bodies",) if of_meshes else ()), "outcome", ">error"),
        *in_time,
        *(f">{name}, relative" for name in measures),
        ">wall time, s",
        *((">its spread, s",) if "wall_spread" in found.columns else ()),
        *(f">{name.replace('_', ' ')}" for name in COUNTS if name in found.columns),
        *(("keys it sets",) if "overrides" in found.columns else ()),
    ]
    cells = [
        _cells(found, place, row, measures, of_meshes) for place, row in enumerate(rows[:MAX_ROWS])
    ]
    return study_table("All settings, one row each", headings, cells, "settings")


def _cells(
    found: CostTable, place: int, row: Row, measures: list[str], of_meshes: bool
) -> list[str | Number]:
    below = str(found.columns[BELOW].values[place]).split() if BELOW in found.columns else []

    def value(name: str) -> Number:
        cell = number(_value(found, name, place), 4)
        return (
            cell._replace(shown=f"{cell.shown}*") if name.removesuffix(RELATIVE) in below else cell
        )

    bodies = row.setting.mesh.bodies if row.setting.mesh else 0
    return [
        row.setting.line,
        row.setting.label,
        *((Number(str(bodies or ""), bodies),) if of_meshes else ()),
        f"{row.status}{': ' if row.reason else ''}{row.reason}",
        value("error"),
        *((value("time_error"),) if "time_error" in found.columns else ()),
        *(value(name + RELATIVE) for name in measures),
        value("wall_seconds"),
        *((value("wall_spread"),) if "wall_spread" in found.columns else ()),
        *(number(_value(found, name, place), 10) for name in COUNTS if name in found.columns),
        *((found.columns["overrides"].values[place],) if "overrides" in found.columns else ()),
    ]


def _value(found: CostTable, name: str, place: int) -> float:
    value = found.columns[name].values[place]
    return float(value) if isinstance(value, (int, float)) else float("nan")


def _failures(rows: list[Row]) -> Iterator[str]:
    failed = [row for row in rows if row.status != "done"]
    if failed:
        cells = [(row.setting.name, row.reason) for row in failed[:MAX_ROWS]]
        caption = f"{len(failed)} of {len(rows)} settings failed"
        yield study_section("Failed settings", study_table(caption, ("setting", "reason"), cells))
