"""Result files that another program has made or changed: refused in a sentence, or read."""

import os
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

import frictionsim as fs
from frictionsim.errors import InputError
from tests.io.test_compared_quantities import edited, golden
from tests.support.scenarios import pulley, simulate

NO_RESULT = "cannot read this result: it is HDF5, but not a frictionsim result"


@cache
def original() -> bytes:
    """Return the bytes of a result without its checksum."""
    path = Path(f"{os.urandom(8).hex()}.h5")
    try:
        fs.Result(simulate(pulley(output__interval=0.5))).save(path)
        return path.read_bytes()[: -len("\nfrictionsim crc32 01234567\n")]
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
    expected = "this is a device or a pipe; give the name of a result file"
    assert message(result) == f"cannot read this result: {expected}"


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


def other_filter(file: Any, name: str) -> None:
    described(file.create_dataset(name, data=file["time"][...], chunks=(2,), compression="lzf"))


def claims(file: Any, name: str) -> None:
    for number in range(4):
        described(file.create_dataset(f"x{number}", (2 * 10**6,), "f8", chunks=(10**6,)))


CHANGES: dict[str, Change] = {
    "soft link": replaced("angle", lambda f, n: f.update({n: h5py.SoftLink("/time")})),
    "external link": replaced("angle", lambda f, n: f.update({n: h5py.ExternalLink("b.h5", "/x")})),
    "link to a pipe": replaced("angle", lambda f, n: f.update({n: h5py.ExternalLink("p", "/x")})),
    "external storage": replaced("angle", external),
    "virtual": replaced("angle", virtual),
    "other filter": replaced("angle", other_filter),
    "group for a channel": replaced("angle", lambda f, n: f.create_group(n)),
    "claims in many datasets": replaced("none", claims),
    "time that goes back": put("time", 2, -1.0),
    "no contacts": lambda f: f.pop("events/contact"),
    "contact without a name": put("events/contact", 0, 7.0),
    "mode without a name": put("events/mode_to", 0, 7.0),
    "no kind": lambda f: f.attrs.pop("kind"),
    "no time": lambda f: f.pop("time"),
    "text for numbers": replaced("angle", lambda f, n: f.update({n: ["a", "b"]})),
    "unknown status": lambda f: f.attrs.update(status="Done"),
}


@pytest.mark.parametrize("what", CHANGES)
def test_what_no_result_has_is_refused(what: str, result: Path) -> None:
    (result.parent / "secret").write_bytes(b"s" * 10_000)
    os.mkfifo(result.parent / "p")
    with h5py.File(result, "r+") as file:
        CHANGES[what](file)
    assert message(result) == NO_RESULT


def too_few_rows(file: Any) -> None:
    del file["pulley_speed"]
    described(file.create_dataset("pulley_speed", data=np.zeros((2, 2))))
    for dimension, axis in zip(file["pulley_speed"].dims, ("time", "pulley"), strict=True):
        dimension.attach_scale(file[axis])


def name_too_many(file: Any) -> None:
    names = ["driver", "driven", "idler"]
    file.create_dataset("wheel", data=names, dtype=h5py.string_dtype()).make_scale("wheel")
    columns = file["pulley_speed"].dims[1]
    columns.detach_scale(file["pulley"])
    columns.attach_scale(file["wheel"])


@pytest.mark.parametrize("damage", [too_few_rows, name_too_many])
def test_columns_without_a_matching_axis_are_refused(damage: Change, result: Path) -> None:
    with h5py.File(edited(golden("belt"), result), "r+") as file:
        damage(file)
    assert message(result) == NO_RESULT


def test_a_file_of_another_format_is_told_so(result: Path) -> None:
    with h5py.File(result, "r+") as file:
        file.attrs["format_version"] = 4
    assert message(result).endswith("is 4, this program reads version 2; solve its scenario again")
    result.write_bytes(b"")
    assert message(result).endswith("it is not a readable HDF5 file")


def test_a_limit_that_is_no_number_is_none_in_json(result: Path) -> None:
    with h5py.File(result, "r+") as file:
        file["audit/limit"][0] = np.nan
    checks = fs.open(result).to_json()["audit"]
    assert next(iter(checks.values()))["limit"] is None


def test_numbers_that_no_picture_can_show_are_refused(result: Path) -> None:
    with h5py.File(result, "r+") as file:
        file["angular_velocity"][1] = 1e300
    with pytest.raises(InputError, match=r"'angular_velocity' has numbers above 1e\+100"):
        fs.plot(result)
