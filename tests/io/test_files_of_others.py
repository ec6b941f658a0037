"""Result files that anyone may have made: to crash, to fill memory, to read or remove others."""

import os
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
from frictionsim.io.hdf5_structure import MAX_MEMBERS

import frictionsim as fs
from frictionsim.errors import InputError
from frictionsim.io import hdf5_writer
from frictionsim.io.checksum import LENGTH, append_trailer
from tests.support.cases import one_in
from tests.support.scenarios import SCENARIOS, pulley, simulate

NO_RESULT = "cannot read this result: it is HDF5, but not a frictionsim result"


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
    path = tmp_path / "a.h5"
    path.write_bytes(original())
    return path


def message(path: Path) -> str:
    with pytest.raises(InputError) as refused:
        fs.open(path)
    return str(refused.value).removeprefix(f"{path}: ")


def test_a_pipe_is_refused_without_waiting_for_a_writer(result: Path) -> None:
    result.unlink()
    os.mkfifo(result)
    waiting = threading.Timer(100.0, lambda: os.close(os.open(result, os.O_WRONLY)))
    waiting.start()
    expected = "this is a device or a pipe; give the name of a result file"
    try:
        assert message(result) == f"cannot read this result: {expected}"
        assert waiting.is_alive()  # nobody has opened it to write
    finally:
        waiting.cancel()


def test_a_file_that_another_program_has_locked_is_read(result: Path) -> None:
    fcntl = pytest.importorskip("fcntl")
    with open(result, "rb") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        assert fs.open(result).status == "done"


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


@pytest.mark.parametrize(
    "what", one_in(2, [*CHANGES, "external link, sealed", "infinite mode, sealed"])
)
def test_what_no_result_has_is_refused(what: str, result: Path) -> None:
    what, _, sealed = what.partition(", ")
    (result.parent / "secret").write_bytes(b"s" * 10_000)
    os.mkfifo(result.parent / "p")
    with h5py.File(result, "r+") as file:
        CHANGES[what](file)
    if sealed:
        append_trailer(result)
    assert message(result) == NO_RESULT


def test_a_label_is_one_line_of_two_hundred_characters(result: Path) -> None:
    with h5py.File(result, "r+") as file:
        file["angle"].attrs.update(units="rad\n" * 2000, long_name="x" * 60_000)
    attributes = fs.open(result).dataset["angle"].attrs
    assert attributes["units"] == " ".join(["rad"] * 50)
    assert attributes["long_name"] == "x" * 200


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
        comparison = fs.compare(result, other)
    assert [row.name for row in comparison.rows if not row.ok] == [
        "angle",
        "events/angular_velocity",
    ]


def segmented(path: Path, listing: str) -> None:
    """Make an unfinished result that lists segments."""
    with h5py.File(path, "r+") as file:
        file.attrs["status"], file.attrs["segments"] = "interrupted", listing
        file.attrs["format_version"] = 3
    append_trailer(path)


def test_only_files_that_are_called_after_a_result_are_its_segments(result: Path) -> None:
    for name in ("thesis.h5", "b.000000.h5", "../a.000000.h5", "a.000001.h5", ".."):
        result.write_bytes(original())
        segmented(result, f"{name} 64 00000000")
        text = message(result)
        assert "its segments are not those of" in text or "a.000000.h5: cannot" in text
    shutil.copy(SCENARIOS / "pulley.toml", "s.toml")
    Path("a.000000.h5").write_text("mine")
    fs.solve("s.toml", output=result)
    assert Path("a.000000.h5").read_text() == "mine"


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
