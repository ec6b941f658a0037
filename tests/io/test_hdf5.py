"""Result files: content, compatibility with xarray, atomic writing, refusal of damaged files."""

import errno
import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray

from frictionsim import __version__
from frictionsim.cli.commands import run_command_line
from frictionsim.errors import InputError, OutputError
from frictionsim.io import hdf5_reader, hdf5_writer, result_format
from frictionsim.scenario.loading import load, resolved_toml
from frictionsim.simulation.simulate import RunResult
from tests.support.scenarios import SCENARIOS, pulley, simulate

pytestmark = pytest.mark.quick

CHANNELS = ["angle", "angular_velocity", "angular_acceleration", "drive_force"]
CHANNELS += ["friction_torque", "shaft_reaction", "mode"]
ENERGIES = ["input", "kinetic", "potential", "friction", "damping"]
SINE = {"sine": {"mean": 2224.1, "amplitude": 1000.0, "frequency_hz": 1.0}}


@pytest.fixture(scope="module")
def done() -> RunResult:
    """A run with several breakaways and stops."""
    return simulate(pulley(drive__force=SINE))


@pytest.fixture(scope="module")
def result(done: RunResult, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file of that run; not to be changed."""
    path = tmp_path_factory.mktemp("result") / "pulley.h5"
    hdf5_writer.write(done, path)
    return path


def datasets(file: Any) -> dict[str, Any]:
    """Return every dataset of a file by its path."""
    found = {}
    file.visititems(
        lambda name, item: found.update(
            {f"/{name}": item} if isinstance(item, h5py.Dataset) else {}
        )
    )
    return found


def test_root_attributes_describe_the_run(done: RunResult, result: Path) -> None:
    with h5py.File(result) as file:
        attributes = dict(file.attrs)
    assert attributes == {
        "format_version": result_format.FORMAT_VERSION,
        "frictionsim_version": __version__,
        "scenario": resolved_toml(done.scenario),
        "kind": "pulley",
        "backend": "events",
        "title": "Pulley on a dry shaft",
        "status": "done",
        "reason": "",
        "failure": "",
        "warnings": "",
    }


def test_the_documented_layout_matches_a_new_file(result: Path) -> None:
    layout = hdf5_writer.__doc__ or ""
    root = layout.partition("attributes ")[2].partition("    /time")[0]
    names = re.sub(r"\([^)]*\)", "", root).split(",")
    documented = set(re.findall(r"/[a-z_/<>]*[a-z>]", layout))
    with h5py.File(result) as file:
        assert set(file.attrs) == {name.strip() for name in names}
        found = set(datasets(file))
    channels = {f"/{name}" for name in CHANNELS}
    energies = {f"/energy_{name}" for name in ENERGIES}
    literal = {name for name in documented if "<" not in name}
    sides = {"/events/<channel>_before", "/events/<channel>_after"}
    assert documented - literal == {"/<channel>", "/energy_<name>", "/<axis>"} | sides
    jumping = channels - {"/angle", "/mode"}
    beside = {f"/events{name}_{side}" for name in jumping for side in ("before", "after")}
    assert found == (literal - {"/checkpoint"}) | channels | energies | beside


def test_every_dataset_is_float64_with_a_unit_and_a_long_name(result: Path) -> None:
    with h5py.File(result) as file:
        for name, dataset in datasets(file).items():
            assert dataset.dtype == np.float64, name
            assert dataset.attrs["units"], name
            assert dataset.attrs["long_name"], name


def test_time_is_the_dimension_scale_of_every_channel_in_its_group(result: Path) -> None:
    with h5py.File(result) as file:
        for name, dataset in datasets(file).items():
            time = dataset.parent["time"]
            if dataset == time:
                assert time.is_scale
            else:
                assert dataset.shape == time.shape, name
                assert dataset.dims[0]["time"] == time, name


def test_channels_are_those_of_the_run(done: RunResult, result: Path) -> None:
    found = hdf5_reader.read(result)
    expected = {"time": done.time, **done.channels}
    assert found.channels.keys() == expected.keys()
    for name, values in expected.items():
        np.testing.assert_array_equal(found.channels[name], values, err_msg=name)
        assert name == "time" or found.units[name] == done.channel_info[name].unit


def test_events_are_the_transitions_of_the_run(done: RunResult, result: Path) -> None:
    found = hdf5_reader.read(result)
    events = zip(
        found.events["time"],
        [found.contacts[int(index)] for index in found.events["contact"]],
        found.events["mode_from"],
        found.events["mode_to"],
        found.events["angle"],
        strict=True,
    )
    assert len(done.transitions) > 2
    assert list(events) == [tuple(transition) for transition in done.transitions]


@pytest.mark.parametrize(
    ("effect", "channels"),
    [
        ("shaft_friction", {"friction_torque", "mode", "energy_friction"}),
        ("viscous_damping", {"energy_damping"}),
    ],
)
def test_an_effect_that_is_off_has_no_channel(
    effect: str, channels: set[str], result: Path, tmp_path: Path
) -> None:
    scenario = pulley(drive__force=SINE, **{f"effects__{effect}": None})
    hdf5_writer.write(simulate(scenario), tmp_path / "without.h5")
    without = hdf5_reader.read(tmp_path / "without.h5").channels.keys()
    assert hdf5_reader.read(result).channels.keys() - without == channels


@pytest.mark.parametrize("force", [SINE, 2224.1], ids=["with events", "without an event"])
def test_xarray_opens_a_result_file(force: Any, tmp_path: Path) -> None:
    done = simulate(pulley(drive__force=force))
    path = tmp_path / "a.h5"
    hdf5_writer.write(done, path)
    with xarray.open_dataset(path, engine="h5netcdf") as root:
        assert root["angle"].dims == ("time",)
        assert root["angle"].attrs["units"] == "rad"
        np.testing.assert_array_equal(root["time"], done.time)
        np.testing.assert_array_equal(root["angle"], done.channels["angle"])
    with xarray.open_dataset(path, engine="h5netcdf", group="events") as events:
        assert events["mode_to"].dims == ("time",)
        times = [transition.time for transition in done.transitions]
        np.testing.assert_array_equal(events["time"], times)


def test_two_runs_of_one_scenario_give_identical_bytes(
    tmp_path: Path, cli: Callable[..., Any]
) -> None:
    path = SCENARIOS / "pulley.toml"
    for name in ("one.h5", "two.h5"):
        assert run_command_line(["solve", str(path), "-o", str(tmp_path / name), "--quiet"]) == 0
    assert cli("solve", path, "-o", "other_process.h5", "--quiet").returncode == 0
    one, two, other = sorted(tmp_path.glob("*.h5"))
    assert one.read_bytes() == two.read_bytes() == other.read_bytes()


def test_a_long_scenario_is_stored_completely(tmp_path: Path) -> None:
    times = [0.001 * i for i in range(20_000)]
    channel = {"time": times, "value": [1800.0 + t for t in times]}
    done = simulate(pulley(drive__force=channel))
    hdf5_writer.write(done, tmp_path / "a.h5")
    text = hdf5_reader.read(tmp_path / "a.h5").attributes["scenario"]
    assert len(text) > 200_000
    (tmp_path / "again.toml").write_text(text)
    assert load(tmp_path / "again.toml") == done.scenario


@pytest.mark.parametrize("title", ["Трение, 摩擦 🙂", "[bold]", ""])
def test_titles_are_stored_verbatim(title: str, tmp_path: Path) -> None:
    hdf5_writer.write(simulate(pulley(title=title, solver__duration=0.1)), tmp_path / "a.h5")
    assert hdf5_reader.read(tmp_path / "a.h5").attributes["title"] == title


def not_hdf5(path: Path) -> None:
    path.write_text("time,angle\n0,0\n")


def empty(path: Path) -> None:
    path.write_bytes(b"")


def truncated(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def foreign(path: Path) -> None:
    with h5py.File(path, "w") as file:
        file["time"] = [0.0, 1.0]


def newer(path: Path) -> None:
    with h5py.File(path, "r+") as file:
        file.attrs["format_version"] = result_format.FORMAT_VERSION + 1


def without_events(path: Path) -> None:
    with h5py.File(path, "r+") as file:
        del file["events"]


def without_kind(path: Path) -> None:
    with h5py.File(path, "r+") as file:
        del file.attrs["kind"]


def without_time(path: Path) -> None:
    with h5py.File(path, "r+") as file:
        del file["time"]


def with_text_for_numbers(path: Path) -> None:
    with h5py.File(path, "r+") as file:
        del file["angle"]
        file["angle"] = ["a", "b"]


def missing(path: Path) -> None:
    path.unlink()


def folder(path: Path) -> None:
    path.unlink()
    path.mkdir()


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (not_hdf5, "it is not a readable HDF5 file"),
        (empty, "it is not a readable HDF5 file"),
        (truncated, "it is not a readable HDF5 file"),
        (missing, "there is no such file"),
        (folder, ""),
        (foreign, "it is HDF5, but not a frictionsim result"),
        (newer, "its format version is 2, this program reads version 1"),
        (without_events, "it is HDF5, but not a frictionsim result"),
        (without_kind, "it is HDF5, but not a frictionsim result"),
        (without_time, "it is HDF5, but not a frictionsim result"),
        (with_text_for_numbers, "it is HDF5, but not a frictionsim result"),
    ],
)
def test_reader_refuses_files_that_are_not_results(
    damage: Callable[[Path], None], message: str, result: Path, tmp_path: Path
) -> None:
    path = tmp_path / "a.h5"
    path.write_bytes(result.read_bytes())
    damage(path)
    with pytest.raises(InputError) as refused:
        hdf5_reader.read(path)
    assert str(refused.value).startswith(f"{path}: ")
    assert str(refused.value).endswith(message)


@pytest.mark.parametrize(("place", "name"), [(os, "fsync"), (Path, "replace"), (Path, "open")])
def test_a_failed_write_keeps_the_old_result_and_leaves_no_part(
    place: Any, name: str, done: RunResult, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.h5"
    path.write_bytes(b"the result of yesterday")

    def fail(*arguments: Any) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patched:
        patched.setattr(place, name, fail)
        with pytest.raises(OutputError, match="cannot write the result: No space left on device"):
            hdf5_writer.write(done, path)
    assert path.read_bytes() == b"the result of yesterday"
    assert os.listdir(tmp_path) == ["a.h5"]


def test_symbolic_links_are_followed(done: RunResult, tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    (tmp_path / "there" / "old.h5").write_bytes(b"the result of yesterday")
    link = tmp_path / "link.h5"
    link.symlink_to(Path("there") / "old.h5")
    hdf5_writer.write(done, link)
    assert link.is_symlink()
    assert hdf5_reader.read(tmp_path / "there" / "old.h5").attributes["status"] == "done"
    assert os.listdir(tmp_path / "there") == ["old.h5"]


def test_the_stored_scenario_reproduces_the_result(result: Path, tmp_path: Path) -> None:
    again = tmp_path / "again.toml"
    again.write_text(hdf5_reader.read(result).attributes["scenario"])
    copy = tmp_path / "again.h5"
    assert run_command_line(["solve", str(again), "-o", str(copy), "--quiet"]) == 0
    assert copy.read_bytes() == result.read_bytes()
