"""The quantities of two results, as `compare` judges them: of all kinds, by the scale of each."""

import json
import shutil
import subprocess
from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import h5py
import numpy as np
import pytest

import frictionsim as fs
from tests.support.scenarios import SCENARIOS

Cli = Callable[..., "subprocess.CompletedProcess[str]"]

RTOL, ATOL, TIME_ATOL = 1e-6, 1e-9, 1e-6  # the defaults
# With few samples, which is quicker.
RUNS: dict[str, tuple[str, dict[str, Any]]] = {
    "pulley": ("pulley", {}),
    "lift": ("lift", {"output.interval": 0.1, "solver.rtol": 1e-5}),
    "gear": ("epicyclic", {"output.interval": 0.05}),
    "belt": (
        "belt_drive",
        {
            "solver.backend": "moreau",
            "mechanism.belt.bodies": 40,
            "solver.duration": 0.002,
            "output.interval": 0.0005,
        },
    ),
}


@cache
def golden(name: str) -> Path:
    """The file of a run, made once."""
    scenario, changes = RUNS[name]
    path = Path(mkdtemp()) / f"{name}.h5"
    fs.solve(SCENARIOS / f"{scenario}.toml", changes, output=path)
    return path


@cache
def opened(name: str) -> fs.Result:
    return fs.open(golden(name))


def edited(path: Path, copy: Path, **values: float | None) -> Path:
    """Copy a result and set quantities of it; None removes one, nan leaves it undefined."""
    shutil.copy(path, copy)
    with h5py.File(copy, "r+") as file:  # h5py drops the checksum
        for name, value in values.items():
            if value is None:
                del file[f"quantities/{name}"]
            else:
                file[f"quantities/{name}"][()] = value
    return copy


def value_of(path: Path, name: str) -> float:
    return float(fs.open(path).quantities[name])


def differing(comparison: fs.Comparison) -> list[str]:
    return [row.name for row in comparison.rows if not row.ok]


def largest(*channels: str) -> Callable[[fs.Result], float]:
    """Return a function of a result: the largest value of some channels."""
    return lambda result: max(float(abs(result.dataset[name]).max()) for name in channels)


def energies(result: fs.Result) -> float:
    """Return the largest energy of a run, from its start to its end."""
    of_channels = [float(abs(c).max()) for c in result.dataset.values() if c.units == "J"]
    return max(*of_channels, *(abs(float(q)) for q in result.quantities.values() if q.unit == "J"))


# Of each run: quantities, and by hand what their relative tolerance is relative to; None: a time.
SCALES: dict[str, dict[str, Callable[[fs.Result], float] | float | None]] = {
    "pulley": {
        "force_to_lift": largest("drive_force", "shaft_reaction"),
        "final_angle": largest("angle"),
        "breakaway_time": None,
        "energy_friction": energies,
        "initial_energy": energies,
    },
    "lift": {
        "torque_to_lift": largest("drive_torque", "friction_torque"),
        "rope_tension_car_min": largest("rope_tension_car"),
        "final_angular_velocity": largest("angular_velocity"),
        "tension_ratio_at_rest": lambda r: float(r.quantities["tension_ratio_at_rest"]),
        "cord_slip_time": None,
        "energy_kinetic": energies,
    },
    "gear": {
        "uniform_torque_mean": largest("uniform_torque"),
        "tracer_cusps": lambda r: float(r.quantities["tracer_cusps"]),
        "tracer_dwell_time": None,
        "energy_potential": energies,
    },
    "belt": {
        "efficiency": 1.0,
        "stick_fraction": 1.0,
        "slip_percent": 100.0,
        "tension_driver_to_driven": largest("tension"),
        "driven_speed": largest("pulley_speed"),
        "energy_friction": energies,
    },
}


@pytest.mark.parametrize(
    ("run", "tolerances"),
    [*((run, (RTOL, ATOL, TIME_ATOL)) for run in RUNS), ("pulley", (3e-3, 0.0, 1e-3))],
)
def test_a_quantity_may_differ_by_its_own_scale_times_rtol(
    run: str, tolerances: tuple[float, float, float], tmp_path: Path
) -> None:
    (rtol, atol, time_atol), expected = tolerances, opened(run)
    allowed = {
        name: time_atol
        if scale is None
        else atol + rtol * (scale if isinstance(scale, float) else scale(expected))
        for name, scale in SCALES[run].items()
        if expected.quantities[name].value is not None  # as the slip of a belt at rest
    }
    for part, sign in ((0.9, 1.0), (1.1, -1.0)):
        values = {n: value_of(golden(run), n) + sign * part * a for n, a in allowed.items()}
        copy = edited(golden(run), tmp_path / "a.h5", **values)
        comparison = fs.compare(copy, expected, rtol=rtol, atol=atol, time_atol=time_atol)
        rows = {row.name: row for row in comparison.rows}
        beyond = {name for name, row in rows.items() if not row.ok}
        assert beyond == (set() if part < 1.0 else {f"quantities/{name}" for name in allowed})
        for name, size in allowed.items():
            row = rows[f"quantities/{name}"]
            assert row.allowed == pytest.approx(size, rel=1e-9)  # sums of two floats
            assert (row.expected, row.unit) == expected.quantities[name]


@pytest.mark.parametrize("run", RUNS)
def test_every_quantity_is_compared(run: str, tmp_path: Path) -> None:
    quantities = opened(run).quantities
    assert fs.compare(golden(run), opened(run)).same
    others = {  # beyond 1e-6 of any scale
        name: 7.0 if quantity.value is None else 1.001 * quantity.value + 2.0
        for name, quantity in quantities.items()
    }
    copy = edited(golden(run), tmp_path / "a.h5", **others)
    assert set(differing(fs.compare(copy, opened(run)))) == {f"quantities/{n}" for n in others}


@pytest.mark.parametrize(
    ("scenario", "rest", "key", "pair", "quantities"),
    [
        # At rest the channels do not show the static coefficient.
        ("pulley", {"drive.force": 2224.0}, "effects.shaft_friction.mu_s", (0.3, 0.2),
         {"force_to_lift", "force_to_hold"}),
        ("lift", {"drive.torque": -600.0}, "effects.cord_friction.mu_s", (0.2, 0.127),
         {"tension_ratio_allowed", "traction_margin"}),
    ],
)  # fmt: skip
def test_runs_at_rest_of_other_friction_differ_in_their_limits(
    scenario: str, rest: dict[str, Any], key: str, pair: tuple[float, float], quantities: set[str]
) -> None:
    path = SCENARIOS / f"{scenario}.toml"
    near = {"output.interval": 0.1, **rest}
    results = [fs.solve(path, {**near, key: value}) for value in pair]
    comparison = fs.compare(*results)
    rows = [row for row in comparison.rows if not row.ok]
    assert {row.name for row in rows} >= {f"quantities/{name}" for name in quantities}
    assert all(row.name.startswith("quantities/") for row in rows)
    for row in rows:
        name = row.name.removeprefix("quantities/")
        assert [(row.value, row.unit), (row.expected, row.unit)] == [
            result.quantities[name] for result in results
        ]


def test_the_command_prints_both_values_with_unit_and_tolerance(cli: Cli) -> None:
    pulley = ["solve", SCENARIOS / "pulley.toml", "-q", "--set", "drive.force=2224.0"]
    cli(*pulley, "-o", "a.h5")
    cli(*pulley, "-o", "b.h5", "--set", "effects.shaft_friction.mu_s=0.3")
    done = cli("compare", "b.h5", "a.h5")
    assert done.returncode == 1
    # By hand: 2224.1 (0.0508 + r)/(0.0508 - r), r = 0.0254 sin(atan(mu_s)); 1e-6 of the largest
    # force of the run, the 4448.1 N on the shaft.
    heading, worst, second, *_ = done.stdout.splitlines()
    assert heading.split() == [
        *("channel", "or", "quantity", "value", "expected", "unit", "off", "by", "allowed")
    ]
    assert worst.split() == [
        *("quantities/force_to_lift", "different", "2970.42", "2707.7", "N", "263", "0.00445")
    ]
    assert second.split()[0] == "quantities/force_to_hold"
    assert done.stdout.endswith("differ\n")
    assert max(map(len, done.stdout.splitlines())) <= 100


def test_values_that_differ_are_not_printed_alike(cli: Cli) -> None:
    source = golden("pulley")
    angle = value_of(source, "final_angle")
    edited(source, Path("b.h5"), final_angle=angle * (1.0 + 3e-12))
    told = cli("compare", "b.h5", source, "--rtol", "1e-14", "--atol", "0")
    assert told.returncode == 1
    name, _, value, expected, *_ = told.stdout.splitlines()[1].split()
    assert name == "quantities/final_angle"
    assert float(expected) == pytest.approx(angle, rel=1e-13)  # digits of a hundredth of it
    assert float(value) - float(expected) == pytest.approx(3e-12 * angle, rel=0.1)


def test_json_has_values_units_and_tolerances_of_all_rows(cli: Cli) -> None:
    source = golden("lift")
    torque = value_of(source, "torque_to_lift")
    edited(source, Path("b.h5"), torque_to_lift=torque + 2.0)
    with h5py.File("b.h5", "r+") as file:
        file["angle"][50] += 0.25
        time = float(file["time"][50])
    done = cli("compare", "b.h5", source, "--json")
    document = json.loads(done.stdout)
    assert (done.returncode, document["same"]) == (1, False)
    worst, angle, *others = document["rows"]
    assert worst == {
        "channel": "quantities/torque_to_lift", "value": torque + 2.0, "expected": torque,
        "unit": "N m", "difference": pytest.approx(2.0), "allowed": pytest.approx(1150e-6),
        "time": None, "ok": False, "note": "",
    }  # fmt: skip
    assert (angle["channel"], angle["time"], angle["unit"]) == ("angle", time, "rad")
    assert angle["value"] - angle["expected"] == pytest.approx(0.25)
    assert all(row["ok"] and None not in (row["value"], row["expected"]) for row in others)
    units = {row["channel"]: row["unit"] for row in others}
    names = ("events", "events/angular_acceleration", "quantities/car_travel", "mode")
    assert [units[name] for name in names] == ["s", "rad/s^2", "m", "1"]


def test_what_differs_stands_first_quantities_before_channels(tmp_path: Path) -> None:
    source = golden("pulley")
    copy = edited(
        source, tmp_path / "b.h5",
        final_angle=value_of(source, "final_angle") + 1e-3,  # some 30 times what is allowed
        breakaway_time=value_of(source, "breakaway_time") + 0.5,
    )  # fmt: skip
    with h5py.File(copy, "r+") as file:
        file["angle"][10] += 10.0
        file["angular_velocity"][10] += 1e-3
    comparison = fs.compare(copy, source)
    assert differing(comparison) == [
        *("quantities/breakaway_time", "quantities/final_angle"),
        *("angle", "angular_velocity"),
    ]
    assert [row.ok for row in comparison.rows[:5]] == [False] * 4 + [True]
    agreeing = [row.name.startswith("quantities/") for row in comparison.rows[4:]]
    assert agreeing == sorted(agreeing, reverse=True)


@pytest.mark.parametrize(
    ("ignore", "left"),
    [
        ("energy_input", set()),  # the channel and the quantity
        ("quantities/energy_*", {"energy_input"}),
        ("final_angle", {"energy_input", "quantities/energy_input"}),
    ],
)
def test_a_bare_name_is_that_of_a_channel_and_a_quantity(
    ignore: str, left: set[str], tmp_path: Path
) -> None:
    source = golden("pulley")
    copy = edited(source, tmp_path / "b.h5", energy_input=7e5)
    with h5py.File(copy, "r+") as file:
        file["energy_input"][1] = 7e5
    comparison = fs.compare(copy, source, ignore=ignore)
    assert set(differing(comparison)) == left
    assert not {row.name for row in comparison.rows} & {ignore, f"quantities/{ignore}"}


def test_a_quantity_that_one_of_two_finished_runs_lacks_is_a_difference(tmp_path: Path) -> None:
    source, row = golden("pulley"), "quantities/force_to_lift"
    copy = edited(source, tmp_path / "b.h5", force_to_lift=None)
    for pair, where in (((copy, source), "the result"), ((source, copy), "the golden file")):
        assert [(r.name, r.note) for r in fs.compare(*pair).rows if not r.ok] == [
            (row, f"missing in {where}")
        ]
    with h5py.File(edited(source, copy), "r+") as file:
        file[row].attrs["units"] = "lbf"
    (other,) = (r for r in fs.compare(copy, source).rows if not r.ok)
    assert (other.name, other.note) == (row, "unit lbf, expected N")


def test_none_equals_none_and_no_number(tmp_path: Path) -> None:
    source, name = golden("pulley"), "last_rest_time"
    nowhere = edited(source, tmp_path / "a.h5", **{name: np.nan})
    somewhere = edited(source, tmp_path / "b.h5", **{name: 1.0})
    # No tolerance makes a number of none.
    for tolerances in ({"rtol": 0.0, "atol": 0.0}, {"rtol": 1e3, "time_atol": 1e3}):
        assert fs.compare(nowhere, nowhere, **tolerances).same
        for pair in ((nowhere, somewhere), (somewhere, nowhere)):
            comparison = fs.compare(*pair, **tolerances)
            assert differing(comparison) == [f"quantities/{name}"]
            assert {comparison.rows[0].value, comparison.rows[0].expected} == {None, 1.0}


@pytest.mark.parametrize("run", ["pulley", "belt"])
def test_roundoff_of_energies_and_of_what_is_at_rest_is_no_difference(
    run: str, tmp_path: Path
) -> None:
    source = golden(run)
    result = fs.open(source)
    # Rounding of the largest energy and of the largest value of each channel; 3e-16 J of a belt's
    # 4 J are 3e-16 of a friction energy of 3e-16 J. Without atol, so that the scale alone counts.
    noise = {
        name: float(quantity) + 1e-13 * energies(result)
        for name, quantity in result.quantities.items()
        if quantity.unit == "J"
    }
    for name, channel in (("final_angular_velocity", "angular_velocity"), ("final_angle", "angle")):
        if name in result.quantities:
            noise[name] = float(result.quantities[name]) + 1e-13 * largest(channel)(result)
    assert fs.compare(edited(source, tmp_path / "b.h5", **noise), source, atol=0.0).same


def test_the_scale_of_an_arc_is_at_most_a_turn(tmp_path: Path) -> None:
    turned = edited(golden("belt"), tmp_path / "golden.h5")
    with h5py.File(turned, "r+") as file:
        file["pulley_angle"][:] += 1e5  # as after a long run
    arc = value_of(turned, "contact_arc_driver")
    for part, same in ((0.9, True), (1.1, False)):
        other = arc + part * (ATOL + RTOL * 2.0 * np.pi)
        copy = edited(turned, tmp_path / "b.h5", contact_arc_driver=other)
        assert fs.compare(copy, turned).same is same


@pytest.mark.parametrize(
    ("channel", "member", "note"),
    [("tension", 17, "joint 17"), ("pulley_speed", 1, "pulley driven")],
)
def test_the_member_of_the_largest_difference_is_named(
    channel: str, member: int, note: str, tmp_path: Path
) -> None:
    copy = edited(golden("belt"), tmp_path / "b.h5")
    with h5py.File(copy, "r+") as file:
        file[channel][2, member] += 0.5
        file[channel][3, 0] += 0.4
        time = file["time"][2]
    (row,) = (row for row in fs.compare(copy, golden("belt")).rows if not row.ok)
    assert (row.name, row.time, row.note) == (channel, time, note)
    assert row.difference == pytest.approx(0.5)


def test_different_members_of_an_axis_differ(tmp_path: Path) -> None:
    record = opened("belt").record

    def notes(**changes: Any) -> dict[str, str]:
        copy = fs.Result(record._replace(**changes)).save(tmp_path / "b.h5")
        return {row.name: row.note for row in fs.compare(copy, golden("belt")).rows if not row.ok}

    for names in (("driver", "idler"), ("0", "1")):
        said = notes(members=record.members | {"pulley": names})
        assert said == dict.fromkeys(
            (name for name, axis in record.axes.items() if axis == "pulley"),
            f"2 columns along pulley: {', '.join(names)}, expected 2 columns along pulley: driver,"
            " driven",
        )
    flat = {**record.channels, "tension": record.time}
    assert list(notes(channels=flat, axes=record.axes | {"tension": ""})) == ["tension"]


def test_quantities_of_runs_that_end_at_other_times_are_not_compared(tmp_path: Path) -> None:
    early, late = (
        fs.solve("pulley", output=tmp_path / f"{n}.h5", max_steps=n).path for n in (20, 60)
    )
    assert early is not None
    assert late is not None
    ends = [float(fs.open(path).dataset["time"][-1]) for path in (early, late)]
    said = f"quantities are not compared: ended at {ends[0]:.9g} s, expected "
    for other, status, end in (
        (golden("pulley"), "'failed', expected 'done'", 3.0),
        (late, "both 'failed'", ends[1]),
    ):
        comparison = fs.compare(early, other)
        assert comparison.rows[0].name == "status"
        assert comparison.rows[0].note == f"{status}; {said}{end:.9g} s"
        assert not [row for row in comparison.rows if row.name.startswith("quantities/")]
    # Two that ended at the same time are compared, whatever their status.
    final_angle = value_of(early, "final_angle")
    assert fs.compare(early, early).same
    other = edited(early, tmp_path / "c.h5", final_angle=final_angle + 1.0, breakaway_time=None)
    assert differing(fs.compare(other, early)) == ["quantities/final_angle"]
    with h5py.File(other, "r+") as file:
        file.attrs["status"] = "done"
    assert differing(fs.compare(other, early)) == ["status", "quantities/final_angle"]
