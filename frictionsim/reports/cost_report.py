"""The report of a work-precision study: what accuracy costs in time."""

from collections.abc import Iterator
from pathlib import Path

from frictionsim.document import Cell, Number, Picture, Table
from frictionsim.io.cost_table import CostTable
from frictionsim.reports.html import Html, listed, number, picture, section, short, study_table
from frictionsim.reports.page import study_page
from frictionsim.work_precision.outcome import Row
from frictionsim.work_precision.reading import RELATIVE, advice_of, floors_of, measures_of, rows_of

BELOW = "below_uncertainty"
COUNTS = ("events", "steps", "rejected", "rhs_evaluations", "states", "repeats")
MAX_ROWS = 1000  # in the page; a study has some hundred
MAX_MEASURES = 40
MAX_NOTES = 10


def cost_page(costs: CostTable, source: str, diagram: Picture) -> str:
    """Return the HTML of the report of a table of costs.

    Parameters
    ----------
    costs : CostTable
    source : str
        Name of its file; empty if there is none.
    diagram : Picture

    Raises
    ------
    ValueError
        If the table is damaged.
    """
    advice, floors = [each.worded() for each in advice_of(costs)], floors_of(costs)
    about = costs.attributes
    title = (
        f"{about.get('title') or about.get('kind') or Path(source).name}: error against run time"
    )
    rows = rows_of(costs)
    measures = measures_of(costs)[:MAX_MEASURES]
    lines = [
        f"kind {about['kind']}" if about.get("kind") else "",
        f"{_status(about)}{len(rows)} settings" + (f", from {source}" if source else ""),
        *costs.notes[:MAX_NOTES],
    ]
    sections = (
        section("What to use", listed(map(short, advice)), *_references(costs, floors)),
        section("Diagram", picture(diagram)),
        section("Settings", *_limits(costs, len(rows)), _settings(costs, rows, measures)),
        *_failures(rows),
    )
    return study_page(title, (title, *lines), sections)


def _status(about: dict[str, str]) -> str:
    if not about.get("status"):
        return ""
    return f"{about['status']}{': ' if about.get('reason') else ''}{about.get('reason', '')}, "


def _references(costs: CostTable, floors: dict[str, float]) -> Iterator[str]:
    """Yield the references of the errors, and the smallest errors that they resolve."""
    names = costs.attributes.get("references", "").splitlines()
    if names:
        yield f"Errors are those against {short(' and '.join(names), 1000)}."
    if floors:
        parts = ", ".join(f"{name} {value:.1e}" for name, value in floors.items())
        yield (
            f"The references differ by {max(floors.values()):.1e} ({short(parts, 2000)});"
            " smaller errors cannot be resolved."
        )
    else:
        yield (
            "The table does not hold the reference uncertainty: the errors may not be resolved"
            " so finely."
        )


def _limits(costs: CostTable, rows: int) -> Iterator[str]:
    measures = len(measures_of(costs))
    if rows > MAX_ROWS:
        yield f"The first {MAX_ROWS} of {rows} rows are shown."
    if BELOW in costs.columns:
        yield "* below the reference uncertainty: an error that is not resolved."
    if measures > MAX_MEASURES:
        yield f"The first {MAX_MEASURES} of {measures} measures are shown."


def _settings(costs: CostTable, rows: list[Row], measures: list[str]) -> Html:
    of_meshes = any(row.setting.mesh for row in rows)
    in_time = [">error in time"] if "time_error" in costs.columns else []
    headings = [
        *("law, method", "setting", *((">bodies",) if of_meshes else ()), "outcome", ">error"),
        *in_time,
        *(f">{name}, relative" for name in measures),
        ">wall time, s",
        *((">its spread, s",) if "wall_spread" in costs.columns else ()),
        *(f">{name.replace('_', ' ')}" for name in COUNTS if name in costs.columns),
        *(("keys it sets",) if "overrides" in costs.columns else ()),
    ]
    cells = [
        _cells(costs, place, row, measures, of_meshes) for place, row in enumerate(rows[:MAX_ROWS])
    ]
    return study_table(Table(headings, cells, "All settings, one row each", "settings"))


def _cells(
    costs: CostTable, place: int, row: Row, measures: list[str], of_meshes: bool
) -> list[Cell]:
    below = str(costs.columns[BELOW].values[place]).split() if BELOW in costs.columns else []

    def value(name: str) -> Number:
        cell = number(_value(costs, name, place), 4)
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
        *((value("time_error"),) if "time_error" in costs.columns else ()),
        *(value(name + RELATIVE) for name in measures),
        value("wall_seconds"),
        *((value("wall_spread"),) if "wall_spread" in costs.columns else ()),
        *(number(_value(costs, name, place), 10) for name in COUNTS if name in costs.columns),
        *((costs.columns["overrides"].values[place],) if "overrides" in costs.columns else ()),
    ]


def _value(costs: CostTable, name: str, place: int) -> float:
    value = costs.columns[name].values[place]
    return float(value) if isinstance(value, (int, float)) else float("nan")


def _failures(rows: list[Row]) -> Iterator[Html]:
    failed = [row for row in rows if row.status != "done"]
    if failed:
        cells = [(row.setting.name, row.reason) for row in failed[:MAX_ROWS]]
        caption = f"{len(failed)} of {len(rows)} settings failed"
        yield section("Failed settings", study_table(Table(("setting", "reason"), cells, caption)))
