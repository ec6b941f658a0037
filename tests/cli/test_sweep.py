"""`frictionsim sweep`, and `resume` of a sweep."""

import os
import signal
import time
from pathlib import Path

import h5py
import numpy as np
import pytest

import frictionsim as fs
from tests.cli.conftest import Run, strict_json
from tests.support.cases import slow
from tests.support.scenarios import SCENARIOS
from tests.support.sweep_files import (
    LOAD,
    LOOSE,
    PULLEY,
    command,
    started,
    wait_for_runs,
)

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
    arguments = command(3, "s.h5", "--csv", "s.csv", "-j", "1")
    out, err = told(*arguments)
    assert out.splitlines()[0] == "Pulley on a dry shaft: sweep done"
    assert "all 3 runs are done" in out or "3 of 3 runs are done" in out
    assert out.splitlines()[-1] == "sweep: s.h5"
    assert err == ""
    assert sorted(os.listdir()) == ["s.csv", "s.h5"]
    expected = fs.sweep(PULLEY, {LOAD: "lin(2000, 2400, 3)"}, LOOSE)
    assert np.array_equal(fs.open_sweep("s.h5")["final_angle"], expected["final_angle"])
    assert len(Path("s.csv").read_text(encoding="utf-8").splitlines()) == 4
    # Both are replaced by another sweep, and nothing else is.
    told(*command(2, "s.h5", "--csv", "s.csv", "-q"))
    assert len(Path("s.csv").read_text(encoding="utf-8").splitlines()) == 3


def test_sobol_indices_replace_no_other_file(told: Run, here: Path) -> None:
    vary = [
        ("--vary", f"{key}=uniform({values})")
        for key, values in (("effects.shaft_friction.mu_s", "0.15, 0.3"), (LOAD, "2000, 2400"))
    ]
    options = ["--sample", "8", "--indices", "-q", "-j", "1"]
    arguments = ["sweep", PULLEY, *vary[0], *vary[1], *options]
    Path("s.sobol.csv").write_text("mine\n")
    _, err = told(*arguments, "-o", "s.h5", "--csv", "s.csv", code=4)
    assert "s.sobol.csv: cannot write the table: the existing file is not a table of Sobol" in err
    assert os.listdir() == ["s.sobol.csv"]
    for _ in range(2):  # such a table is replaced
        told(*arguments, "-o", "t.h5", "--csv", "t.csv")
    assert len(Path("t.sobol.csv").read_text(encoding="utf-8").splitlines()) == 1 + 2 * 13
    _, err = told(*arguments, "-o", "u.h5", "--csv", "t.csv", "--no-clobber", code=4)
    assert "t.csv" in err


def test_runs_that_fail_are_rows_and_are_counted(told: Run, here: Path) -> None:
    vary = "solver.max_steps=[1, 100000]"
    out, err = told("sweep", PULLEY, "--vary", vary, "--set", "solver.rtol=1e-4", "--json")
    document = strict_json(out)
    assert document["runs"] == {"all": 2, "not_run": 0, "done": 1, "failed": 1, "audit_failed": 0}
    assert document["output"] == str(Path("results") / "pulley-sweep.h5")
    assert err == "frictionsim: warning: 1 of 2 runs failed\n"
    assert str(fs.open_sweep(document["output"])["failure"][0].item()) == "budget_exceeded"


def test_a_study_in_a_file_is_run(told: Run, here: Path) -> None:
    Path("study.toml").write_text(STUDY)
    told("sweep", "study.toml", "-q", "-j", "1", "-o", "s.h5")
    sweep = fs.open_sweep("s.h5")
    assert sweep["effects.shaft_friction.mu_s"].values.tolist() == [0.2, 0.3]


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="signals of POSIX")
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", slow("SIGHUP")])
def test_a_signal_keeps_what_is_done(name: str, told: Run, here: Path) -> None:
    process = started(command(2000, "s.h5", "-j", "2"), here)
    wait_for_runs(here / "s.partial.runs", process)
    os.killpg(process.pid, getattr(signal, name))  # as a terminal and `timeout`: workers, too
    out, err = process.communicate(timeout=30.0)
    assert process.returncode == 128 + getattr(signal, name), err
    assert out == b""
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


def test_a_belt_is_swept(told: Run, here: Path) -> None:
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
    # They are of the process group of their parent.
    latest = time.monotonic() + 20.0
    while time.monotonic() < latest:
        try:
            os.killpg(process.pid, 0)
        except ProcessLookupError:
            return
        time.sleep(0.05)
    pytest.fail("a worker goes on without its parent")


def test_a_sweep_of_other_values_is_said_to_be_replaced(told: Run, here: Path) -> None:
    for values, said in (("1500,2000", ""), ("1500,2000", ""), ("1500,2500", "mechanism.load")):
        vary = f"mechanism.load=[{values}]"
        _, stderr = told("sweep", SCENARIOS / "pulley.toml", "--vary", vary, "-o", "s.h5")
        note = f"frictionsim: note: s.h5 is a sweep of other values ({said}), and replaced\n"
        assert stderr == (note if said else "")
