"""The files of results/ are those that its README names, and say what they were made with."""

import csv
import re
from math import exp
from pathlib import Path
from typing import Any

import pytest

from frictionsim.scenario.loading import load
from frictionsim.simulation.simulate import run
from tests.benchmarks import results_guided
from tests.support.problems import (
    BREAKAWAY,
    CORD_RADIUS,
    DRAG,
    INERTIA,
    LOAD,
    P_END,
    P_START,
    R_K,
    T_RAMP,
    SlipOnRamp,
)
from tests.support.scenarios import SCENARIOS

RESULTS = Path(__file__).parents[1] / "results"
LISTED = re.findall(
    r"`(\w+\.(?:png|txt|csv|md|json))`", (RESULTS / "README.md").read_text(encoding="utf-8")
)
PICTURES = sorted(name for name in LISTED if name.endswith(".png"))
TABLES = sorted(name for name in LISTED if name.endswith((".txt", ".csv", ".md")))
MAX_BYTES = 200_000


def test_the_readme_lists_each_file_once() -> None:
    assert len(LISTED) == len(set(LISTED))
    assert PICTURES
    assert TABLES
    sizes = {name: (RESULTS / name).stat().st_size for name in LISTED}
    assert min(sizes.values()) > 0
    assert max(sizes[name] for name in PICTURES) < MAX_BYTES


@pytest.mark.parametrize("name", TABLES)
def test_a_table_names_machine_and_versions(name: str) -> None:
    text = (RESULTS / name).read_text(encoding="utf-8")
    assert re.search(r"^\W*machine: \S", text, re.MULTILINE)
    versions = r"^\W*versions: Python \S+, numpy \S+, scipy \S+, numba \S"
    assert re.search(versions, text, re.MULTILINE)


def fig10_rows() -> list[tuple[float, ...]]:
    """Return time, angle, velocity, acceleration and difference of the table of fig. 10."""
    rows = page_rows("| time, s |", "../../results/README")
    assert rows[0][0] == f"{BREAKAWAY:.9f}"
    return [tuple(map(float, row)) for row in rows[1:]]


def closed_form(time: float) -> tuple[float, float, float]:
    """Return angle, velocity and acceleration on the ramp, and at the force that stays after it."""
    slip = SlipOnRamp(P_START, (P_END - P_START) / T_RAMP, BREAKAWAY, 0.0, 1)
    steady = ((P_END - LOAD) * CORD_RADIUS - R_K * (P_END + LOAD)) / DRAG
    angle, velocity = slip(min(time, T_RAMP))
    rest, rate = max(time - T_RAMP, 0.0), DRAG / INERTIA
    gap = velocity - steady
    if time >= T_RAMP:
        angle += steady * rest + gap * (1.0 - exp(-rate * rest)) / rate
        velocity = steady + gap * exp(-rate * rest)
    return angle, velocity, rate * (steady - velocity)


@pytest.mark.parametrize(("law", "backend"), [("set-valued", "events"), ("published", "rkf45")])
def test_fig_10_has_the_numbers_of_its_table(law: str, backend: str) -> None:
    overrides = ["solver.duration=10", f"effects.shaft_friction.law={law}"]
    done = run(load(SCENARIOS / "pulley.toml", overrides, backend), lambda t: None)
    rows = fig10_rows()
    assert [row[0] for row in rows] == [0.8, 1.0, 2.0, 5.0, 10.0]
    for time, *printed, largest in rows:
        exact = closed_form(time)
        assert printed == pytest.approx(exact, abs=6e-10)  # nine decimals
        at = abs(done.time - time).argmin()
        names = ("angle", "angular_velocity", "angular_acceleration")
        values = [done.channels[name][at] for name in names]
        worst = max(abs(a - b) for a, b in zip(values, exact, strict=True))
        # The table is of `events`; the same steps on another processor differ in roundings.
        assert worst < (2.0 * largest + 1e-12 if backend == "events" else 2e-9)


def measured_rows(name: str) -> list[dict[str, str]]:
    with (RESULTS / f"{name}.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


def numbers(name: str) -> list[list[str]]:
    return [list(row.values()) for row in measured_rows(name)]


def page_rows(heading: str, page: str = "belt-drive") -> list[list[str]]:
    """Return the cells of the table of a page on belts that begins like this."""
    text = (RESULTS.parent / f"docs/mechanisms/{page}.md").read_text(encoding="utf-8")
    table = text.split(heading)[1].split("\n\n")[0].splitlines()[2:]
    return [[cell.strip() for cell in row.strip("|").split("|")] for row in table]


def assert_same_numbers(shown: list[list[str]], measured: list[list[Any]]) -> None:
    """Check that cells are those of a table, rounded to the digits that are shown."""
    assert len(shown) == len(measured)
    for row, values in zip(shown, measured, strict=True):
        for cell, figure in zip(row, values, strict=True):
            digits = len(cell.partition(".")[2])
            assert cell == figure or cell == f"{float(figure):.{digits}f}"


def test_the_page_has_the_wrap_factors_of_the_table() -> None:
    measured = {
        (row[1], row[2]): [*row[1:5], *row[6:8]]
        for row in numbers("belt_wrap")
        if row[0] == "corrected"
    }
    shown = page_rows("| bending | bodies | T1, N |")
    assert {row[1] for row in shown} >= {"150", "300", "600"}
    assert_same_numbers(shown, [measured[row[0], row[1]] for row in shown])


def test_the_page_has_the_depths_of_the_table() -> None:
    measured = {
        (row[0], row[1]): [row[0], row[1], *row[3:10]]
        for row in numbers("belt_seat")
        if row[2] == "without"
    }
    shown = page_rows("| stiffness over the paper's | bodies", "belt-contact")
    assert {row[0] for row in shown} == {stiffness for stiffness, _ in measured}
    assert_same_numbers(shown, [measured[row[0], row[1]] for row in shown])


def test_the_page_has_the_energy_balances_above_the_targets() -> None:
    rows = numbers("energy")
    above = [row for row in rows if row[5]]
    below = [row for row in rows if row not in above and float(row[3]) <= float(row[4])]
    assert {row[4] for row in below} == {"1e-09", "1e-06"}
    assert all(float(row[6]) < 0.3 * float(row[3]) for row in above)  # second order in the step
    shown = page_rows("| scenario | method | energy balance | with |", "../accuracy")
    assert shown == [[row[0], row[2], row[3], row[5], row[6]] for row in above]
    assert [row[0] for row in rows if row not in below + above] == ["belt_drive_published"]


def test_the_page_has_the_paper_s_numbers_of_the_table() -> None:
    measured = {row[0].split(" [")[0]: row[2:] for row in numbers("belt_paper")}
    shown = {row[0]: row[2:] for row in page_rows("| | paper | exact stick, 150 bodies |")}
    pairs = {
        "speed of the driver, rad/s": "speed of the driver",
        "slip, %": "slip",
        "bodies on the arcs that stick": "share of touching bodies that stick",
    }
    assert_same_numbers(
        [shown[words] for words in pairs], [measured[name] for name in pairs.values()]
    )
    spans = (measured["tension of the active span"], measured["tension of the passive span"])
    for cell, *both in zip(shown["active, passive span, N"], *spans, strict=True):
        assert cell == ", ".join(f"{float(value):.0f}" for value in both)


def test_the_page_has_the_meshes_of_the_cost_table() -> None:
    measured: dict[tuple[str, str], dict[str, str]] = {}
    for row in measured_rows("belt_drive_cost"):
        if row["backend"] == "moreau" and row["status"] == "done":
            measured.setdefault((row["model"], f"{float(row['bodies [1]']):.0f}"), row)
    shown = page_rows("| model | bodies | slip |", "../accuracy")
    assert {row[0] for row in shown} == {model for model, _ in measured}
    names = ("slip", "tension_tight", "tension_slack", "driven_speed")
    for model, bodies, *cells in shown:
        measurement = measured[model, bodies]
        errors = [100.0 * float(measurement[f"{name}_relative [1]"]) for name in names]
        assert list(map(float, cells[:4])) == [float(f"{error:.2g}") for error in errors]
        assert cells[5] == f"{float(measurement['wall_seconds [s]']):.2g}"


def test_the_page_on_guided_belts_has_the_measured_errors_of_creep() -> None:
    rows = measured_rows("guided_creep")
    heading = "<!-- table: creep of guided belts -->\n"
    page = RESULTS.parent / "docs/mechanisms/guided-belt.md"
    first = page.read_text(encoding="utf-8").split(heading)[1].partition("\n")[0]
    assert [cell.strip() for cell in first.strip("|").split("|")] == list(rows[0])
    for cells, row in zip(page_rows(heading, "guided-belt"), rows, strict=True):
        points, *values = row.values()
        assert cells == [points, *(f"{float(value):.2g}" for value in values)]


@pytest.mark.every(2)
@pytest.mark.parametrize("drive", [2, 5])
def test_errors_of_creep_are_within_those_of_the_table(drive: int) -> None:
    row = measured_rows("guided_creep")[0]
    errors = results_guided.errors_of(drive, int(row["points"]))
    # The means of a few rounds of the belt differ by a part of their error from machine to machine.
    for key, column in (
        ("creep", "creep, largest [%]"),
        ("tension_tight", "tight span, largest [%]"),
        ("tension_slack", "slack span, largest [%]"),
        ("adhesion_arc", "arc of adhesion, largest [rad]"),
    ):
        assert max(map(abs, errors[key])) <= 1.05 * float(row[column])
