"""Tables of costs whose rows are made by hand, in CSV."""

import csv
import html
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from matplotlib.figure import Figure

import frictionsim as fs
from frictionsim.io.cost_table import read_csv
from frictionsim.plots.studies import cost_diagram


def made_row(
    backend: str,
    error: float | None,
    seconds: float,
    evaluations: int = 100,
    repeats: int = 3,
    mesh: tuple[str, int] | None = None,
    **others: Any,
) -> dict[str, Any]:
    """Return a row of a table; without an error that of a run that failed."""
    shown = "nan" if error is None else error
    of_mesh = {}
    if mesh:
        of_mesh = {"model": mesh[0], "bodies [1]": mesh[1], "time_error [1]": "nan"}
    return {
        "law": "",
        "backend": backend,
        "setting": "rtol 1",
        **of_mesh,
        "status": "failed" if error is None else "done",
        "error [1]": shown,
        "angle_error [rad]": shown,
        "angle_relative [1]": shown,
        "wall_seconds [s]": seconds,
        "repeats [1]": repeats,
        "steps [1]": 1,
        "rhs_evaluations [1]": evaluations,
        "title": "A pulley",
        **others,
    }


def made_table(
    path: Path, rows: list[dict[str, Any]], uncertainty: Mapping[str, float] | None = None
) -> Path:
    """Write rows as the file of a study, with the difference of its references by measure."""
    with path.open("w", newline="", encoding="utf-8") as file:
        known = {"angle": 0.0} if uncertainty is None else uncertainty
        about = {"references": "one and two", "reference_uncertainty": json.dumps(known)}
        writer = csv.DictWriter(file, [*rows[0], *about])
        writer.writeheader()
        writer.writerows(row | about for row in rows)
    return path


def drawn_table(
    path: Path, rows: list[dict[str, Any]], uncertainty: Mapping[str, float] | None = None
) -> Figure:
    """Return the picture of such a study; here alone a table is drawn that no study has made."""
    return cost_diagram(read_csv(made_table(path, rows, uncertainty)))


def said_of(path: Path) -> list[str]:
    """Return what the report of a table recommends."""
    page = fs.report(path, path.with_suffix(".html")).read_text(encoding="utf-8")
    found = re.findall(r">\s*(for [0-9., and%]+ ?%:[^<]*?)\s*<", html.unescape(page))
    return [sentence.replace("\N{MINUS SIGN}", "-") for sentence in found]
