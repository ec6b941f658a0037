"""Measured data: columns of CSV files and of mappings, units, offsets and gaps; bad data."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from tests.fits.measurements import FORCE, SLOPE, frictionless

TIME = np.linspace(0.1, 0.9, 9)
VELOCITY = SLOPE * 200.0 * TIME  # of a force of 300 N
W = "angular_velocity"
FREE = {FORCE: (0.0, 1000.0)}


def fit_of(data: Any, channels: Any = W, **options: Any) -> fs.Fit:
    """Return the fit of a force to data, of 300 N if they are read as they are meant."""
    return fs.fit(frictionless(), data=data, channels=channels, free=FREE, starts=1, **options)


class Frame:
    """Columns by name that are no mapping, as a pandas.DataFrame is."""

    def __init__(self, **columns: Any) -> None:
        self._columns = columns

    def __getitem__(self, name: str) -> Any:
        return self._columns[name]

    def keys(self) -> Any:
        return self._columns.keys()


def text_of(line: str, header: str = "") -> str:
    return header + "".join(line.format(t=t, w=w) for t, w in zip(TIME, VELOCITY, strict=True))


def of_dataset() -> Any:
    made = fs.solve(frictionless(), {"output.interval": 0.1}).dataset
    made[W] = np.degrees(made[W])
    made[W].attrs["units"] = "deg/s"
    return made


COMMENT = "# a comment; 1;2\ntime [s],angular_velocity [rad/s]\n"
IN_DEGREES = {"time": 1e3 * TIME, W: np.degrees(VELOCITY)}


@pytest.mark.parametrize(
    ("data", "options"),
    [
        (Frame(time=TIME, angular_velocity=VELOCITY), {}),
        (IN_DEGREES, {"time_unit": "ms", "units": {W: "deg/s"}}),
        ({"time": TIME + 7.0, W: VELOCITY}, {"time_offset": -7.0}),
        ({"time": TIME, W: np.where(TIME == 0.5, np.nan, VELOCITY)}, {}),
        ({"time": TIME, "w [deg/s]": np.degrees(VELOCITY)}, {"channels": {W: "w [deg/s]"}}),
        # Times that are off by their rounding are within the run.
        ({"time": [-1e-16, 1.0 + 1e-15], W: [0.0, SLOPE * 200.0]}, {}),
        (of_dataset, {}),
        (text_of("{t},{w}\n", COMMENT), {}),
        (text_of("{t};{w}\n", "t;w\n").replace(".", ","), {"channels": {W: "w"}}),
        (text_of("{w},{t}\n"), {"time": 2, "channels": {W: 1}}),
        (text_of("{t},{w}\n", "t,w (motor)\n"), {"channels": {W: "w"}, "units": {W: "rad/s"}}),
        (
            text_of("{t},{w}\n", "time [ms],angular_velocity [deg/s]\n"),
            {"time_unit": "s", "units": {W: "rad/s"}},
        ),
    ],
)
def test_data_are_read_by_name_or_number_in_their_units_or_given_ones(
    data: Any, options: dict[str, Any], tmp_path: Path
) -> None:
    if isinstance(data, str):
        (tmp_path / "log.csv").write_text(data)
        data = str(tmp_path / "log.csv")
    fit = fit_of(data() if callable(data) else data, **options)
    assert fit.values[FORCE] == pytest.approx(300.0, rel=1e-6)


def test_gaps_of_a_file_are_not_data(tmp_path: Path) -> None:
    """Channels that were sampled at other times than each other."""
    angle = 0.5 * SLOPE * 200.0 * TIME**2
    lines = ["time,angular_velocity,angle"]
    for i, t in enumerate(TIME):
        lines.append(f"{t},{VELOCITY[i]}," if i % 2 else f"{t},,{angle[i]}")
    path = tmp_path / "log.csv"
    path.write_text("\n".join(lines))
    fit = fit_of(path, [W, "angle"])
    assert fit.values[FORCE] == pytest.approx(300.0, rel=1e-6)
    assert [part.values.size for part in fit.residuals] == [4, 5]


def test_sigma_is_a_column_or_a_number_in_the_unit_of_the_data() -> None:
    """Of two values for the same force, the one with less noise counts more."""
    data = {"time": [0.4, 0.8], "w": SLOPE * np.array([200.0 * 0.4, 210.0 * 0.8]), "s": [0.1, 0.2]}
    force = fit_of(data, {W: "w"}, sigma={W: "s"}).values[FORCE]
    weights = np.array([0.4, 0.8]) ** 2 / np.array([0.1, 0.2]) ** 2
    assert force == pytest.approx(100.0 + float(weights @ [200.0, 210.0] / weights.sum()))
    degrees = {"time": TIME, W: np.degrees(VELOCITY)}
    fit = fit_of(degrees, units={W: "deg/s"}, sigma={W: 1.0})
    error = np.radians(1.0) / (SLOPE * np.sqrt(TIME @ TIME))
    assert fit.standard_errors[FORCE] == pytest.approx(error, rel=1e-5)
    other = {"time": TIME, "w [rad/s]": VELOCITY, "s [rpm]": np.ones(len(TIME))}
    with pytest.raises(fs.InputError, match=r"the column 's \[rpm\]' is in rpm, the data are in"):
        fit_of(other, channels={W: "w [rad/s]"}, sigma={W: "s [rpm]"})


@pytest.mark.parametrize(
    ("quantity", "unit", "factor"),
    [
        ("final_angular_velocity", "rpm", np.pi / 30.0),
        ("final_time", "ms", 1e-3),
        ("energy_kinetic", "kJ", 1e3),
    ],
)
def test_a_value_is_converted_to_the_unit_of_its_quantity(
    quantity: str, unit: str, factor: float
) -> None:
    scenario = frictionless()
    value = float(fs.solve(scenario).quantities[quantity]) / factor
    given: dict[str, Any] = {"quantities": {quantity: value}, "free": FREE, "starts": 1}
    fit = fs.fit(scenario, units={quantity: unit}, **given)
    assert fit.residual_rms[quantity] < 1e-6 * abs(value * factor)
    with pytest.raises(fs.InputError, match=r"expected one of .*, got 'marbles'"):
        fs.fit(scenario, units={quantity: "marbles"}, **given)


@pytest.mark.parametrize("column", ["w", 2])
def test_a_unit_in_round_brackets(column: str | int, tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(text_of("{t},{w}\n", "t (s),w (deg/s)\n"))
    fit = fit_of(path, {W: column})
    assert fit.values[FORCE] == pytest.approx(100.0 + 200.0 * np.pi / 180.0, rel=1e-6)
    name = "column 2" if column == 2 else f"'{column}'"
    assert f"\ndata: angular_velocity from {name} in deg/s\n" in fit.summary()
    residuals = fit.to_json()["residuals"][W]
    assert (residuals["column"], residuals["data_unit"]) == (column, "deg/s")
