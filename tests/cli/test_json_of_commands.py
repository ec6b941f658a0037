"""`--json` of check, compare and plot, `check` of folders, and `--no-clobber` of plot."""

import os
import shutil
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

import frictionsim as fs
from tests.cli.conftest import Run, strict_json
from tests.support.belt_results import belt_run
from tests.support.cases import slow
from tests.support.scenarios import SCENARIOS

PULLEY = str(SCENARIOS / "pulley.toml")


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
    assert document["ok"] is False
    good, bad = document["scenarios"]
    assert good == {
        "scenario": PULLEY,
        "ok": True,
        "faults": [],
        "warnings": [],
        "overrides": {},
        "kind": "pulley",
        "effects": ["shaft_friction", "viscous_damping"],
        "law": "set-valued",
        "backend": "events",
    }
    assert (bad["scenario"], bad["ok"]) == ("bad.toml", False)
    assert (
        "bad.toml:2: mechanism.load: should be greater than or equal to 0 N, got -1"
        in bad["faults"]
    )
    assert told("check", PULLEY)[0] == (
        f"{PULLEY}: ok; effects shaft_friction, viscous_damping; backend events\n"
    )
    assert os.listdir() == ["bad.toml"]


def test_compare_as_json_has_only_finite_numbers(told: Run) -> None:
    told("solve", PULLEY, "-q", "-o", "a.h5")
    document = strict_json(told("compare", "a.h5", "a.h5", "--json")[0])
    assert (document["result"], document["golden"], document["same"]) == ("a.h5", "a.h5", True)

    def angle_of(*pair: str) -> dict[str, Any]:
        document = strict_json(told("compare", *pair, "--json", code=1)[0])
        assert document["same"] is False
        (angle,) = (row for row in document["rows"] if row["channel"] == "angle")
        assert angle.keys() == {
            *("channel", "value", "expected", "unit", "difference", "allowed", "time", "ok"),
            "note",
        }
        assert angle["ok"] is False
        return angle  # type: ignore[no-any-return]

    told("solve", PULLEY, "-q", "-o", "b.h5", "--set", "mechanism.load=2224.2")
    angle = angle_of("b.h5", "a.h5")
    assert angle["difference"] > angle["allowed"] > 0.0
    for value in (np.nan, np.inf):
        shutil.copy("a.h5", "b.h5")
        with h5py.File("b.h5", "r+") as file:  # h5py drops its checksum
            file["angle"][5] = value
        for pair in (("a.h5", "b.h5"), ("b.h5", "a.h5")):
            assert angle_of(*pair)["difference"] is None
            assert "angle" in told("compare", *pair, code=1)[0]


def test_plot_of_all_views_as_json(told: Run) -> None:
    run = belt_run(samples=5)
    kept = {name: run.channels[name] for name in ("time", "pulley_speed", "pulley_torque")}
    fs.Result(run._replace(channels=kept)).save("a.h5")
    out, err = told("plot", "a.h5", "--view", "all", "--json", "--no-clobber")
    document = strict_json(out)
    assert (document["pictures"], err) == (["a-speeds.png"], "")
    assert len(document["skipped"]) == 4
    assert all(isinstance(reason, str) for reason in document["skipped"])


def test_plot_keeps_an_existing_picture(told: Run) -> None:
    told("solve", PULLEY, "-q", "-o", "a.h5")
    for options in (["--json"], ["--view", "all"]):
        picture = Path("a-response.png" if "all" in options else "a.png")
        picture.write_bytes(b"\x89PNG precious")
        assert told("plot", "a.h5", "--no-clobber", *options, code=4) == (
            "",
            f"frictionsim: {picture}: cannot write the picture: the file exists and is"
            " not replaced; give another name\n",
        )
        assert picture.read_bytes() == b"\x89PNG precious"
        out, _ = told("plot", "a.h5", *options)
        assert picture.read_bytes().startswith(b"\x89PNG\r\n")
        if options == ["--json"]:
            assert strict_json(out) == {"result": "a.h5", "pictures": ["a.png"], "skipped": []}


SET = {
    "effects.shaft_friction.mu_s": 0.25,
    "effects.viscous_damping": None,
    "drive.direction": "horizontal",
    "drive.force": {"time": [0, 0.5], "value": [1832.6, 3000.0]},
    "output.at_events": False,
    "title": "A = B, \u00b0",
}
WRITTEN = {
    **SET,
    "effects.viscous_damping": "none",
    "drive.force": "{time = [0, 0.5], value = [1832.6, 3000.0]}",
    "output.at_events": "false",
    "title": "'A = B, \u00b0'",
}
OPTIONS = [part for key, value in WRITTEN.items() for part in ("--set", f"{key}={value}")]
BRIEF = ("--set", "solver.rtol=1e-6", "--set", "solver.duration=0.4")


def test_the_overrides_of_a_run_are_in_its_json_and_in_its_file(told: Run) -> None:
    document = strict_json(told("solve", "pulley", *OPTIONS, "--backend", "rkf45", "--json")[0])
    assert document["overrides"] == SET | {"solver.backend": "rkf45"}
    shown = strict_json(told("show", "results/pulley.h5", "--json")[0])
    assert shown["overrides"] == document["overrides"]
    # They give the same scenario again, from Python too.
    assert fs.load("pulley", document["overrides"]) == fs.open(
        "results/pulley.h5"
    ).scenario.replace({"output.interval": 0.01})
    assert strict_json(told("solve", "pulley", "--json")[0])["overrides"] == {}


@pytest.mark.parametrize(
    "command",
    [
        ("check",),
        slow(("static",)),
        ("cost", "--backends", "events", "--tolerances", "1e-3", "--repeats", "1"),
        slow(("sweep", "--vary", "mechanism.load=[2000.0, 2100.0]")),
        slow(("fit", "--free", "mechanism.load=2000:2300", "--quantity", "force_to_lift=2600")),
    ],
    ids=lambda command: command[0],
)
def test_every_command_that_takes_overrides_has_them_in_its_json(
    command: tuple[str, ...], told: Run
) -> None:
    def overrides_of(*options: str) -> Any:
        text = told(command[0], "pulley", *command[1:], *options, "--json")[0]
        data = strict_json(text)
        return (data["scenarios"][0] if command[0] == "check" else data)["overrides"]

    assert overrides_of() == {}
    assert overrides_of(*BRIEF) == {"solver.rtol": 1e-6, "solver.duration": 0.4}


def test_a_sweep_that_is_shown_and_a_run_that_is_resumed_have_their_overrides(told: Run) -> None:
    told("sweep", "pulley", *BRIEF, "--vary", "mechanism.load=[2000.0, 2100.0]", "-q", "-j", "1")
    document = strict_json(told("show", "results/pulley-sweep.h5", "--json")[0])
    assert document["overrides"] == {"solver.rtol": 1e-6, "solver.duration": 0.4}
    told("solve", "pulley", "--set", "solver.rtol=1e-8", "-q", "--max-steps", "9", code=5)
    document = strict_json(told("resume", "results/pulley.h5", "--json")[0])
    assert document["overrides"] == {"solver.rtol": 1e-8}


def test_overrides_that_are_no_toml_stay_text(told: Run) -> None:
    told("solve", "pulley", *BRIEF, "-q")
    with h5py.File("results/pulley.h5", "r+") as file:
        file.attrs["overrides"] = "a=[1,\nb\nc=inf\nd=1979-05-27\ne=2"
    document = strict_json(told("show", "results/pulley.h5", "--json")[0])
    assert document["overrides"] == {"a": "[1,", "b": "", "c": "inf", "d": "1979-05-27", "e": 2}
