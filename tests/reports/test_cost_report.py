"""Reports of tables of costs: their charts hold the numbers of the table."""

import csv
from pathlib import Path

import frictionsim as fs
from tests.support.html_elements import charts_of
from tests.support.scenarios import ROOT, pulley

COLUMNS = (
    "law,backend,setting,status,reason,error [1],wall_seconds [s],steps [1],rhs_evaluations [1]"
)


def rows_of(file: Path) -> list[dict[str, str]]:
    """Return the rows of a table by their columns, read by others' readers."""
    text = file.read_text(encoding="utf-8").splitlines()
    rows = csv.DictReader(line for line in text if not line.startswith("#"))
    return [{key.split(" [")[0]: value for key, value in row.items()} for row in rows]


def test_the_chart_holds_the_numbers_of_the_table(tmp_path: Path) -> None:
    backends, laws = ["events", "lsoda"], ["set-valued", "regularised"]
    study = fs.cost(
        pulley(solver__duration=1.0),
        backends=backends,
        laws=laws,
        tolerances=[1e-3, 1e-4, 1e-5],
        repeats=1,
    )
    file = study.save(tmp_path / "costs.csv")
    page = fs.report(file, tmp_path / "a.html").read_text(encoding="utf-8")
    assert all(sentence.replace("'", "&#x27;") in page for sentence in study.recommendations)
    traces, layout = charts_of(page)["charts"]
    assert layout["yaxis"]["type"] == layout["xaxis"]["type"] == "log"
    for work, axis in (("wall_seconds", "x"), ("rhs_evaluations", "x2")):
        lines: dict[str, list[tuple[float, float]]] = {}
        for row in rows_of(file):
            if row["status"] == "done" and float(row["error"]) > 0.0:
                point = float(row[work]), float(row["error"])
                lines.setdefault(f"{row['backend']}, {row['law']}", []).append(point)
        drawn = {
            trace["name"]: list(zip(trace["x"], trace["y"], strict=True))
            for trace in traces
            if trace["xaxis"] == axis
        }
        assert drawn == lines


def test_no_two_methods_of_a_chart_look_alike(tmp_path: Path) -> None:
    table = tmp_path / "c.csv"
    rows = [f"set-valued,m{number},a,done,,1e-3,1.0,9,9" for number in range(20)]
    table.write_text("\n".join((COLUMNS, *rows)), encoding="utf-8")
    page = fs.report(table, tmp_path / "a.html").read_text(encoding="utf-8")
    traces, _ = charts_of(page)["charts"]
    looks = {(trace["marker"]["color"], trace["marker"]["symbol"]) for trace in traces}
    assert len(looks) == len(rows)


def test_recommendations_are_apart_from_failed_settings(tmp_path: Path) -> None:
    table = tmp_path / "c.csv"
    rows = ("x,m,a,failed,too stiff,,1.0,9,9", "x,m,b,done,,1e-9,1.0,9,9")
    table.write_text("\n".join((COLUMNS, *rows)), encoding="utf-8")
    page = fs.report(table, tmp_path / "a.html").read_text(encoding="utf-8")
    places = [page.index(f">{h}</h2>") for h in ("What to use", "Failed settings", "Settings")]
    assert places == sorted(places)
    assert places[0] < page.index("<li>for ") < places[1] < page.index("<li>x, m, a: too stiff")


def test_a_shipped_table_of_meshes_has_a_report(tmp_path: Path) -> None:
    table = ROOT / "results" / "belt_drive_cost.csv"
    rows = rows_of(table)
    page = fs.report(table, tmp_path / "a.html").read_text(encoding="utf-8")
    settings = page[page.index('id="settings"') :]
    assert settings[: settings.index("</table>")].count("<tr") == len(rows) + 1  # the headings
    traces, _ = charts_of(page)["charts"]
    assert sum(len(trace["x"]) for trace in traces if trace["xaxis"] == "x") == len(rows)
