"""Tables of costs: the study, its file and the report of its file say the same."""

import csv
import html
import re
from collections.abc import Callable
from pathlib import Path

import pytest

import frictionsim as fs
from tests.costs.made import made_row, made_table, said_of
from tests.support.scenarios import pulley

REFERENCES = ["events, set-valued, rtol 5e-8", "rkf45, set-valued, rtol 1e-7"]


@pytest.fixture(scope="module")
def study() -> fs.Study:
    changed = {"solver.duration": 1.0, "mechanism.load": 2200.0}
    return fs.cost(
        pulley(), changed, backends=["events", "lsoda"], tolerances=[1e-3, 1e-6], repeats=1
    )


@pytest.fixture(scope="module")
def saved(study: fs.Study, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return study.save(tmp_path_factory.mktemp("costs") / "a.csv")


def test_a_file_has_the_columns_and_references_of_its_study(study: fs.Study, saved: Path) -> None:
    dataset = study.dataset
    with saved.open(newline="", encoding="utf-8") as file:
        lines = list(csv.DictReader(file))
    assert len(lines) == dataset.sizes["row"]
    for number, line in enumerate(lines):
        for name, column in dataset.data_vars.items():
            unit, value = column.attrs.get("units"), column.values[number]
            if unit is None:
                assert line[str(name)] == value, name
            else:
                cell = line[f"{name} [{unit}]"]
                assert float(cell or "nan") == pytest.approx(value, nan_ok=True, rel=0), name
    assert study.to_json()["references"] == REFERENCES
    assert lines[0]["references"] == " and ".join(REFERENCES)
    assert lines[0]["set"] == "solver.duration = 1.0, mechanism.load = 2200.0"


def test_json_text_and_columns_have_the_same_numbers(study: fs.Study) -> None:
    told, dataset = study.to_json(), study.dataset
    assert told["overrides"] == {"solver.duration": 1.0, "mechanism.load": 2200.0}
    words = [word.rstrip("*") for word in study.summary().split()]
    assert {"law", "method", "setting", "error", "evaluations"} <= {*words}
    for number, setting in enumerate(told["settings"]):
        for name in ("law", "backend", "setting", "status", "error", "wall_seconds"):
            assert setting[name] == dataset[name].values[number]
        for name in ("events", "steps", "rhs_evaluations", "states", "repeats"):
            assert setting[name] == int(dataset[name].values[number])
            assert isinstance(setting[name], int)
        assert setting["overrides"] == dataset["overrides"].values[number].split()
        for name, error in setting["errors"].items():
            assert error["relative"] == dataset[f"{name}_relative"].values[number]
            assert error["absolute"] == dataset[f"{name}_error"].values[number]
        assert {str(setting["rhs_evaluations"]), f"{setting['error']:.1e}"} <= {*words}


def test_the_report_of_a_file_has_the_rows_and_recommendations_of_its_study(
    study: fs.Study, saved: Path, told: Callable[..., tuple[str, str]]
) -> None:
    def rows_of(page: str) -> list[str]:
        return re.findall(r"<tr>(.*?)</tr>", page, re.DOTALL)

    page = fs.report(study, "b.html").read_text(encoding="utf-8")
    told("report", saved, "-o", "c.html")
    of_file = Path("c.html").read_text(encoding="utf-8")
    assert len(rows_of(page)) > len(study.to_json()["settings"])
    assert rows_of(of_file) == rows_of(page)
    assert said_of(saved) == study.recommendations
    text = html.unescape(of_file)
    for line in study.summary().splitlines()[1:4]:  # overrides, references, their uncertainty
        assert line.replace("e-", "e\N{MINUS SIGN}") in text or line in text


def test_errors_below_the_reference_uncertainty_are_marked(tmp_path: Path) -> None:
    """A study of one tolerance is as exact as its references allow."""
    options = {"backends": ["events"], "tolerances": [1e-11], "repeats": 1}
    study = fs.cost(pulley(), {"solver.duration": 1.0}, **options)
    told = study.to_json()
    (row,) = told["settings"]
    floor = {name: error["relative"] for name, error in told["floor"].items()}
    below = [name for name, error in row["errors"].items() if error["relative"] < floor[name]]
    if row["error"] < max(floor.values()):
        below.insert(0, "error")
    assert row["below_uncertainty"] == below
    assert len(re.findall(r"\d\*", study.summary())) == len(below)
    rows = [made_row("a", 2e-6, 1.0, below_uncertainty="angle"), made_row("b", 5e-7, 1.0)]
    rows[1]["below_uncertainty"] = "error angle"
    table = made_table(tmp_path / "a.csv", rows, {"angle": 1e-6})
    page = fs.report(table, tmp_path / "a.html").read_text(encoding="utf-8")
    assert page.count("2.0e\N{MINUS SIGN}06*") == 1
    assert page.count("5.0e\N{MINUS SIGN}07*") == 2


@pytest.mark.parametrize("damage", ["[1]", "{", '{"a": 1e999}'])
def test_a_damaged_uncertainty_is_refused(damage: str, tmp_path: Path) -> None:
    path = made_table(tmp_path / "a.csv", [made_row("a", 1e-3, 1.0)], {})
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("{}", '"' + damage.replace('"', '""') + '"'), encoding="utf-8")
    with pytest.raises(fs.InputError, match="its reference uncertainty is damaged"):
        fs.report(path, tmp_path / "page.html")
