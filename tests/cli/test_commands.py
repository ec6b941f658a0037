"""The commands: exit codes, stdout and stderr, files, signals, imports."""

import os
import re
import time
from pathlib import Path
from typing import Any

import h5py
import pytest
import tomli_w

import frictionsim as fs
from frictionsim.errors import Interrupted
from frictionsim.results import Quantity
from tests.cli.conftest import Run, strict_json
from tests.support.scenarios import SCENARIOS, pulley, python

PULLEY = str(SCENARIOS / "pulley.toml")
LOOSE = ["--set", "solver.rtol=1e-4", "-q"]


@pytest.mark.parametrize(
    "command",
    [
        ["solve", PULLEY, *LOOSE],
        ["sweep", PULLEY, "--vary", "mechanism.load=[2000.0, 2100.0]", *LOOSE, "-j", "1"],
        ["resume", "incomplete.partial.h5", "-q"],
    ],
    ids=lambda command: command[0],
)
def test_a_file_with_another_name_is_said_to_be_hdf5(command: list[str], told: Run) -> None:
    for name in ("x.h5.bak", "x.HDF5"):
        if command[0] == "resume":
            told("solve", PULLEY, *LOOSE, "--max-steps", "9", "-o", "incomplete.h5", code=5)
        warning = (
            f"frictionsim: warning: {name}: the file is HDF5 whatever its name; names of HDF5 end"
            " in .h5, .hdf5 or .nc\n"
        )
        assert told(*command, "-o", name)[1] == ("" if name == "x.HDF5" else warning)
        assert h5py.is_hdf5(name)


def test_solve_prints_quantities_and_names_the_file_after_the_scenario(told: Run) -> None:
    out, err = told("solve", PULLEY)
    assert err == ""
    for quantity in ["force_to_lift", "2707.70308", "breakaway_time", "0.546448475", "slip +"]:
        assert quantity in out
    assert "result: results/pulley.h5" in out
    assert fs.open(Path("results/pulley.h5")).record.attributes["status"] == "done"


def test_json_is_one_object_with_the_documented_keys(told: Run) -> None:
    document = strict_json(told("solve", PULLEY, "--json", "-o", "a.h5")[0])
    assert document.keys() == {
        *("scenario", "kind", "law", "backend", "status", "quantities", "solver", "effects"),
        *("overrides", "audit", "output", "reason", "failure", "events", "warnings"),
    }
    told_of = [
        document[key] for key in ("scenario", "kind", "backend", "status", "reason", "output")
    ]
    assert told_of == [PULLEY, "pulley", "events", "done", "", "a.h5"]
    assert {"force_to_lift", "force_to_hold", "breakaway_time", "final_angle"} <= set(
        document["quantities"]
    )
    for quantity in document["quantities"].values():
        assert quantity.keys() == {"value", "unit"}
        assert quantity["value"] is None or isinstance(quantity["value"], float)
    statistics = document["solver"]
    seconds = {"wall_seconds", "compile_seconds"}
    assert statistics.keys() == {"steps", "rejected", "rhs_evaluations", "states"} | seconds
    assert all(isinstance(statistics[key], int) for key in statistics.keys() - seconds)
    assert statistics["wall_seconds"] > 0.0
    assert statistics["compile_seconds"] == 0.0
    assert document["effects"] == ["shaft_friction", "viscous_damping"]
    assert document["audit"].keys() == {
        *("energy_balance", "friction_law", "dissipation_sign", "stick_drift", "release")
    }
    for check in document["audit"].values():
        assert check["ok"] is True
        assert 0.0 <= check["value"] <= check["limit"]
    (event,) = document["events"]
    assert (event["contact"], event["mode_from"], event["mode_to"]) == ("shaft", 0, 1)
    assert event["time"] == document["quantities"]["breakaway_time"]["value"]


def test_warnings_agree_in_json_result_file_and_stderr(told: Run) -> None:
    """Warnings of the scenario come first; resumed and quiet runs have them too."""
    data = pulley(output={"interval": 9.0, "channels": ["angle", "energy_friction"]})
    del data["effects"]["shaft_friction"]
    Path("s.toml").write_text(tomli_w.dumps(data))
    warnings = [
        "output.interval = 9.0 s is longer than the run: only its start and end are sampled",
        "output.channels: this scenario has no channel 'energy_friction'; it is left out",
    ]
    stderr = [f"frictionsim: warning: {warning}" for warning in warnings]

    def check(*arguments: str, code: int = 0, written: str = "a.h5") -> None:
        out, err = told(*arguments, "--json", code=code)
        assert strict_json(out)["warnings"] == warnings
        assert err.splitlines()[:2] == stderr
        assert fs.open(Path(written)).record.attributes["warnings"].splitlines() == warnings

    check("solve", "s.toml", "-o", "a.h5")
    Path("a.h5").unlink()
    check("solve", "s.toml", "-o", "a.h5", "--max-wall", "1e-9", code=5, written="a.partial.h5")
    check("resume", "a.partial.h5")
    content = fs.open(Path("a.h5")).record
    assert content.channels.keys() == {"time", "angle"}
    assert '"energy_friction"' in content.attributes["scenario"]
    assert told("solve", "s.toml", "-o", "a.h5", "--quiet") == ("", "\n".join([*stderr, ""]))


def test_the_pace_excludes_earlier_parts(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a resumed run, the simulated time before does not count."""
    began = 1.0

    def stop(t: float) -> None:
        if t >= began:
            raise Interrupted(2, t)

    part = fs.solve(PULLEY, {"solver.max_step": 5e-5}, progress=stop)  # 20 000 steps
    monkeypatch.setenv("FORCE_COLOR", "1")  # rich takes any stream for a terminal then
    monkeypatch.setenv("COLUMNS", "120")
    start = time.perf_counter()
    assert fs.resume(part, progress=True).status == "done"
    seconds = time.perf_counter() - start
    shown = re.findall(r", ([\d.e-]+) s per simulated second, \d+ s left", capsys.readouterr().err)
    # Were the time before counted, this were two thirds of the time that it takes at most.
    assert (
        0.8 * seconds < float(shown[-1]) * (3.0 - began) <= 1.01 * seconds
    )  # three digits are shown


def test_static_prints_forces_and_writes_nothing(told: Run) -> None:
    document = strict_json(told("static", PULLEY, "--json")[0])
    assert document.keys() == {
        *("scenario", "overrides", "kind", "quantities", "notes", "warnings")
    }
    assert document["notes"] == document["warnings"] == []
    assert document["quantities"]["force_to_lift"]["unit"] == "N"
    # Eq 24 by hand: 2224.1 (0.0508 + r)/(0.0508 - r) with r = 0.0254 0.2/sqrt(1.04), 7 digits.
    assert document["quantities"]["force_to_lift"]["value"] == pytest.approx(2707.703, rel=1e-7)
    table = told("static", PULLEY)[0]
    assert all(name in table for name in document["quantities"])
    assert os.listdir() == []


def test_static_warns_of_implausible_values_as_check_does(told: Run) -> None:
    implausible = ("pulley", "--set", "mechanism.cord_radius=50")
    (warned,) = strict_json(told("static", *implausible, "--json")[0])["warnings"]
    assert "50 m is a radius above 5 m" in warned
    assert told("static", *implausible)[1] == f"frictionsim: warning: {warned}\n"
    (checked,) = strict_json(told("check", *implausible, "--json")[0])["scenarios"]
    assert checked["warnings"] == [warned]


def test_non_finite_quantities_are_null_in_json() -> None:
    quantities = {
        "a": Quantity(float("inf"), "N"),
        "b": Quantity(None, "s"),
        "c": Quantity(1.5, "m"),
    }
    result = fs.Result(fs.solve(PULLEY).record._replace(quantities=quantities))
    assert result.to_json()["quantities"] == {
        "a": {"value": None, "unit": "N"},
        "b": {"value": None, "unit": "s"},
        "c": {"value": 1.5, "unit": "m"},
    }


@pytest.mark.parametrize("protected", [".", "old.h5"])
def test_solve_refuses_an_output_without_write_permission(
    protected: str, told: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    def owner_may(path: Any, mode: int, **options: Any) -> bool:
        """Check the permission as for an ordinary user, even if root runs the tests."""
        return mode != os.W_OK or bool(os.stat(path).st_mode & 0o200)

    monkeypatch.setattr(os, "access", owner_may)
    Path("old.h5").write_bytes(b"the result of yesterday")
    mode = os.stat(protected).st_mode
    os.chmod(protected, mode & ~0o222)
    try:
        out, err = told("solve", PULLEY, "-o", "old.h5", code=4)
    finally:
        os.chmod(protected, mode)
    assert (out, err.startswith("frictionsim: old.h5: cannot write the result: ")) == ("", True)
    assert Path("old.h5").read_bytes() == b"the result of yesterday"
    assert os.listdir() == ["old.h5"]


UNUSED = {"frictionsim.cli.studies", "frictionsim.scenario.csv_columns", "frictionsim.plots"}
HEAVY = {"numpy", "h5py", "scipy", "numba", "matplotlib", "xarray", "pandas", "h5netcdf"}


def loaded_by(program: str, cwd: Path) -> set[str]:
    """Return the modules that a program in Python loads."""
    done = python("-c", f"import sys\n{program}\nprint(*sys.modules, file=sys.stderr)", cwd=cwd)
    assert done.returncode == 0, done.stderr
    return set(done.stderr.split())


FEW_COORDINATES = ["epicyclic", "lift", "marble_machine", "pulley", "shaft", "swing_door"]
COMMAND = "import frictionsim as fs\nassert fs.run_command_line({}) == 0"
CHECK = ["check", *(str(SCENARIOS / f"{name}.toml") for name in FEW_COORDINATES)]


@pytest.mark.parametrize(
    ("program", "unwanted"),
    [
        (COMMAND.format(["--help"]), {*HEAVY, "rich", "logging", "json"}),
        (COMMAND.format(CHECK), {*HEAVY, "rich", "logging"}),
        (COMMAND.format(["solve", PULLEY]), {*HEAVY, *UNUSED} - {"numpy", "h5py"}),
        (
            "import frictionsim as fs\nfs.solve(fs.scenarios()['pulley']).quantities",
            {*HEAVY, "rich", "typer"} - {"numpy"},
        ),
    ],
    ids=["help", "check", "solve", "solve in memory"],
)
def test_no_more_is_imported_than_needed(program: str, unwanted: set[str], tmp_path: Path) -> None:
    loaded = loaded_by(program, tmp_path)
    assert "frictionsim" in loaded
    assert not unwanted & loaded


def test_static_says_below_the_table_what_the_roots_mean(told: Run) -> None:
    out, err = told("static", "shaft", "--set", "statics.unknown=forces.effort.size")
    assert err == ""
    # A key with dots needs no quotes, and may have them.
    assert told("static", "shaft", "--set", 'statics.unknown="forces.effort.size"') == (out, "")
    lines = out.splitlines()
    row = next(line.split() for line in lines if line.startswith("effort_counter_clockwise "))
    assert row == ["effort_counter_clockwise", "208.4430034", "N"]
    assert lines[-2:] == [
        "at 0 deg and 0 s, the body rests",
        "at 0 deg, the body rests with forces.effort.size from 191.689 N to 208.443 N",
    ]


def test_static_as_json_has_the_sentences_as_notes(told: Run) -> None:
    document = strict_json(
        told("static", "shaft", "--set", "statics.unknown=mechanism.mass", "--json")[0]
    )
    assert document.keys() >= {"kind", "quantities", "notes", "warnings"}
    assert document["quantities"]["mass_clockwise"] == {"value": None, "unit": "kg"}
    assert document["notes"][:2] == [
        "at 0 deg and 0 s, the body rests",
        "at 0 deg, no mechanism.mass makes the body move: the friction exceeds the moment with any",
    ]
