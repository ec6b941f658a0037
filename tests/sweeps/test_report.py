"""A sweep as CSV: every run with all its digits, for spreadsheets and pandas."""

import csv
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.errors import OutputError
from tests.support.sweep_files import LOOSE, MU_S, PULLEY
from tests.support.sweeps import FAILED, grid_of, with_outcomes


def write_csv(table: Any, path: Path) -> None:
    fs.Sweep(table).save(path)


def rows_of(path: Path) -> list[list[str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.reader(file))


def test_each_run_is_a_line_with_all_digits(tmp_path: Path) -> None:
    vary = {MU_S: "lin(0.1, 0.4, 4)", "drive.direction": ["vertical", "horizontal"]}
    sweep = fs.sweep(PULLEY, vary, LOOSE, output=tmp_path / "s.h5", workers=1)
    fs.open_sweep(tmp_path / "s.h5").save(tmp_path / "s.csv")
    heading, *rows = rows_of(tmp_path / "s.csv")
    assert heading[:3] == ["run [1]", f"{MU_S} [1]", "drive.direction"]
    assert heading[-4:] == ["status", "failure", "reason", "warnings"]
    for number, row in enumerate(rows):
        cells = dict(zip(heading, row, strict=True))
        assert cells["run [1]"] == str(number)
        at = sweep.sel({MU_S: float(cells[f"{MU_S} [1]"]), "drive.direction": row[2]})
        names = set(sweep) - {"status", "failure", "reason", "warnings"}
        assert len(names) == len(heading) - 3 - 4
        for name in names:
            cell = cells[f"{name} [{sweep[name].attrs['units']}]"]
            assert np.array_equal(float(cell or "nan"), float(at[name]), equal_nan=True), name
        assert cells["status"] == "done"
        assert cells["warnings"] == at["warnings"].item()
    assert len(rows) == 8


def test_text_with_quotes_lines_and_formulas_stays_in_its_cell(tmp_path: Path) -> None:
    table = grid_of({"word": ["=1+1", 'a "b", c']}, {"f": lambda word: 1.0})
    table = with_outcomes(table, {1: FAILED})
    table.texts["failure"][1] = "diverged"
    table.texts["reason"][1] = '@a, "b"'
    table.texts["warnings"][0] = "first\nsecond"
    write_csv(table, tmp_path / "s.csv")
    assert rows_of(tmp_path / "s.csv")[1:] == [
        ["0", "'=1+1", "1.0", "done", "", "", "first\nsecond"],
        ["1", 'a "b", c', "1.0", "failed", "diverged", '\'@a, "b"', ""],
    ]


def test_it_replaces_such_a_table_only(
    tmp_path: Path, told: Callable[..., tuple[str, str]]
) -> None:
    table = grid_of({"a": [1.0, 2.0]}, {"f": lambda a: a})
    path = tmp_path / "s.csv"
    write_csv(table, path)
    before = path.read_bytes()
    write_csv(table, path)
    assert path.read_bytes() == before
    _, refused = told("cost", PULLEY, "--csv", path, code=4)
    assert "is not a table of costs and is not overwritten" in refused
    path.write_text("run [1],a\n1,2\n")  # while the runs go on
    with pytest.raises(OutputError, match="is not a sweep in CSV and is not overwritten"):
        write_csv(table, path)
    assert path.read_text() == "run [1],a\n1,2\n"
    path.write_text("")
    write_csv(table, path)
    assert path.read_bytes() == before


def test_truth_values_are_those_of_the_file(tmp_path: Path) -> None:
    write_csv(grid_of({"on": [False, True]}, {"f": lambda on: 1.0}), tmp_path / "s.csv")
    assert [row[1] for row in rows_of(tmp_path / "s.csv")[1:]] == ["0", "1"]


def test_many_runs_are_written_in_parts(tmp_path: Path) -> None:
    values = np.linspace(0.0, 1.0, 5001)
    write_csv(grid_of({"a": values.tolist()}, {"f": lambda a: 2.0 * a}), tmp_path / "s.csv")
    rows = rows_of(tmp_path / "s.csv")[1:]
    np.testing.assert_array_equal([float(row[1]) for row in rows], values)
    np.testing.assert_array_equal([float(row[2]) for row in rows], 2.0 * values)
