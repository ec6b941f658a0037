"""Studies from their tables: a report of a file says what its study does."""

import csv
import html
import re
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray

import frictionsim as fs
from tests.support.scenarios import ROOT
from tests.work_precision.made import measured

MESHES = ROOT / "results" / "belt_drive_cost.csv"


@dataclass
class Saved:
    study: fs.Study
    folder: Path

    @cached_property
    def page(self) -> str:
        """The report of the study itself."""
        page = fs.report(self.study, self.folder / "b.html")
        return html.unescape(page.read_text(encoding="utf-8"))


@pytest.fixture(scope="module")
def saved(tmp_path_factory: pytest.TempPathFactory) -> Saved:
    folder = tmp_path_factory.mktemp("costs")
    measured().save(folder / "a.h5")
    measured().save(folder / "a.csv")
    return Saved(measured(), folder)


def page_of(path: Path, folder: Path) -> str:
    return html.unescape(fs.report(path, folder / "page.html").read_text(encoding="utf-8"))


def changed(path: Path, folder: Path, edit: Callable[[list[dict[str, str]]], None]) -> Path:
    """Return a copy of a table in CSV, with an edit of its rows by column."""
    with path.open(newline="", encoding="utf-8") as file:
        lines = list(csv.DictReader(line for line in file if not line.startswith("#")))
    edit(lines)
    copy = folder / "edited.csv"
    with copy.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, list(lines[0]))
        writer.writeheader()
        writer.writerows(lines)
    return copy


def with_about(path: Path, folder: Path, **about: str) -> Path:
    """Return a copy of a table in CSV that says something else of its study."""

    def edit(lines: list[dict[str, str]]) -> None:
        for line in lines:
            line.update(about)

    return changed(path, folder, edit)


def sentences_of(path: Path, folder: Path) -> list[str]:
    return recommended_in(page_of(path, folder))


def recommended_in(page: str) -> list[str]:
    found = re.findall(r">\s*(for [0-9.]+ %[^<]*?)\s*<", page)
    return [sentence.replace("\N{MINUS SIGN}", "-") for sentence in found]


def test_files_have_the_rows_of_their_study(saved: Saved) -> None:
    dataset = saved.study.dataset
    with xarray.open_dataset(saved.folder / "a.h5", group="cost", engine="h5netcdf") as read:
        assert set(read.data_vars) >= set(dataset.data_vars)
        for name, column in dataset.data_vars.items():
            numbers = column.dtype.kind == "f"
            assert np.array_equal(read[name].values, column.values, equal_nan=numbers), name
    with (saved.folder / "a.csv").open(newline="", encoding="utf-8") as file:
        lines = list(csv.DictReader(file))
    assert len(lines) == dataset.sizes["row"]
    for number, line in enumerate(lines):
        for name, column in dataset.data_vars.items():
            unit = column.attrs.get("units")
            value = column.values[number]
            if unit is None:
                assert line[str(name)] == value, name
            else:
                cell = line[f"{name} [{unit}]"]
                assert float(cell or "nan") == pytest.approx(value, nan_ok=True, rel=0), name


def test_files_say_what_the_errors_are_relative_to(saved: Saved) -> None:
    references = ["events, set-valued, rtol 5e-8", "rkf45, set-valued, rtol 1e-7"]
    assert saved.study.to_json()["references"] == references
    with (saved.folder / "a.csv").open(newline="", encoding="utf-8") as file:
        assert next(csv.DictReader(file))["references"] == " and ".join(references)
    with h5py.File(saved.folder / "a.h5") as file:
        assert file.attrs["references"] == "\n".join(references)


@pytest.mark.parametrize("name", ["a.h5", "a.csv"])
def test_the_report_of_a_file_has_the_rows_and_recommendations_of_its_study(
    name: str, saved: Saved, tmp_path: Path
) -> None:
    def rows_of(page: str) -> list[list[str]]:
        """Return the cells of each row; a file may have the errors in another order."""
        rows = re.findall(r"<tr>(.*?)</tr>", page, re.DOTALL)
        return [sorted(re.findall(r"<t[hd].*?</t[hd]>", row, re.DOTALL)) for row in rows]

    wanted = rows_of(saved.page)
    assert len(wanted) > len(saved.study.data.rows)
    page = page_of(saved.folder / name, tmp_path)
    assert rows_of(page) == wanted
    assert len(saved.study.recommendations) == 3
    assert recommended_in(page) == saved.study.recommendations


def test_an_uncertain_reference_recommends_nothing(saved: Saved, tmp_path: Path) -> None:
    about = {"reference_uncertainty": '{"final_angle": 5e-3}'}
    sentences = sentences_of(with_about(saved.folder / "a.csv", tmp_path, **about), tmp_path)
    assert sentences[0].startswith("for 1 %: ")
    assert sentences[1] == "for 0.1 %: unknown, the reference uncertainty is 5.0e-03"


def test_tables_of_meshes_recommend_for_each_quantity(tmp_path: Path) -> None:
    def edit(lines: list[dict[str, Any]]) -> None:
        assert {line["bodies [1]"] for line in lines} >= {"60.0", "600.0"}
        for line in lines:
            line["quantities"] = "slip driven_speed no_measure"

    sentences = sentences_of(changed(MESHES, tmp_path, edit), tmp_path)
    assert len(sentences) == 3 + 2 * 2
    assert sentences[3].startswith("for 1 % of driven_speed: moreau, set-valued")


@pytest.mark.parametrize("damage", ["[1]", "{", '{"a": "x"}', '{"a": 1e999}', "null"])
def test_a_damaged_uncertainty_is_refused(saved: Saved, damage: str, tmp_path: Path) -> None:
    path = with_about(saved.folder / "a.csv", tmp_path, reference_uncertainty=damage)
    with pytest.raises(fs.InputError, match="its reference uncertainty is"):
        fs.report(path, tmp_path / "page.html")
