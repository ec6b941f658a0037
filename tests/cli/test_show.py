"""`show`: a result file as summary, JSON, CSV and scenario."""

import csv
import io
import re
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest

import frictionsim as fs
from tests.cli.conftest import Run, strict_json
from tests.support.scenarios import SCENARIOS

PULLEY, RETURN = str(SCENARIOS / "pulley.toml"), str(SCENARIOS / "pulley_return.toml")
BELT = str(SCENARIOS / "belt_drive.toml")
WALL_TIME = re.compile(r"solved in \S+ s(?: after \S+ s of compilation)?: ")


@pytest.mark.parametrize("interval", ["0.01", "9"])  # of the latter is warned
def test_the_summary_is_that_of_solve_but_for_wall_times(interval: str, told: Run) -> None:
    options = ("--set", f"output.interval={interval}")
    solved, warned = told("solve", PULLEY, "-o", "a.h5", *options)
    assert WALL_TIME.search(solved)
    assert bool(warned) == (interval == "9")
    assert told("show", "a.h5") == (WALL_TIME.sub("", solved), warned)


def test_json_is_that_of_solve_but_for_wall_times(told: Run) -> None:
    solved = strict_json(told("solve", PULLEY, "-o", "a.h5", "--json")[0])
    shown = strict_json(told("show", "a.h5", "--json")[0])
    assert shown["solver"].pop("wall_seconds") is None
    assert shown["solver"].pop("compile_seconds") is None
    for name in ("wall_seconds", "compile_seconds"):
        del solved["solver"][name]
    solved["scenario"] = "pulley.toml"  # a file holds the name, not the path
    assert shown == solved


def channels_of(text: str) -> dict[str, list[float]]:
    heading, *rows = csv.reader(io.StringIO(text))
    return {name: [float(row[i]) for row in rows] for i, name in enumerate(heading)}


def test_csv_has_the_channels_to_the_last_digit(told: Run) -> None:
    told("solve", PULLEY, "-o", "a.h5", "-q")
    record = fs.open(Path("a.h5")).record
    columns = channels_of(told("show", "a.h5", "--csv")[0])
    assert list(columns) == [f"{name} [{record.units[name]}]" for name in record.channels]
    assert next(iter(columns)) == "time [s]"
    for values, (name, channel) in zip(columns.values(), record.channels.items(), strict=True):
        np.testing.assert_array_equal(values, channel, err_msg=name)
    pandas = pytest.importorskip("pandas")
    text = io.StringIO(told("show", "a.h5", "--csv")[0])
    table = pandas.read_csv(text, dtype=str).astype(float)
    np.testing.assert_array_equal(table["angle [rad]"], record.channels["angle"])


def test_csv_has_a_column_for_each_member(told: Run) -> None:
    short = ["--set", "solver.duration=1e-3", "--set", 'output.channels=["tension","pulley_speed"]']
    told("solve", BELT, "-o", "a.h5", "-q", *short)
    record = fs.open(Path("a.h5")).record
    columns = channels_of(told("show", "a.h5", "--csv")[0])
    assert len(columns) == 1 + 2 + record.channels["tension"].shape[1]
    np.testing.assert_array_equal(columns["tension.3 [N]"], record.channels["tension"][:, 3])
    speeds = record.channels["pulley_speed"]
    np.testing.assert_array_equal(columns["pulley_speed.driven [rad/s]"], speeds[:, 1])


def test_the_scenario_gives_the_same_result_again(told: Run) -> None:
    told("solve", PULLEY, "-o", "a.h5", "-q", "--set", "mechanism.load=2000")
    text, err = told("show", "a.h5", "--scenario")
    assert err == ""
    assert tomllib.loads(text)["mechanism"]["load"] == 2000
    Path("again.toml").write_text(text, encoding="utf-8")
    told("solve", "again.toml", "-o", "b.h5", "-q")
    told("compare", "b.h5", "a.h5", "--rtol", "0", "--atol", "0", "--time-atol", "0")


def test_a_failed_run_says_why_and_how_to_resume_it(told: Run) -> None:
    _, solved = told("solve", PULLEY, "-o", "a.h5", "-q", "--max-steps", "50", code=5)
    out, err = told("show", "a.partial.h5")
    assert out.startswith("Pulley on a dry shaft: failed\n")
    reason, *_, resume = solved.splitlines()
    assert err.splitlines() == [reason, resume]
    assert reason.startswith("frictionsim: run failed: limit of 50 steps reached")
    assert resume == "frictionsim: 'frictionsim resume a.partial.h5' continues the run"
    document = strict_json(told("show", "a.partial.h5", "--json")[0])
    assert (document["status"], document["failure"]) == ("failed", "budget_exceeded")


def test_a_run_that_cannot_be_resumed_is_not_said_to(told: Run) -> None:
    told("solve", PULLEY, "-o", "a.h5", "-q", "--max-steps", "50", "--backend", "dop853",
         "--set", "effects.shaft_friction.law=regularised", code=5)  # fmt: skip
    _, err = told("show", "a.partial.h5")
    assert err.startswith("frictionsim: run failed: limit of 50 steps reached")
    assert "resume a.partial.h5" not in err


def test_a_failed_audit_is_reported(told: Run) -> None:
    """Fixed steps through the chattering of eq 30 lose energy."""
    force = "drive.force={time=[0,0.8,4,4.8],value=[1832.6,3113.75,3113.75,2224.1]}"
    law = ["--set", "effects.shaft_friction.law=published", "--backend", "rkf45"]
    told("solve", RETURN, "-q", "-o", "a.h5", *law, "--set", "solver.step=1e-3", "--set", force,
         code=3)  # fmt: skip
    out, err = told("show", "a.h5")
    assert "FAILED" in out
    assert "frictionsim: self-audit failed: energy_balance" in err
    document = strict_json(told("show", "a.h5", "--json")[0])
    assert document["audit"]["energy_balance"]["ok"] is False
    assert err.endswith("; do not trust a.h5\n")
    attributes = fs.open(Path("a.h5")).record.attributes
    assert attributes["status"] == "done"
    assert attributes["reason"].startswith("self-audit failed: energy")


@pytest.mark.skipif(sys.getfilesystemencoding() != "utf-8", reason="names of files in UTF-8")
def test_names_may_have_blanks_and_letters_of_any_script(told: Run) -> None:
    Path("a b/ü").mkdir(parents=True)
    Path("a b/ü/Überlast θ.toml").write_bytes(Path(PULLEY).read_bytes())
    told("solve", "a b/ü/Überlast θ.toml", "-q")
    assert told("show", "results/Überlast θ.h5")[0].endswith("result: results/Überlast θ.h5\n")
    assert (
        "(did you mean 'results/Überlast θ.h5'?)" in told("show", "results/Uberlast.h5", code=2)[1]
    )


def test_channels_and_times_of_the_csv_are_chosen_and_written(told: Run) -> None:
    told("solve", PULLEY, "-o", "a.h5", "-q")
    options = ["--csv", "--channels", "angle,angular_velocity", "--from", "1", "--to", "2"]
    printed = told("show", "a.h5", *options)[0]
    columns = channels_of(printed)
    assert list(columns) == ["time [s]", "angle [rad]", "angular_velocity [rad/s]"]
    dataset = fs.open("a.h5").dataset.sel(time=slice(1.0, 2.0))
    for name, values in columns.items():
        np.testing.assert_array_equal(values, dataset[name.partition(" ")[0]].values)
    assert told("show", "a.h5", *options, "-o", "a.csv")[0] == "a.csv\n"
    assert Path("a.csv").read_text() == printed
    assert "did you mean 'angle'" in told("show", "a.h5", "--csv", "--channels", "angel", code=2)[1]
    assert "--from: it applies to --csv" in told("show", "a.h5", "--from", "1", code=2)[1]
    for times in (("--from", "5"), ("--from", "2", "--to", "1"), ("--to", "-1")):
        assert "no sample is between" in told("show", "a.h5", "--csv", *times, code=2)[1]


def test_several_results_are_shown_side_by_side(told: Run) -> None:
    for mu in (0.2, 0.3):
        told("solve", PULLEY, "--set", f"effects.shaft_friction.mu_s={mu}", "-o", f"{mu}.h5", "-q")
    out, _ = told("show", "0.2.h5", "0.3.h5")
    assert re.search(r"effects.shaft_friction.mu_s +0.2 +0.3", out)
    times = [fs.open(f"{mu}.h5").quantities["breakaway_time"].value for mu in (0.2, 0.3)]
    shown = re.search(r"breakaway_time +(\S+) +(\S+)", out)
    assert shown is not None
    assert [float(text) for text in shown.groups()] == pytest.approx(times, rel=1e-9)
    told("sweep", PULLEY, "--vary", "solver.duration=[0.1]", "-o", "sweep.h5", "-q")
    files = ["0.2.h5", "0.3.h5", "sweep.h5"]  # one after the other, as of the file alone
    alone = [strict_json(told("show", file, "--json")[0]) for file in files]
    assert strict_json(told("show", *files, "--json")[0]) == alone
    assert [(one["output"], one["kind"]) for one in alone[:2]] == [(f, "pulley") for f in files[:2]]


@pytest.mark.parametrize("command", ["show", "plot", "resume"])
def test_a_table_of_costs_is_said_to_be_one(command: str, told: Run) -> None:
    fast = ("--set", "solver.duration=0.5", "--repeats", "1", "--tolerances", "1e-3")
    told("cost", "pulley", *fast, "--backends", "events", "--csv", "cost.csv")
    _, err = told(command, "cost.csv", code=2)
    assert err.endswith("this is a table of costs; 'frictionsim report cost.csv' shows it\n")
