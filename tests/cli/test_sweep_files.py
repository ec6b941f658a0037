"""`show` and `plot` of the files of sweeps."""

import csv
import io
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray

import frictionsim as fs
from tests.cli.conftest import Run, strict_json
from tests.support.scenarios import ROOT
from tests.support.sweep_files import LOAD, LOOSE, MU_S, PULLEY
from tests.support.sweeps import grid_of, with_outcomes

NOT_RUN, FAILED = 0, 2  # of a run, as a file has them
RESULT = ROOT / "tests" / "golden" / "belt_verification.h5"


@pytest.fixture
def grid(here: Path) -> xarray.Dataset:
    """A sweep over two keys in the file s.h5."""
    vary = {MU_S: "lin(0.1, 0.4, 4)", LOAD: [2000.0, 2224.1, 3000.0]}
    return fs.sweep(PULLEY, vary, LOOSE, output="s.h5", workers=1)


def test_no_run_is_named_for_extremes_that_differ_by_roundoff(
    grid: xarray.Dataset, told: Run
) -> None:
    table = grid.table  # type: ignore[attr-defined]
    force = table.values["force_to_lift"]
    force[:] = 2000.0 * (1.0 + 1e-15 * np.arange(force.size).reshape(force.shape))
    row = next(line for line in grid.summary().splitlines() if line.startswith("force_to_lift"))
    assert row.split() == ["force_to_lift", "2000", "2000", "N", "12"]


def test_the_summary_of_a_grid_has_the_extremes(grid: xarray.Dataset, told: Run) -> None:
    out, err = told("show", "s.h5")
    assert err == ""
    lines = out.splitlines()
    assert lines[0] == "Pulley on a dry shaft: sweep done"
    assert lines[1] == "kind pulley, all combinations of these keys"
    assert lines[-1] == "sweep: s.h5"
    assert "12 of 12 runs are done" in lines
    row = next(line for line in lines if line.startswith("force_to_lift")).split()
    force = grid["force_to_lift"].values.ravel()
    assert row == [
        "force_to_lift",
        f"{force.min():.6g}",
        "0",
        f"{force.max():.6g}",
        "11",
        "N",
        "12",
    ]
    document = strict_json(told("show", "s.h5", "--json")[0])
    quantity = document["quantities"]["force_to_lift"]
    assert quantity["largest"] == {
        "value": force.max(), "run": 11, "at": {MU_S: 0.4, LOAD: 3000.0}
    }  # fmt: skip
    assert document["runs"] == {"all": 12, "not_run": 0, "done": 12, "failed": 0, "audit_failed": 0}
    assert document["varied"][LOAD] == {
        "unit": "N", "distribution": None, "values": [2000.0, 2224.1, 3000.0]
    }  # fmt: skip


def test_the_summary_of_a_sample_has_its_statistics(here: Path, told: Run) -> None:
    vary = {MU_S: "uniform(0.1, 0.2)", LOAD: "normal(2000.0, 30.0)"}
    sweep = fs.sweep(PULLEY, vary, LOOSE, sample=16, indices=True, output="s.h5", workers=1)
    out, _ = told("show", "s.h5")
    angle = sweep["final_angle"].values[:32]  # of A and B
    row = next(line for line in out.splitlines() if line.startswith("final_angle")).split()
    quantiles = np.quantile(angle, (0.05, 0.5, 0.95))
    numbers = (angle.mean(), angle.std(ddof=1), *quantiles)
    assert row == ["final_angle", *(f"{number:.6g}" for number in numbers), "rad", "32"]
    assert "the first 32 runs are independent" in out
    assert "uniform(0.1, 0.2)" in out
    data = strict_json(told("show", "s.h5", "--json")[0])["quantities"]["final_angle"]
    assert data["standard_deviation"] == pytest.approx(angle.std(ddof=1), rel=1e-14)
    assert (data["runs"], data["unit"]) == (32, "rad")
    assert data["quantile_95"] == pytest.approx(quantiles[2], rel=1e-14)


def test_csv_scenario_and_study_are_those_of_the_sweep(grid: xarray.Dataset, told: Run) -> None:
    out, _ = told("show", "s.h5", "--csv")
    fs.open_sweep("s.h5").save("s.csv")
    assert out == Path("s.csv").read_text(encoding="utf-8")
    assert len(list(csv.reader(io.StringIO(out)))) == 13
    assert tomllib.loads(told("show", "s.h5", "--scenario")[0])["solver"]["rtol"] == 1e-4
    study = tomllib.loads(told("show", "s.h5", "--study")[0])
    assert fs.sweep(study, workers=1).equals(grid)
    assert told("show", RESULT, "--study", code=2)[1] == (
        f"frictionsim: {RESULT}: --study is for sweeps, this is the result of a run\n"
    )


def test_failed_runs_and_runs_that_are_left_are_reported(here: Path, told: Run) -> None:
    table = grid_of({"a": list(np.arange(1.0, 21.0))}, {"f": lambda a: a})
    table = with_outcomes(table, {0: FAILED, 3: FAILED, 8: FAILED, 19: NOT_RUN})
    for run in (0, 3):
        table.texts["failure"][run] = "diverged"
        table.texts["reason"][run] = f"stopped at t = {run}.5 s"
    for run in range(4, 14):
        table.texts["warnings"][run] = "kind " + "abcdefghij"[run - 4]
    table.texts["reason"][8] = "no memory"
    left = {"status": "interrupted", "reason": "interrupted by the user"}
    fs.Sweep(table._replace(attributes=table.attributes | left)).save("s.h5")
    out, err = told("show", "s.partial.h5")
    lines = out.splitlines()
    assert "16 of 20 runs are done; 3 failed, 1 not run: not in the table below" in lines
    assert "failed, 2 runs: diverged: stopped at t = 0.5 s (run 0)" in lines
    assert "failed, run 8: no memory" in lines
    assert "warnings, run 4: kind a" in lines
    assert "warnings: 5 more kinds, in 5 runs" in lines
    assert "f 2 1 19 18 N m 16" in [" ".join(line.split()) for line in lines]
    assert err == (
        "frictionsim: sweep interrupted: 1 of 20 runs are left: interrupted by the user\n"
    )
    data = strict_json(told("show", "s.partial.h5", "--json")[0])
    assert data["failures"][0] == {
        "runs": 2, "first_run": 0, "text": "diverged: stopped at t = 0.5 s"
    }  # fmt: skip


def test_a_chosen_quantity_is_drawn_at_a_chosen_value(grid: xarray.Dataset, told: Run) -> None:
    told("plot", "s.h5", "--view", "final_angle", "--at", f"{LOAD}=2000", "-o", "a.svg")
    text = Path("a.svg").read_text(encoding="utf-8")
    assert ">final angle," in text
    assert "mechanism.load = 2000 N; 4 of 12 runs)" in text
    told("plot", "s.h5", "-o", "a.svg", "--no-clobber", code=4)


def test_all_quantities_are_drawn_each_into_its_file(here: Path, told: Run) -> None:
    functions: Any = {"f": lambda a: a, "g": lambda a: 2 * a, "h": lambda a: np.nan}
    table = grid_of({"a": [1.0, 2.0]}, functions | {"same": lambda a: 5.0})
    fs.Sweep(table).save("s.h5")
    document = strict_json(told("plot", "s.h5", "--view", "all", "--json")[0])
    assert document["pictures"] == ["s-f.png", "s-g.png"]
    assert document["skipped"] == [
        "h is not defined in any run",
        "same has one value in all runs",
    ]
    assert sorted(path.name for path in here.glob("*.png")) == document["pictures"]
