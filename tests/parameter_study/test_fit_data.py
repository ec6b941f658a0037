"""Measured data: columns of CSV files and of mappings, units, offsets and gaps; bad data."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.errors import InputError
from frictionsim.parameter_study.units import factor
from frictionsim.scenario.csv_columns import NoSuchColumn, read_columns
from tests.parameter_study.measurements import (
    FORCE,
    LOAD,
    MU_K,
    MU_S,
    SLOPE,
    frictionless,
    pulley,
    write_csv,
)

pytestmark = pytest.mark.quick

TIME = np.linspace(0.1, 0.9, 9)
VELOCITY = SLOPE * 200.0 * TIME  # of a force of 300 N
FREE = {FORCE: (0.0, 1000.0)}


def force_of(data: Any, channels: Any = "angular_velocity", **options: Any) -> float:
    """Return the force that a fit to data finds; 300 N if they are read as they are meant."""
    found = fs.fit(frictionless(), data=data, channels=channels, free=FREE, starts=1, **options)
    return found.values[FORCE]


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
        ({"time": TIME.tolist(), "angular_velocity": VELOCITY.tolist()}, {}),
        (Frame(time=TIME, angular_velocity=VELOCITY), {}),
        ({"t": TIME, "w": VELOCITY}, {"time": "t", "channels": {"angular_velocity": "w"}}),
        (
            {"time": 1e3 * TIME, "angular_velocity": np.degrees(VELOCITY)},
            {"time_unit": "ms", "units": {"angular_velocity": "deg/s"}},
        ),
        (
            {"time": TIME, "angular_velocity": VELOCITY * 30.0 / np.pi},
            {"units": {"angular_velocity": "rpm"}},
        ),
        ({"time": TIME + 7.0, "angular_velocity": VELOCITY}, {"time_offset": -7.0}),
        ({"time": TIME, "angular_velocity": np.where(TIME == 0.5, np.nan, VELOCITY)}, {}),
    ],
)
def test_data_in_memory(data: Any, options: dict[str, Any]) -> None:
    assert force_of(data, **options) == pytest.approx(300.0, rel=1e-6)


def test_a_time_that_is_off_by_its_rounding_is_within_the_run() -> None:
    velocity = [0.0, SLOPE * 100.0, SLOPE * 200.0]
    data = {"time": [-1e-16, 0.5, 1.0 + 1e-15], "angular_velocity": velocity}
    assert force_of(data) == pytest.approx(300.0, rel=1e-6)


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
        (rows("{t}\t{w}\n", "t\tw\n"), {"channels": {"angular_velocity": 2}}),
        (rows("{t} {w}\n"), {"channels": {"angular_velocity": 2}}),
        (rows("{w},{t}\n", "angular_velocity,time\n"), {}),
        (rows("{w},{t}\n"), {"time": 2, "channels": {"angular_velocity": 1}}),
        (rows("{t},{w},x\n", "time,angular_velocity,note\n"), {}),
        (rows("{t},{w}\n", "Log of the rig\n\ntime,angular_velocity\n"), {}),
    ],
)
def test_data_in_csv(text: str, options: dict[str, Any], tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(text)
    assert force_of(path, **options) == pytest.approx(300.0, rel=1e-6)
    assert force_of(str(path), **options) == pytest.approx(300.0, rel=1e-6)


def test_a_unit_in_a_heading_is_used_unless_another_is_given(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(rows("{t},{w}\n", "time [ms],angular_velocity [deg/s]\n"))
    units = {"angular_velocity": "rad/s"}
    assert force_of(path, time_unit="s", units=units) == pytest.approx(300.0, rel=1e-6)
    assert force_of(path) != pytest.approx(300.0, rel=0.1)


def test_gaps_of_a_file_are_not_data(tmp_path: Path) -> None:
    """Channels that were sampled at other times than each other."""
    angle = 0.5 * SLOPE * 200.0 * TIME**2
    lines = ["time,angular_velocity,angle"]
    for i, t in enumerate(TIME):
        lines.append(f"{t},{VELOCITY[i]}," if i % 2 else f"{t},,{angle[i]}")
    path = tmp_path / "log.csv"
    path.write_text("\n".join(lines))
    found = fs.fit(
        frictionless(), data=path, channels=["angular_velocity", "angle"], free=FREE, starts=1
    )
    assert found.values[FORCE] == pytest.approx(300.0, rel=1e-6)
    assert [part.values.size for part in found.data.residuals] == [4, 5]


def test_sigma_may_be_a_column() -> None:
    """Of two values for the same force, the one with less noise counts more."""
    data = {"time": [0.4, 0.8], "w": SLOPE * np.array([200.0 * 0.4, 210.0 * 0.8]), "s": [0.1, 0.2]}
    found = force_of(data, {"angular_velocity": "w"}, sigma={"angular_velocity": "s"})
    weights = np.array([0.4, 0.8]) ** 2 / np.array([0.1, 0.2]) ** 2
    assert found == pytest.approx(100.0 + float(weights @ [200.0, 210.0] / weights.sum()))


def test_sigma_is_in_the_unit_of_the_data() -> None:
    data = {"time": TIME, "angular_velocity": np.degrees(VELOCITY)}
    found = fs.fit(
        frictionless(),
        data=data,
        channels="angular_velocity",
        free=FREE,
        starts=1,
        units={"angular_velocity": "deg/s"},
        sigma={"angular_velocity": 1.0},
    )
    error = np.radians(1.0) / (SLOPE * np.sqrt(TIME @ TIME))
    assert found.standard_errors[FORCE] == pytest.approx(error, rel=1e-5)


@pytest.mark.parametrize(
    ("unit", "own", "wanted"),
    [
        ("rad/s", "rad/s", 1.0),
        ("rpm", "rad/s", np.pi / 30.0),
        ("rad/s", "rpm", 30.0 / np.pi),
        ("1", "%", 100.0),
        ("mN m", "N m", 1e-3),
        ("marbles", "marbles", 1.0),
    ],
)
def test_units(unit: str, own: str, wanted: float) -> None:
    assert factor(unit, own) == pytest.approx(wanted)


def test_a_unit_of_something_else_is_refused() -> None:
    with pytest.raises(InputError, match=r"^expected one of N, mN, kN, lbf, got 'kg'$"):
        factor("kg", "N")
    with pytest.raises(InputError, match=r"^expected 'marbles', got 's'$"):
        factor("s", "marbles")


# --- what is refused ----------------------------------------------------------------------------

GOOD = {"time": [0.1, 0.2], "angular_velocity": [0.5, 1.0]}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"data": None}, "data: missing; expected a CSV file or columns by name"),
        ({"data": 3}, "data: expected a CSV file or columns by name, got int"),
        ({"data": {}}, "data: unknown column 'time'; known: "),
        (
            {"data": {"time": [1.0], "angular_velocty": [1.0]}},
            "data: unknown column 'angular_velocity' (did you mean 'angular_velocty'?)",
        ),
        (
            {"data": {**GOOD, "angular_velocity": [1.0]}},
            "data: expected columns of one length, got time 2, angular_velocity 1",
        ),
        (
            {"data": {**GOOD, "angular_velocity": [[1.0], [2.0]]}},
            "data: expected a list of numbers in 'angular_velocity', got an array of shape (2, 1)",
        ),
        (
            {"data": {**GOOD, "angular_velocity": ["a", "b"]}},
            "data: expected numbers in 'angular_velocity'",
        ),
        (
            {"data": {**GOOD, "angular_velocity": [1.0, np.inf]}},
            "data: expected finite numbers in 'angular_velocity', got inf",
        ),
        (
            {"data": {**GOOD, "angular_velocity": [np.nan, np.nan]}},
            "data: no numbers in the column 'angular_velocity'",
        ),
        ({"data": {**GOOD, "time": [0.1, np.nan]}}, "data: row 1: no number in 'time'"),
        (
            {"data": {**GOOD, "time": [0.2, 0.2]}},
            "data: row 1: times must increase from row to row, but 0.2 s follows 0.2 s",
        ),
        (
            {"data": {**GOOD, "time": [0.2, 9.0]}},
            "data: the times are from 0.2 s to 9 s, the run is from 0 to 1 s; set solver.duration"
            " or the time offset",
        ),
        (
            {"time_offset": -0.15},
            "data: the times with the offset of -0.15 s are from -0.05 s to 0.05 s, the run is from"
            " 0 to 1 s; set solver.duration or the time offset",
        ),
        (
            {"channels": ()},
            "channels: expected a channel or quantity that was measured; none is given",
        ),
        ({"channels": 3}, "channels: expected names, got 3"),
        ({"channels": {"angle": 1.5}}, "channels: angle: expected a column, got 1.5"),
        (
            {"channels": "angular_speed"},
            "channels: unknown channel 'angular_speed' (did you mean 'angular_velocity'?)",
        ),
        (
            {"channels": "friction_torque", "data": {**GOOD, "friction_torque": [0.1, 0.1]}},
            "channels: this scenario has no channel 'friction_torque'; it has angle,"
            " angular_velocity, angular_acceleration, drive_force, shaft_reaction, energy_input,"
            " energy_kinetic, energy_potential",
        ),
        (
            {"channels": "mode", "data": {**GOOD, "mode": [1, 1]}},
            "channels: 'mode' counts or names something; it cannot be fitted",
        ),
        ({"free": {}}, "free: expected at least one key; a free key needs bounds, as"),
        ({"free": [FORCE]}, "free: expected bounds by key, as {'drive.force': (0.0, 1.0)}, got"),
        ({"free": {FORCE: 3.0}}, f"free: {FORCE}: expected bounds (low, high) or (low, high, st"),
        ({"free": {FORCE: (1.0, np.nan)}}, f"free: {FORCE}: expected bounds (low, high) or"),
        (
            {"free": {FORCE: (3.0, 2.0)}},
            f"free: {FORCE}: the lower bound 3 is not below the upper bound 2",
        ),
        (
            {"free": {FORCE: (1.0, 2.0, 3.0)}},
            f"free: {FORCE}: the start 3 is not between 1 and 2",
        ),
        ({"free": {LOAD: (-1.0, 2.0)}}, f"free: {LOAD}: expected bounds of at least 0, got -1"),
        (
            {"free": {"mechanism.inertia": (0.0, 2.0)}},
            "free: mechanism.inertia: expected bounds above 0, got 0",
        ),
        (
            {"free": {"mechanism.inerta": (1.0, 2.0)}},
            "free: mechanism.inerta: unknown key 'inerta' (did you mean 'inertia'?)",
        ),
        (
            {"free": {"solver.rtol": (1e-9, 1e-3)}},
            "free: solver.rtol: expected a key of mechanism, drive or effects",
        ),
        (
            {"free": {FORCE: (1, 2), LOAD: (1, 2), "mechanism.inertia": (1, 2)}},
            "data: 2 values cannot determine 3 free keys; give more data",
        ),
        (
            {"sigma": {"angle": 1.0}},
            "sigma: unknown channel or quantity 'angle'; known: angular_velocity",
        ),
        ({"sigma": 0.1}, "sigma: expected a mapping of channels or quantities"),
        (
            {"sigma": {"angular_velocity": -1.0}},
            "sigma: angular_velocity: expected a number above 0, got -1",
        ),
        (
            {"units": {"angular_velocity": "kg"}},
            "units: angular_velocity: expected one of rad/s, deg/s, rev/s, rpm, 1/min, got 'kg'",
        ),
        ({"time_unit": "d"}, "time_unit: expected one of s, ms, us, min, h, got 'd'"),
        ({"time_offset": "1"}, "time_offset: expected a finite number, got '1'"),
        ({"starts": 0}, "starts: expected a whole number above 0, got 0"),
        ({"seed": -1}, "seed: expected a whole number of at least 0, got -1"),
        ({"bootstrap": 1.5}, "bootstrap: expected a whole number of at least 0, got 1.5"),
        ({"progress": 3}, "progress: expected a function of a number, got 3"),
        (
            {"quantities": {"final_angle": 1.0}},
            "sigma: the quantity final_angle beside channels needs a standard deviation, as"
            " final_angle=0.01",
        ),
        (
            {"quantities": "final_angle"},
            "quantities: expected the measured value of each quantity",
        ),
        (
            {"quantities": {"final_angle": "x"}},
            "quantities: final_angle: expected a finite number, got 'x'",
        ),
        (
            {"channels": (), "quantities": {"final_angl": 1.0}},
            "quantities: unknown quantity 'final_angl' (did you mean 'final_angle'?)",
        ),
        (
            {"channels": (), "quantities": {"final_angle": 1.0}, "units": {"final_angle": "m"}},
            "units: final_angle: expected one of rad, deg, rev, got 'm'",
        ),
        (
            {"over": {LOAD: "time"}},
            "over: the rows of the data are runs, or times of channels; leave out one of them",
        ),
        (
            {"channels": (), "quantities": {"final_angle": "time"}, "over": {FORCE: "time"}},
            f"over: '{FORCE}' is free, too; the data give it or the fit does",
        ),
        (
            {
                "channels": (),
                "quantities": {"final_angle": "time"},
                "over": {"mechanism.lod": "time"},
            },
            "over: row 1 of the data: mechanism.lod: unknown key 'lod' (did you mean 'load'?)",
        ),
    ],
)
def test_bad_arguments_are_refused(arguments: dict[str, Any], message: str) -> None:
    given = {"data": GOOD, "channels": "angular_velocity", "free": FREE, **arguments}
    with pytest.raises(fs.ArgumentError) as caught:
        fs.fit(frictionless(), **given)
    assert str(caught.value).startswith(message)
    assert caught.value.exit_code == 2


def test_bounds_that_another_key_forbids() -> None:
    """Kinetic friction is 0.1: part of the bounds may be impossible, not all of it."""
    data = {"time": [0.1, 0.2], "angular_velocity": [0.0, 0.0]}
    with pytest.raises(fs.ArgumentError, match=f"^free: {MU_K}: 0.1 is above mu_s = 0.03; "):
        fs.fit(pulley(), data=data, channels="angular_velocity", free={MU_S: (0.01, 0.05)})
    found = fs.fit(pulley(), data=data, channels="angular_velocity", free={MU_S: (0.05, 0.4)})
    assert found.not_identified == {MU_S: "the data do not change with it"}


def test_an_unknown_argument_is_one_of_python() -> None:
    wanted = r"^fit\(\): unknown keyword argument 'sart' \(did you mean 'starts'\?\)$"
    with pytest.raises(TypeError, match=wanted):
        fs.fit(frictionless(), data=GOOD, channels="angle", free=FREE, sart=3)  # type: ignore[call-arg]


@pytest.mark.parametrize(
    ("text", "wanted", "message"),
    [
        ("", ["w"], "'log.csv' is empty"),
        (" \n\n", ["w"], "'log.csv' is empty"),
        ("1,2\n", ["w"], "'log.csv' has no line with the names of its columns; give the number"),
        ("t,v\n1,2\n", ["w"], "line 1 of 'log.csv': unknown column 'w'; known: t, v"),
        ("t,w,w\n1,2,3\n", ["w"], "'log.csv': columns 2, 3 are all named 'w'; give the number of"),
        ("t,w\n1,x\n", ["w"], "line 2 of 'log.csv': expected a finite number in column 'w', got"),
        ("t,w\n1,inf\n", ["w"], "line 2 of 'log.csv': expected a finite number in column 'w', got"),
        ("t,w\n,3\n", ["t"], "line 2 of 'log.csv': expected a finite number in column 't', got ''"),
        ("t,w\n1,2\n3\n", ["w"], "line 3 of 'log.csv': no column 2, only 1"),
        ("t,w\n1,2\n", [0], "line 2 of 'log.csv': no column 0, only 2"),
        ("t,w\n", ["w"], "'log.csv' has no lines of numbers"),
        ('t,w\n1,"2\n', ["w"], "line 2 of 'log.csv', separated by ',': not valid CSV: "),
    ],
)
def test_files_that_lack_something(
    text: str, wanted: list[Any], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("log.csv").write_text(text)
    with pytest.raises(InputError) as caught:
        read_columns(Path("log.csv"), wanted, ["t"])
    assert str(caught.value).startswith(message)


def test_a_file_that_is_not_there(tmp_path: Path) -> None:
    path = tmp_path / "none.csv"
    with pytest.raises(InputError) as caught:
        read_columns(path, ["w"], [])
    assert str(caught.value) == f"cannot read '{path}' (No such file or directory)"
    assert not isinstance(caught.value, NoSuchColumn)


def test_results_as_csv_are_data(tmp_path: Path) -> None:
    """Their headings have units in brackets."""
    path = write_csv(tmp_path / "a.csv", {"time [s]": TIME, "angular_velocity [rad/s]": VELOCITY})
    assert force_of(path) == pytest.approx(300.0, rel=1e-6)
