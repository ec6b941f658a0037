"""Channels that are read from their file when they are needed are as good as arrays."""

import io
import pickle
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from frictionsim.simulation.stored_channel import StoredChannel
from hypothesis import example, given
from hypothesis import strategies as st

import frictionsim as fs
from frictionsim.api.result import write_channels
from frictionsim.errors import InputError
from frictionsim.io import checksum, hdf5_content, hdf5_reader, hdf5_writer
from frictionsim.plots import draw, save
from frictionsim.results import Channel
from frictionsim.simulation import sample_store, stored_channel
from tests.support.belt_results import belt_run
from tests.support.scenarios import SCENARIOS

SAMPLES, BODIES = 201, 40


@pytest.fixture
def pair(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[fs.Result, fs.Result]:
    """One result, whole in memory and read when needed."""
    run = belt_run(bodies=BODIES, samples=SAMPLES)
    hdf5_writer.write(run, tmp_path / "short.h5")
    short = fs.open(tmp_path / "short.h5")
    monkeypatch.setattr(sample_store, "SEGMENT_BYTES", 50_000)
    monkeypatch.setattr(hdf5_content, "LONG_BYTES", 50_000)
    monkeypatch.setattr(hdf5_content, "LONG_CHANNEL_BYTES", 1000)
    monkeypatch.setattr(stored_channel, "BLOCK_BYTES", 25_000)  # a third of a channel
    hdf5_writer.write(run, tmp_path / "long.h5")
    long = fs.open(tmp_path / "long.h5")
    assert isinstance(long.record.channels["x"], StoredChannel)
    return short, long


# Lists need a sorting, a mask none; the samples of a tuple are followed by columns.
ROWS = (
    st.integers(-SAMPLES, SAMPLES - 1)
    | st.slices(SAMPLES)
    | st.lists(st.integers(-SAMPLES, SAMPLES - 1), min_size=1)
    | st.just(Ellipsis)
)
MASKS = st.integers(1, SAMPLES).map(lambda n: np.arange(SAMPLES) % n == 0)


@given(ROWS | MASKS | st.tuples(ROWS, st.integers(-BODIES, BODIES - 1) | st.slices(BODIES)))
@example([200, 3, 3])
@example(([3, 1], 5))
@example([-1])
@example(slice(5, 190, 7))
@example((slice(9, 4), 5))
def test_an_index_gives_what_it_gives_of_an_array(
    pair: tuple[fs.Result, fs.Result], index: Any
) -> None:
    for name in ("x", "pulley_index"):
        array, stored = (result.record.channels[name] for result in pair)
        part = stored[index]
        assert np.array_equal(part, array[index])
        assert part.dtype == array.dtype


def test_a_stored_channel_is_an_array_where_one_is_needed(
    pair: tuple[fs.Result, fs.Result],
) -> None:
    array, stored = (result.record.channels["tension"] for result in pair)
    assert (stored.shape, stored.ndim, stored.size) == (array.shape, 2, array.size)
    assert (stored.nbytes, len(stored), stored.max()) == (array.nbytes, SAMPLES, array.max())
    assert np.array_equal(stored, array)
    assert np.array_equal(2.0 * stored > 1000.0, 2.0 * array > 1000.0)
    assert np.array_equal(list(stored), array)
    with pytest.raises(IndexError):
        stored[SAMPLES]
    with pytest.raises(AttributeError, match="tension_of"):
        getattr(stored, "tension_of")  # noqa: B009


@pytest.mark.slow
def test_everything_made_of_a_long_result_is_that_of_a_short_one(
    pair: tuple[fs.Result, fs.Result], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    short, long = pair
    again = pickle.loads(pickle.dumps(long))
    assert np.array_equal(again.record.channels["x"], short.record.channels["x"])
    long.save(tmp_path / "copy.h5")
    assert (tmp_path / "copy.h5").read_bytes() == (tmp_path / "long.h5").read_bytes()
    assert fs.compare(long, short, rtol=0.0, atol=0.0).same
    # A line of the table takes 12 kB: some forty lines are read at once.
    monkeypatch.setattr(stored_channel, "BLOCK_BYTES", 500_000)
    tables = [io.StringIO(), io.StringIO()]
    for result, table in zip(pair, tables, strict=True):
        write_channels(result.record, table)
    assert tables[0].getvalue() == tables[1].getvalue()
    pictures = tmp_path / "short.png", tmp_path / "long.png"
    for result, picture in zip(pair, pictures, strict=True):
        save(draw(result.record, "tension"), picture, dpi=50)
    assert pictures[0].read_bytes() == pictures[1].read_bytes()


@pytest.mark.parametrize(("name", "written"), [("tension", 0), ("tension", 1), ("angle", 0)])
def test_samples_that_were_never_written_are_refused(
    name: str, written: int, pair: tuple[fs.Result, fs.Result], tmp_path: Path
) -> None:
    """They take no space: a small file would take minutes to read."""
    path = tmp_path / "long.h5"
    path.write_bytes(path.read_bytes()[: -checksum.LENGTH])
    with h5py.File(path, "r+") as file:
        item = file[name]
        values, scales = item[...], [file["time"], file[item.dims[1].keys()[0]]]
        described = Channel(item.attrs["units"], item.attrs["long_name"])
        del file[name]
        chunks = (100, values.shape[1]) if name == "tension" else None
        item = file.create_dataset(name, values.shape, values.dtype, chunks=chunks)
        hdf5_writer.describe(item, described, *scales)
        item[: 100 * written] = values[: 100 * written]
    checksum.append_trailer(path, checksum.RESULT)
    with pytest.raises(InputError, match="it is HDF5, but not a frictionsim result"):
        fs.open(path)


def test_scattered_samples_are_read_alone(
    pair: tuple[fs.Result, fs.Result], monkeypatch: pytest.MonkeyPatch
) -> None:
    short, long = (result.record.channels["x"] for result in pair)
    monkeypatch.setattr(hdf5_reader.RowsOfFile, "rows", None)
    assert np.array_equal(long[[190, 3, 90]], short[[190, 3, 90]])


def test_a_dataset_reads_what_is_selected(pair: tuple[fs.Result, fs.Result]) -> None:
    short, long = (result.dataset for result in pair)
    assert not long["x"]._in_memory
    some = {"time": slice(3, 50, 4), "body": [3, 5]}
    assert np.array_equal(long["x"].isel(some), short["x"].isel(some))
    assert np.array_equal(long["x"].isel(time=-1), short["x"].isel(time=-1))
    assert not long["x"]._in_memory
    assert short.identical(long)


def test_a_comparison_finds_the_largest_difference_of_all_blocks(
    pair: tuple[fs.Result, fs.Result],
) -> None:
    short, long = pair
    changed = {**short.record.channels, "x": short.record.channels["x"].copy()}
    for sample, size in ((20, 0.1), (150, 0.4), (190, 0.2)):
        changed["x"][sample, 7] += size
    comparison = fs.compare(long, fs.Result(short.record._replace(channels=changed)))
    worst, *others = comparison.rows
    assert (worst.name, worst.ok, worst.note) == ("x", False, "body 7")
    assert worst.difference == pytest.approx(0.4)
    assert worst.time == short.record.channels["time"][150]
    assert all(row.ok for row in others)


def test_a_file_that_has_changed_is_not_mixed_with_what_was_read(
    pair: tuple[fs.Result, fs.Result], tmp_path: Path
) -> None:
    path = tmp_path / "long.h5"
    hdf5_writer.write(belt_run(bodies=BODIES, samples=SAMPLES + 1), path)
    with pytest.raises(InputError, match=r"long.h5: cannot read the channel 'x': it has changed"):
        pair[1].record.channels["x"][0]
    path.unlink()
    with pytest.raises(InputError, match="it could be opened before, and cannot be now"):
        pair[1].record.channels["x"][0]


@pytest.mark.slow
def test_a_long_channel_without_columns_stays_in_its_file(tmp_path: Path) -> None:
    count, names = 9_000_000, ("time", "angle", "mode")
    record = fs.solve(SCENARIOS / "pulley.toml", {"solver.rtol": 1e-6}).record
    time = np.linspace(0.0, 3.0, count)
    channels = {"time": time, "angle": np.sin(time), "mode": np.ones(count, np.int8)}
    events = {name: record.events[name] for name in ("time", "contact", "mode_from", "mode_to")}
    units, axes = ({name: of[name] for name in names} for of in (record.units, record.axes))
    short = record._replace(channels=channels, events=events, units=units, axes=axes)
    hdf5_writer.write_record(short, tmp_path / "long.h5", None)  # of more than 64 MiB
    stored = fs.open(tmp_path / "long.h5").record.channels
    assert isinstance(stored["angle"], StoredChannel)
    assert isinstance(stored["time"], np.ndarray)
    np.testing.assert_array_equal(stored["angle"][70_000:300_000:7], np.sin(time[70_000:300_000:7]))
