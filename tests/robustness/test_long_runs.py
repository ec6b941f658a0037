"""Long runs of belts: their samples go to the disk while they run, and survive what may happen."""

import os
import random
import shutil
import signal
from itertools import product
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

import frictionsim as fs
from frictionsim.errors import InputError, OutputError
from frictionsim.io import hdf5_writer, segments
from frictionsim.io.checksum import append_trailer
from frictionsim.io.unfinished import partial_name
from frictionsim.simulation import sample_store
from tests.support.belt_scenarios import pair
from tests.support.cases import one_in
from tests.support.crafted_segments import WAYS, craft
from tests.support.stopped_runs import interrupted_at, stopped_at

SEGMENT_BYTES = 50_000
ROWS = 32  # of 24 bodies, in a segment
LONG = pair(solver__backend="moreau", solver__duration=0.15)


@pytest.fixture(autouse=True)
def small_segments(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sample_store, "SEGMENT_BYTES", SEGMENT_BYTES)


@pytest.fixture(scope="module")
def in_memory() -> fs.Result:
    """The run as it was before there were segments."""
    return fs.solve(LONG)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The result that a run without interruption writes."""
    path = tmp_path_factory.mktemp("whole") / "whole.h5"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sample_store, "SEGMENT_BYTES", SEGMENT_BYTES)
        fs.solve(LONG, output=path)
    return path


@pytest.fixture(scope="module")
def stopped_run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of a run that was stopped after some segments."""
    path = tmp_path_factory.mktemp("stopped")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sample_store, "SEGMENT_BYTES", SEGMENT_BYTES)
        fs.solve(LONG, output=path / "a.h5", progress=interrupted_at(0.1))
    return path


@pytest.fixture
def stopped(stopped_run: Path, tmp_path: Path) -> Path:
    """Its result in a separate folder."""
    shutil.copytree(stopped_run, tmp_path, dirs_exist_ok=True)
    return tmp_path / "a.h5"


def test_summary_and_channels_are_those_of_a_run_in_memory(
    in_memory: fs.Result, whole: Path, tmp_path: Path
) -> None:
    result = fs.open(whole)
    assert os.listdir(whole.parent) == ["whole.h5"]
    assert result.quantities == in_memory.quantities
    assert result.audit == in_memory.audit
    assert result.warnings == in_memory.warnings
    assert result.record.transitions == in_memory.record.transitions
    for name, values in in_memory.record.channels.items():
        assert np.array_equal(result.record.channels[name], values), name
    in_memory.save(tmp_path / "saved.h5")
    assert (tmp_path / "saved.h5").read_bytes() == whole.read_bytes()
    some = ["sticking", "pulley_speed", "energy_input"]
    result = fs.solve(LONG, {"output.channels": some}, output=tmp_path / "a.h5")
    assert result.quantities == in_memory.quantities
    assert result.audit == in_memory.audit
    assert set(result.record.channels) == {"time", *some}
    for name, values in result.record.channels.items():
        assert np.array_equal(in_memory.record.channels[name], values), name


def test_a_stopped_run_counts_its_segments_and_resumes_to_the_same_bytes(
    whole: Path, in_memory: fs.Result, tmp_path: Path
) -> None:
    path = tmp_path / "a.h5"
    stopped = fs.solve(LONG, output=path, progress=interrupted_at(0.04))
    n = len(stopped.record.channels["time"])
    before = (n - 1) // ROWS
    assert before > 0
    for part in (stopped, fs.open(path)):
        assert part.status == "interrupted"
        assert part.quantities.keys() == in_memory.quantities.keys()
        for name, values in in_memory.record.channels.items():
            assert np.array_equal(part.record.channels[name], values[:n]), name
    with h5py.File(partial_name(path)) as file:
        assert file.attrs["format_version"] == 3
        lines = [line.split() for line in file.attrs["segments"].split("\n")]
        assert [line[:2] for line in lines] == [
            [f"a.{number:06d}.h5", str(ROWS)] for number in range(before)
        ]
        assert len(file["time"]) == n - before * ROWS
    again = fs.resume(path, progress=interrupted_at(0.125))
    assert len(again.record.channels["time"]) > n
    assert fs.resume(path).status == "done"
    assert path.read_bytes() == whole.read_bytes()
    assert os.listdir(tmp_path) == ["a.h5"]


@pytest.mark.parametrize("change", [(f" {ROWS} ", " 2 "), (f" {ROWS} ", f" {ROWS} 00"), (" ", "")])
def test_segments_that_are_not_those_of_the_result_are_not_shown(
    change: tuple[str, str], stopped: Path
) -> None:
    path = partial_name(stopped)
    with h5py.File(path, "r+") as file:
        file.attrs["segments"] = file.attrs["segments"].replace(*change, 1)
    append_trailer(path)
    with pytest.raises(fs.InputError):
        fs.open(path)


# Of the first only the resumed run needs the samples.
@pytest.mark.parametrize(
    ("way", "name"), one_in(3, product(WAYS, ["_mean_tension", "energy_input"]))
)
def test_crafted_segments_are_refused(way: str, name: str, stopped: Path) -> None:
    path = partial_name(stopped)
    craft(path, 1, lambda file: WAYS[way](random.Random(1), file, name))
    if not name.startswith("_"):
        with pytest.raises(InputError, match="cannot read th"):
            fs.open(path)
    with pytest.raises(InputError, match="cannot re"):
        fs.resume(path)
    assert not stopped.exists()


def test_scattered_samples_of_a_stopped_run_are_read_alone(
    stopped: Path, in_memory: fs.Result, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Else a chart of a long run takes the time to read all of it."""
    monkeypatch.setattr(segments.SegmentFiles, "rows", None)
    channels = fs.open(stopped).record.channels
    last = len(channels["time"]) - 1
    assert last > 2 * ROWS
    for numbers in ([last, 3, ROWS + 2, 4], [2 * ROWS - 1, 0]):
        for name in ("x", "pulley_index"):
            expected = in_memory.record.channels[name][numbers]
            assert np.array_equal(channels[name][numbers], expected)


def test_a_run_that_is_resumed_into_another_file_leaves_the_first_as_it_is(
    whole: Path, stopped: Path
) -> None:
    other = stopped.parent / "other" / "of_another_length.h5"
    other.parent.mkdir()
    fs.resume(stopped, output=other)
    assert other.read_bytes() == whole.read_bytes()
    assert os.listdir(other.parent) == [other.name]
    fs.resume(stopped)
    assert stopped.read_bytes() == whole.read_bytes()


def test_a_new_run_replaces_an_incomplete_one_with_its_segments(whole: Path, stopped: Path) -> None:
    fs.solve(LONG, output=stopped)
    assert stopped.read_bytes() == whole.read_bytes()
    assert os.listdir(stopped.parent) == ["a.h5"]


@pytest.mark.parametrize("damage", ["missing", "changed", "other", "link"])
def test_damaged_segments_are_neither_shown_nor_resumed_from(damage: str, stopped: Path) -> None:
    first, second = (stopped.with_name(f"a.00000{number}.h5") for number in (0, 1))
    if damage == "missing":
        second.unlink()
    elif damage == "changed":
        content = bytearray(second.read_bytes())
        content[len(content) // 2] ^= 1
        second.write_bytes(content)
    elif damage == "link":
        second.symlink_to(second.rename(stopped.with_name("elsewhere")))
    else:
        shutil.copy(first, second)
    for use in (fs.open, fs.resume):
        with pytest.raises(InputError) as refused:
            use(stopped)
        assert f"{second}: cannot read these samples of an unfinished result" in str(refused.value)
        assert "keep a.000001.h5 and the other segments beside the result" in str(refused.value)
    assert partial_name(stopped).exists()


def test_a_checkpoint_writes_what_is_new_and_says_what_it_leaves_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Bytes and calls per checkpoint stay the same, however much was written before."""
    written: list[tuple[int, int]] = []
    before = hdf5_writer.write

    def write(run: Any, path: Path, part: Any = None) -> None:
        before(run, path, part)
        if run.status != "done":
            written.append((run.time.size, path.stat().st_size))
            opened = fs.open(path)
            assert np.all(np.diff(opened.record.channels["time"]) > 0.0)
            assert (opened.status, opened.quantities) == ("interrupted", {})
            assert "checkpoint at t = " in opened.reason
            missing = "this is a checkpoint of a long run: quantities,"
            assert opened.warnings[-1].startswith(missing)

    monkeypatch.setattr(hdf5_writer, "write", write)
    result = fs.solve(LONG, output=tmp_path / "a.h5")
    assert result.status == "done"
    counts = [count for count, _ in written]
    assert len(counts) > 2  # after a segment, or after several between two calls
    assert counts[-1] > 2 * counts[0]
    sizes = [size for _, size in written]
    assert max(sizes) < 1.05 * min(sizes)


@pytest.mark.parametrize("change", one_in(6, [34, 4, 13, 20, 48, 60]))  # the last when it is done
def test_a_long_run_killed_at_a_change_of_a_file_is_resumed_to_the_same_bytes(
    change: int, whole: Path, tmp_path: Path
) -> None:
    target = tmp_path / "a.h5"

    def work() -> int:
        fs.solve(LONG, output=target)
        return 0

    code = stopped_at(change, work, tmp_path)
    is_there = target.exists() or partial_name(target).exists()
    if is_there:
        result = fs.open(target)
        kept = len(result.record.channels["time"])
        expected = fs.open(whole).record.channels
        for name, values in result.record.channels.items():
            assert np.array_equal(values, expected[name][:kept]), name
    assert code == -signal.SIGKILL or result.status == "done"
    if is_there and result.status == "interrupted":
        fs.resume(target)
    else:  # before the first checkpoint, or after the last: what is left over goes
        fs.solve(LONG, output=target)
    assert target.read_bytes() == whole.read_bytes()
    assert os.listdir(tmp_path) == ["a.h5"]


HUGE = {"solver.duration": 1000.0}
WHAT = r"1000001 samples of all recorded channels take 1\.\d+ GB before compression"


def test_refuses_a_run_that_the_memory_does_not_hold(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sample_store, "available_memory", lambda: 10**9)
    with pytest.raises(InputError) as refused:
        fs.solve(LONG, HUGE)
    assert str(refused.value).startswith("cannot start this run: 1000001 samples of all recorded")
    assert "GB of memory, and 1 GB are available; write the result to a file (output=)" in str(
        refused.value
    )


def test_refuses_a_run_that_the_disk_does_not_hold_and_says_of_others_what_they_take(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(sample_store, "SEGMENT_BYTES", 1000 * SEGMENT_BYTES)  # fewer names
    fs.solve(LONG, HUGE, output=tmp_path / "a.h5", progress=interrupted_at(0.0))
    assert "1000001 samples of all recorded channels take" in caplog.text
    assert "stored in" not in caplog.text  # the run has ended before its first segment
    partial_name(tmp_path / "a.h5").unlink(missing_ok=True)
    free = shutil.disk_usage(tmp_path)._replace(free=10**8)
    monkeypatch.setattr(shutil, "disk_usage", lambda path: free)
    with pytest.raises(
        OutputError, match=rf"cannot write the result: {WHAT}, and the disk has"
    ) as e:
        fs.solve(LONG, HUGE, output=tmp_path / "a.h5")
    assert str(e.value).endswith(
        "0.1 GB free; give a longer output.interval, fewer output.channels, or a file on another"
        " disk with -o"
    )
    assert os.listdir(tmp_path) == []


def test_a_full_disk_keeps_the_samples_so_far(
    whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.h5"
    before = hdf5_writer.write_segment

    def full(record: Any, target: Path) -> int:
        if target.name == "a.000002.h5":
            raise OutputError(f"{target}: cannot write the segment: No space left on device")
        return before(record, target)

    with monkeypatch.context() as patch:
        patch.setattr(hdf5_writer, "write_segment", full)
        with pytest.raises(OutputError, match=r"No space left on device\. The last checkpoint is"):
            fs.solve(LONG, output=path)
    assert len(fs.open(path).record.channels["time"]) > 3 * ROWS  # those of this segment, too
    fs.resume(path)
    assert path.read_bytes() == whole.read_bytes()


@pytest.mark.parametrize("number", [0, 3])
def test_a_foreign_file_at_the_name_of_a_segment_is_refused_before_the_run(
    number: int, tmp_path: Path
) -> None:
    foreign, started = tmp_path / f"a.{number:06d}.h5", []
    foreign.write_text("precious")
    with pytest.raises(OutputError) as refused:
        fs.solve(LONG, output=tmp_path / "a.h5", progress=started.append)
    assert str(refused.value) == (
        f"{foreign}: cannot write the segment: the existing file is not a segment of a run and is"
        " not overwritten; give another name"
    )
    assert started == []
    assert os.listdir(tmp_path) == [foreign.name]
    # A run that has no such segment.
    fs.solve(LONG, {"solver.duration": 1e-3}, output=tmp_path / "a.h5")
    assert foreign.read_text() == "precious"


@pytest.mark.parametrize("number", one_in(2, [2, 0]))
def test_a_foreign_file_that_comes_during_a_run_loses_no_sample(
    number: int, whole: Path, tmp_path: Path
) -> None:
    path, foreign = tmp_path / "a.h5", tmp_path / f"a.{number:06d}.h5"
    part = partial_name(path)
    latest = 0.0

    def on_step(t: float) -> None:
        nonlocal latest
        latest = t
        foreign.write_text("precious")

    with pytest.raises(OutputError) as refused:
        fs.solve(LONG, output=path, progress=on_step)
    assert str(refused.value) == (
        f"{foreign}: cannot write the segment: the existing file is not a segment of a run and is"
        f" not overwritten; give another name. The last checkpoint is in {part}: 'frictionsim"
        f" resume {part}' continues the run"
    )
    kept = fs.open(part)
    assert kept.status == "interrupted"
    assert 0.0 <= latest - kept.record.channels["time"][-1] < kept.scenario.interval
    with pytest.raises(OutputError, match="is not overwritten"):
        fs.resume(part)
    assert foreign.read_text() == "precious"
    foreign.unlink()
    fs.resume(part)
    assert path.read_bytes() == whole.read_bytes()
    assert os.listdir(tmp_path) == ["a.h5"]
