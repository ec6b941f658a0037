"""`solve`, `resume`, `check` and `static`: exit codes, text, JSON, files, logs, imports."""

import io
import logging
import os
import sys
from pathlib import Path

import h5py
import pytest
import tomli_w

import frictionsim as fs
from tests.cli.conftest import Run, strict_json
from tests.support.belt_scenarios import pair
from tests.support.scenarios import SCENARIOS, pulley, python

PULLEY, RETURN = str(SCENARIOS / "pulley.toml"), str(SCENARIOS / "pulley_return.toml")
BELT = str(SCENARIOS / "belt_drive.toml")


def test_solve_prints_quantities_and_names_the_file_after_the_scenario(told: Run) -> None:
    out, err = told("solve", PULLEY)
    assert err == ""
    for text in ("force_to_lift", "2707.70308", "breakaway_time", "0.546448475", "slip +"):
        assert text in out
    assert "result: results/pulley.h5" in out
    assert fs.open("results/pulley.h5").status == "done"


def test_json_has_the_numbers_of_the_run(told: Run) -> None:
    """Its keys are those of docs/cli.md."""
    document = strict_json(told("solve", PULLEY, "--json", "-o", "a.h5")[0])
    told_of = [document[key] for key in ("scenario", "kind", "backend", "status", "output")]
    assert told_of == [PULLEY, "pulley", "events", "done", "a.h5"]
    assert document["solver"]["wall_seconds"] > 0.0
    assert document["effects"] == ["shaft_friction", "viscous_damping"]
    assert all(0.0 <= check["value"] <= check["limit"] for check in document["audit"].values())
    (event,) = document["events"]
    assert (event["contact"], event["mode_from"], event["mode_to"]) == ("shaft", 0, 1)
    assert event["time"] == document["quantities"]["breakaway_time"]["value"]


def test_warnings_agree_in_json_result_file_and_stderr(told: Run) -> None:
    """Warnings of the scenario come first; resumed and quiet runs have them too."""
    data = pulley(output={"interval": 9.0, "channels": ["angle", "energy_friction"]})
    del data["effects"]["shaft_friction"]
    Path("s.toml").write_text(tomli_w.dumps(data))
    warnings = [
        "output.interval = 9 s is longer than the run: only its start and end are sampled",
        "output.channels: this scenario has no channel 'energy_friction'; it is left out",
    ]
    stderr = [f"frictionsim: warning: {warning}" for warning in warnings]

    def check(*arguments: str, code: int = 0, written: str = "a.h5") -> None:
        out, err = told(*arguments, "--json", code=code)
        assert strict_json(out)["warnings"] == warnings
        assert err.splitlines()[:2] == stderr
        assert fs.open(written).warnings == tuple(warnings)

    check("solve", "s.toml", "-o", "a.h5", "--max-wall", "1e-9", code=5, written="a.partial.h5")
    check("resume", "a.partial.h5")
    assert fs.open("a.h5").record.channels.keys() == {"time", "angle"}
    assert told("solve", "s.toml", "-o", "a.h5", "--quiet") == ("", "\n".join([*stderr, ""]))


def test_the_log_is_on_stderr_and_python_has_the_same(
    told: Run, caplog: pytest.LogCaptureFixture
) -> None:
    out, err = told("solve", PULLEY, "--json", "-vv")
    assert strict_json(out)["status"] == "done"
    assert (
        f"frictionsim: scenario {PULLEY}: kind pulley, effects shaft_friction, viscous_damping,"
        " law set-valued, backend events"
    ) in err
    caplog.clear()
    with caplog.at_level(logging.INFO, logger="frictionsim"):
        fs.solve(PULLEY)
    assert {record.name for record in caplog.records} == {"frictionsim.simulation.simulate"}
    _, err = told("solve", BELT, "-q", "-vv", "-o", "a.h5", "--set", "solver.duration=1e-3")
    assert "frictionsim: folder of the compiled kernels: " in err


# --- several scenarios ----------------------------------------------------------------------


def test_each_has_a_file_and_a_summary(told: Run) -> None:
    out, err = told("solve", PULLEY, RETURN)
    assert err == ""
    files = ["results/pulley.h5", "results/pulley_return.h5"]
    assert [line for line in out.splitlines() if line.startswith("result: ")] == [
        f"result: {name}" for name in files
    ]
    documents = strict_json(told("solve", "pulley_return", PULLEY, "--json")[0])
    assert [item["scenario"] for item in documents] == ["pulley_return", PULLEY]
    assert [item["output"] for item in documents] == files[::-1]
    by_path = Path("results/pulley.h5").read_bytes()
    told("solve", "pulley", "-q")
    assert Path("results/pulley.h5").read_bytes() == by_path


def test_output_is_a_folder_or_the_only_file(told: Run, here: Path) -> None:
    for output, scenarios, names in (
        ("one/", [PULLEY], ["one/pulley.h5"]),
        ("one/b.h5", [PULLEY], ["one/b.h5"]),
        ("one", [RETURN], ["one/pulley_return.h5"]),  # a folder that is there
        ("two", [PULLEY, RETURN], ["two/pulley.h5", "two/pulley_return.h5"]),
        ("two/three/", [RETURN], ["two/three/pulley_return.h5"]),
    ):
        before = set(here.rglob("*.h5"))
        assert told("solve", *scenarios, "-q", "-o", output) == ("", "")
        assert {here / name for name in names} == set(here.rglob("*.h5")) - before
    for output, why in (
        ("a/b/", "No such file or directory"),
        ("one/pulley.h5/", "this is a file"),
    ):
        _, err = told("solve", PULLEY, "-q", "-o", output, code=4)
        assert f"cannot create the folder '{Path(output)}' ({why})" in err
    assert not Path("a").exists()


def test_the_exit_code_is_the_highest_and_warnings_name_the_scenario(told: Run) -> None:
    Path("short.toml").write_text(tomli_w.dumps(pulley(solver={"max_steps": 10})))
    out, err = told("solve", PULLEY, "short.toml", RETURN, "--json", code=5)
    assert [item["status"] for item in strict_json(out)] == ["done", "failed", "done"]
    assert "run failed: limit of 10 steps reached" in err
    for scenarios, prefix in ([PULLEY], "warning: "), ([PULLEY, RETURN], f"warning: {PULLEY}: "):
        _, err = told("solve", *scenarios, "--set", "solver.duration=0.2", "-q")
        assert err.splitlines()[0].startswith(f"frictionsim: {prefix}nothing moves")


@pytest.mark.slow  # it compiles kernels
def test_one_that_cannot_be_solved_does_not_stop_the_others(told: Run) -> None:
    """A belt without a position of rest, which only the start of a run tells."""
    belt = pair(solver__backend="moreau", solver__rtol=None, effects__gravity={"g": 1e9})
    Path("first.toml").write_text(tomli_w.dumps(belt))
    out, err = told("solve", "first.toml", RETURN, "--json", code=2)
    assert [item["scenario"] for item in strict_json(out)] == [RETURN]
    assert any(line.startswith("frictionsim: first.toml: ") for line in err.splitlines())


def test_all_faults_of_all_scenarios_are_told_and_none_is_solved(told: Run) -> None:
    Path("a.toml").write_text(tomli_w.dumps(pulley(solver={"max_steps": 0, "rtol": -1.0})))
    Path("b.toml").write_text("kind = 3\n")
    out, err = told("solve", PULLEY, "a.toml", "none.toml", "b.toml", code=2)
    places = [line.removeprefix("frictionsim: ").split(":")[0] for line in err.splitlines()]
    assert (out, places) == ("", ["a.toml", "a.toml", "none.toml", "b.toml"])
    assert not Path("results").exists()


# --- standard input -------------------------------------------------------------------------


def give(text: bytes, monkeypatch: pytest.MonkeyPatch) -> None:
    """Have the standard input hold a text."""
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(text)))


def test_the_standard_input_is_a_scenario(told: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    text = Path(PULLEY).read_bytes()
    give(text, monkeypatch)
    options = ("--set", "mechanism.load=2000", "--backend", "rkf45")
    document = strict_json(told("solve", "-", "--json", *options)[0])
    assert (document["scenario"], document["output"]) == ("-", "results/stdin.h5")
    with h5py.File("results/stdin.h5") as file:
        assert file.attrs["command"] == (
            "frictionsim solve - --set mechanism.load=2000 --set solver.backend=rkf45"
        )
    give(b"\xef\xbb\xbf" + text, monkeypatch)  # a mark of the byte order is no error
    out, _ = told("check", RETURN, "-")
    assert out.splitlines()[1].startswith("-: ok; effects shaft_friction")
    give(text, monkeypatch)
    both = ("--vary", "mechanism.load=[1]", "--set", "mechanism.load=2.0")
    assert "both set for all runs and varied" in told("sweep", "-", *both, code=2)[1]


BAD = {
    b"": "<stdin>:1: kind: the scenario is empty; it starts with kind, one of 'pulley',"
    " 'marble_machine', 'epicyclic', 'shaft', 'belt_drive'",
    b"#" * (16 * 2**20 + 1): "-: the file is larger than 1 MiB; use CSV files for signals",
    b'kind = "\xff"': "-: expected a scenario in TOML on the standard input, got invalid UTF-8 at"
    " byte 8",
    b"kind = \n": "<stdin>:1: not valid TOML: Invalid value, in 'kind ='",
    None: "-: the standard input is closed; expected a scenario in TOML",
}


@pytest.mark.parametrize("text", BAD, ids=["empty", "long", "not UTF-8", "not TOML", "closed"])
def test_a_bad_standard_input_is_one_sentence(
    text: bytes | None, told: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    if text is None:
        monkeypatch.setattr(sys, "stdin", None)
    else:
        give(text, monkeypatch)
    assert told("solve", "-", code=2) == ("", f"frictionsim: {BAD[text]}\n")


# --- check and static -----------------------------------------------------------------------


def test_check_of_a_folder_checks_all_in_it(told: Run) -> None:
    out, err = told("check", SCENARIOS)
    checked = [line.partition(": ok; ")[0] for line in out.splitlines()]
    assert checked == sorted(map(str, SCENARIOS.rglob("*.toml")))
    assert all(line.startswith("frictionsim: warning: ") for line in err.splitlines())


def test_check_lists_each_scenario_and_its_faults_as_json(told: Run) -> None:
    Path("bad.toml").write_text('kind = "pulley"\nmechanism.load = -1\n')
    out, err = told("check", PULLEY, "bad.toml", "--json", code=2)
    assert err == ""
    document = strict_json(out)
    good, bad = document["scenarios"]
    assert good == {
        "scenario": PULLEY, "ok": True, "faults": [], "warnings": [], "overrides": {},
        "kind": "pulley", "effects": ["shaft_friction", "viscous_damping"],
        "law": "set-valued", "backend": "events",
    }  # fmt: skip
    assert (document["ok"], bad["scenario"], bad["ok"]) == (False, "bad.toml", False)
    negative = "mechanism.load: should be greater than or equal to 0 N, got -1"
    assert f"bad.toml:2: {negative}" in bad["faults"]
    assert told("check", PULLEY)[0] == (
        f"{PULLEY}: ok; effects shaft_friction, viscous_damping; backend events\n"
    )
    assert os.listdir() == ["bad.toml"]


def test_static_prints_forces_and_warnings_and_writes_nothing(told: Run) -> None:
    document = strict_json(told("static", PULLEY, "--json")[0])
    assert document.keys() == {
        *("scenario", "overrides", "kind", "quantities", "notes", "warnings")
    }
    # Eq 24 by hand: 2224.1 (0.0508 + r)/(0.0508 - r) with r = 0.0254 0.2/sqrt(1.04), 7 digits.
    assert document["quantities"]["force_to_lift"] == {
        "value": pytest.approx(2707.703, rel=1e-7), "unit": "N"
    }  # fmt: skip
    table = told("static", PULLEY)[0]
    assert all(name in table for name in document["quantities"])
    implausible = ("pulley", "--set", "mechanism.cord_radius=50")
    (warned,) = strict_json(told("static", *implausible, "--json")[0])["warnings"]
    assert "50 m is a radius above 5 m" in warned
    assert told("static", *implausible)[1] == f"frictionsim: warning: {warned}\n"
    (checked,) = strict_json(told("check", *implausible, "--json")[0])["scenarios"]
    assert checked["warnings"] == [warned]
    assert os.listdir() == []


def test_static_says_below_the_table_what_the_roots_mean(told: Run) -> None:
    out, _ = told("static", "shaft", "--set", "statics.unknown=forces.effort.size")
    # A key with dots needs no quotes, and may have them.
    assert told("static", "shaft", "--set", 'statics.unknown="forces.effort.size"') == (out, "")
    lines = out.splitlines()
    row = next(line.split() for line in lines if line.startswith("effort_counter_clockwise "))
    assert row == ["effort_counter_clockwise", "208.4430034", "N"]
    assert lines[-1] == (
        "at 0 deg, the body rests with forces.effort.size from 191.689 N to 208.443 N"
    )
    mass = ("--set", "statics.unknown=mechanism.mass", "--json")
    document = strict_json(told("static", "shaft", *mass)[0])
    assert document["quantities"]["mass_clockwise"] == {"value": None, "unit": "kg"}
    assert document["notes"][0] == "at 0 deg and 0 s, the body rests"


# --- resume ---------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["k.h5", "k.partial.h5", "j.nc"])
def test_a_missing_file_is_nothing_to_resume(name: str, told: Run) -> None:
    told("solve", "pulley", "--set", "solver.duration=0.01", "-o", "int.h5", "--quiet")
    _, said = told("resume", name, code=2)
    assert f"{name}: there is nothing to resume" in said
    assert ("output.checkpoint" in said, "int.h5" in said) == (True, False)
    for resume in (fs.resume, fs.resume_sweep):
        with pytest.raises(fs.InputError, match="there is nothing to resume"):
            resume(name)
    assert "there is no folder 'no'" in told("resume", f"no/{name}", code=2)[1]


# --- what is imported -----------------------------------------------------------------------

UNUSED = {"frictionsim.cli.studies", "frictionsim.scenario.csv_columns", "frictionsim.plots"}
HEAVY = {"numpy", "h5py", "scipy", "numba", "matplotlib", "xarray", "pandas", "h5netcdf"}
FEW_COORDINATES = ["epicyclic", "lift", "marble_machine", "pulley", "shaft", "swing_door"]
COMMAND = "import frictionsim as fs\nassert fs.run_command_line({}) == 0"
SMOOTHED = ["--backend", "rkf45", "--set", "effects.shaft_friction.law=regularised"]
CHECK = ["check", *(str(SCENARIOS / f"{name}.toml") for name in FEW_COORDINATES)]


@pytest.mark.parametrize(
    ("program", "unwanted"),
    [
        (COMMAND.format(["--help"]), {*HEAVY, "rich", "logging", "json"}),
        (COMMAND.format(CHECK), {*HEAVY, "rich", "logging"}),
        (COMMAND.format(["solve", PULLEY]), {*HEAVY, *UNUSED} - {"numpy", "h5py"}),
        (COMMAND.format(["solve", PULLEY, *SMOOTHED]), {*HEAVY, *UNUSED} - {"numpy", "h5py"}),
        (
            "import frictionsim as fs\nfs.solve(fs.scenarios()['pulley']).quantities",
            {*HEAVY, "rich", "typer"} - {"numpy"},
        ),
    ],
    ids=["help", "check", "solve", "solve smoothed", "solve in memory"],
)
def test_no_more_is_imported_than_needed(program: str, unwanted: set[str], tmp_path: Path) -> None:
    code = f"import sys\n{program}\nprint(*sys.modules, file=sys.stderr)"
    done = python("-c", code, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    loaded = set(done.stderr.split())
    assert "frictionsim" in loaded
    assert not unwanted & loaded
