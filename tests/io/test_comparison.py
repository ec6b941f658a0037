"""Comparison of two result files: tolerances, events, and files that cannot be compared."""

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

import frictionsim as fs
from tests.cli.conftest import strict_json
from tests.support.scenarios import pulley, simulate

# The default tolerances of the command line.
RTOL, ATOL, TIME_ATOL = 1e-6, 1e-9, 1e-6
OF_EVENTS = {"angle", "mode"}  # without sides in /events
INTERVAL = 0.01  # s, between two samples of the shipped pulley

Edit = Callable[[Any], Any]
Compare = Callable[..., tuple[int, str]]


@pytest.fixture(scope="module")
def golden(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A result with one event, the breakaway between two samples; not to be changed."""
    path = tmp_path_factory.mktemp("golden") / "golden.h5"
    fs.Result(simulate(pulley())).save(path)
    with h5py.File(path, "r+") as file:  # of one part, as its printed table is read here
        for name in ("lever_arm", "events/lever_arm_before", "events/lever_arm_after"):
            del file[name]
    return path


@pytest.fixture
def compare(golden: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> Compare:
    """Compare a changed copy with the golden file; return the exit code and the output."""

    def run(edit: Edit, *options: str) -> tuple[int, str]:
        path = tmp_path / "result.h5"
        path.write_bytes(golden.read_bytes())
        with h5py.File(path, "r+") as file:
            edit(file)
        code = fs.run_command_line(["compare", str(path), str(golden), *options])
        captured = capsys.readouterr()
        assert (captured.err == "") == (code in (0, 1))
        return code, captured.out + captured.err

    return run


def nothing(file: Any) -> None:
    """Leave the copy as it is."""


def add(name: str, index: int, difference: float) -> Edit:
    """Return an edit that adds to one value of a channel, or of the events."""
    return lambda file: file[name].__setitem__(index, file[name][index] + difference)


def put(name: str, index: int, value: float) -> Edit:
    """Return an edit that sets one value of a channel, or of the events."""
    return lambda file: file[name].__setitem__(index, value)


def attribute(name: str = "", **values: str | int) -> Edit:
    """Return an edit of attributes, of the file or of a channel."""
    return lambda file: (file[name] if name else file).attrs.update(values)


def without(name: str) -> Edit:
    return lambda file: file.pop(name)


def cut(file: Any) -> None:
    kept, attributes = file["angle"][:-1], dict(file["angle"].attrs)
    del file["angle"], attributes["DIMENSION_LIST"]
    file["angle"] = kept
    file["angle"].attrs.update(attributes)


def without_events(file: Any) -> None:
    for name, dataset in list(file["events"].items()):
        attributes = {key: dataset.attrs[key] for key in dataset.attrs if key.islower()}
        del file["events"][name]
        file["events"][name] = np.empty(0)
        file["events"][name].attrs.update(attributes)


def renamed(file: Any) -> None:
    file.move("energy_damping", "energy_lost")


def rows(table: str) -> list[list[str]]:
    """Return the rows of a printed table, split into words."""
    lines = table.splitlines()[1:-1]  # without the heading and the verdict
    return [line.split() for line in lines if not line.startswith("note:")]


def notes(table: str) -> list[str]:
    return [line for line in table.splitlines() if line.startswith("note: ")]


# 0.01 of 34 rad is above 1e-6 of it and 0.001, below 1e-3 of it and 0.1.
FAR = add("angle", -1, 0.01)
BEFORE = "events/friction_torque_before"
FOREIGN = "it is HDF5, but not a frictionsim result"
# An edit, options, the exit code, and a pattern of what is printed.
CASES: dict[str, tuple[Edit, str, int, str]] = {
    "no tolerances": (nothing, "--rtol 0 --atol 0 --time-atol 0", 0, ""),
    "a value": (FAR, "", 1, r"\nangle at 3 s +different +\S+ +\S+ +rad +0\.01 "),
    "within a wider rtol": (FAR, "--rtol 1e-3", 0, ""),
    "within a wider atol": (FAR, "--atol 0.1", 0, ""),
    "left out": (FAR, "--ignore angle", 0, ""),
    "two patterns": (FAR, "--ignore angular_* --ignore angle", 0, ""),
    "events left out": (FAR, "--ignore events", 1, ""),
    "not a number": (put("angle", 100, np.nan), "--atol 1e300", 1, r"\nangle "),
    "infinity": (put("angle", 100, np.inf), "--atol 1e300", 1, r"\nangle "),
    "a channel renamed": (renamed, "", 1, "\nenergy_damping: missing in the result"),
    "a channel more": (renamed, "", 1, "\nenergy_lost: missing in the golden file"),
    "renamed but left out": (renamed, "--ignore energy_*", 0, ""),
    "in another unit": (attribute("angle", units="deg"), "", 1, "unit deg, expected rad"),
    "another status": (attribute(status="failed"), "", 1, r"\nstatus.*'failed', expected 'done'"),
    "an event a little later": (add("events/time", 0, 0.9 * TIME_ATOL), "", 0, ""),
    "an event a little earlier": (add("events/time", 0, -0.9 * TIME_ATOL), "", 0, ""),
    "an event too late": (add("events/time", 0, 1.1 * TIME_ATOL), "", 1, r"\nevents "),
    "an event late within": (add("events/time", 0, 1e-3), "--time-atol 2e-3", 0, ""),
    "an event at no time": (put("events/time", 0, np.nan), "", 1, r"\nevents "),
    "to another mode": (
        put("events/mode_to", 0, -1.0), "", 1,
        r"\nevents: shaft: stick to sliding_backward at 0.\d+ s, expected shaft: stick to sliding_",
    ),
    "no events": (without_events, "", 1, "0 events, expected 1"),
    "no events, left out": (without_events, "--ignore events", 0, ""),
    "a side": (add(BEFORE, 0, 0.1), "", 1, r"\nevents/friction_torque "),
    "a side named": (add(BEFORE, 0, 0.1), "--ignore events/friction_torque", 0, ""),
    "a side left out": (add(BEFORE, 0, 0.1), "--ignore friction*", 0, ""),
    "a side missing": (without("events/friction_torque_after"), "", 0, "the files agree"),
    "another kind": (attribute(kind="belt_drive"), "", 2, "is of kind 'belt_drive', "),
    "other times": (add("time", 100, 1e-3), "", 2, r"at different times \(302 and 302 samples\)"),
    "a truncated channel": (cut, "", 2, FOREIGN),
}  # fmt: skip


@pytest.mark.parametrize(("edit", "options", "code", "told"), CASES.values(), ids=CASES)
def test_a_difference_beyond_the_tolerances_is_found(
    edit: Edit, options: str, code: int, told: str, compare: Compare
) -> None:
    exit_code, table = compare(edit, *options.split())
    assert exit_code == code
    assert re.search(told, table)
    assert code != 1 or rows(table)[0][1] != "ok"  # differences stand first
    assert code != 2 or table.startswith("frictionsim: ")


def test_equal_files_agree_in_every_channel_and_in_the_events(
    compare: Compare, golden: Path
) -> None:
    code, printed = compare(nothing, "--json")
    assert code == 0
    lines = json.loads(printed)["rows"]
    record = fs.open(golden).record
    channels = record.channels.keys() - {"time"}
    quantities = {f"quantities/{name}" for name in record.quantities}
    beside = {f"events/{name}" for name in channels - OF_EVENTS if not name.startswith("energy_")}
    assert {row["channel"] for row in lines} == channels | beside | quantities | {"events"}
    assert all((row["difference"], row["ok"]) == (0.0, True) for row in lines)
    # In the order of the file, which is the same in each process.
    sides = [row["channel"] for row in lines if row["channel"] in beside]
    assert sides == [f"events/{name}" for name in record.channels if f"events/{name}" in beside]
    _, table = compare(nothing, "--ignore", "energy_*", "--ignore", "events")
    assert not [row for row in rows(table) if re.match("(quantities/)?energy_|events", row[0])]


@pytest.mark.parametrize(("factor", "code"), [(0.9, 0), (-1.1, 1)])
def test_a_value_may_differ_by_the_tolerances(
    factor: float, code: int, compare: Compare, golden: Path
) -> None:
    allowed = ATOL + RTOL * abs(float(fs.open(golden).record.channels["angle"][-1]))
    assert compare(add("angle", -1, factor * allowed))[0] == code


@pytest.mark.parametrize(("factor", "code"), [(2.0, 1), (0.5, 0)])
def test_the_relative_tolerance_is_of_the_golden_value(
    factor: float, code: int, compare: Compare, golden: Path
) -> None:
    change = (factor - 1.0) * float(fs.open(golden).record.channels["angle"][-1])
    assert compare(add("angle", -1, change), "--rtol", "0.7")[0] == code


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_non_finite_values_equal_themselves_alone(
    value: float, compare: Compare, golden: Path, tmp_path: Path
) -> None:
    code, printed = compare(put("angle", 100, value), "--json")
    document, path = strict_json(printed), tmp_path / "result.h5"
    assert (code, document["same"]) == (1, False)
    assert (document["result"], document["golden"]) == (str(path), str(golden))
    assert [row["difference"] for row in document["rows"] if not row["ok"]] == [None]
    assert not fs.compare(golden, path).same
    assert fs.compare(path, path).same


def test_a_sample_beside_an_event_may_be_on_the_other_side_of_the_jump(
    compare: Compare, golden: Path
) -> None:
    content = fs.open(golden).record
    (event,) = content.events["time"]
    after = int(np.searchsorted(content.channels["time"], event, side="right"))
    distance = float(content.channels["time"][after] - event)
    assert TIME_ATOL < distance < INTERVAL
    jump = add("friction_torque", after, 10.0)
    wide = ["--time-atol", str(1.01 * distance)]
    assert compare(jump)[0] == 1
    assert compare(jump, "--time-atol", str(0.99 * distance))[0] == 1
    assert compare(jump, *wide)[0] == 0
    # The next sample is further away than this tolerance.
    assert compare(add("friction_torque", after + 1, 10.0), *wide)[0] == 1


NO_TOML = "note: the two files differ in their scenario, of which one is not valid TOML"


@pytest.mark.parametrize(
    ("key", "value", "note"),
    [
        ("mechanism.load", 2224.2, "mechanism.load: 2224.2, expected 2224.1"),
        ("drive.force", {"time": [x / 7 for x in range(40)], "value": [1e3] * 40},
         "drive.force.time: [0.0, 0.14285714285714285, ... 40 in all], expected [0.0, 0.8]"),
        ("effects.viscous_damping", None,
         "effects.viscous_damping.coefficient: none, expected 1.355"),
        ("title", "x" * 70, f'title: "{"x" * 58}…, expected "Pulley on a dry shaft"'),
    ],
)  # fmt: skip
def test_each_key_that_differs_is_noted_with_both_values(
    key: str, value: Any, note: str, compare: Compare
) -> None:
    other = fs.load(pulley(), {key: value}).to_toml()
    code, table = compare(attribute(scenario=other))
    assert (code, notes(table)[:1]) == (0, [f"note: {note}"])


def test_other_differences_of_origin_are_noted(compare: Compare) -> None:
    code, table = compare(attribute(scenario="another"))
    assert (code, notes(table)) == (0, [NO_TOML])
    code, table = compare(attribute(frictionsim_version="0.0.1"))
    assert code == 0
    assert f"note: frictionsim_version: '0.0.1', expected '{fs.__version__}'\n" in table
    more = "".join(f"\nextra_{i} = {i}" for i in range(25))
    _, table = compare(lambda file: attribute(scenario=file.attrs["scenario"] + more)(file))
    assert len(notes(table)) == 21
    assert notes(table)[-1] == "note: 5 more keys differ"


@pytest.mark.parametrize(
    ("change", "code", "told"),
    [
        ({"solver__max_steps": 20}, 1, "'failed', expected 'done'"),
        ({"output__interval": 0.02}, 2, "(output.interval: 0.02, expected 0.01)\n"),
        ({"solver__duration": 2.0}, 2, "(solver.duration: 2.0, expected 3.0)\n"),
        # Samples at events may differ in time or be missing.
        ({"output__at_events": False}, 0, ""),
        ({"solver__backend": "rkf45"}, 0, ""),
    ],
)
def test_runs_of_other_scenarios_agree_where_they_can_be_compared(
    change: Any, code: int, told: str, golden: Path, tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    path = tmp_path / "other.h5"
    path = fs.Result(simulate(pulley(**change))).save(path)
    options = ["--ignore", "lever_arm"]  # see `golden`
    assert fs.run_command_line(["compare", str(path), str(golden), *options]) == code
    captured = capsys.readouterr()
    assert told in captured.out + captured.err
    assert code != 2 or "run both with the same solver.duration and output." in captured.err
    if code == 0:
        assert fs.run_command_line(["compare", str(golden), str(path), *options]) == 0
        assert captured.err == ""


@pytest.mark.parametrize(("factor", "code"), [(0.9, 0), (1.1, 1)])
def test_a_side_of_an_event_may_differ_by_its_change_within_time_atol(
    factor: float, code: int, compare: Compare
) -> None:
    # Where it sticks, the friction rises by 81 N m/s: 81e-6 N m in 1e-6 s, and 25e-6 are allowed.
    rise = (3113.75 - 1832.6) / 0.8 * 0.0508 * TIME_ATOL
    allowed = ATOL + RTOL * 24.567 + rise
    assert compare(add(BEFORE, 0, factor * allowed))[0] == code


def test_a_comparison_is_shown_by_its_verdict(golden: Path) -> None:
    loads = (golden, fs.solve(pulley(mechanism__load=2000.0)))
    for other, verdict in zip(loads, ("the files agree", r"\d+ of \d+ differ"), strict=True):
        assert re.fullmatch(f"<frictionsim.Comparison: {verdict}>", repr(fs.compare(other, golden)))
