"""Result files that anyone may have made: to crash, to fill memory, to read or remove others."""

import os
import re
import shutil
import struct
import threading
import warnings
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

import frictionsim as fs
from frictionsim.errors import InputError
from frictionsim.io import child_process, hdf5_reader, hdf5_writer
from frictionsim.io.checksum import LENGTH, append_trailer, checksum_of, checksum_trailer
from frictionsim.io.child_process import ChildFailed, EndedFromOutside
from frictionsim.io.hdf5_structure import MAX_MEMBERS, Budget, array_of
from frictionsim.io.segment_file import SegmentFile, segment_image
from frictionsim.io.stored_array import StoredArray
from tests.support.scenarios import SCENARIOS, frictionsim, pulley, simulate

NO_RESULT = "cannot read this result: it is HDF5, but not a frictionsim result"
HARMFUL = ": the file is corrupt or malicious"


@cache
def original() -> bytes:
    """Return the bytes of a result without its checksum."""
    path = Path(f"{os.urandom(8).hex()}.h5")
    try:
        hdf5_writer.write(simulate(pulley(output__interval=0.5)), path)
        return path.read_bytes()[:-LENGTH]
    finally:
        path.unlink()


@pytest.fixture
def result(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a result to be changed, in a folder that is the working directory."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(child_process, "only_one_thread", lambda: True)
    path = tmp_path / "a.h5"
    path.write_bytes(original())
    return path


def message(path: Path) -> str:
    with pytest.raises(InputError) as refused:
        fs.open(path)
    return str(refused.value).removeprefix(f"{path}: ")


def last_entry_of_heap(raw: bytes) -> int:
    """Return where the free entry of a global heap begins, which ends a walk through it.

    A heap that is full has none.
    """
    for found in re.finditer(b"GCOL", raw):
        place = found.start() + 16
        end = found.start() + struct.unpack_from("<Q", raw, found.start() + 8)[0]
        while place + 16 <= end:
            number, size = struct.unpack_from("<H6xQ", raw, place)
            if number == 0:
                return place
            place += 16 + (size + 7) // 8 * 8
    raise AssertionError("all heaps are full")


@pytest.mark.parametrize("seal", [b"", None], ids=["no checksum", "made anew"])
def test_one_byte_on_which_hdf5_aborts_is_an_error(seal: bytes | None, result: Path) -> None:
    raw = original().replace(b"DIMENSION_SCALE", b"XIMENSION_SCALE", 1)
    result.write_bytes(raw + (checksum_trailer(raw) if seal is None else seal))
    crashed = f"cannot read this result: HDF5 crashed on it (SIGABRT){HARMFUL}"
    assert message(result) in (crashed, NO_RESULT)  # of another version of HDF5
    with pytest.raises(InputError):
        hdf5_reader.read_checkpoint(result)
    with pytest.raises(InputError):
        fs.compare(result, result)


def test_one_byte_on_which_hdf5_never_returns_is_an_error(
    result: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(hdf5_reader, "CPU_SECONDS", 0.5)
    monkeypatch.setattr(hdf5_reader, "SECONDS", 300.0)  # a busy machine may take long for those
    raw = bytearray(original())
    place = last_entry_of_heap(raw) + 8
    raw[place : place + 8] = bytes(8)  # an entry without length
    result.write_bytes(raw)
    expected = f"HDF5 did not come to an end within 1 s{HARMFUL}"
    assert message(result) == f"cannot read this result: {expected}"
    tries, run = [], hdf5_reader.run_in_child

    def tried(*arguments: Any) -> Any:
        tries.append(arguments)
        return run(*arguments)

    monkeypatch.setattr(hdf5_reader, "run_in_child", tried)
    assert hdf5_reader.may_be_done(result)  # it is not replaced by a part of a run
    assert hdf5_reader.folder_of_segments(result) is None
    assert tries == []  # it took a second, and did not change


def test_the_command_line_survives_such_a_file(result: Path) -> None:
    result.write_bytes(original().replace(b"DIMENSION_SCALE", b"XIMENSION_SCALE", 1))
    done = frictionsim("show", "a.h5", cwd=result.parent)
    assert done.returncode == 2
    assert re.fullmatch(r"frictionsim: a\.h5: cannot read this result: .*\n", done.stderr)


def test_hdf5_is_never_called_by_this_process(
    result: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    process, opened = os.getpid(), h5py.File.__init__

    def guarded(*arguments: Any, **named: Any) -> None:
        assert os.getpid() != process
        opened(*arguments, **named)

    monkeypatch.setattr(h5py.File, "__init__", guarded)
    assert fs.open(result).status == "done"
    assert hdf5_reader.may_be_done(result)
    assert fs.compare(result, result).same


def test_a_pipe_is_refused_without_waiting_for_a_writer(result: Path) -> None:
    result.unlink()
    os.mkfifo(result)
    waiting = threading.Timer(100.0, lambda: os.close(os.open(result, os.O_WRONLY)))
    waiting.start()
    expected = "this is a device or a pipe; give the name of a result file"
    try:
        assert message(result) == f"cannot read this result: {expected}"
        assert hdf5_reader.may_be_done(result)
        assert waiting.is_alive()  # nobody has opened it to write
    finally:
        waiting.cancel()


Change = Callable[[Any], None]


def replaced(name: str, make: Callable[[Any, str], Any]) -> Change:
    def change(file: Any) -> None:
        if name in file:
            del file[name]
        make(file, name)

    return change


def put(name: str, place: int, value: float) -> Change:
    """Return the change of a number, in a dataset of floats."""

    def change(file: Any) -> None:
        data, attributes = file[name][...].astype(float), dict(file[name].attrs)
        del file[name]
        data[place] = value
        file[name] = data
        for key in attributes.keys() & {"units", "long_name", "flag_meanings", "flag_values"}:
            file[name].attrs[key] = attributes[key]

    return change


def virtual(file: Any, name: str) -> None:
    layout = h5py.VirtualLayout(file["time"].shape, "f8")
    layout[...] = h5py.VirtualSource(".", "time", file["time"].shape)
    described(file.create_virtual_dataset(name, layout))


def described(dataset: Any) -> None:
    dataset.attrs["units"] = dataset.attrs["long_name"] = "rad"


def external(file: Any, name: str) -> None:
    count = len(file["time"])
    described(file.create_dataset(name, (count,), "f8", external=[("secret", 0, 8 * count)]))


def named_type(file: Any, name: str) -> None:
    file["number"] = np.dtype("f8")
    described(file.create_dataset(name, file["time"].shape, file["number"]))


def other_filter(file: Any, name: str) -> None:
    described(file.create_dataset(name, data=file["time"][...], chunks=(2,), compression="lzf"))


def circle(file: Any, name: str) -> None:
    file["events/angle"] = file["events"]


def many(file: Any, name: str) -> None:
    for number in range(MAX_MEMBERS):
        file.create_group(f"n{number}")


def claims(file: Any, name: str) -> None:
    for number in range(40):
        described(file.create_dataset(f"x{number}", (10**6,), "f8", chunks=(1000,)))


CHANGES: dict[str, Change] = {
    "soft link": replaced("angle", lambda f, n: f.update({n: h5py.SoftLink("/time")})),
    "external link": replaced("angle", lambda f, n: f.update({n: h5py.ExternalLink("b.h5", "/x")})),
    "link to a pipe": replaced("angle", lambda f, n: f.update({n: h5py.ExternalLink("p", "/x")})),
    "circle": replaced("events/angle", circle),
    "external storage": replaced("angle", external),
    "virtual": replaced("angle", virtual),
    "named type": replaced("angle", named_type),
    "other filter": replaced("angle", other_filter),
    "group for a channel": replaced("angle", lambda f, n: f.create_group(n)),
    "many members": replaced("none", many),
    "claims in many datasets": replaced("none", claims),
    "long text": lambda f: f.attrs.update(title="x" * 70_000),
    "many attributes": lambda f: f["angle"].attrs.update({f"a{i}": i for i in range(100)}),
    "name that is not UTF-8": lambda f: f.id.move(b"angle", b"\xff\xfe"),
    "name with control characters": lambda f: f.id.move(b"angle", b"\x1b[2J"),
    "event at no time": put("events/time", 0, np.nan),
    "event at infinity": put("events/time", -1, np.inf),
    "mode that is no number": put("events/mode_from", 0, np.nan),
    "infinite mode": put("events/mode_to", 0, np.inf),
    "mode that there is not": put("events/mode_to", 0, 9.0),
    "contact that there is not": put("events/contact", 0, np.nan),
    "time that is no number": put("time", 2, np.nan),
    "time that goes back": put("time", 2, -1.0),
    "no contacts": lambda f: f.pop("events/contact"),
    "contact without a name": put("events/contact", 0, 7.0),
    "no kind": lambda f: f.attrs.pop("kind"),
    "no time": lambda f: f.pop("time"),
    "text for numbers": replaced("angle", lambda f, n: f.update({n: ["a", "b"]})),
    "unknown status": lambda f: f.attrs.update(status="Done"),
    "status with an escape": lambda f: f.attrs.update(status="\x1b[2J"),
    "no status": lambda f: f.attrs.update(status=""),
}


@pytest.mark.parametrize("what", [*CHANGES, "external link, sealed", "infinite mode, sealed"])
def test_what_no_result_has_is_refused(what: str, result: Path) -> None:
    what, _, sealed = what.partition(", ")
    (result.parent / "secret").write_bytes(b"s" * 10_000)
    os.mkfifo(result.parent / "p")
    with h5py.File(result, "r+") as file:
        CHANGES[what](file)
    if sealed:
        append_trailer(result)
    assert message(result) == NO_RESULT


def test_one_long_text_many_times_does_not_fill_memory(result: Path) -> None:
    with h5py.File(result, "r+") as file:
        scale = file.create_dataset("body", (4000,), h5py.string_dtype())
        scale.make_scale("body")
        scale[:2] = ["x" * 60_000, "\u00e4" * 7]
    raw = result.read_bytes()
    # Each entry of the dataset is 4 bytes of length, 8 of the heap's place and 4 of the number.
    first = raw.index(struct.pack("<I", 60_000))
    entry, second = raw[first : first + 16], raw[first + 16 : first + 20]
    assert second == struct.pack("<I", 14)
    result.write_bytes(raw[:first] + 4000 * entry + raw[first + 16 * 4000 :])
    with h5py.File(result) as file:
        assert len(file["body"].asstr()[3999]) == 60_000
    assert message(result) == NO_RESULT


def test_differences_of_huge_numbers_are_no_warning(result: Path) -> None:
    other = result.with_name("b.h5")
    for path, number in ((result, 1.7e308), (other, -1.7e308)):
        path.write_bytes(original())
        with h5py.File(path, "r+") as file:
            file["angle"][1] = number
            file["events/angular_velocity_before"][0] = number
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = fs.compare(result, other)
    assert [row.name for row in found.rows if not row.ok] == [
        "angle",
        "events/angular_velocity",
    ]


@pytest.mark.parametrize("dtype", ["f8", "f4", ">f8", "i1", "i4", "u2"])
@pytest.mark.parametrize("options", ["compression shuffle", "compression", "shuffle", ""])
def test_chunks_are_read_as_hdf5_reads_them(dtype: str, options: str, tmp_path: Path) -> None:
    chosen = {name: {"compression": "gzip", "shuffle": True}[name] for name in options.split()}
    path = tmp_path / "a.h5"
    values = np.random.default_rng(1).integers(0, 100, (50, 3)).astype(dtype)
    with h5py.File(path, "w") as file:
        file.create_dataset("x", data=values, chunks=(16, 3), **chosen)
    with h5py.File(path) as file:
        array = array_of(file["x"], Budget(path.stat().st_size))
        assert array is not None
        with path.open("rb") as raw:
            for start, stop in ((0, 50), (0, 1), (15, 17), (16, 32), (49, 50), (20, 20), (47, 60)):
                found = array.read(raw, start, stop)
                assert np.array_equal(found, file["x"][start:stop])
                assert (found.dtype.kind, found.itemsize) == (values.dtype.kind, values.itemsize)


@pytest.mark.parametrize(
    "change",
    [
        {"shape": (2**40, 3)},
        {"shape": (16, 10**9), "rows": 16},
        {"dtype": "O"},
        {"dtype": "V8"},
        {"rows": 0},
        {"parts": np.array([[0, 101]])},
        {"parts": np.array([[-5, 20]])},
        {"parts": np.array([[90, 20]])},
        {"parts": np.array([[2**62, 20]])},
        {"compressed": False},
    ],
    ids=str,
)
def test_places_that_a_file_does_not_have_are_refused(change: dict[str, Any]) -> None:
    array = StoredArray("<f8", (16, 3), 16, np.array([[10, 20]]), compressed=True)
    array.check(100)
    with pytest.raises(ValueError, match=r"."):
        array._replace(**change).check(100)


def test_a_part_that_holds_more_or_less_than_its_rows_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.segment"
    image = segment_image(7, {"time": np.arange(8.0), "x": np.ones((8, 3))}, {"k": np.zeros(8)})
    path.write_bytes(image)
    segment = SegmentFile(path)
    assert segment.after == 7
    assert np.array_equal(segment.rows("x", 2, 5), np.ones((3, 3)))
    array = segment.array("x")
    with path.open("rb") as file:
        for rows in (4, 16):
            with pytest.raises(ValueError, match="does not hold its rows"):
                array._replace(rows=rows, shape=(rows, 3)).read(file, 0, 1)
    place = int(array.parts[0][0]) + 3
    path.write_bytes(image[:place] + b"\xff\xff\xff" + image[place + 3 :])
    with pytest.raises(ValueError, match=r"while decompressing|rows"), path.open("rb") as file:
        array.read(file, 0, 8)


def segmented(path: Path, reference: str) -> None:
    """Make an interrupted result that refers to segments."""
    with h5py.File(path, "r+") as file:
        file.attrs["status"], file.attrs["segments"] = "interrupted", reference
        file.attrs["format_version"] = 3
    append_trailer(path)


@pytest.mark.parametrize(
    "name",
    ["thesis", "..", ".", "a.samples-0000000g", "a.samples-000000000", "b/a.samples-00000000"],
)
def test_a_folder_that_no_run_has_made_is_not_touched(name: str, result: Path) -> None:
    folder = Path(name if name.strip(".") else "thesis")
    folder.mkdir(parents=True)
    (folder / "000000.segment").write_text("mine")
    segmented(result, f"{name} 1 64 0")
    assert message(result) == NO_RESULT
    assert hdf5_reader.folder_of_segments(result) is None
    shutil.copy(SCENARIOS / "pulley.toml", "s.toml")
    fs.solve("s.toml", output=result)
    assert (folder / "000000.segment").read_text() == "mine"


def test_other_files_in_a_folder_of_segments_are_kept(result: Path) -> None:
    folder = Path("a.samples-00000000")
    folder.mkdir()
    (folder / "000000.segment").write_text("old")
    (folder / "mine.txt").write_text("mine")
    segmented(result, f"{folder} 1 64 0")
    assert "000000.segment: cannot read these samples of an incomplete" in message(result)
    fs.solve(pulley(), output=result)
    assert os.listdir(folder) == ["mine.txt"]


def test_segments_of_other_columns_are_refused(result: Path) -> None:
    folder = Path("a.samples-00000000")
    folder.mkdir()
    with h5py.File(result) as file:
        names = [name for name in file if isinstance(file[name], h5py.Dataset)]
    odd = {name: np.zeros((64, 5)) for name in names} | {"time": np.arange(64.0) - 100.0}
    image = segment_image(0, odd, {})
    (folder / "000000.segment").write_bytes(image)
    segmented(result, f"{folder} 1 64 {checksum_of(image[-LENGTH:])}")
    found = fs.open(result)
    with pytest.raises(InputError, match="cannot read these samples of an incomplete result"):
        found.record.channels["angle"][3]


def test_numbers_that_no_picture_can_show_are_refused(result: Path) -> None:
    with h5py.File(result, "r+") as file:
        file["angular_velocity"][1] = 1e300
    with pytest.raises(InputError, match=r"'angular_velocity' has numbers above 1e\+100"):
        fs.plot(result)


def test_a_limit_that_is_no_number_is_none_in_json(result: Path) -> None:
    with h5py.File(result, "r+") as file:
        file["audit/limit"][0] = np.nan
    checks = fs.open(result).to_json()["audit"]
    assert next(iter(checks.values()))["limit"] is None


def interrupted(path: Path) -> Path:
    with h5py.File(path, "r+") as file:
        file.attrs["status"] = "interrupted"
    append_trailer(path)
    return path


def failing(monkeypatch: pytest.MonkeyPatch, *failures: Exception) -> None:
    """Have the next children fail, those after them not."""
    left, run = list(failures), hdf5_reader.run_in_child

    def run_or_fail(*arguments: Any) -> Any:
        if left:
            raise left.pop(0)
        return run(*arguments)

    monkeypatch.setattr(hdf5_reader, "run_in_child", run_or_fail)


def test_a_failure_of_the_child_is_not_remembered(
    result: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    interrupted(result)
    failing(monkeypatch, ChildFailed("crashed"))
    assert hdf5_reader.may_be_done(result)  # nothing is known of it
    assert not hdf5_reader.may_be_done(result)


def test_a_child_that_was_ended_from_outside_is_tried_once_more(
    result: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    failing(monkeypatch, EndedFromOutside("ended"))
    assert not hdf5_reader.may_be_done(interrupted(result))
    failing(monkeypatch, EndedFromOutside("ended"), EndedFromOutside("ended again"))
    with pytest.raises(InputError, match=r"a\.h5: cannot read this result: ended again"):
        fs.open(result)
