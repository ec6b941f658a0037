"""`sweep` and `fit`: options, tables, files, exit codes; files of sweeps shown and drawn."""

import csv
import io
import os
import signal
import time
import tomllib
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

import frictionsim as fs
from tests.cli.conftest import Run, strict_json
from tests.fits.measurements import MU_K, pulley, series, write_csv
from tests.support.cases import slow
from tests.support.file_sizes import limited_files
from tests.support.scenarios import SCENARIOS
from tests.support.sweep_files import (
    LOAD,
    LOOSE,
    MU_S,
    PULLEY,
    command,
    started,
    wait_for_runs,
)
from tests.support.sweeps import grid_of, with_outcomes

NOT_RUN, FAILED = 0, 2  # of a run, as a file has them

# --- sweep ----------------------------------------------------------------------------------

STUDY = f"""\
[study]
scenario = "{PULLEY.as_posix()}"
zip = true
[set]
"solver.rtol" = 1e-4
[vary]
"{LOAD}" = [2000.0, 2100.0]
"effects.shaft_friction.mu_s" = [0.2, 0.3]
"""


def test_a_sweep_is_written_and_summarised(told: Run, here: Path) -> None:
    out, err = told(*command(3, "s.h5", "--csv", "s.csv", "-j", "1"))
    assert out.splitlines()[0] == "Pulley on a dry shaft: sweep done"
    assert "3 of 3 runs are done" in out
    assert (out.splitlines()[-1], err) == ("sweep: s.h5", "")
    assert sorted(os.listdir()) == ["s.csv", "s.h5"]
    expected = fs.sweep(PULLEY, {LOAD: "lin(2000, 2400, 3)"}, LOOSE, workers=1)
    assert np.array_equal(fs.open_sweep("s.h5")["final_angle"], expected["final_angle"])
    assert len(Path("s.csv").read_text(encoding="utf-8").splitlines()) == 4
    # Both are replaced by another sweep, which says so.
    _, err = told(*command(2, "s.h5", "--csv", "s.csv", "-q", "-j", "1"))
    change = f'{LOAD}: "lin(2000, 2400, 3)", now "lin(2000, 2400, 2)"'
    assert err == f"frictionsim: note: s.h5 replaces a sweep of other values ({change})\n"
    assert len(Path("s.csv").read_text(encoding="utf-8").splitlines()) == 3


def test_sobol_indices_replace_no_other_file(told: Run, here: Path) -> None:
    vary = [f"--vary={MU_S}=uniform(0.15, 0.3)", f"--vary={LOAD}=uniform(2000, 2400)"]
    arguments = ["sweep", PULLEY, *vary, "--sample", "8", "--indices", "-q", "-j", "1"]
    Path("s.sobol.csv").write_text("mine\n")
    _, err = told(*arguments, "-o", "s.h5", "--csv", "s.csv", code=4)
    assert "s.sobol.csv: cannot write the table: the existing file is not a table of Sobol" in err
    assert os.listdir() == ["s.sobol.csv"]
    for _ in range(2):  # such a table is replaced
        told(*arguments, "-o", "t.h5", "--csv", "t.csv")
    assert len(Path("t.sobol.csv").read_text(encoding="utf-8").splitlines()) == 1 + 2 * 13
    assert "t.csv" in told(*arguments, "-o", "u.h5", "--csv", "t.csv", "--no-clobber", code=4)[1]


def test_runs_that_fail_are_rows_and_are_counted(told: Run) -> None:
    vary = ("--vary", "solver.max_steps=[1, 100000]", "-j", "1")
    out, err = told("sweep", PULLEY, *vary, "--set", "solver.rtol=1e-4", "--json")
    document = strict_json(out)
    assert document["runs"] == {"all": 2, "not_run": 0, "done": 1, "failed": 1, "audit_failed": 0}
    assert document["output"] == str(Path("results") / "pulley-sweep.h5")
    assert err == "frictionsim: warning: 1 of 2 runs failed\n"


def test_a_study_in_a_file_is_run(told: Run) -> None:
    Path("study.toml").write_text(STUDY)
    told("sweep", "study.toml", "-q", "-j", "1", "-o", "s.h5")
    assert fs.open_sweep("s.h5")[MU_S].values.tolist() == [0.2, 0.3]


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="signals of POSIX")
@pytest.mark.parametrize("name", ["SIGINT", slow("SIGTERM"), slow("SIGHUP")])
def test_a_signal_keeps_what_is_done(name: str, here: Path) -> None:
    process = started(command(2000, "s.h5", "-j", "2"), here)
    wait_for_runs(here / "s.partial.runs", process)
    os.killpg(process.pid, getattr(signal, name))  # as a terminal and `timeout`: workers, too
    out, err = process.communicate(timeout=30.0)
    assert (process.returncode, out) == (128 + getattr(signal, name), b""), err
    kept = fs.open_sweep(here / "s.partial.runs")
    assert kept.exit_code == process.returncode
    done = int((kept.table.status == 1).sum())
    assert 0 < done < 2000
    assert kept.reason == f"interrupted by {name} after {done} of 2000 runs"
    assert err.decode() == (
        f"frictionsim: sweep interrupted: {done} of 2000 runs are saved in s.partial.runs;"
        " 'frictionsim resume s.partial.runs' continues the sweep\n"
    )
    assert os.listdir() == ["s.partial.runs"]


@pytest.mark.slow  # workers load kernels
def test_a_belt_is_swept(told: Run) -> None:
    """Kernels are compiled before the workers start, and output of runs is discarded."""
    told(
        *("sweep", SCENARIOS / "belt_drive.toml", "--vary", "mechanism.belt.pretension=[500, 600]"),
        *("--set", "solver.duration=1e-4", "--set", "output.interval=1e-4"),
        *("-j", "2", "-o", "s.h5", "-q"),
    )
    with h5py.File("s.h5") as file:
        assert file["status"][...].tolist() == [1, 1]


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="process groups of POSIX")
def test_the_program_ends_its_workers(here: Path) -> None:
    process = started(command(3000, "s.h5", "-j", "2"), here)
    wait_for_runs(here / "s.partial.runs", process)
    process.kill()
    process.wait()
    latest = time.monotonic() + 20.0
    while time.monotonic() < latest:
        try:
            os.killpg(process.pid, 0)  # they are of the process group of their parent
        except ProcessLookupError:
            return
        time.sleep(0.05)
    pytest.fail("a worker goes on without its parent")


# --- files of sweeps ------------------------------------------------------------------------


@pytest.fixture
def grid(here: Path) -> fs.Sweep:
    """A sweep over two keys in the file s.h5."""
    vary = {MU_S: "lin(0.1, 0.4, 4)", LOAD: [2000.0, 2224.1, 3000.0]}
    return fs.sweep(PULLEY, vary, LOOSE, output="s.h5", workers=1)


def test_the_summary_of_a_grid_has_the_extremes(grid: fs.Sweep, told: Run) -> None:
    out, _ = told("show", "s.h5")
    lines = [" ".join(line.split()) for line in out.splitlines()]
    assert lines[1] == "kind pulley, all combinations of these keys"
    assert "12 of 12 runs are done" in lines
    force = grid["force_to_lift"].values.ravel()
    assert f"force_to_lift {force.min():.6g} 0 {force.max():.6g} 11 N 12" in lines
    document = strict_json(told("show", "s.h5", "--json")[0])
    quantity = document["quantities"]["force_to_lift"]
    at = {MU_S: 0.4, LOAD: 3000.0}
    assert quantity["largest"] == {"value": force.max(), "run": 11, "at": at}
    assert document["varied"][LOAD] == {
        "unit": "N", "distribution": None, "values": [2000.0, 2224.1, 3000.0]
    }  # fmt: skip
    # No run is named for extremes that differ by roundoff.
    force = grid.table.values["force_to_lift"]
    force[:] = 2000.0 * (1.0 + 1e-15 * np.arange(force.size).reshape(force.shape))
    lines = [" ".join(line.split()) for line in grid.summary().splitlines()]
    assert "force_to_lift 2000 2000 N 12" in lines


def test_the_summary_of_a_sample_has_its_statistics(here: Path, told: Run) -> None:
    vary = {MU_S: "uniform(0.1, 0.2)", LOAD: "normal(2000.0, 30.0)"}
    sweep = fs.sweep(PULLEY, vary, LOOSE, sample=16, indices=True, output="s.h5", workers=1)
    out, _ = told("show", "s.h5")
    angle = sweep["final_angle"].values[:32]  # of A and B
    row = next(line for line in out.splitlines() if line.startswith("final_angle")).split()
    numbers = (angle.mean(), angle.std(ddof=1), *np.quantile(angle, (0.05, 0.5, 0.95)))
    assert row == ["final_angle", *(f"{number:.6g}" for number in numbers), "rad", "32"]
    assert "the first 32 runs are independent" in out
    assert "uniform(0.1, 0.2)" in out
    data = strict_json(told("show", "s.h5", "--json")[0])["quantities"]["final_angle"]
    assert data["standard_deviation"] == pytest.approx(angle.std(ddof=1), rel=1e-14)


def test_csv_scenario_and_study_are_those_of_the_sweep(grid: fs.Sweep, told: Run) -> None:
    out, _ = told("show", "s.h5", "--csv")
    fs.open_sweep("s.h5").save("s.csv")
    assert out == Path("s.csv").read_text(encoding="utf-8")
    assert len(list(csv.reader(io.StringIO(out)))) == 13
    assert tomllib.loads(told("show", "s.h5", "--scenario")[0])["solver"]["rtol"] == 1e-4
    study = tomllib.loads(told("show", "s.h5", "--study")[0])
    assert fs.sweep(study, workers=1).equals(grid)


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
    lines = [" ".join(line.split()) for line in out.splitlines()]
    for line in (
        "16 of 20 runs are done; 3 failed, 1 not run: not in the table below",
        "failed, 2 runs: diverged: stopped at t = 0.5 s (run 0)",
        "failed, run 8: no memory",
        "warnings, run 4: kind a",
        "warnings: 5 further kinds, in 5 runs",
        "f 2 1 19 18 N m 16",
    ):
        assert line in lines
    said = "sweep interrupted: 1 of 20 runs are left: interrupted by the user"
    assert err == f"frictionsim: {said}\n"
    data = strict_json(told("show", "s.partial.h5", "--json")[0])
    first = {"runs": 2, "first_run": 0, "text": "diverged: stopped at t = 0.5 s"}
    assert data["failures"][0] == first


def test_chosen_quantities_are_drawn_at_a_chosen_value_and_all_in_files(
    grid: fs.Sweep, here: Path, told: Run
) -> None:
    told("plot", "s.h5", "--view", "final_angle", "--at", f"{LOAD}=2000", "-o", "a.svg")
    text = Path("a.svg").read_text(encoding="utf-8")
    assert ">final angle," in text
    assert "mechanism.load = 2000 N; 4 of 12 runs)" in text
    told("plot", "s.h5", "-o", "a.svg", "--no-clobber", code=4)
    functions: Any = {"f": lambda a: a, "g": lambda a: 2 * a, "h": lambda a: np.nan}
    fs.Sweep(grid_of({"a": [1.0, 2.0]}, functions | {"same": lambda a: 5.0})).save("t.h5")
    document = strict_json(told("plot", "t.h5", "--view", "all", "--json")[0])
    assert document["pictures"] == ["t-f.png", "t-g.png"]
    undrawn = ["h is not defined in any run", "same has one value in all runs"]
    assert document["skipped"] == undrawn
    assert sorted(path.name for path in here.glob("*.png")) == document["pictures"]


# --- fit ------------------------------------------------------------------------------------

SET = ("--set", "solver.duration=1.5", "--set", "solver.rtol=1e-8")
ONE = ("--free", f"{MU_S}=0.1:0.4", "--channel", "angular_velocity", "--starts", "1")
FIT = ("fit", PULLEY, *SET, *ONE, "--data", "log.csv")


@pytest.fixture
def log(here: Path) -> Path:
    """Measured velocity of a pulley with mu_s = 0.23."""
    data = series(pulley().replace({MU_S: 0.23}), 0.1, angular_velocity=0.02)
    return write_csv(here / "log.csv", data)


def test_a_fit_prints_its_tables(told: Run, log: Path) -> None:
    out, err = told(*FIT, "--free", f"{MU_K}=0.02:0.2")
    title, overrides, *table = out.splitlines()
    assert title == "Pulley on a dry shaft: fit of 2 keys to 16 values"
    assert overrides == "set: solver.duration = 1.5, solver.rtol = 1e-08"
    rows = [line.split() for line in table]
    assert rows[1][0] == MU_S
    assert float(rows[1][1]) == pytest.approx(0.23, rel=0.01)
    assert rows[3:5] == [["correlation", "(1)", "(2)"], ["(1)", MU_S, "1.000", rows[4][3]]]
    assert rows[6] == ["residual", "values", "rms", "largest", "sigma", "unit"]
    assert (rows[7][:2], rows[7][-2:]) == (["angular_velocity", "16"], ["estimated", "rad/s"])
    assert table[8] == "data: angular_velocity from 'angular_velocity' in rad/s"
    assert table[9].startswith("1 of 1 search found this minimum,")
    assert (err, os.listdir()) == ("", ["log.csv"])


def test_a_fit_writes_a_scenario_and_a_picture(told: Run, log: Path) -> None:
    out, err = told(*FIT, "-o", "fitted.toml", "--plot", "fit.png")
    assert (out.splitlines()[-2:], err) == (["output: fitted.toml", "picture: fit.png"], "")
    text = Path("fitted.toml").read_text(encoding="utf-8")
    assert text.startswith(
        "# Fitted by 'frictionsim fit' from pulley.toml to measured angular_velocity: estimate,"
        f" standard error\n#   {MU_S} = 0.2"
    )
    assert fs.load("fitted.toml").effects.shaft_friction.mu_s == pytest.approx(0.23, rel=0.01)
    assert Path("fit.png").read_bytes().startswith(b"\x89PNG")
    # A scenario is not replaced, a picture is; nothing is fitted before that is known.
    _, err = told(*FIT, "-o", "fitted.toml", code=4)
    exists = "the file exists and is not replaced; give another name"
    assert err == f"frictionsim: fitted.toml: cannot write the scenario: {exists}\n"
    _, err = told(*FIT, "--plot", "fit.png", "--no-clobber", code=4)
    assert err == f"frictionsim: fit.png: cannot write the picture: {exists}\n"


def test_a_fit_as_json(told: Run, log: Path) -> None:
    options = ("--sigma", "angular_velocity=0.02", "--bootstrap", "40", "--seed", "2", "--json")
    data = strict_json(told(*FIT, *options)[0])
    key, part = data["keys"][MU_S], data["residuals"]["angular_velocity"]
    assert key["value"] == pytest.approx(0.23, rel=0.01)
    low, high = key["interval"]
    assert high - low == pytest.approx(2.0 * 1.959964 * key["standard_error"])
    assert (key["bounds"], len(key["bootstrap_interval"])) == ([0.1, 0.4], 2)
    assert data["bootstrap"] == {"done": 40, "failed": 0}
    assert (part["sigma"], part["sigma_given"]) == (pytest.approx(0.02), True)
    # Of so many values the largest is more than the root of the mean square, and not above it by
    # the root of their number.
    assert 1.2 * part["rms"] < part["largest"] <= part["rms"] * part["count"] ** 0.5
    assert data["degrees_of_freedom"] == 15
    assert data["reduced_chi_squared"] == pytest.approx(data["chi_squared"] / 15)
    assert (data["status"], data["output"], data["picture"]) == ("done", None, None)


def test_files_that_cannot_be_written_are_not_named(told: Run, log: Path) -> None:
    """The others are, and the estimates are printed."""
    long = ("--set", f"title='{'long ' * 1000}'", "-o", "fitted.toml", "--plot", "fit.png")
    with limited_files(4096):
        out, err = told(*FIT, *long, code=4)
    assert ("written" in out, MU_S in out) == (False, True)
    assert "fit.png: cannot write the picture" in err


def test_units_offset_and_columns(told: Run, here: Path) -> None:
    data = series(pulley().replace({MU_S: 0.23}), 0.1, angular_velocity=0.0)
    shifted = {"t": 1e3 * (data["time"] + 5.0), "n": data["angular_velocity"] * 30.0 / np.pi}
    path = write_csv(here / "rig.csv", shifted)
    out, _ = told(
        *("fit", PULLEY, *SET, "--data", path, "--channel", "angular_velocity=n", "--time", "1"),
        *("--time-unit", "ms", "--time-offset", "-5", "--unit", "angular_velocity=rpm"),
        *("--free", f"{MU_S}=0.1:0.4:0.25", "--starts", "1", "--json"),
    )
    assert strict_json(out)["keys"][MU_S]["value"] == pytest.approx(0.23, rel=1e-6)


def test_a_table_of_runs(told: Run, here: Path) -> None:
    rows = ["W,t"]
    for load in (2000.0, 2200.0):
        result = fs.solve(pulley(), {MU_S: 0.23, LOAD: load})
        rows.append(f"{load},{result.quantities['breakaway_time'].value!r}")
    (here / "curve.csv").write_text("\n".join(rows))
    out, _ = told(
        *("fit", PULLEY, *SET, "--data", "curve.csv", "--quantity", "breakaway_time=t"),
        *("--over", f"{LOAD}=W", "--free", f"{MU_S}=0.1:0.4", "--starts", "1"),
        *("--plot", "curve.svg"),
    )
    assert float(out.splitlines()[3].split()[1]) == pytest.approx(0.23, rel=1e-6)
    assert Path("curve.svg").exists()


def test_a_fit_of_which_all_runs_fail(told: Run, log: Path) -> None:
    limits = ("--set", "solver.max_steps=2", "--set", "mechanism.initial_angular_velocity=1.0")
    out, err = told(*FIT, *limits, "-o", "f.toml", code=1)
    assert out == ""
    assert err.startswith("frictionsim: the run of the fit failed: limit of 2 steps")
    assert not Path("f.toml").exists()


def test_a_value_out_of_reach_is_exit_1(told: Run) -> None:
    arguments = ("--free", f"{MU_S}=0.15:0.4", "--quantity", "force_to_lift=2500")
    out, err = told("fit", PULLEY, "--set", "solver.duration=0.1", *arguments, code=1)
    reason = "out of reach: force_to_lift = 2500 N; "
    assert out.splitlines()[-1].startswith(reason)
    assert f"warning: {reason}" in err
