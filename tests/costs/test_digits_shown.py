"""Digits of a quantity are those that its error bears, in summary, `show`, report and statics."""

import re
from collections.abc import Callable
from decimal import Decimal
from pathlib import Path

import pytest

import frictionsim as fs
from tests.support.scenarios import GOLDEN, SCENARIOS

Told = Callable[..., tuple[str, str]]
# What scenario and time give, or the line of an ideal belt, with any number of bodies.
GIVEN = re.compile("final_time|pretension|path_|belt_l|body_l|strain|wrap_|capstan_|torque_limit_")


def rows_of(text: str) -> dict[str, list[str]]:
    """Return the rows of the table of quantities by name."""
    lines = text.splitlines()
    start = next(i for i, line in enumerate(lines) if line.startswith("quantity"))
    rows: dict[str, list[str]] = {}
    for line in lines[start + 1 :]:
        name, *cells = line.split()
        if name in ("error:", "event", "audit") or len(cells) > 4:  # a note of statics is longer
            break
        rows[name] = cells
    return rows


def significant(number: str) -> int:
    return len(Decimal(number).as_tuple().digits)


@pytest.mark.parametrize(("name", "rtol"), [("pulley", 1e-5), ("marble_machine", 1e-6)])
def test_the_last_digit_has_the_place_of_the_first_of_the_error(
    name: str, rtol: float, tmp_path: Path
) -> None:
    overrides = {"solver.rtol": rtol, "solver.duration": 1.5}
    result = fs.solve(SCENARIOS / f"{name}.toml", overrides, estimate_error=True)
    rows = rows_of(result.summary())
    judged = 0
    for quantity, error in result.errors.items():
        value = result.quantities[quantity].value
        if value is None:
            continue
        shown = Decimal(rows[quantity][0])
        if not error:
            assert rows[quantity][0] == f"{value:.10g}"
            continue
        place = Decimal(f"{error:.1e}").adjusted()
        # Ten digits are the most, of a smaller error as well.
        if Decimal(value).adjusted() - place < 10:
            assert shown.as_tuple().exponent == min(place, 0)
            assert abs(float(shown) - value) <= 0.5001 * 10.0**place  # it is rounded, not cut
            judged += 1
    assert judged >= 3
    told = result.to_json()["quantities"]
    assert all(told[name]["value"] == q.value for name, q in result.quantities.items())
    page = fs.report(result, tmp_path / "a.html").read_text(encoding="utf-8")
    assert rows["energy_input"][0] in page


@pytest.mark.parametrize("name", ["belt_drive", "belt_string"])
def test_without_an_estimate_belts_show_three_digits_of_what_their_mesh_makes(
    name: str, told: Told
) -> None:
    out, _ = told("show", GOLDEN / f"{name}.h5")
    result = fs.open(GOLDEN / f"{name}.h5")
    checked = 0
    for quantity, (shown, *_) in rows_of(out).items():
        value = result.quantities[quantity].value
        if value and GIVEN.match(quantity):
            assert shown == f"{value:.10g}"
        elif value and "_speed" not in quantity:
            assert float(shown) == float(f"{value:.2e}")
            checked += 1
            assert significant(shown) == 3 or "." not in shown
    assert checked >= 10


def test_a_speed_that_the_scenario_gives_has_all_its_digits() -> None:
    record, speed = fs.open(GOLDEN / "belt_verification.h5").record, -20.03125
    text = record.attributes["scenario"].replace("-12.0", repr(speed))
    quantities = {**record.quantities, "driven_speed": fs.Quantity(0.9991 * speed, "rad/s")}
    quantities["drive_speed"] = fs.Quantity(speed, "rad/s")
    attributes = {**record.attributes, "scenario": text}
    made = fs.Result(record._replace(attributes=attributes, quantities=quantities))
    rows = rows_of(made.summary())
    assert float(rows["drive_speed"][0]) == speed
    assert float(rows["driven_speed"][0]) == float(f"{0.9991 * speed:.2e}")
    edited = fs.Result(record._replace(attributes=attributes | {"scenario": "no TOML ["}))
    assert (
        rows_of(edited.summary())["final_time"][0] == f"{record.quantities['final_time'].value:g}"
    )


def test_an_estimate_of_a_belt_says_that_the_mesh_is_not_in_it(told: Told) -> None:
    belt = ("solve", "belt_string", "--set", "solver.duration=0.002", "--estimate-error")
    out, _ = told(*belt)
    (line,) = [line for line in out.splitlines() if line.startswith("error: ")]
    assert "mesh is not included" in line
    assert "frictionsim cost" in line
    rows = rows_of(out)
    assert rows["pretension"][0] == "555"
    value, error = rows["energy_kinetic"][:2]
    assert Decimal(value).as_tuple().exponent == Decimal(error).adjusted()
    out, _ = told("solve", "pulley", "--estimate-error")
    assert "mesh" not in out


def test_statics_have_ten_digits_but_for_what_the_mesh_of_a_belt_makes(told: Told) -> None:
    for name in ("pulley", "lift"):
        out, _ = told("static", name)
        quantities = fs.static(name)
        for quantity, (shown, *_) in rows_of(out).items():
            if (value := quantities[quantity].value) is not None:
                assert shown == f"{value:.10g}"
    out, _ = told("static", "belt_drive")
    quantities = fs.static("belt_drive")
    for quantity, (shown, *_) in rows_of(out).items():
        value = quantities[quantity].value or 0.0
        if GIVEN.match(quantity):
            assert shown == f"{value:.10g}"
        else:
            assert float(shown) == float(f"{value:.2e}")
