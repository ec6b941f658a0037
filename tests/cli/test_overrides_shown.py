"""Overrides are seen where a result is; one that replaces a result of other values says so."""

from pathlib import Path
from typing import Any

import h5py
import matplotlib.pyplot as plt
import pytest

import frictionsim as fs
from tests.cli.conftest import Run, strict_json
from tests.support.cases import slow

MU, RTOL = "effects.shaft_friction.mu_s", "solver.rtol"
CASES: list[tuple[str, dict[str, Any], str, str]] = [
    (
        "shaft",
        {"solver.backend": "rkf45", "title": "Two words"},
        'set: solver.backend = rkf45, title = "Two words"',
        "Two words (backend rkf45)",
    ),
    (
        "pulley_return",
        {"effects.viscous_damping": None, RTOL: 1e-7, "mechanism.load": 2000, MU: 0.25},
        f"set: effects.viscous_damping = none, {RTOL} = 1e-07, mechanism.load = 2000, {MU} = 0.25",
        "(viscous_damping = none; rtol = 1e-07; load = 2000 N; 1 more set; backend events)",
    ),
    ("pulley", {}, "", "(backend events)"),
]


def title_of(figure: Any) -> str:
    text = " ".join(figure.get_suptitle().split())
    plt.close(figure)
    return text


@pytest.mark.parametrize(("name", "overrides", "line", "title"), CASES)
def test_overrides_are_in_summary_show_picture_and_report(
    name: str, overrides: dict[str, Any], line: str, title: str, told: Run
) -> None:
    result = fs.solve(name, overrides, output="a.h5")
    texts = [f"{key}={'none' if v is None else v}" for key, v in overrides.items()]
    texts = [text.replace("=Two words", '="Two words"') for text in texts]
    options = [part for text in texts for part in ("--set", text)]
    solved = told("solve", name, *options, "-o", "b.h5")[0]
    for text in (result.summary(), solved, told("show", "b.h5")[0]):
        assert [one for one in text.splitlines() if one.startswith("set: ")] == [line] * bool(line)
    assert title_of(fs.open("b.h5").plot()).endswith(title)
    told("report", "b.h5")
    page = Path("b.html").read_text(encoding="utf-8")
    head = page[page.index("<header>") : page.index("</header>")]
    shown = line.removeprefix("set: ").replace("load = 2000", "load = 2000 N")
    assert shown.replace('"', "&quot;") in head.replace("&#34;", "&quot;")
    assert ("<dt>set</dt>" in head) == bool(line)


def test_long_values_are_cut_and_keys_of_one_end_are_told_apart() -> None:
    table = {"time": [0.1 * i for i in range(40)], "value": [1900.0 + i for i in range(40)]}
    result = fs.solve("pulley", {"drive.force": table})
    (line,) = [line for line in result.summary().splitlines() if line.startswith("set: ")]
    assert len(line) < 90
    keys = [f"mechanism.pulleys.{name}.inertia=0.0003" for name in ("driver", "driven")]
    attributes = result.record.attributes | {"overrides": "\n".join(keys)}
    figure = fs.Result(result.record._replace(attributes=attributes)).plot()
    assert "driver.inertia = 0.0003; driven.inertia = 0.0003" in title_of(figure)


def test_a_comparison_and_a_sweep_name_what_all_their_runs_have(told: Run) -> None:
    for number, mu in enumerate((0.2, 0.3)):
        fs.solve("pulley", {RTOL: 1e-7, MU: mu}, output=f"{number}.h5")
    assert "(rtol = 1e-07; 2 results)" in title_of(fs.plot(["0.h5", "1.h5"]))
    vary = ("--vary", "mechanism.load=[2000.0, 2100.0]", "--set", f"{MU}=0.3", "-o", "s.h5")
    out, _ = told("sweep", "pulley", *vary, "-j", "1")
    assert f"set: {MU} = 0.3" in out.splitlines()
    assert "mu_s = 0.3" in title_of(fs.open_sweep("s.h5").plot())
    assert strict_json(told("show", "s.h5", "--json")[0])["overrides"] == {MU: 0.3}


# --- in JSON --------------------------------------------------------------------------------

SET = {
    MU: 0.25,
    "effects.viscous_damping": None,
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
BRIEF = ("--set", "solver.rtol=1e-6", "--set", "solver.duration=0.4")


def test_the_overrides_of_a_run_are_in_its_json_and_in_its_file(told: Run) -> None:
    options = [part for key, value in WRITTEN.items() for part in ("--set", f"{key}={value}")]
    document = strict_json(told("solve", "pulley", *options, "--backend", "rkf45", "--json")[0])
    assert document["overrides"] == SET | {"solver.backend": "rkf45"}
    shown = strict_json(told("show", "results/pulley.h5", "--json")[0])
    assert shown["overrides"] == document["overrides"]
    # They give the same scenario again, from Python too.
    again = fs.load("pulley", document["overrides"])
    assert fs.open("results/pulley.h5").scenario.replace({"output.interval": 0.01}) == again
    with h5py.File("results/pulley.h5", "r+") as file:  # those that are no TOML stay text
        file.attrs["overrides"] = "a=[1,\nb\nc=inf\nd=1979-05-27\ne=2"
    document = strict_json(told("show", "results/pulley.h5", "--json")[0])
    assert document["overrides"] == {"a": "[1,", "b": "", "c": "inf", "d": "1979-05-27", "e": 2}


@pytest.mark.parametrize(
    "command",
    [
        ("check",),
        ("cost", "--backends", "events", "--tolerances", "1e-3", "--repeats", "1"),
        slow(("static",)),
        slow(("sweep", "--vary", "mechanism.load=[2000.0, 2100.0]")),
        slow(("fit", "--free", "mechanism.load=2000:2300", "--quantity", "force_to_lift=2600")),
    ],
    ids=lambda command: command[0],
)
def test_every_command_that_takes_overrides_has_them_in_its_json(
    command: tuple[str, ...], told: Run
) -> None:
    data = strict_json(told(command[0], "pulley", *command[1:], *BRIEF, "--json")[0])
    overrides = (data["scenarios"][0] if command[0] == "check" else data)["overrides"]
    assert overrides == {"solver.rtol": 1e-6, "solver.duration": 0.4}


# --- results that are replaced --------------------------------------------------------------


@pytest.mark.parametrize(
    ("key", "value", "change"),
    [(MU, "0.3", f"{MU}: 0.2, now 0.3"), ("effects.viscous_damping", "none", "viscous_damping")],
)
def test_a_result_that_replaces_one_of_other_values_says_so(
    key: str, value: str, change: str, told: Run
) -> None:
    given, note = ("--set", f"{key}={value}"), "note: results/pulley.h5 replaces a result of other"
    assert told("solve", "pulley")[1] == told("solve", "pulley")[1] == ""
    (line,) = told("solve", "pulley", *given, "--json")[1].splitlines()
    assert note in line
    assert change in line
    assert told("solve", "pulley", "-q")[1] == ""
    assert told("solve", "pulley", *given, "-o", "other.h5")[1] == ""


def test_nothing_is_said_of_a_damaged_result_or_an_unfinished_run(told: Run) -> None:
    told("solve", "pulley", "-q")
    file = Path("results/pulley.h5")
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 0xFF
    file.write_bytes(data)
    assert told("solve", "pulley", "--set", f"{MU}=0.3")[1] == ""
    _, err = told("solve", "pulley", "--set", f"{MU}=0.25", "--max-steps", "20", code=5)
    assert "replaces" not in err  # the earlier one is still there
    assert "replaces" not in told("resume", "results/pulley.h5", code=2)[1]
    assert f"({MU}: 0.3, now 0.25)" in told("resume", "results/pulley.partial.h5")[1]
