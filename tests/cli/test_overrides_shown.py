"""Overrides are seen where a result is; one that replaces a result of other values says so."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import pytest

import frictionsim as fs
from tests.support.scenarios import SCENARIOS

Told = Callable[..., tuple[str, str]]
MU, RTOL = "effects.shaft_friction.mu_s", "solver.rtol"
CASES: list[tuple[str, dict[str, Any], str, str]] = [
    ("pulley", {MU: 0.3}, f"set: {MU} = 0.3", "(mu_s = 0.3; backend events)"),
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
]


def title_of(result: fs.Result) -> str:
    figure = result.plot()
    text = " ".join(figure.get_suptitle().split())
    plt.close(figure)
    return text


@pytest.mark.parametrize(("name", "overrides", "line", "title"), CASES)
def test_overrides_are_in_summary_show_picture_and_report(
    name: str, overrides: dict[str, Any], line: str, title: str, told: Told
) -> None:
    by_mapping = fs.solve(SCENARIOS / f"{name}.toml", overrides, output="a.h5")
    assert line in by_mapping.summary().splitlines()
    texts = [f"{key}={'none' if v is None else v}" for key, v in overrides.items()]
    texts = [text.replace("=Two words", '="Two words"') for text in texts]
    options = [part for text in texts for part in ("--set", text)]
    out, _ = told("solve", SCENARIOS / f"{name}.toml", *options, "-o", "b.h5")
    assert line in out.splitlines()
    out, _ = told("show", "b.h5")
    assert line in out.splitlines()
    assert title_of(fs.open("b.h5")).endswith(title)
    told("report", "b.h5")
    page = Path("b.html").read_text()
    head = page[page.index("<header>") : page.index("</header>")]
    shown = line.removeprefix("set: ").replace("load = 2000", "load = 2000 N")
    assert shown.replace('"', "&quot;") in head.replace("&#34;", "&quot;")


def test_without_overrides_nothing_is_said_of_them(told: Told) -> None:
    out, _ = told("solve", "pulley", "-o", "a.h5")
    assert not [line for line in out.splitlines() if line.startswith("set")]
    assert title_of(fs.open("a.h5")).endswith("(backend events)")
    told("report", "a.h5")
    assert "<dt>set</dt>" not in Path("a.html").read_text()


def test_long_values_are_cut_and_keys_of_one_end_are_told_apart(tmp_path: Path) -> None:
    table = {"time": [0.1 * i for i in range(40)], "value": [1900.0 + i for i in range(40)]}
    result = fs.solve("pulley", {"drive.force": table})
    (line,) = [line for line in result.summary().splitlines() if line.startswith("set: ")]
    assert len(line) < 90
    pulleys = {f"mechanism.pulleys.{name}.inertia": 3e-4 for name in ("driver", "driven")}
    other = fs.solve("pulley", {MU: 0.3, "effects.shaft_friction.mu_k": 0.1})
    assert "mu_s = 0.3; mu_k = 0.1" in title_of(other)
    done = fs.solve("pulley").record
    texts = "\n".join(f"{key}={value}" for key, value in pulleys.items())
    shown = done._replace(attributes=done.attributes | {"overrides": texts})
    assert "driver.inertia = 0.0003; driven.inertia = 0.0003" in title_of(fs.Result(shown))


def test_a_comparison_and_a_sweep_name_what_all_their_runs_have(told: Told) -> None:
    for number, mu in enumerate((0.2, 0.3)):
        fs.solve("pulley", {RTOL: 1e-7, MU: mu}, output=f"{number}.h5")
    figure = fs.plot(["0.h5", "1.h5"])
    assert "(rtol = 1e-07; 2 results)" in figure.get_suptitle()
    plt.close(figure)
    vary = ("--vary", "mechanism.load=[2000.0, 2100.0]", "--set", f"{MU}=0.3", "-o", "s.h5")
    out, _ = told("sweep", "pulley", *vary)
    assert f"set: {MU} = 0.3" in out.splitlines()
    figure = fs.open_sweep("s.h5").plot()
    assert "mu_s = 0.3" in figure.get_suptitle()
    plt.close(figure)


@pytest.mark.slow  # draws twenty pictures
def test_the_report_of_a_sweep_begins_with_its_overrides(told: Told) -> None:
    vary = ("--vary", "mechanism.load=[2000.0, 2100.0]", "--set", f"{MU}=0.3", "-o", "s.h5")
    told("sweep", "pulley", *vary)
    told("report", "s.h5")
    assert f"set: {MU} = 0.3" in Path("s.html").read_text().partition("</header>")[0]


@pytest.mark.parametrize(
    ("key", "value", "change"),
    [
        (MU, 0.3, f"{MU}: 0.2, now 0.3"),
        ("solver.duration", 2.5, "solver.duration: 3.0, now 2.5"),
        ("effects.viscous_damping", None, "effects.viscous_damping"),
    ],
)
def test_a_result_that_replaces_one_of_other_values_says_so(
    key: str, value: Any, change: str, told: Told
) -> None:
    _, err = told("solve", "pulley")
    assert err == ""
    _, err = told("solve", "pulley")
    assert err == ""
    given = ("--set", f"{key}={'none' if value is None else value}")
    out, err = told("solve", "pulley", *given, "--json")
    assert json.loads(out)["overrides"] == {key: value}
    (line,) = err.splitlines()
    assert "note: results/pulley.h5 replaces a result of other values" in line
    assert change in line
    _, err = told("solve", "pulley", "-q")
    assert err == ""
    _, err = told("solve", "pulley", *given, "-o", "other.h5")
    assert err == ""


def test_nothing_is_said_of_a_damaged_result_or_an_unfinished_run(told: Told) -> None:
    told("solve", "pulley", "-q")
    file = Path("results/pulley.h5")
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 0xFF
    file.write_bytes(data)
    _, err = told("solve", "pulley", "--set", f"{MU}=0.3")
    assert err == ""
    _, err = told("solve", "pulley", "--set", f"{MU}=0.25", "--max-steps", "20", code=5)
    assert "replaces" not in err  # the earlier one is still there
    _, err = told("resume", "results/pulley.h5", code=2)
    assert "replaces" not in err
    _, err = told("resume", "results/pulley.partial.h5")
    assert f"({MU}: 0.3, now 0.25)" in err
