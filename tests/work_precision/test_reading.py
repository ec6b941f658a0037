"""Studies from their tables: the same rows and recommendations."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

import frictionsim as fs
from frictionsim.errors import InputError
from frictionsim.io.cost_table import CostTable, is_costs_in_csv, read_csv
from frictionsim.io.hdf5_reader import read_costs
from frictionsim.work_precision.reading import advice_of, floors_of, rows_of, table_of
from tests.support.scenarios import ROOT, changed, pulley

MESHES = ROOT / "results" / "belt_drive_cost.csv"


@dataclass
class Saved:
    study: fs.Study
    folder: Path


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> Saved:
    scenario = changed(pulley(), solver__duration=1.0)
    with pytest.MonkeyPatch.context() as patched:  # no other load decides what is fastest
        place = "frictionsim.work_precision.study._seconds"
        patched.setattr(place, lambda run: 1e-3 * run.statistics.steps)
        study = fs.cost(scenario, backends=["events", "lsoda"], tolerances=[1e-3, 1e-6], repeats=1)
    folder = tmp_path_factory.mktemp("costs")
    study.save(folder / "a.h5")
    study.save(folder / "a.csv")
    return Saved(study, folder)


def plain(table: CostTable) -> list[Any]:
    return [
        (row.setting.line, row.setting.label, row.status, row.error, row.wall_seconds, row.steps)
        for row in rows_of(table)
    ]


def test_files_have_the_rows_of_their_study(saved: Saved) -> None:
    wanted = plain(table_of(saved.study.data))
    assert wanted == [
        (r.setting.line, r.setting.label, r.status, r.error, r.wall_seconds, r.steps)
        for r in saved.study.data.rows
    ]
    assert plain(read_costs(saved.folder / "a.h5")) == wanted
    assert plain(read_csv(saved.folder / "a.csv")) == wanted


def test_a_file_recommends_what_its_study_does(saved: Saved) -> None:
    table = read_costs(saved.folder / "a.h5")
    assert [advice.sentence for advice in advice_of(table)] == saved.study.recommendations
    floor = saved.study.data.reference.floor if saved.study.data.reference else {}
    assert floors_of(table) == {name: error.relative for name, error in floor.items()}


def test_an_uncertain_reference_recommends_nothing(saved: Saved) -> None:
    table = read_csv(saved.folder / "a.csv")
    about = {"reference_uncertainty": '{"final_angle": 5e-3}'}
    sentences = [advice.sentence for advice in advice_of(table._replace(attributes=about))]
    assert sentences[0].startswith("for 1 %: events, set-valued with rtol 1e-3")
    assert sentences[1] == "for 0.1 %: unknown, the reference uncertainty is 5.0e-03"


def test_tables_of_meshes_recommend_for_each_quantity() -> None:
    table = read_csv(MESHES)
    assert {row.setting.mesh.bodies for row in rows_of(table) if row.setting.mesh} >= {60, 600}
    about = {"quantities": "slip driven_speed no_measure"}
    sentences = [advice.sentence for advice in advice_of(table._replace(attributes=about))]
    assert len(sentences) == 3 + 2 * 2
    assert sentences[5].startswith("for 1 % of driven_speed: moreau, set-valued")


@pytest.mark.parametrize("damage", ["[1]", "{", '{"a": "x"}', '{"a": 1e999}', "null"])
def test_a_damaged_uncertainty_is_refused(saved: Saved, damage: str) -> None:
    table = read_csv(saved.folder / "a.csv")._replace(attributes={"reference_uncertainty": damage})
    with pytest.raises(ValueError, match="its reference uncertainty is"):
        advice_of(table)


BROKEN = {
    "law,backend,setting,overrides\n\xff": "it is not text in UTF-8",
    "law,backend,setting,law\n": "its heading names a column twice, or one that has a line break",
    "law,backend,setting,status,error [1]\na,b,c\n": "line 2 has 3 cells, the heading has 5",
    "law,backend,setting,status,error\n": "its column 'error' does not hold numbers with a unit",
    'law,backend,setting,status\na,b,c,"': "unexpected end of data",
    "law,backend,setting," + ",".join(map(str, range(600))): "no such table has more than 500",
}


@pytest.mark.parametrize("text", BROKEN)
def test_a_damaged_csv_is_refused_in_a_sentence(text: str, tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text(text, encoding="latin-1")
    assert is_costs_in_csv(path)
    with pytest.raises(InputError, match="cannot read this table of costs: ") as caught:
        read_csv(path)
    assert BROKEN[text] in str(caught.value)
    assert "\n" not in str(caught.value)
