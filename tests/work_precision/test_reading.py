"""Studies from their tables: the same rows and recommendations."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

import frictionsim as fs
from frictionsim.io.cost_table import CostTable, read_csv
from frictionsim.io.hdf5_reader import read_any
from frictionsim.work_precision.outcome import Row
from frictionsim.work_precision.recommendation import recommendations
from frictionsim.work_precision.table import study_of, table_of
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


def plain(rows: list[Row]) -> list[Any]:
    return [
        (row.setting.line, row.setting.label, row.status, row.error, row.wall_seconds, row.steps)
        for row in rows
    ]


def sentences_of(table: CostTable) -> list[str]:
    return [advice.sentence for advice in recommendations(study_of(table))]


def test_files_have_the_rows_of_their_study(saved: Saved) -> None:
    wanted = plain(saved.study.data.rows)
    assert plain(study_of(read_any(saved.folder / "a.h5")).rows) == wanted
    assert plain(study_of(read_csv(saved.folder / "a.csv")).rows) == wanted


def test_a_study_that_is_read_has_the_columns_that_were_written(saved: Saved) -> None:
    """But for absolute errors, which nothing that reads a table needs."""
    table = read_any(saved.folder / "a.h5")
    again = table_of(study_of(table))
    written = {name: column.values for name, column in again.columns.items()}
    assert set(written) == set(table.columns)
    for name, values in written.items():
        if not name.endswith("_error") or name == "time_error":
            assert repr(values) == repr(table.columns[name].values), name
    about = again.attributes
    assert about == {name: table.attributes[name] for name in about}


def test_a_file_recommends_what_its_study_does(saved: Saved) -> None:
    table = read_any(saved.folder / "a.h5")
    assert sentences_of(table) == saved.study.recommendations
    reference, reference_of_file = saved.study.data.reference, study_of(table).reference
    assert reference
    assert reference_of_file
    floors = {name: error.relative for name, error in reference.floor.items()}
    assert {name: error.relative for name, error in reference_of_file.floor.items()} == floors != {}


def test_an_uncertain_reference_recommends_nothing(saved: Saved) -> None:
    table = read_csv(saved.folder / "a.csv")
    about = {"reference_uncertainty": '{"final_angle": 5e-3}'}
    sentences = sentences_of(table._replace(attributes=about))
    assert sentences[0].startswith("for 1 %: events, set-valued with rtol 1e-3")
    assert sentences[1] == "for 0.1 %: unknown, the reference uncertainty is 5.0e-03"


def test_tables_of_meshes_recommend_for_each_quantity() -> None:
    table = read_csv(MESHES)
    rows = study_of(table).rows
    assert {row.setting.mesh.bodies for row in rows if row.setting.mesh} >= {60, 600}
    about = {"quantities": "slip driven_speed no_measure"}
    sentences = sentences_of(table._replace(attributes=about))
    assert len(sentences) == 3 + 2 * 2
    assert sentences[3].startswith("for 1 % of driven_speed: moreau, set-valued")


@pytest.mark.parametrize("damage", ["[1]", "{", '{"a": "x"}', '{"a": 1e999}', "null"])
def test_a_damaged_uncertainty_is_refused(saved: Saved, damage: str) -> None:
    table = read_csv(saved.folder / "a.csv")._replace(attributes={"reference_uncertainty": damage})
    with pytest.raises(ValueError, match="its reference uncertainty is"):
        study_of(table)
