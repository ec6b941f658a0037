"""Segments of long runs: no link leads elsewhere, and only marked segments are removed."""

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from frictionsim.io.destination import Destination
from frictionsim.io.segments import SampleSegments, SegmentFiles

import frictionsim as fs
from frictionsim.errors import InputError
from frictionsim.io.checksum import is_damaged
from frictionsim.results import Record
from tests.support.scenarios import pulley, simulate

DAMAGED = "the file is missing or damaged; keep a.00000"
pytestmark = pytest.mark.usefixtures("here")


@pytest.fixture(scope="module")
def record() -> Record:
    return simulate(pulley(output__interval=0.5))


@pytest.fixture
def segments(here: Path, record: Record) -> SampleSegments:
    """Return two segments of a result in the working directory, and a file that must not change."""
    Path("victim.txt").write_text("precious")
    made = again()
    for number in range(2):
        made.write(number, record)
    return made


def again() -> SampleSegments:
    return SampleSegments(Path("a.h5"), lambda: None)


def replace_by_link(path: Path, target: Path | str) -> None:
    path.unlink(missing_ok=True)
    path.symlink_to(target)


def test_a_segment_is_an_ordinary_result(segments: SampleSegments, record: Record) -> None:
    assert sorted(os.listdir()) == ["a.000000.h5", "a.000001.h5", "victim.txt"]
    segment = fs.open("a.000001.h5").record
    for name, values in record.channels.items():
        assert np.array_equal(segment.channels[name], values)
        assert np.array_equal(segments.rows(1, name, 2, 5), values[2:5])
    assert [part["angle"].tolist() for part in again().channels(["angle"], 2)] == [
        record.channels["angle"].tolist()
    ] * 2


def test_a_segment_is_checked_once_and_again_when_it_has_changed(
    segments: SampleSegments, record: Record, monkeypatch: pytest.MonkeyPatch
) -> None:
    checksums = [segments.checksum_of(number) for number in range(2)]
    opened = SegmentFiles(Path("a.h5"), checksums)
    computed = []

    def counted(file: Any) -> bool:
        computed.append(file)
        return is_damaged(file)

    monkeypatch.setattr("frictionsim.io.segments.is_damaged", counted)
    places = {number: np.array([1, 3]) for number in range(2)}
    for name in ("angle", "angular_velocity"):
        for part in opened.samples(name, places):
            assert np.array_equal(part, record.channels[name][[1, 3]])
        assert np.array_equal(opened.rows(1, name, 1, 4), record.channels[name][1:4])
    assert len(computed) == 2
    path = segments.path(1)
    status, content = path.stat(), bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)
    os.utime(path, ns=(status.st_atime_ns, status.st_mtime_ns))
    with pytest.raises(InputError, match=DAMAGED):
        opened.samples("angle", places)
    replace_by_link(path, segments.path(0).resolve())
    with pytest.raises(InputError, match=DAMAGED):
        opened.samples("angle", places)


def test_segments_are_taken_over_and_later_ones_removed(segments: SampleSegments) -> None:
    checksum = segments.checksum
    segments.write(2, fs.open("a.000001.h5").record)
    resumed = again()
    assert not resumed.restore(2, checksum + 1)
    assert Path("a.000002.h5").exists()
    assert resumed.restore(2, checksum)
    assert resumed.checksum == checksum
    assert resumed.listing(7) == segments.listing(7).rpartition("\n")[0]
    assert not Path("a.000002.h5").exists()


@pytest.mark.parametrize("number", [0, 1])
@pytest.mark.parametrize("what", ["link", "pipe", "missing", "cut", "a result"])
def test_what_is_no_segment_is_not_taken_over(
    what: str, number: int, segments: SampleSegments, record: Record
) -> None:
    path = segments.path(number)
    if what == "link":
        replace_by_link(path, path.rename("elsewhere.h5").resolve())
    elif what == "cut":
        path.write_bytes(path.read_bytes()[:-100])
    else:
        path.unlink()
    if what == "pipe":
        os.mkfifo(path)
    elif what == "a result":
        fs.Result(record).save(path)
    other = SampleSegments(Path("b.h5"), lambda: None, again())
    for use in (
        lambda: again().restore(2, segments.checksum),
        lambda: other.restore(2, segments.checksum),
        lambda: segments.rows(number, "time", 0, 1),
    ):
        with pytest.raises(InputError, match=DAMAGED):
            use()
    assert not Path("b.000000.h5").exists()


def test_segments_of_a_run_that_is_resumed_elsewhere_are_linked(segments: SampleSegments) -> None:
    other = SampleSegments(Path("b.h5"), lambda: None, again())
    assert other.restore(2, segments.checksum)
    assert other.checksum == segments.checksum
    assert Path("b.000001.h5").samefile("a.000001.h5")
    other.remove()
    assert sorted(os.listdir()) == ["a.000000.h5", "a.000001.h5", "victim.txt"]


@pytest.mark.parametrize("what", ["link", "a result", "text"])
def test_what_lies_in_the_place_of_a_segment_stays(
    what: str, segments: SampleSegments, record: Record
) -> None:
    path = segments.path(2)
    if what == "link":
        path.symlink_to("victim.txt")
    elif what == "text":
        path.write_text("mine")
    else:
        fs.Result(record).save(path)
    segments.write(2, record)
    assert "a.000002.h5: cannot write the segment: " in str(segments.failure)
    segments.remove()
    assert sorted(os.listdir()) == ["a.000002.h5", "victim.txt"]
    assert Path("victim.txt").read_text() == "precious"


def test_segments_of_a_killed_run_go_with_the_next_run(segments: SampleSegments) -> None:
    fs.solve(pulley(), output="a.h5")
    assert sorted(os.listdir()) == ["a.h5", "victim.txt"]


def test_segments_of_a_result_that_a_run_replaces_go_first(
    segments: SampleSegments, record: Record
) -> None:
    """A kill in between leaves no result whose segments are of another run."""
    fs.Result(record._replace(attributes=record.attributes | {"status": "failed"})).save("a.h5")
    assert Path("a.partial.h5").exists()
    place = Destination(Path("a.h5"))
    kept: Any = place.segments()
    kept.write(0, record)
    assert not Path("a.partial.h5").exists()
    place.close()
    assert not Path("a.000000.h5").exists()
