"""A sweep gives what single runs give, in the order of its design, in memory and in its file."""

import tomllib
from pathlib import Path

import numpy as np
import pytest
import xarray

import frictionsim as fs
from tests.support.scenarios import SCENARIOS

pytestmark = pytest.mark.quick

PULLEY = SCENARIOS / "pulley.toml"
MU_S, LOAD = "effects.shaft_friction.mu_s", "mechanism.load"
LOOSE = {"solver.rtol": 1e-6}


def test_a_grid_holds_what_single_runs_give(tmp_path: Path) -> None:
    levels, loads = [0.1, 0.25, 0.4], [2000.0, 2224.1, 9000.0]
    found = fs.sweep(PULLEY, {MU_S: levels, LOAD: loads}, LOOSE, output=tmp_path / "s.h5")
    assert found.sizes == {MU_S: 3, LOAD: 3}
    for mu in levels:
        for load in loads:
            single = fs.solve(PULLEY, {**LOOSE, MU_S: mu, LOAD: load})
            at = found.sel({MU_S: mu, LOAD: load})
            assert int(at["status"]) == 1
            for name, quantity in single.quantities.items():
                # The same steps are taken whatever is sampled: the same bits.
                assert np.array_equal(float(at[name]), float(quantity), equal_nan=True), name
                assert found[name].attrs["units"] == quantity.unit
            assert str(at["warnings"].item()) == "\n".join(single.warnings)
    assert found[MU_S].attrs["units"] == "1"
    assert found[LOAD].attrs["units"] == "N"


def test_the_file_opens_in_xarray_with_the_same_data(tmp_path: Path) -> None:
    vary = {MU_S: "lin(0.1, 0.3, 3)", "drive.direction": ["vertical", "horizontal"]}
    found = fs.sweep(PULLEY, vary, LOOSE, output=tmp_path / "s.h5")
    assert fs.open_sweep(tmp_path / "s.h5").identical(found)
    with xarray.open_dataset(tmp_path / "s.h5", engine="h5netcdf") as read:
        xarray.testing.assert_equal(read.load(), found)
        assert read["drive.direction"].values.tolist() == ["vertical", "horizontal"]


def test_the_study_in_the_file_runs_again(tmp_path: Path) -> None:
    vary = {MU_S: "uniform(0.1, 0.4)", LOAD: "normal(2000.0, 50.0)"}
    found = fs.sweep(PULLEY, vary, LOOSE, sample=4, seed=3)
    again = fs.sweep(tomllib.loads(found.attrs["study"]))
    xarray.testing.assert_equal(found, again)
