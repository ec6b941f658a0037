"""Printed tables are at most 100 columns wide: wide ones have broken headings, or are in parts."""

import re
from pathlib import Path

import pytest

import frictionsim as fs
from tests.cli.conftest import Run

WIDTH = 100
LONG = "effects.viscous_damping.coefficient"
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


def test_results_of_unlike_kinds_side_by_side(told: Run) -> None:
    """A part has the rows that one of its results has; lists end after a whole number."""
    kinds = ("pulley", "lift", "shaft", "epicyclic")
    for kind in kinds:
        told("solve", kind, "-q", "-o", f"{kind}.h5")
    for names in (kinds[:2], kinds[:3], kinds):
        out, _ = told("show", *(f"{name}.h5" for name in names))
        assert_narrow(out)
        lines = out.splitlines()
        # Two are beside each other as far as the lines go.
        assert lines[0].split() == ["key", *names[:2]]
        for line in lines:
            assert line.split()[1:], line
            assert set(line.split()[1:]) != {"\N{EM DASH}"}
            assert re.search(r"\d\.\.\.", line) is None
        assert re.search(r"^drive.torque.value .* \[-560.0, .*, \.\.\. 15 in all\]", out, re.M)
        # The audit is not turned: each check is a row, whatever the number of results.
        (audit,) = (i for i, line in enumerate(lines) if line.startswith("energy_balance "))
        assert lines[audit].count(" ok") == len(names)


def test_the_table_of_sobol_indices_is_in_one_part(told: Run) -> None:
    vary = [f"--vary={key}=uniform(1.0, 1.2)" for key in ("mechanism.inertia", LONG)]
    options = ("--set", "solver.duration=0.8", "-j", "1", "-o", "s.h5", "--sample", "64")
    out, _ = told("sweep", "pulley", *vary, *options, "--indices")
    assert_narrow(out)
    heading = next(line for line in out.splitlines() if line.startswith("Sobol indices of "))
    assert re.split("  +", heading)[2:] == [
        *("first-order", "95 % of first-order", "total", "95 % of total")
    ]
    assert len(re.findall(r"^final_angle  ", out, re.M)) == 1 + 2
    assert "\nSobol indices from 64 rows; 95 % confidence\n" in out


def test_a_comparison_of_two_pulleys_has_each_row_once(told: Run) -> None:
    fs.solve("pulley", output="a.h5")
    for change in ({"mechanism.load": 2000.0}, {"mechanism.load": 2300.0, LONG: 1.0}):
        fs.solve("pulley", change, output="b.h5")
        out, _ = told("compare", "a.h5", "b.h5", code=1)
        assert_narrow(out)
        names = [line.split("  ")[0].split(" at ")[0] for line in out.splitlines()]
        assert len(names) == len(set(names))
        (row,) = (r for r in fs.compare("a.h5", "b.h5").rows if r.name == "angle")
        assert re.search(rf"^angle at {row.time:.6g} s  +different ", out, re.M)


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
