"""Units in the headings of measured data, and what the table says that they were read in."""

from pathlib import Path

import numpy as np
import pytest

import frictionsim as fs
from tests.parameter_study.measurements import FORCE, frictionless
from tests.parameter_study.test_fit_data import FREE, TIME, VELOCITY, force_of, rows

pytestmark = pytest.mark.quick


@pytest.mark.parametrize("column", ["w", "w (deg/s)", 2])
def test_a_unit_in_round_brackets(column: str | int, tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(rows("{t},{w}\n", "t (s),w (deg/s)\n"))
    found = fs.fit(
        frictionless(), data=path, channels={"angular_velocity": column}, free=FREE, starts=1
    )
    assert found.values[FORCE] == pytest.approx(100.0 + 200.0 * np.pi / 180.0, rel=1e-6)
    name = "column 2" if column == 2 else f"'{column}'"
    assert f"\ndata: angular_velocity from {name} in deg/s\n" in found.summary()
    residuals = found.to_json()["residuals"]["angular_velocity"]
    assert (residuals["column"], residuals["data_unit"]) == (column, "deg/s")


def test_a_unit_in_the_name_of_a_column_in_memory() -> None:
    data = {"time": TIME, "w [deg/s]": np.degrees(VELOCITY)}
    assert force_of(data, {"angular_velocity": "w [deg/s]"}) == pytest.approx(300.0, rel=1e-6)


def test_wrong_units_name_what_was_given(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(rows("{t},{w}\n", "t,w (motor)\n"))
    channels, known = {"angular_velocity": "w"}, "expected one of rad/s, deg/s, rev/s, rpm, 1/min"
    with pytest.raises(fs.ArgumentError) as caught:
        force_of(path, channels, units={"angular_velocity": "km/h"})
    assert str(caught.value) == f"units: angular_velocity: {known}, got 'km/h'"
    with pytest.raises(fs.ArgumentError) as caught:
        force_of(path, channels)
    assert str(caught.value) == f"data: unit of the column 'w': {known}, got 'motor'"
    assert force_of(path, channels, units={"angular_velocity": "rad/s"}) == pytest.approx(300.0)
