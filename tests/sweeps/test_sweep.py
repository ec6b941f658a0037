"""A sweep gives what single runs give, in the order of its design, in memory and in its file."""

import csv
import tomllib
from itertools import product
from pathlib import Path

import numpy as np
import pytest
import xarray

import frictionsim as fs
from tests.support.plugins import searched
from tests.support.scenarios import SCENARIOS
from tests.support.unreliable import ANGLE, SCENARIO, unreliable

PULLEY = SCENARIOS / "pulley.toml"
MU_S, MU_K = "effects.shaft_friction.mu_s", "effects.shaft_friction.mu_k"
LOAD = "mechanism.load"
BOTH = f"{MU_S},{MU_K}"
LOOSE = {"solver.rtol": 1e-6}


def assert_as_single(at: xarray.Dataset, single: fs.Result) -> None:
    """Check one run of a sweep: the same steps are taken whatever is sampled, the same bits."""
    assert int(at["status"]) == 1
    for name, quantity in single.quantities.items():
        assert np.array_equal(float(at[name]), float(quantity), equal_nan=True), name
        assert at[name].attrs["units"] == quantity.unit
    assert str(at["warnings"].item()) == "\n".join(single.warnings)


def test_a_grid_holds_what_single_runs_give(tmp_path: Path) -> None:
    levels, loads = [0.1, 0.25, 0.4], [2000.0, 2224.1, 9000.0]
    sweep = fs.sweep(
        PULLEY, {MU_S: levels, LOAD: loads}, LOOSE, output=tmp_path / "s.h5", workers=1
    )
    assert sweep.sizes == {MU_S: 3, LOAD: 3}
    for mu, load in product(levels, loads):
        single = fs.solve(PULLEY, {**LOOSE, MU_S: mu, LOAD: load})
        assert_as_single(sweep.sel({MU_S: mu, LOAD: load}), single)
    assert sweep[MU_S].attrs["units"] == "1"
    assert sweep[LOAD].attrs["units"] == "N"


def test_several_keys_have_one_value(tmp_path: Path) -> None:
    values = [0.1, 0.2]
    sweep = fs.sweep(
        PULLEY, {f"{MU_S}, {MU_K}": values}, LOOSE, output=tmp_path / "s.h5", workers=1
    )
    assert dict(sweep.sizes) == {BOTH: 2}
    for mu in values:
        assert_as_single(sweep.sel({BOTH: mu}), fs.solve(PULLEY, {**LOOSE, MU_S: mu, MU_K: mu}))
    assert sweep[BOTH].attrs["units"] == "1"
    assert sweep.equals(fs.sweep(tomllib.loads(sweep.attrs["study"]), workers=1))
    assert fs.open_sweep(tmp_path / "s.h5").identical(sweep)


@pytest.mark.parametrize(
    ("kind", "steps"), [("pulley", [20, 60]), ("marble_machine", [5, 200]), ("epicyclic", [5, 100])]
)
def test_a_run_that_fails_has_the_quantities_that_solve_gives(kind: str, steps: list[int]) -> None:
    path = SCENARIOS / f"{kind}.toml"
    sweep = fs.sweep(path, {"solver.max_steps": steps}, workers=1)
    assert sweep["status"].values.tolist() == [2, 2]
    names = [n for n in sweep.data_vars if n not in ("status", "failure", "reason", "warnings")]
    for number, limit in enumerate(steps):
        single = fs.solve(path, {"solver.max_steps": limit})
        assert single.quantities.keys() <= set(names)
        for name in names:
            quantity = single.quantities.get(name)
            wanted = np.nan if quantity is None else float(quantity)
            # The same run: the same bits.
            assert np.array_equal(sweep[name].values[number], wanted, equal_nan=True), name


def test_sobol_indices_are_numbers_in_the_dataset_and_every_file(tmp_path: Path) -> None:
    vary = {MU_S: "uniform(0.15, 0.3)", LOAD: "normal(2224.0, 50.0)"}
    path = tmp_path / "s.h5"
    sweep = fs.sweep(PULLEY, vary, LOOSE, sample=16, indices=True, output=path, workers=1)
    a, b, *mixed = sweep["force_to_lift"].values.reshape(4, 16)
    variance = np.var(np.concatenate((a, b)))
    centre = 0.5 * (a.mean() + b.mean())
    for key, ab in zip((MU_S, LOAD), mixed, strict=True):
        of_key = sweep.sel(sobol_quantity="force_to_lift", sobol_key=key)
        first = ((b - centre) * (ab - a)).mean() / variance  # Saltelli et al. 2010, Table 2 (b)
        assert float(of_key["sobol_first"]) == pytest.approx(first, rel=1e-12)
        total = 0.5 * ((a - ab) ** 2).mean() / variance  # (f)
        assert float(of_key["sobol_total"]) == pytest.approx(total, rel=1e-12)
        assert of_key["sobol_total_low"] < of_key["sobol_total"] < of_key["sobol_total_high"]
    swept = fs.open_sweep(path)
    assert swept.identical(sweep)
    with xarray.open_dataset(path, engine="h5netcdf") as read:
        xarray.testing.assert_equal(read.load(), sweep.dataset)
    swept.save(tmp_path / "s.csv")
    told = swept.to_json()["sobol_indices"]
    with (tmp_path / "s.sobol.csv").open(newline="") as file:
        lines = {(line["quantity"], line["key"]): line for line in csv.DictReader(file)}
    for name, key in product(sweep["sobol_quantity"].values.tolist(), (MU_S, LOAD)):
        of_key = sweep.sel(sobol_quantity=name, sobol_key=key)
        for index in ("sobol_first", "sobol_total"):
            words = [f"{index}{end}" for end in ("", "_low", "_high")]
            numbers = [float(of_key[word]) for word in words]
            wanted = [None if np.isnan(value) else value for value in numbers]
            in_json, short = told[name]["keys"][key], index.removeprefix("sobol_")
            assert [in_json[short], *(in_json[f"{short}_interval"] or [None, None])] == wanted
            cells = [lines[name, key][f"{word} [1]"] for word in words]
            assert [float(cell) if cell else None for cell in cells] == wanted
    assert told["final_time"]["basis"] == "no Sobol indices: the quantity does not vary"
    assert "force_to_lift" in swept.summary().partition("Sobol indices of")[2]


def test_an_error_in_the_program_is_a_row(tmp_path: Path) -> None:
    with searched(unreliable(tmp_path, 1, "raise ZeroDivisionError('division\\nby zero')")):
        sweep = fs.sweep(SCENARIO, {ANGLE: [0.0, 1.0, 2.0]}, workers=1)
    assert sweep["failure"].values.tolist() == ["", "internal_error", ""]
    assert sweep["reason"].values[1] == "internal error: ZeroDivisionError: division by zero"


def test_quantities_that_some_runs_lack_are_undefined_there() -> None:
    friction = "effects.shaft_friction"
    values = [{"shaft_radius": 0.0254, "mu_s": 0.2, "mu_k": 0.1}, "none"]
    sweep = fs.sweep(PULLEY, {friction: values}, LOOSE, workers=1)
    assert sweep["status"].values.tolist() == [1, 1]
    assert np.isfinite(sweep["breakaway_time"].values).tolist() == [True, False]
    assert np.isfinite(sweep["final_angle"].values).all()
    assert sweep[friction].values.tolist()[1] == "none"
