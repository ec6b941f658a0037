"""Work-precision studies: errors, settings, failures, the command `cost`."""

import csv
import json
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from tests.costs.made import made_row, made_table
from tests.support.plugins import searched
from tests.support.problems import RAMP
from tests.support.scenarios import GOLDEN, SCENARIOS, pulley, simulate, with_method
from tests.support.unreliable import SCENARIO, unreliable

PULLEY, RETURN = (str(SCENARIOS / f"{name}.toml") for name in ("pulley", "pulley_return"))
SHORT = {"solver.duration": 1.0}  # the pulley breaks away at 0.5 s


def settings_of(scenario: Any, overrides: Any = None, **options: Any) -> list[dict[str, Any]]:
    """Return the rows of a study of runs that are timed once."""
    told = fs.cost(scenario, overrides, repeats=1, **options).to_json()
    settings: list[dict[str, Any]] = told["settings"]
    return settings


def line_of(row: dict[str, Any]) -> str:
    return ", ".join(part for part in (row["backend"], row["law"]) if part)


# --- errors ---------------------------------------------------------------------------------


def test_errors_are_those_of_separate_runs() -> None:
    """Relative to the reference; those of times relative to the duration."""
    options: dict[str, Any] = {"backends": ["rkf45"], "laws": ["regularised"]}
    told = fs.cost(PULLEY, SHORT, tolerances=[1e-6], repeats=1, **options).to_json()
    assert told["references"][0] == "events, set-valued, rtol 5e-8"
    exact = fs.solve(PULLEY, {**SHORT, "solver.rtol": 5e-8, "solver.atol": 5e-11})
    grid = np.arange(0.0, 1.0, 0.01)
    wanted = exact.dataset["angular_velocity"].sel(time=grid, method="nearest")
    names = {"event_time": "breakaway_time", "final_angle": "final_angle"}
    names["friction_heat"] = "energy_friction"
    # Times of events to their tolerance; a study samples its runs as they are.
    near = {"rel": 1e-3, "abs": 1e-12}
    for row in told["settings"][:3]:
        run, errors = solved_as(row, "rkf45"), row["errors"]
        for error, name in names.items():
            off = abs(float(run.quantities[name]) - float(exact.quantities[name]))
            assert errors[error]["absolute"] == pytest.approx(off, **near)
            size = 1.0 if error == "event_time" else float(exact.quantities[name])
            assert errors[error]["relative"] == pytest.approx(off / size, **near)
        speed = run.dataset["angular_velocity"].sel(time=grid, method="nearest")
        mean = float(abs(speed - wanted).mean()) / float(abs(wanted).mean())
        # Beside the samples on the grid a study has those at the events.
        assert errors["velocity_L1"]["relative"] == pytest.approx(mean, rel=0.1)
        assert row["error"] == max(error["relative"] for error in errors.values())


def solved_as(row: dict[str, Any], backend: str, scenario: Any = PULLEY) -> fs.Result:
    """Return the run of a row by itself."""
    return fs.solve(scenario, [*row["overrides"], "solver.duration=1", f"solver.backend={backend}"])


def test_an_event_that_comes_too_early_has_an_error() -> None:
    """Smoothed friction lets a pulley that turns count as at rest before it is."""
    turning = {"mechanism.initial_angular_velocity": 5.0, "drive.force": 2224.1}
    options: dict[str, Any] = {"backends": ["rkf45"], "laws": ["regularised"]}
    (row, *_) = settings_of(PULLEY, {**SHORT, **turning}, tolerances=[1e-6], **options)
    (exact,) = fs.solve(PULLEY, {**SHORT, **turning}).transitions
    (early,) = solved_as(row, "rkf45", fs.load(PULLEY, turning)).transitions
    assert early.time < exact.time - 1e-3
    wanted = pytest.approx(exact.time - early.time, rel=1e-6)
    assert row["errors"]["event_time"]["absolute"] == wanted


@pytest.mark.slow
def test_errors_fall_with_tolerance_and_transition_speed_but_not_those_of_eq_30() -> None:
    by_line: dict[str, list[float]] = {}  # by method and law, from the loosest to the tightest
    for row in settings_of(RETURN, max_wall=60.0):
        assert row["error"] is not None, row["reason"]
        by_line.setdefault(line_of(row), []).append(row["error"])
    for backend in ("events", "rkf45"):
        errors = by_line.pop(f"{backend}, set-valued")
        # From one rung to the next the tolerance falls by 100, and the error follows it.
        assert all(fine < 0.2 * coarse for coarse, fine in pairwise(errors)), backend
        assert errors[-1] < 1e-12, backend
    # It runs back instead of sticking: other events, and an error of the angle of 58 %.
    assert by_line.pop("rkf45, published") == [1.0, 1.0, 1.0]
    for backend in ("rkf45", "rk45", "dop853", "radau", "bdf", "lsoda"):
        errors = by_line.pop(f"{backend}, regularised")
        # By 10 in speed: at first order 10, where the breakaway decides 10^(2/3) = 4.6.
        assert all(fine < coarse / 4.0 for coarse, fine in pairwise(errors)), backend
        assert errors[0] < 0.02, backend
    assert by_line == {}


def test_the_reference_uncertainty_is_realistic() -> None:
    overrides = {"solver.duration": 5.0}
    told = fs.cost(PULLEY, overrides, backends=["events"], tolerances=[1e-11], repeats=1).to_json()
    assert told["references"][0] == "events, set-valued, rtol 5e-13"
    reference = fs.solve(PULLEY, {**overrides, "solver.rtol": 5e-13, "solver.atol": 5e-16})
    exact = RAMP[3][1]
    error = abs(float(reference.quantities["final_angle"]) / exact - 1.0)
    floor = told["floor"]["final_angle"]["relative"]
    assert 0.0 < floor < 1e-12
    assert error < 10.0 * floor


COUNTS = GOLDEN / "pulley_cost.json"


@pytest.mark.slow
def test_step_counts_agree_with_the_golden_file(request: pytest.FixtureRequest) -> None:
    """Those of our own integrator; SciPy's change with its version."""
    statistics = {
        f"{line_of(row)}, {row['setting']}": [
            row[name] for name in ("steps", "rejected", "rhs_evaluations")
        ]
        for row in settings_of(PULLEY, backends=["events", "rkf45"], max_wall=60.0)
    }
    if request.config.getoption("--update-golden"):
        lines = ",\n".join(f"  {json.dumps(name)}: {list_}" for name, list_ in statistics.items())
        COUNTS.write_text(f"{{\n{lines}\n}}\n", encoding="utf-8")
    golden = json.loads(COUNTS.read_text(encoding="utf-8"))
    assert statistics.keys() == golden.keys()
    for name, counts in statistics.items():
        # Sums in another order moved a step in 140, and two rejected ones in 3151.
        assert counts == pytest.approx(golden[name], rel=0.01, abs=3), name


def test_step_counts_exclude_samples_and_runs_are_repeated() -> None:
    study = fs.cost(PULLEY, backends=["events"], tolerances=[1e-9], repeats=2)
    (row,) = study.to_json()["settings"]
    bare = simulate(pulley(solver__rtol=1e-9, solver__atol=1e-12, output__interval=3.0))
    assert bare.statistics is not None
    assert row["steps"] == bare.statistics.steps
    assert row["rhs_evaluations"] == bare.statistics.rhs_evaluations
    assert row["repeats"] == 2
    assert row["wall_spread"] >= 0.0
    (once,) = settings_of(PULLEY, backends=["events"], tolerances=[1e-9])
    assert (once["repeats"], once["wall_spread"]) == (1, None)


def test_settings_of_a_study_override_the_scenario() -> None:
    options: dict[str, Any] = {"backends": ["events"], "tolerances": [1e-5]}
    scenario = with_method(
        pulley(solver__step=1e-2, output__channels=["mode"]), "published", "rkf45"
    )
    changed, plain = (settings_of(data, SHORT, **options) for data in (scenario, pulley()))
    assert [row["setting"] for row in changed] == ["rtol 1e-5"]
    for name in ("law", "backend", "overrides", "error", "errors", "steps"):
        assert changed[0][name] == plain[0][name], name


def test_references_without_friction_use_two_methods() -> None:
    told = fs.cost(pulley(effects=None), SHORT, tolerances=[1e-4], repeats=1).to_json()
    assert told["references"] == ["events, rtol 5e-6", "dop853, rtol 1e-5"]
    assert [row["backend"] for row in told["settings"][:2]] == ["events", "rkf45"]
    of_scipy = {"rk45", "dop853", "radau", "bdf", "lsoda"}
    assert {row["backend"] for row in told["settings"][2:]} == of_scipy
    assert {(row["law"], row["setting"]) for row in told["settings"]} == {("", "rtol 1e-4")}


# --- failures ------------------------------------------------------------------------------


def test_failed_settings_are_reported_with_the_reason() -> None:
    """The smoothest friction has too few steps."""
    rows = settings_of(PULLEY, SHORT | {"solver.max_steps": 1000}, backends="rk45")
    assert (rows[0]["status"], rows[-1]["status"]) == ("done", "failed")
    assert rows[-1]["reason"].startswith("limit of 1000 steps reached at t = ")
    assert rows[-1]["error"] is None


def test_failed_references_are_reported_and_an_error_if_all_fail() -> None:
    options: dict[str, Any] = {"backends": ["events"], "tolerances": [1e-9], "repeats": 1}
    few = r"all reference runs failed: events, set-valued, rtol 5e-11: limit"
    with pytest.raises(fs.SolverError, match=few):
        fs.cost(PULLEY, {**SHORT, "solver.max_steps": 2}, **options)
    # The first reference takes 129 steps, the second one 190.
    failed = fs.cost(PULLEY, {**SHORT, "solver.max_steps": 160}, **options)
    assert "reference uncertainty: unknown, the second reference failed" in failed.summary()
    assert failed.recommendations[0].endswith("; the reference uncertainty is unknown")


def test_an_interrupted_study_shows_its_results(cli: Callable[..., Any], tmp_path: Path) -> None:
    """Ctrl-C comes while the n-th run is set up; two references come first."""
    whole = made_table(Path("table.csv"), [made_row("events", 1e-3, 1.0)])
    before = whole.read_bytes()
    left = tmp_path / "left"
    left.write_text("x" * 24)
    body = (
        "import os, pathlib, signal",
        f"left = pathlib.Path({str(left)!r})",
        "left.write_text(left.read_text()[1:])",
        "if not left.read_text():",
        "    os.kill(os.getpid(), signal.SIGINT)",
    )
    with searched(unreliable(tmp_path / "site", 0, *body)):
        done = cli("cost", SCENARIO, "--backends", "events,rkf45", "--csv", "table.csv")
    assert done.returncode == 130
    assert "error against run time (interrupted)" in done.stdout
    assert done.stderr.startswith("frictionsim: study interrupted by SIGINT at t = ")
    assert done.stderr.endswith("the results cover the settings before, in table.partial.csv\n")
    table = Path("table.partial.csv").read_text(encoding="utf-8").splitlines()
    assert len(table) >= 3
    assert "\ntable: table.partial.csv\n" in done.stdout
    assert whole.read_bytes() == before


def test_a_done_study_removes_the_unfinished_files_of_its_names(told: Callable[..., Any]) -> None:
    made_table(Path("table.partial.csv"), [made_row("events", 1e-3, 1.0)])
    Path("notes.partial.csv").write_text("a,b\n1,2\n")
    few = ("--backends", "events", "--tolerances", "1e-6", "--set", "solver.duration=1")
    for name in ("table", "notes"):
        told("cost", "pulley", *few, "--csv", f"{name}.csv", code=0)
    left = sorted(path.name for path in Path().glob("*.*"))
    assert left == ["notes.csv", "notes.partial.csv", "table.csv"]


# --- the command ---------------------------------------------------------------------------


def test_the_command_writes_and_names_table_and_picture(
    cli: Callable[..., Any], tmp_path: Path
) -> None:
    command = (
        *("cost", PULLEY, "--backends", "events", "--tolerances", "1e-4,1e-8"),
        *("--set", "solver.duration=1", "--repeats", "1"),
    )
    done = cli(*command, "--json", "--csv", "a.csv", "--plot", "a.png")
    assert (done.returncode, done.stderr) == (0, "")
    told = json.loads(done.stdout)
    assert (told["table"], told["picture"]) == ("a.csv", "a.png")
    assert [s["setting"] for s in told["settings"][:2]] == ["rtol 1e-4", "rtol 1e-8"]
    with (tmp_path / "a.csv").open(encoding="utf-8") as file:
        lines = list(csv.DictReader(file))
    assert [float(line["error [1]"]) for line in lines] == [s["error"] for s in told["settings"]]
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")
    shown = cli(*command, "--csv", "b.csv").stdout.splitlines()
    assert shown[1] == "set: solver.duration = 1"
    assert shown[-1] == "table: b.csv"
    assert "0.01 %: " in shown[-2]


def test_files_that_cannot_be_written_cost_no_result(
    cli: Callable[..., Any], tmp_path: Path
) -> None:
    """The disk fills while the study runs: here the folder goes."""
    folder = tmp_path / "site"
    body = ("import pathlib, shutil", "shutil.rmtree('gone', ignore_errors=True)")
    (tmp_path / "gone").mkdir()
    with searched(unreliable(folder, 0, *body)):
        done = cli(
            *("cost", SCENARIO, "--backends", "events", "--tolerances", "1e-3", "--repeats", "1"),
            *("--csv", "gone/a.csv", "--plot", "b.png"),
        )
    assert done.returncode == 4
    assert "gone/a.csv: cannot write the table" in done.stderr
    assert done.stdout.splitlines()[-1] == "picture: b.png"
    assert "table: " not in done.stdout


# --- a kind with ladders of its own ----------------------------------------------------------


@pytest.mark.slow
def test_a_belt_compares_tolerances_steps_and_friction_laws() -> None:
    rows = settings_of("belt_drive", {"solver.duration": 0.002}, bodies="none", tolerances=[1e-5])
    lines = [f"{name}, set-valued" for name in ("rkf45", "moreau")]
    lines.append("rkf45, regularised")
    assert list(dict.fromkeys(map(line_of, rows))) == lines
    for row in rows:
        assert f"effects.belt_friction.law={row['law']}" in row["overrides"]
    steps = [row for row in rows if row["backend"] == "moreau"]
    assert [row["status"] for row in steps] == ["done"] * 3
    # The driving torque has just begun to rise: what moves is small and its errors relative to it.
    assert max(row["errors"]["tension_tight"]["relative"] for row in steps) < 1e-4
