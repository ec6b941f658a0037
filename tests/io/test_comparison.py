"""Comparison of two result files: tolerances, events, and files that cannot be compared."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

import frictionsim as fs
from frictionsim import __version__
from frictionsim.cli.commands import run_command_line
from frictionsim.io import hdf5_reader, hdf5_writer
from tests.support.scenarios import pulley, simulate

# The default tolerances of the command line.
RTOL, ATOL, TIME_ATOL = 1e-6, 1e-9, 1e-6
OF_EVENTS = {"angle", "mode"}  # without sides in /events
INTERVAL = 0.01  # s, between two samples of the shipped pulley

Edit = Callable[[Any], None]
Compare = Callable[..., tuple[int, str]]


@pytest.fixture(scope="module")
def golden(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A result with one event, the breakaway between two samples; not to be changed."""
    path = tmp_path_factory.mktemp("golden") / "golden.h5"
    hdf5_writer.write(simulate(pulley()), path)
    return path


@pytest.fixture
def compare(golden: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Compare:
    """Compare a changed copy with the golden file; return the exit code and what was printed."""

    def run(edit: Edit, *options: str) -> tuple[int, str]:
        path = tmp_path / "result.h5"
        path.write_bytes(golden.read_bytes())
        with h5py.File(path, "r+") as file:
            edit(file)
        code = run_command_line(["compare", str(path), str(golden), *options])
        captured = capsys.readouterr()
        assert (captured.err == "") == (code in (0, 1))
        return code, captured.out + captured.err

    return run


def nothing(file: Any) -> None:
    """Leave the copy as it is."""


def add(name: str, index: int, difference: float) -> Edit:
    """Return an edit that adds to one value of a channel, or of the events."""

    def edit(file: Any) -> None:
        file[name][index] += difference

    return edit


def set_value(name: str, index: int, value: float) -> Edit:
    """Return an edit that sets one value of a channel, or of the events."""

    def edit(file: Any) -> None:
        file[name][index] = value

    return edit


def rows(table: str) -> list[list[str]]:
    """Return the rows of a printed table, split into words."""
    lines = table.splitlines()[1:-1]  # without the heading and the verdict
    return [line.split() for line in lines if not line.startswith("note:")]


def final_angle(golden: Path) -> float:
    return float(hdf5_reader.read(golden).channels["angle"][-1])


def samples_beside_the_breakaway(golden: Path) -> tuple[int, float]:
    """Return the index of the first sample after the event, and its time after it."""
    found = hdf5_reader.read(golden)
    (event,) = found.events["time"]
    after = int(np.searchsorted(found.channels["time"], event, side="right"))
    return after, float(found.channels["time"][after] - event)


def test_equal_files_agree_in_every_channel_and_in_the_events(
    compare: Compare, golden: Path
) -> None:
    code, table = compare(nothing)
    assert code == 0
    found = rows(table)
    channels = hdf5_reader.read(golden).channels.keys() - {"time"}
    beside = {f"events/{name}" for name in channels - OF_EVENTS if not name.startswith("energy_")}
    assert {row[0] for row in found} == channels | beside | {"events"}
    assert all((row[1], row[-1]) == ("0", "ok") for row in found)


def test_equal_files_agree_with_zero_tolerances(compare: Compare) -> None:
    assert compare(nothing, "--rtol", "0", "--atol", "0", "--time-atol", "0")[0] == 0


@pytest.mark.parametrize(("factor", "code"), [(0.9, 0), (1.1, 1), (-0.9, 0), (-1.1, 1)])
def test_a_value_may_differ_by_the_tolerances(
    factor: float, code: int, compare: Compare, golden: Path
) -> None:
    allowed = ATOL + RTOL * abs(final_angle(golden))
    assert compare(add("angle", -1, factor * allowed))[0] == code


@pytest.mark.parametrize(("factor", "code"), [(2.0, 1), (0.5, 0)])
def test_the_relative_tolerance_is_of_the_golden_value(
    factor: float, code: int, compare: Compare, golden: Path
) -> None:
    change = (factor - 1.0) * final_angle(golden)
    assert compare(add("angle", -1, change), "--rtol", "0.7")[0] == code


@pytest.mark.parametrize(
    ("options", "code"),
    [
        ([], 1),
        (["--rtol", "1e-3"], 0),
        (["--atol", "0.1"], 0),
        (["--rtol", "0", "--atol", "0.001"], 1),
        (["--time-atol", "0.004"], 1),
        (["--ignore", "angle"], 0),
        (["--ignore", "ang*"], 0),
        (["--ignore", "angular_*", "--ignore", "angle"], 0),
        (["--ignore", "angular_*"], 1),
        (["--ignore", "events"], 1),
    ],
)
def test_options_widen_tolerances_and_leave_channels_out(
    options: list[str], code: int, compare: Compare
) -> None:
    # 0.01 of 34 rad is above 1e-6 of it and 0.001, below 1e-3 of it and 0.1.
    assert compare(add("angle", -1, 0.01), *options)[0] == code


def test_differences_are_listed_first_with_size_and_time(compare: Compare) -> None:
    def edit(file: Any) -> None:
        add("drive_force", 100, 0.5)(file)  # one more sample is at the event before
        add("energy_input", 200, 1000.0)(file)

    code, table = compare(edit)
    assert code == 1
    worst, second, *others = rows(table)
    assert [worst[0], worst[1], *worst[3:]] == ["energy_input", "1e+03", "1.99", "different"]
    assert [second[0], second[1], *second[3:]] == ["drive_force", "0.5", "0.99", "different"]
    assert all(row[-1] == "ok" for row in others)


def test_rows_are_sorted_by_difference(compare: Compare) -> None:
    code, table = compare(add("shaft_reaction", 30, 1e-6))
    assert code == 0
    assert rows(table)[0][:2] == ["shaft_reaction", "1e-06"]
    assert rows(table)[1][1] == "0"


def test_an_ignored_channel_is_not_in_the_table(compare: Compare) -> None:
    _, table = compare(nothing, "--ignore", "energy_*", "--ignore", "events")
    assert not [row for row in rows(table) if row[0].startswith(("energy_", "events"))]


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_non_finite_values_differ_from_every_number(value: float, compare: Compare) -> None:
    code, table = compare(set_value("angle", 100, value), "--atol", "1e300")
    assert code == 1
    assert rows(table)[0][0] == "angle"


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_equal_non_finite_values_agree(
    value: float, golden: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "a.h5"
    path.write_bytes(golden.read_bytes())
    with h5py.File(path, "r+") as file:
        file["angle"][100] = value
    assert run_command_line(["compare", str(path), str(path)]) == 0


def test_a_channel_that_only_one_file_has_differs(compare: Compare) -> None:
    def rename(file: Any) -> None:
        file.move("energy_damping", "energy_lost")

    code, table = compare(rename)
    assert code == 1
    assert re.search("energy_damping .* *missing in the result", table)
    assert re.search("energy_lost .* *missing in the golden file", table)
    assert compare(rename, "--ignore", "energy_*")[0] == 0


def test_a_truncated_channel_differs(compare: Compare) -> None:
    def cut(file: Any) -> None:
        kept, attributes = file["angle"][:-1], dict(file["angle"].attrs)
        del file["angle"], attributes["DIMENSION_LIST"]
        file["angle"] = kept
        file["angle"].attrs.update(attributes)

    assert compare(cut)[0] != 0


def test_a_channel_in_another_unit_differs(compare: Compare) -> None:
    code, table = compare(lambda file: file["angle"].attrs.update(units="deg"))
    assert code == 1
    assert "unit deg, expected rad" in table


@pytest.mark.parametrize(
    ("edit", "code"),
    [
        pytest.param(add("events/time", 0, 0.9 * TIME_ATOL), 0, id="a little later"),
        pytest.param(add("events/time", 0, -0.9 * TIME_ATOL), 0, id="a little earlier"),
        pytest.param(add("events/time", 0, 1.1 * TIME_ATOL), 1, id="too late"),
        pytest.param(set_value("events/time", 0, np.nan), 2, id="at no time"),
        pytest.param(set_value("events/mode_to", 0, -1.0), 1, id="to another mode"),
        pytest.param(set_value("events/mode_from", 0, 1.0), 1, id="from another mode"),
    ],
)
def test_events_agree_in_modes_and_within_the_time_tolerance(
    edit: Edit, code: int, compare: Compare
) -> None:
    found, table = compare(edit)
    assert found == code
    assert code != 1 or rows(table)[0][0] == "events"


def test_a_wider_time_tolerance_lets_a_later_event_pass(compare: Compare) -> None:
    assert compare(add("events/time", 0, 1e-3), "--time-atol", "2e-3")[0] == 0


def test_a_missing_event_differs_unless_events_are_ignored(compare: Compare) -> None:
    def remove(file: Any) -> None:
        for name, dataset in list(file["events"].items()):
            attributes = {key: dataset.attrs[key] for key in dataset.attrs if key.islower()}
            del file["events"][name]
            file["events"][name] = np.empty(0)
            file["events"][name].attrs.update(attributes)

    code, table = compare(remove)
    assert code == 1
    assert "0 events, expected 1" in table
    assert compare(remove, "--ignore", "events")[0] == 0


def test_a_sample_beside_an_event_may_be_on_the_other_side_of_the_jump(
    compare: Compare, golden: Path
) -> None:
    after, distance = samples_beside_the_breakaway(golden)
    assert TIME_ATOL < distance < INTERVAL
    jump = add("friction_torque", after, 10.0)
    wide = ["--time-atol", str(1.01 * distance)]
    assert compare(jump)[0] == 1
    assert compare(jump, "--time-atol", str(0.99 * distance))[0] == 1
    assert compare(jump, *wide)[0] == 0
    # The next sample is further away than this tolerance.
    assert compare(add("friction_torque", after + 1, 10.0), *wide)[0] == 1


def test_another_version_is_noted_but_agrees(compare: Compare) -> None:
    code, table = compare(lambda file: file.attrs.update(frictionsim_version="0.0.1"))
    assert code == 0
    assert f"note: frictionsim_version: '0.0.1', expected '{__version__}'\n" in table


def notes(table: str) -> list[str]:
    return [line for line in table.splitlines() if line.startswith("note: ")]


POINTS = np.linspace(0.0, 1.0, 40).tolist()


@pytest.mark.parametrize(
    ("key", "value", "note"),
    [
        ("mechanism.load", 2224.2, "mechanism.load: 2224.2, expected 2224.1"),
        ("solver.backend", "rkf45", 'solver.backend: "rkf45", expected "events"'),
        ("effects.viscous_damping", None,
         "effects.viscous_damping.coefficient: none, expected 1.355"),
        ("drive.force.value.1", 3113.5,
         "drive.force.value: [1832.6, 3113.5], expected [1832.6, 3113.75]"),
        ("solver.max_step", 0.1, "solver.max_step: 0.1, expected none"),
        ("solver.rtol", 1e-9 * (1.0 + 2.0**-52), f"solver.rtol: {1e-9 * (1.0 + 2.0**-52)!r},"
         " expected 1e-09"),
        ("title", "x" * 70, f'title: "{"x" * 59}..., expected "Pulley on a dry shaft"'),
        ("output.channels", ["angle"], 'output.channels: ["angle"], expected none'),
    ],
)  # fmt: skip
def test_each_key_that_differs_is_noted_with_both_values(
    key: str, value: Any, note: str, compare: Compare
) -> None:
    other = fs.load(pulley(), {key: value}).to_toml()
    code, table = compare(lambda file: file.attrs.update(scenario=other))
    assert (code, notes(table)) == (0, [f"note: {note}"])


def test_the_entry_of_a_long_list_that_differs_is_noted() -> None:
    other = [*POINTS[:20], 3.0, *POINTS[21:]]
    results = [
        fs.solve(pulley(drive={"force": {"time": POINTS, "value": values}}))
        for values in (other, POINTS)
    ]
    comparison = fs.compare(results[0], results[1])
    assert comparison.notes == [
        "note: drive.force.value: a list of 40 with 3.0 at 20, expected a list of 40 with"
        f" {POINTS[20]!r} at 20"
    ]


def test_many_keys_are_counted(compare: Compare) -> None:
    def edit(file: Any) -> None:
        file.attrs["scenario"] += "\n" + "\n".join(f"extra_{i} = {i}" for i in range(25))

    found = notes(compare(edit)[1])
    assert len(found) == 21
    assert found[-1] == "note: 5 more keys of their scenarios differ"


@pytest.mark.parametrize("text", ["another", f"a = {'[' * 5000}", f"a = {'1' * 5000}"])
def test_a_scenario_that_is_no_toml_is_noted(text: str, compare: Compare) -> None:
    code, table = compare(lambda file: file.attrs.update(scenario=text))
    assert (code, notes(table)) == (
        0,
        ["note: the two files differ in their scenario, of which one is not valid TOML"],
    )


def test_a_different_status_differs(compare: Compare) -> None:
    code, table = compare(lambda file: file.attrs.update(status="failed"))
    assert code == 1
    assert table.splitlines()[1].startswith("status")
    assert "'failed', expected 'done'" in table


def test_a_run_that_stopped_early_differs(
    golden: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "short.h5"
    hdf5_writer.write(simulate(pulley(solver__max_steps=20)), path)
    assert run_command_line(["compare", str(path), str(golden)]) == 1
    assert "'failed', expected 'done'" in capsys.readouterr().out


FOREIGN = "it is HDF5, but not a frictionsim result"
NOT_COMPARABLE: dict[str, tuple[Edit, str]] = {
    "another kind": (
        lambda file: file.attrs.update(kind="belt_drive"),
        "is of kind 'belt_drive', ",
    ),
    "other times": (add("time", 100, 1e-3), "sampled at different times (302 and 302 samples)"),
    "another format": (
        lambda file: file.attrs.update(format_version=99),
        "its format version is 99",
    ),
    "no contacts": (lambda file: file.pop("events/contact"), FOREIGN),
    "no kind": (lambda file: file.attrs.pop("kind"), FOREIGN),
    "no time": (lambda file: file.pop("time"), FOREIGN),
    "contact without a name": (set_value("events/contact", 0, 7.0), FOREIGN),
}


@pytest.mark.parametrize(("edit", "message"), NOT_COMPARABLE.values(), ids=NOT_COMPARABLE)
def test_incomparable_files_exit_2(edit: Edit, message: str, compare: Compare) -> None:
    code, captured = compare(edit)
    assert code == 2
    assert captured.startswith("frictionsim: ")
    assert message in captured


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"output__interval": 0.02}, "output.interval: 0.02, expected 0.01"),
        ({"solver__duration": 2.0}, "solver.duration: 2.0, expected 3.0"),
    ],
)
def test_runs_sampled_differently_exit_2(
    change: dict[str, float],
    key: str,
    golden: Path,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    path = tmp_path / "other.h5"
    hdf5_writer.write(simulate(pulley(**change)), path)
    assert run_command_line(["compare", str(path), str(golden)]) == 2
    way = f"run both with the same solver.duration and output.interval ({key})\n"
    assert way in capsys.readouterr().err


def test_the_sides_of_an_event_are_compared(compare: Compare) -> None:
    """The tolerance includes the change of the channel within time_atol."""
    code, table = compare(add("events/friction_torque_before", 0, 0.1))
    assert code == 1
    assert rows(table)[0][0] == "events/friction_torque"
    # Where it sticks, the friction rises by 81 N m/s: 81e-6 N m in 1e-6 s, and 25e-6 are allowed.
    rise = (3113.75 - 1832.6) / 0.8 * 0.0508 * TIME_ATOL
    for factor, expected in ((0.9, 0), (1.1, 1)):
        allowed = ATOL + RTOL * 24.567 + rise
        assert compare(add("events/friction_torque_before", 0, factor * allowed))[0] == expected
    assert compare(add("events/friction_torque_before", 0, 0.1), "--ignore", "friction*")[0] == 0
    assert compare(add("events/friction_torque_before", 0, 0.1), "--ignore", "events")[0] == 0


def test_missing_sides_of_events_are_not_compared(compare: Compare) -> None:
    code, table = compare(lambda file: file.pop("events/friction_torque_after"))
    assert code == 0
    assert "events/friction_torque" not in {row[0] for row in rows(table)}


def test_samples_at_events_may_differ_in_time(
    golden: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Runs agree although their samples at events differ in time or are missing."""
    path = tmp_path / "other.h5"
    for change in ({"output__at_events": False}, {"solver__backend": "rkf45"}):
        hdf5_writer.write(simulate(pulley(**change)), path)
        for pair in ((path, golden), (golden, path)):
            assert run_command_line(["compare", *map(str, pair)]) == 0
    captured = capsys.readouterr()
    assert captured.err == ""
