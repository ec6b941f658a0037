"""`--json` of check, compare and plot, `check` of folders, and `--no-clobber` of plot."""

import shutil
from pathlib import Path

import h5py
import numpy as np
import pytest

from tests.cli.conftest import Run, strict_json
from tests.support.scenarios import SCENARIOS

PULLEY = str(SCENARIOS / "pulley.toml")


def test_check_of_a_folder_checks_all_in_it(told: Run) -> None:
    out, err = told("check", SCENARIOS)
    checked = [line.partition(": ok; ")[0] for line in out.splitlines()]
    assert checked == sorted(map(str, SCENARIOS.rglob("*.toml")))
    assert all(line.startswith("frictionsim: warning: ") for line in err.splitlines())


def test_check_takes_folders_and_files(told: Run) -> None:
    Path("a/b").mkdir(parents=True)
    for place in ("a/one.toml", "a/b/two.toml", "three.toml"):
        shutil.copy(PULLEY, place)
    Path("a/notes.txt").write_text("no scenario")
    Path("a/bad.toml").write_text('kind = "puley"\n')
    out, err = told("check", "three.toml", "a", code=2)
    assert [line.split(":")[0] for line in out.splitlines()] == [
        *("three.toml", "a/b/two.toml", "a/one.toml"),
    ]
    assert err.startswith("frictionsim: a/bad.toml:1: kind: unknown kind 'puley'")


def test_a_folder_without_scenarios_is_told(told: Run) -> None:
    Path("empty").mkdir()
    assert told("check", "empty", code=2) == (
        "",
        "frictionsim: empty: there is no scenario (*.toml) in this folder\n",
    )


def test_check_as_json(told: Run) -> None:
    Path("bad.toml").write_text('kind = "pulley"\nmechanism.load = -1\n')
    out, err = told("check", PULLEY, "bad.toml", "--json", code=2)
    assert err == ""
    found = strict_json(out)
    assert found["ok"] is False
    good, bad = found["scenarios"]
    assert good == {
        "scenario": PULLEY,
        "ok": True,
        "faults": [],
        "warnings": [],
        "kind": "pulley",
        "effects": ["shaft_friction", "viscous_damping"],
        "law": "set-valued",
        "backend": "events",
    }
    assert (bad["scenario"], bad["ok"]) == ("bad.toml", False)
    assert "bad.toml:2: mechanism.load: expected a number of at least 0 N, got -1" in bad["faults"]
    found = strict_json(told("check", PULLEY, "--json", "--set", "output.interval=9")[0])
    assert found["ok"] is True
    assert found["scenarios"][0]["warnings"] == [
        "output.interval = 9.0 s is longer than the run: only its start and end are sampled"
    ]


def test_an_implausible_radius_is_warned_of_wherever_warnings_are(told: Run) -> None:
    wrong = ("--set", "mechanism.cord_radius=50.8")
    words = (
        "mechanism.cord_radius = 50.8 m is a radius above 5 m; did you mean 0.0508, for 50.8 mm?"
    )
    assert told("check", "pulley", *wrong)[1] == f"frictionsim: warning: pulley: {words}\n"
    assert strict_json(told("check", "pulley", *wrong, "--json")[0])["scenarios"][0]["ok"] is True
    out, err = told("solve", "pulley", *wrong, "--set", "output.interval=9", "--json")
    assert err.startswith(f"frictionsim: warning: {words}\n")
    assert strict_json(out)["warnings"][0] == words
    assert strict_json(told("show", "results/pulley.h5", "--json")[0])["warnings"][0] == words


def test_compare_as_json(told: Run) -> None:
    told("solve", PULLEY, "-q", "-o", "a.h5")
    told("solve", PULLEY, "-q", "-o", "b.h5", "--set", "mechanism.load=2224.2")
    found = strict_json(told("compare", "a.h5", "a.h5", "--json")[0])
    assert (found["result"], found["golden"], found["same"]) == ("a.h5", "a.h5", True)
    found = strict_json(told("compare", "b.h5", "a.h5", "--json", code=1)[0])
    assert found["same"] is False
    (angle,) = (row for row in found["rows"] if row["channel"] == "angle")
    assert angle.keys() == {"channel", "difference", "allowed", "time", "ok", "note"}
    assert angle["ok"] is False
    assert angle["difference"] > angle["allowed"] > 0.0


def with_value(path: Path, value: float) -> None:
    """Put a value into the angle of a result; h5py drops its checksum."""
    with h5py.File(path, "r+") as file:
        file["angle"][5] = value


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_compare_as_json_has_only_finite_numbers(value: float, told: Run) -> None:
    told("solve", PULLEY, "-q", "-o", "a.h5")
    shutil.copy("a.h5", "b.h5")
    with_value(Path("b.h5"), value)
    for pair in (("a.h5", "b.h5"), ("b.h5", "a.h5")):
        found = strict_json(told("compare", *pair, "--json", code=1)[0])
        (angle,) = (row for row in found["rows"] if row["channel"] == "angle")
        assert (angle["ok"], angle["difference"]) == (False, None)
        assert "angle" in told("compare", *pair, code=1)[0]


def test_plot_as_json(told: Run) -> None:
    told("solve", PULLEY, "-q", "-o", "a.h5")
    found = strict_json(told("plot", "a.h5", "--json")[0])
    assert found == {"result": "a.h5", "pictures": ["a.png"], "skipped": []}
    assert Path("a.png").exists()


def test_plot_of_all_views_as_json(told: Run) -> None:
    belt = str(SCENARIOS / "belt_verification.toml")
    told("solve", belt, "-q", "-o", "a.h5", "--set", "solver.duration=1e-3",
         "--set", 'output.channels=["pulley_speed","pulley_torque"]')  # fmt: skip
    out, err = told("plot", "a.h5", "--view", "all", "--json", "--no-clobber")
    found = strict_json(out)
    assert (found["pictures"], err) == (["a-speeds.png"], "")
    assert len(found["skipped"]) == 3
    assert all(isinstance(reason, str) for reason in found["skipped"])


@pytest.mark.parametrize("options", [[], ["--view", "all"], ["--view", "all", "--json"]])
def test_plot_keeps_an_existing_picture(options: list[str], told: Run) -> None:
    told("solve", PULLEY, "-q", "-o", "a.h5")
    picture = Path("a-response.png" if options else "a.png")
    picture.write_bytes(b"\x89PNG precious")
    assert told("plot", "a.h5", "--no-clobber", *options, code=4) == (
        "",
        f"frictionsim: {picture}: the file exists and --no-clobber forbids to replace it; give"
        " another name\n",
    )
    assert picture.read_bytes() == b"\x89PNG precious"
    told("plot", "a.h5", *options)
    assert picture.read_bytes().startswith(b"\x89PNG\r\n")


@pytest.mark.parametrize(
    ("output", "code", "message"),
    [
        ("a.txt", 2, "a.txt: expected a picture name that ends in .png, .pdf or .svg"),
        ("no/a.png", 4, "no/a.png: cannot write the picture: there is no folder 'no'"),
    ],
)
def test_plot_into_an_impossible_file(output: str, code: int, message: str, told: Run) -> None:
    told("solve", PULLEY, "-q", "-o", "a.h5")
    assert told("plot", "a.h5", "-o", output, code=code) == ("", f"frictionsim: {message}\n")
