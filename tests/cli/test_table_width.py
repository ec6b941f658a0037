"""Printed tables are at most 100 columns wide: wide ones have broken headings, or are turned."""

import re
from pathlib import Path

import pytest

import frictionsim as fs
from tests.cli.conftest import Run

WIDTH = 100
LOWS = (0.2, 1, 2000)  # of keys that are varied
CELLS = re.compile(r"\S {2,}\S.* {2,}\S")  # a line of a table of three columns or more


def assert_narrow(text: str) -> None:
    lines = [line for line in text.splitlines() if CELLS.search(line)]
    assert lines
    assert not [line for line in lines if len(line) > WIDTH]


@pytest.mark.parametrize("count", [2, 3, 8])
def test_results_side_by_side(count: int, told: Run) -> None:
    """No value is lost where a table is broken into parts."""
    results = [
        fs.solve(
            "pulley",
            {"mechanism.load": 2000.0 + 10 * i, "effects.shaft_friction.mu_s": 0.2 + 0.01 * i},
            output=f"a_rather_long_name_of_a_result_{i}.h5",
        )
        for i in range(count)
    ]
    out, _ = told("show", *(str(result.path) for result in results))
    assert_narrow(out)
    for name in ("force_to_lift", "final_angle", "energy_input"):
        rows = [line.split() for line in out.splitlines() if line.startswith(f"{name} ")]
        shown = [cell for row in rows for cell in row[1:]]
        for result in results:
            assert f"{result.quantities[name].value:.10g}" in shown


def test_long_keys_and_several_of_them(told: Run) -> None:
    keys = ("effects.shaft_friction.mu_s", "effects.viscous_damping.coefficient", "mechanism.load")
    vary = [
        f"--vary={key}=uniform({low}, {low * 1.1})" for key, low in zip(keys, LOWS, strict=True)
    ]
    options = ("--set", "solver.duration=0.5", "-j", "1", "-o", "s.h5")
    assert_narrow(told("sweep", "pulley", *vary, "--sample", "4", "--indices", *options)[0])


def test_a_comparison_of_unlike_results(told: Run) -> None:
    for name, slope in (("a", 0.31), ("b", 1.0 / 3)):
        fs.solve("lift", {"effects.shaft_friction.mu_k": slope / 10}, output=f"{name}.h5")
    out, _ = told("compare", "a.h5", "b.h5", code=1)
    assert_narrow(out)


def test_a_cost_study_with_a_failed_setting(told: Run, here: Path) -> None:
    options = ("--set", "solver.duration=1", "--set", "solver.max_steps=1000", "--repeats", "1")
    out, _ = told("cost", "pulley", *options, "--tolerances", "1e-5", "--backends", "events,rk45")
    assert_narrow(out)
    assert re.search(r"^\w+, rk45, speed \S+: limit of 1000 steps reached", out, re.MULTILINE)


def test_a_fit_of_several_keys(told: Run) -> None:
    free = ("effects.shaft_friction.mu_k=0.05:0.2", "effects.viscous_damping.coefficient=0.5:3")
    made = fs.solve("pulley")
    made.save_csv("data.csv", ["angle", "angular_velocity"])
    options = ("--data", "data.csv", "--channel", "angle", "--channel", "angular_velocity")
    arguments = [f"--free={text}" for text in (*free, "mechanism.inertia=0.5:3")]
    assert_narrow(told("fit", "pulley", *arguments, *options, "--starts", "1")[0])
