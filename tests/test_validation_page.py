"""The page on validation has the numbers of its file, and these are what belts promise."""

from math import exp, pi
from typing import Any

import pytest

from tests.benchmarks.validation import MEASURED, PAGE, PARTS, load, rendered
from tests.support.belt_closed_forms import (
    SECTION_4,
    capstan_with_bending,
    creep,
    loop_mode,
    transverse_mode,
    two_pulley_mode,
)
from tests.support.closed_forms_of_others import (
    den_hartog_amplitude,
    flat_belt,
    friction_oscillator,
)

NUMBERS = load()


def rows(part: str) -> list[dict[str, Any]]:
    """Return the rows of a part, by the headings of its columns."""
    table = NUMBERS[part]
    return [dict(zip(table["heading"], row, strict=True)) for row in table["rows"]]


def test_the_page_shows_each_part_that_is_measured() -> None:
    shown = [name for _, name, _ in MEASURED.findall(PAGE.read_text(encoding="utf-8"))]
    assert shown == list(PARTS)
    assert set(NUMBERS) == set(PARTS)


def test_the_page_has_the_numbers_of_the_file() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert rendered(page, NUMBERS) == page, "python -m tests.benchmarks.validation --page writes it"


@pytest.mark.parametrize("part", PARTS)
def test_the_numbers_have_the_columns_of_the_command(part: str) -> None:
    assert tuple(NUMBERS[part]["heading"]) == PARTS[part].heading


def test_torques_balance_from_150_bodies_on() -> None:
    forces = {
        (row["model"], row["bodies"]): row["T1 - T2, N"]
        for row in rows("drive")
        if row["model"] != "closed form"
    }
    assert ("string", 60) in forces
    for (model, bodies), force in forces.items():
        if model == "corrected" and bodies >= 150:
            assert force == pytest.approx(15.0 / 0.027, rel=1e-3)
        if model == "string":
            assert force == pytest.approx(15.0 / 0.027, rel=1e-4)
    assert abs(forces["polygon", 150] - 15.0 / 0.027) > 4.0


def test_full_slip_is_within_half_a_percent_at_300_bodies() -> None:
    fine = [row for row in rows("slip") if row["bodies"] >= 300]
    assert len(fine) >= 4
    for row in fine:
        # The closed form has one speed for both spans, which at 60 m/s is worth 0.7 % of the ratio.
        fast = 0.75 if row["speed of the belt, m/s"] > 30.0 else 0.0
        assert abs(row["off, %"]) < 0.5 + fast


def test_waves_and_creep_are_those_of_the_closed_forms_of_now() -> None:
    steady = creep(SECTION_4, 15.0, 1.0, 25.13 * 0.027)
    assert rows("drive")[0]["T1, N"] == pytest.approx(steady.tight, rel=1e-12)
    exact = {
        "pulleys against each other, rad/s": two_pulley_mode(SECTION_4),
        "wave along the loop, rad/s": loop_mode(SECTION_4),
        "wave 1 across a span, rad/s": transverse_mode(SECTION_4, 1),
        "wave 3 across a span, rad/s": transverse_mode(SECTION_4, 3),
    }
    checked = [row for row in rows("waves") if row["what"] in exact]
    assert {row["what"] for row in checked} == exact.keys()
    for row in checked:
        assert row["closed form"] == pytest.approx(exact[row["what"]], rel=1e-12)
        # 2 % of 150 bodies, which goes with the square of their length.
        assert abs(row["off, %"]) < (0.6 if row["bodies"] == 300 else 2.4)


def test_weight_is_exact() -> None:
    errors = [row["off, %"] for row in rows("waves") if "span, mm" in row["what"]]
    assert errors
    assert max(map(abs, errors)) < 0.02


def test_benchmarks_of_others_are_met() -> None:
    for row in rows("den_hartog"):
        expected = den_hartog_amplitude(float(row["ratio r"]))
        assert float(row["amplitude, P/k"]) == pytest.approx(expected, abs=1e-10)
    exact, ours, theirs = (
        (float(row["rest at, s"]), float(row["x at rest"])) for row in rows("siconos")
    )
    assert exact == pytest.approx(friction_oscillator(), abs=1e-12)
    assert ours == pytest.approx(exact, abs=1e-9)
    assert abs(theirs[1] - exact[1]) == pytest.approx(1.3e-4, abs=1e-5)
    belts = rows("exudyn")
    assert [row["program"] for row in belts] == ["closed form", "Exudyn", "ours", "ours"]
    for row in belts[2:]:
        values = [float(row[key]) for key in ("mean from 2.4 s on, rad/s", "T1, N", "T2, N")]
        assert values == pytest.approx(flat_belt(), abs=0.05)
        assert values[0] == pytest.approx(flat_belt()[0], abs=2e-4)


def test_a_belt_that_hardly_bends_obeys_the_plain_capstan() -> None:
    ratios = [capstan_with_bending(0.3, pi, rigidity, 0.027, 770.0) for rigidity in (1e-8, 0.026)]
    assert ratios[0] == pytest.approx(exp(0.3 * pi), rel=1e-3)
    assert ratios[1] == pytest.approx(2.49, abs=5e-3)
