"""Measured data: columns of CSV files and of mappings, units, offsets and gaps; bad data."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.errors import InputError
from tests.fits.measurements import FORCE, MU_S, SLOPE, frictionless, pulley

TIME = np.linspace(0.1, 0.9, 9)
VELOCITY = SLOPE * 200.0 * TIME  # of a force of 300 N
FREE = {FORCE: (0.0, 1000.0)}


def fit_of(data: Any, channels: Any = "angular_velocity", **options: Any) -> fs.Fit:
    """Return the fit of a force to data."""
    return fs.fit(frictionless(), data=data, channels=channels, free=FREE, starts=1, **options)


def force_of(data: Any, channels: Any = "angular_velocity", **options: Any) -> float:
    """Return the force that a fit to data finds; 300 N if they are read as they are meant."""
    return fit_of(data, channels, **options).values[FORCE]


class Frame:
    """Columns by name that are no mapping, as a pandas.DataFrame is."""

    def __init__(self, **columns: Any) -> None:
        self._columns = columns

    def __getitem__(self, name: str) -> Any:
        return self._columns[name]

    def keys(self) -> Any:
        return self._columns.keys()


@pytest.mark.parametrize(
    ("data", "options"),
    [
        ({"time": TIME, "angular_velocity": VELOCITY}, {}),
        (Frame(time=TIME, angular_velocity=VELOCITY), {}),
        ({"t": TIME, "w": VELOCITY}, {"time": "t", "channels": {"angular_velocity": "w"}}),
        (
            {"time": 1e3 * TIME, "angular_velocity": np.degrees(VELOCITY)},
            {"time_unit": "ms", "units": {"angular_velocity": "deg/s"}},
        ),
        ({"time": TIME + 7.0, "angular_velocity": VELOCITY}, {"time_offset": -7.0}),
        ({"time": TIME, "angular_velocity": np.where(TIME == 0.5, np.nan, VELOCITY)}, {}),
        (
            {"time": TIME, "w [deg/s]": np.degrees(VELOCITY)},
            {"channels": {"angular_velocity": "w [deg/s]"}},
        ),
        # Times that are off by their rounding are within the run.
        ({"time": [-1e-16, 1.0 + 1e-15], "angular_velocity": [0.0, SLOPE * 200.0]}, {}),
    ],
)
def test_data_in_memory(data: Any, options: dict[str, Any]) -> None:
    assert force_of(data, **options) == pytest.approx(300.0, rel=1e-6)


def test_a_dataset_has_the_units_of_its_channels() -> None:
    made = fs.solve(frictionless(), {"output.interval": 0.1}).dataset
    made["angular_velocity"] = np.degrees(made["angular_velocity"])
    made["angular_velocity"].attrs["units"] = "deg/s"
    assert force_of(made) == pytest.approx(300.0, rel=1e-6)


def rows(line: str, header: str = "") -> str:
    text = "".join(line.format(t=t, w=w) for t, w in zip(TIME, VELOCITY, strict=True))
    return header + text


@pytest.mark.parametrize(
    ("text", "options"),
    [
        (rows("{t},{w}\n", "time,angular_velocity\n"), {}),
        (rows("{t},{w}\n", "# a comment; 1;2\ntime [s],angular_velocity [rad/s]\n"), {}),
        (rows("{t};{w}\n", "t;w\n").replace(".", ","), {"channels": {"angular_velocity": "w"}}),
        (rows("{w},{t}\n"), {"time": 2, "channels": {"angular_velocity": 1}}),
        (
            rows("{t},{w}\n", "t,w (motor)\n"),
            {"channels": {"angular_velocity": "w"}, "units": {"angular_velocity": "rad/s"}},
        ),
        (rows("{t}e3,{w}\n", "time [ms],angular_velocity [rad/s]\n"), {}),
        (
            rows("{t},{w}\n", "time [ms],angular_velocity [deg/s]\n"),
            {"time_unit": "s", "units": {"angular_velocity": "rad/s"}},
        ),
    ],
)
def test_data_in_csv_are_read_by_name_or_number_in_their_units_or_given_ones(
    text: str, options: dict[str, Any], tmp_path: Path
) -> None:
    path = tmp_path / "log.csv"
    path.write_text(text)
    assert force_of(str(path), **options) == pytest.approx(300.0, rel=1e-6)


def test_gaps_of_a_file_are_not_data(tmp_path: Path) -> None:
    """Channels that were sampled at other times than each other."""
    angle = 0.5 * SLOPE * 200.0 * TIME**2
    lines = ["time,angular_velocity,angle"]
    for i, t in enumerate(TIME):
        lines.append(f"{t},{VELOCITY[i]}," if i % 2 else f"{t},,{angle[i]}")
    path = tmp_path / "log.csv"
    path.write_text("\n".join(lines))
    fit = fit_of(path, ["angular_velocity", "angle"])
    assert fit.values[FORCE] == pytest.approx(300.0, rel=1e-6)
    assert [part.values.size for part in fit.residuals] == [4, 5]


def test_sigma_may_be_a_column() -> None:
    """Of two values for the same force, the one with less noise counts more."""
    data = {"time": [0.4, 0.8], "w": SLOPE * np.array([200.0 * 0.4, 210.0 * 0.8]), "s": [0.1, 0.2]}
    force = force_of(data, {"angular_velocity": "w"}, sigma={"angular_velocity": "s"})
    weights = np.array([0.4, 0.8]) ** 2 / np.array([0.1, 0.2]) ** 2
    assert force == pytest.approx(100.0 + float(weights @ [200.0, 210.0] / weights.sum()))


def test_sigma_in_another_unit_than_the_data_is_refused() -> None:
    data = {"time": TIME, "w [rad/s]": VELOCITY, "s [rpm]": np.ones(len(TIME))}
    with pytest.raises(fs.InputError, match=r"the column 's \[rpm\]' is in rpm, the data are in"):
        fit_of(
            data,
            channels={"angular_velocity": "w [rad/s]"},
            sigma={"angular_velocity": "s [rpm]"},
        )


def test_sigma_is_in_the_unit_of_the_data() -> None:
    data = {"time": TIME, "angular_velocity": np.degrees(VELOCITY)}
    fit = fit_of(data, units={"angular_velocity": "deg/s"}, sigma={"angular_velocity": 1.0})
    error = np.radians(1.0) / (SLOPE * np.sqrt(TIME @ TIME))
    assert fit.standard_errors[FORCE] == pytest.approx(error, rel=1e-5)


@pytest.mark.parametrize(
    ("quantity", "unit", "factor"),
    [
        ("final_angular_velocity", "rad/s", 1.0),
        ("final_angular_velocity", "rpm", np.pi / 30.0),
        ("final_angle", "deg", np.pi / 180.0),
        ("final_time", "ms", 1e-3),
        ("energy_kinetic", "kJ", 1e3),
        ("energy_kinetic", "mJ", 1e-3),
    ],
)
def test_a_value_is_converted_to_the_unit_of_its_quantity(
    quantity: str, unit: str, factor: float
) -> None:
    scenario = frictionless()
    value = float(fs.solve(scenario).quantities[quantity]) / factor
    fit = fs.fit(
        scenario, quantities={quantity: value}, units={quantity: unit}, free=FREE, starts=1
    )
    assert fit.residual_rms[quantity] < 1e-6 * abs(value * factor)
    with pytest.raises(InputError, match=r"expected one of .*, got 'marbles'"):
        fs.fit(scenario, quantities={quantity: value}, units={quantity: "marbles"}, free=FREE)


def test_part_of_the_bounds_may_be_what_another_key_forbids() -> None:
    """Kinetic friction is 0.1, and static friction not below it."""
    data = {"time": [0.1, 0.2], "angular_velocity": [0.0, 0.0]}
    fit = fs.fit(pulley(), data=data, channels="angular_velocity", free={MU_S: (0.05, 0.4)})
    assert fit.not_identified == {MU_S: "the data do not change with it"}


@pytest.mark.parametrize("column", ["w", "w (deg/s)", 2])
def test_a_unit_in_round_brackets(column: str | int, tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(rows("{t},{w}\n", "t (s),w (deg/s)\n"))
    fit = fit_of(path, {"angular_velocity": column})
    assert fit.values[FORCE] == pytest.approx(100.0 + 200.0 * np.pi / 180.0, rel=1e-6)
    name = "column 2" if column == 2 else f"'{column}'"
    assert f"\ndata: angular_velocity from {name} in deg/s\n" in fit.summary()
    residuals = fit.to_json()["residuals"]["angular_velocity"]
    assert (residuals["column"], residuals["data_unit"]) == (column, "deg/s")


def test_a_comma_is_no_decimal_one_where_numbers_have_points(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text(rows("{t};{w}\n", "t;w\n") + "1.0;2,5\n")
    with pytest.raises(InputError, match="got '2,5'"):
        force_of(path, {"angular_velocity": "w"})
    path.write_text(rows("{t};{w}\n", "t;w\n").replace(".", ","))
    assert force_of(path, {"angular_velocity": "w"}) == pytest.approx(300.0, rel=1e-6)
