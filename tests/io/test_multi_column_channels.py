"""Channels with columns (bodies, pulleys): written, read, compared and drawn."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

import frictionsim as fs
from frictionsim.errors import InputError
from frictionsim.results import Channel, Check, Quantity, Record, SolverStatistics, Transition
from tests.support.scenarios import made_record, pulley

SAMPLES, BODIES = 3000, 40
CHANNELS = {
    "belt_speed": Channel("m/s", "speed of the belt"),
    "speed": Channel("rad/s", "angular velocity of the pulleys", "pulley"),
    "tension": Channel("N", "tension of the belt at its bodies", "body"),
}


def run_of(samples: int) -> Record:
    """Return a synthetic run with channels over bodies and pulleys."""
    time = np.linspace(0.0, 3.0, samples)
    bodies = np.arange(BODIES)
    channels = {
        "time": time,
        "belt_speed": 2.0 * time,
        "speed": np.column_stack([time, 0.5 * time]),
        "tension": 100.0 + np.sin(np.outer(time, bodies)),
    }
    members = {"pulley": ("driver", "driven"), "body": tuple(map(str, bodies))}
    transitions = [Transition(1.5, "driver", 0, 1)]
    scenario = fs.load(pulley()).to_toml()
    return made_record(scenario, CHANNELS, members, channels, transitions)._replace(
        quantities={"final_time": Quantity(3.0, "s")},
        checks={"energy_balance": Check(0.0, 1e-7)},
        statistics=SolverStatistics(100, 0, 100, 2 * BODIES, 0.1),
    )


@pytest.fixture
def run() -> Record:
    return run_of(SAMPLES)


@pytest.fixture
def path(run: Record, tmp_path: Path) -> Path:
    return fs.Result(run).save(tmp_path / "a.h5")


def test_a_run_without_samples_is_read_as_it_was(tmp_path: Path) -> None:
    run = run_of(0)
    content = fs.open(fs.Result(run).save(tmp_path / "a.h5")).record
    assert content.channels.keys() == run.channels.keys()
    for name, channel in run.channels.items():
        np.testing.assert_array_equal(content.channels[name], channel, err_msg=name)
    assert content.axes == {"time": "", **{name: info.axis for name, info in CHANNELS.items()}}
    assert content.members == run.members
    assert content.events.keys() == {"time", "contact", "mode_from", "mode_to"}


def too_few_rows(file: Any) -> None:
    scales = file["time"], file["pulley"]
    del file["speed"]
    file["speed"] = np.zeros((2, 2))
    for dimension, scale in zip(file["speed"].dims, scales, strict=True):
        dimension.attach_scale(scale)


def name_too_many(file: Any) -> None:
    scale = file["pulley"]
    file["speed"].dims[1].detach_scale(scale)
    del file["pulley"]
    file.create_dataset("pulley", data=["driver", "driven", "idler"], dtype=h5py.string_dtype())
    file["pulley"].make_scale("pulley")
    file["speed"].dims[1].attach_scale(file["pulley"])


@pytest.mark.parametrize("damage", [too_few_rows, name_too_many])
def test_columns_without_a_matching_axis_are_refused(
    damage: Callable[[Any], None], path: Path
) -> None:
    with h5py.File(path, "r+") as file:
        damage(file)
    with pytest.raises(InputError, match="it is HDF5, but not a frictionsim result"):
        fs.open(path)


def compared(run: Record, path: Path, channel: str, **changes: Any) -> Any:
    """Return the row of a channel of the comparison of a changed run with the file."""
    other = path.with_name("other.h5")
    fs.Result(run._replace(**changes)).save(other)
    rows = fs.compare(other, path).rows
    assert [row.name for row in rows if not row.ok] in ([], [channel])
    return next(row for row in rows if row.name == channel)


@pytest.mark.parametrize(
    ("channel", "member", "note"), [("tension", 17, "body 17"), ("speed", 1, "pulley driven")]
)
def test_compare_names_the_member_of_the_largest_difference(
    channel: str, member: int, note: str, run: Record, path: Path
) -> None:
    assert compared(run, path, channel).ok
    values = run.channels[channel].copy()
    values[1000, member] += 0.5
    row = compared(run, path, channel, channels=run.channels | {channel: values})
    assert (row.ok, row.time, row.note) == (False, run.time[1000], note)
    assert row.difference == pytest.approx(0.5)


def test_different_members_of_an_axis_differ(run: Record, path: Path) -> None:
    for names in (("driver", "idler"), ("0", "1")):
        row = compared(run, path, "speed", members=run.members | {"pulley": names})
        assert row.note == (
            f"2 columns along pulley: {', '.join(names)}, expected 2 columns along pulley: driver,"
            " driven"
        )
    flat = run.channels | {"tension": run.time}
    row = compared(run, path, "tension", channels=flat, axes=run.axes | {"tension": ""})
    assert (row.ok, row.difference) == (False, None)
