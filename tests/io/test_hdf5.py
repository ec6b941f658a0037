"""Result files: content, compatibility with xarray, atomic writing, refusal of damaged files."""

import os
import pickle
import warnings
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray

import frictionsim as fs
from frictionsim.errors import InputError
from frictionsim.results import Record
from tests.io.test_compared_quantities import opened
from tests.support.scenarios import pulley, scenario_run, simulate

SINE = {"sine": {"mean": 2224.1, "amplitude": 1000.0, "frequency_hz": 1.0}}


@pytest.fixture(scope="module")
def done() -> Record:
    """A run with several breakaways and stops."""
    return simulate(pulley(drive__force=SINE))


@pytest.fixture(scope="module")
def result(done: Record, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file of that run; not to be changed."""
    return fs.Result(done).save(tmp_path_factory.mktemp("result") / "pulley.h5")


def datasets(file: Any) -> dict[str, Any]:
    """Return every dataset of a file by its path."""
    arrays = {}
    file.visititems(
        lambda name, item: arrays.update(
            {f"/{name}": item} if isinstance(item, h5py.Dataset) else {}
        )
    )
    return arrays


def test_root_attributes_describe_the_run(done: Record, result: Path) -> None:
    with h5py.File(result) as file:
        attributes = dict(file.attrs)
    assert attributes == {
        "format_version": 2,
        "Conventions": "CF-1.11",
        "frictionsim_version": fs.__version__,
        "scenario": scenario_run(done).to_toml(),
        "source": "",
        "overrides": "",
        "command": "",
        "kind": "pulley",
        "law": "set-valued",
        "backend": "events",
        "effects": "shaft_friction viscous_damping",
        "title": "Pulley on a dry shaft",
        "status": "done",
        "reason": "",
        "failure": "",
        "warnings": "",
    }


def test_numbers_have_types_units_and_meanings(result: Path) -> None:
    integers = {"mode", "contact", "mode_from", "mode_to", "event", "ok", "steps", "rejected"}
    integers |= {"rhs_evaluations", "states", "case", "case_before", "case_after"}
    with h5py.File(result) as file:
        for path, dataset in datasets(file).items():
            name = path.rpartition("/")[2]
            assert dataset.attrs["long_name"], path
            if path == "/audit/check":
                continue
            assert dataset.attrs["units"], path
            kind = dataset.dtype.kind if dataset.dtype != np.float64 else "float64"
            assert kind == ("i" if name in integers else "float64"), path
            if "flag_values" in dataset.attrs:
                assert dataset.attrs["flag_values"].dtype == dataset.dtype
                words = dataset.attrs["flag_meanings"].split()
                assert len(words) == len(dataset.attrs["flag_values"])
                assert set(np.ravel(dataset[...])) <= set(dataset.attrs["flag_values"])


def test_a_quantity_without_a_value_is_nan_and_read_as_none(tmp_path: Path) -> None:
    done = simulate(pulley(drive__force=2224.1))
    assert done.quantities["breakaway_time"].value is None
    path = fs.Result(done).save(tmp_path / "a.h5")
    with h5py.File(path) as file:
        assert np.isnan(file["quantities/breakaway_time"][()])
        assert "events" not in file
    assert fs.open(path).quantities == done.quantities


def test_a_file_holds_what_the_run_and_its_record_hold(done: Record, result: Path) -> None:
    expected, content = done, fs.open(result).record
    attributes = {k: v for k, v in content.attributes.items() if k in expected.attributes}
    assert attributes == expected.attributes
    for name in ("units", "long_names", "axes", "members", "flags", "contacts"):
        assert getattr(content, name) == getattr(expected, name), name
    for part in ("channels", "events"):
        arrays, others = getattr(content, part), getattr(expected, part)
        assert list(arrays) == list(others)
        for name, values in others.items():
            np.testing.assert_array_equal(arrays[name], values, err_msg=name)
            assert arrays[name].dtype == values.dtype, name
    assert list(content.quantities.items()) == list(done.quantities.items())
    assert (content.checks, content.transitions) == (done.checks, done.transitions)
    assert content.statistics is not None
    assert content.statistics[:4] == done.statistics[:4]
    assert content.statistics.wall_seconds is None
    names = [content.contacts[int(index)] for index in content.events["contact"]]
    columns = [content.events[name] for name in ("time", "mode_from", "mode_to", "angle")]
    assert len(done.transitions) > 2
    assert list(zip(names, *columns, strict=True)) == [
        (each.contact, each.time, each.mode_from, each.mode_to, each.position)
        for each in done.transitions
    ]


def test_an_interrupted_result_opens_as_a_tree(tmp_path: Path) -> None:
    """The arrays of the checkpoint have dimensions, so that no reader needs to invent some."""
    stopped = simulate(pulley(solver__max_steps=20))
    assert stopped.checkpoint is not None
    path = fs.Result(stopped).save(tmp_path / "a.h5")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with xarray.open_datatree(path, engine="h5netcdf") as tree:
            assert "checkpoint" in tree.children


def test_a_belt_without_samples_is_read_as_it_was(tmp_path: Path) -> None:
    belt = opened("belt").record
    empty = belt._replace(channels={name: v[:0] for name, v in belt.channels.items()})
    content = fs.open(fs.Result(empty).save(tmp_path / "a.h5")).record
    assert content.channels.keys() == empty.channels.keys()
    for name, channel in empty.channels.items():
        np.testing.assert_array_equal(content.channels[name], channel, err_msg=name)
    assert (content.axes, content.members) == (belt.axes, belt.members)
    assert content.events.keys() == belt.events.keys()


def test_a_long_scenario_is_stored_completely(tmp_path: Path) -> None:
    times = [0.001 * i for i in range(4000)]
    channel = {"time": times, "value": [1800.0 + t for t in times]}
    done = simulate(pulley(drive__force=channel))
    with h5py.File(fs.Result(done).save(tmp_path / "a.h5")) as file:
        text = file.attrs["scenario"]
    assert len(text) > 70_000
    (tmp_path / "again.toml").write_text(text)
    assert fs.load(tmp_path / "again.toml") == scenario_run(done)


@pytest.mark.parametrize("max_steps", [None, 20])
def test_every_flipped_bit_is_detected(max_steps: int | None, tmp_path: Path) -> None:
    """Of a complete result and of one with a checkpoint."""
    seal = len("\nfrictionsim crc32 01234567\n")
    done = fs.solve(pulley(output__interval=1.0), output=tmp_path / "a.h5", max_steps=max_steps)
    path = done.path
    assert path is not None
    content = path.read_bytes()
    for place in range(0, len(content) - seal, 997):
        changed = bytes([content[place] ^ 1 << place % 8])
        path.write_bytes(content[:place] + changed + content[place + 1 :])
        with pytest.raises(InputError, match="cannot read this result: it is damaged"):
            fs.open(path)
    # HDF5 drops the checksum when another program changes the file.
    path.write_bytes(content[:-seal])
    assert fs.open(path).status == done.status


FINE = {"output.interval": 3e-4}  # channels of 80 kB, which are unpacked when they are wanted


def test_channels_of_a_large_file_are_read_when_they_are_wanted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And told if the file has changed since; it is not open meanwhile."""
    path = tmp_path / "a.h5"
    fs.solve("pulley", FINE, output=path)
    small = fs.open(path)
    monkeypatch.setattr("frictionsim.io.result_reader.WHOLE", 1000)
    large = fs.open(path)
    assert large.summary() == small.summary()
    assert fs.compare(large, small).same
    xarray.testing.assert_identical(large.dataset, small.dataset)
    other = fs.open(path)
    assert not [name for name in os.listdir("/proc/self/fd") if _leads_to(name, path)]
    fs.solve("pulley", {"solver.duration": 2.0}, output=path)
    with pytest.raises(InputError, match="it has changed since it was opened; open it again"):
        other.record.channels["angle"]


def test_channels_of_a_smaller_file_stay_when_it_is_gone(tmp_path: Path) -> None:
    """Large ones are unpacked later; also in a copy for another process."""
    path = tmp_path / "a.h5"
    solved = fs.solve("pulley", FINE, output=path)
    opened = fs.open(path)
    path.unlink()
    for result in (opened, pickle.loads(pickle.dumps(opened))):
        xarray.testing.assert_identical(result.dataset, solved.dataset)


def test_a_channel_that_cannot_be_unpacked_is_told_when_it_is_wanted(
    done: Record, tmp_path: Path
) -> None:
    """Of a file without our checksum, which another program has changed."""
    path = fs.Result(done).save(tmp_path / "a.h5")
    numbers = np.random.default_rng(1).normal(size=(len(done.time), 60))
    with h5py.File(path, "r+") as file:
        axis = file.create_dataset("body", data=np.arange(60, dtype="i4"))
        axis.make_scale("body")
        file.create_dataset("x", data=numbers, compression="gzip", chunks=numbers.shape)
        file["x"].attrs["units"] = file["x"].attrs["long_name"] = "m"
        file["x"].dims[1].attach_scale(axis)
        chunk = file["x"].id.get_chunk_info(0)
    content = bytearray(path.read_bytes())
    content[chunk.byte_offset + 20 : chunk.byte_offset + 60] = bytes(40)
    path.write_bytes(content)
    result = fs.open(path)
    with pytest.raises(InputError, match="its x is damaged"):
        assert result.dataset


def test_a_result_is_not_resumed_from_the_file_of_another_run(tmp_path: Path) -> None:
    path = tmp_path / "a.partial.h5"
    fs.solve("pulley", output=tmp_path / "a.h5", max_steps=40)
    result = fs.open(path)
    fs.solve("pulley", {"solver.rtol": 1e-8}, output=tmp_path / "a.h5", max_steps=60)
    with pytest.raises(InputError, match="it has changed since it was opened; open it again"):
        fs.resume(result, output=tmp_path / "b.h5")


def _leads_to(descriptor: str, path: Path) -> bool:
    try:
        return os.readlink(f"/proc/self/fd/{descriptor}") == str(path)
    except OSError:
        return False
