"""Result files whose bytes are sound HDF5 and whose content is not that of a result.

Attributes, datasets and links that no run writes: huge, cyclic, elsewhere, of odd types.
"""

import random
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from frictionsim.io.checksum import append_trailer
from tests.attacks.hdf5_bytes import SOUND, TARGET, originals, place, use

TEXT = h5py.string_dtype()
VALUES: list[Any] = [
    *("", "done", "interrupted", "failed", "x" * 60_000, "\ud7ff", "kind", "\x1b]0;title\x07"),
    *(1, -1, 2**63 - 1, 1.5, float("nan"), [1.0, 2.0], np.zeros(8000), h5py.Empty("f")),
    *(b"\xff\xfe", True, ["a", "b"], ["a"] * 3000, "a.000000.h5 64 00000000", "../b.h5 64 0"),
    *("belt_drive", "pulley", "2", "stick " * 5000, np.void(b"x"), 1j),
]
NUMBERS: list[Any] = [
    *(np.nan, np.inf, -np.inf, -1.0, 0.0, 1.5, 3.0, 7.0, 1e300, -1e308, 2.0**40, 1e-320)
]
SHAPES: list[tuple[int, ...]] = [
    *((10**12,), (10**6, 10**6), (2**40, 3), (0,), (1,), (), (0, 3), (3, 0), (2, 2, 2)),
    *((10**9, 2), (200, 10**5)),
]


def _attribute(rng: random.Random, file: Any, name: str) -> str:
    owner = rng.choice([file, file[name]])
    key = rng.choice([*owner.attrs, "names", "units", "format_version", "segments", "\udcff"])
    value = rng.choice(VALUES)
    owner.attrs[key] = value
    return f"{owner.name} @{key!r} = {value!r:.50}"


def _missing(rng: random.Random, file: Any, name: str) -> str:
    del file[name]
    return f"no {name}"


def _shape(rng: random.Random, file: Any, name: str) -> str:
    shape = rng.choice(SHAPES)
    large = bool(shape) and min(shape) > 1023
    chunks: dict[str, Any] = {"chunks": (1024,) * len(shape)} if large else {}
    if shape and min(shape) and rng.random() < 0.3:
        chunks = {"chunks": tuple(min(n, 256) for n in shape), "compression": "gzip"}
    dtype = rng.choice(["f8", "f4", "i1", "S10", ">i8", "u8", "f2", "bool"])
    del file[name]
    file.create_dataset(name, shape, dtype, **chunks)
    return f"{name} of {shape} {dtype}"


def _group(rng: random.Random, file: Any, name: str) -> str:
    del file[name]
    group = file.create_group(name)
    for _ in range(rng.choice([0, 1, 300])):
        group = group.create_group("g")
    return f"{name} a group"


def _odd_values(rng: random.Random, file: Any, name: str) -> str:
    del file[name]
    values: list[Any] = [["a", "b"], [np.nan] * 31, np.arange(31.0) * 1e300, [1j], True]
    values += [np.zeros(3, [("a", "f8"), ("b", "i4")]), np.zeros(31, "f2"), np.zeros((31, 2))]
    file[name] = rng.choice(values)
    return f"{name} of odd values"


def _link(rng: random.Random, file: Any, name: str) -> str:
    del file[name]
    if rng.random() < 0.4:
        target = rng.choice(["/", "/time", "/events"])
        if target in file:
            file[name] = file[target]  # a hard link, of a group also a circle
        return f"{name} a hard link to {target}"
    elsewhere = h5py.ExternalLink(rng.choice([SOUND, TARGET, "/etc/passwd", "/dev/zero"]), "/time")
    file[name] = rng.choice([h5py.SoftLink(f"/{name}"), h5py.SoftLink("/time"), elsewhere])
    return f"{name} a link"


def _elsewhere(rng: random.Random, file: Any, name: str) -> str:
    """Store a dataset in other files, or make it of those of others."""
    old = file[name]
    shape = old.shape if isinstance(old, h5py.Dataset) else (31,)
    del file[name]
    if rng.random() < 0.5:
        size = 8 * int(np.prod(shape))
        file.create_dataset(name, shape, "f8", external=[("/etc/passwd", 0, max(size, 1))])
        return f"{name} in another file"
    layout = h5py.VirtualLayout(shape, "f8")
    if shape:
        layout[...] = h5py.VirtualSource(rng.choice([SOUND, "."]), "angle", shape)
    file.create_virtual_dataset(name, layout)
    return f"{name} virtual"


def _many(rng: random.Random, file: Any, name: str) -> str:
    way = rng.choice(["groups", "soft links", "attributes", "texts", "names"])
    if way == "attributes":
        for number in range(300):
            file.attrs[f"a{number}"] = number
    elif way == "texts":
        count = rng.choice([500, 4000])
        dataset = file.create_dataset("texts", (count,), TEXT)
        dataset[0] = "x" * 10**6
    elif way == "names":
        del file[name]
        file.create_dataset(name, data=["x" * 100] * 3000, dtype=TEXT)
    else:
        for number in range(3000):
            if way == "groups":
                file.create_group(f"n{number}")
            else:
                file[f"n{number}"] = h5py.SoftLink("/time")
    return f"thousands of {way}"


def _number(rng: random.Random, file: Any, name: str) -> str:
    """Put a number that is none, or is extreme, into a dataset."""
    names = [n for n in _names(file) if isinstance(file.get(n), h5py.Dataset) and file[n].size]
    names = [n for n in names if file[n].dtype.kind in "fi"]
    events = [n for n in names if n.startswith("events/")]
    chosen = rng.choice(events if events and rng.random() < 0.6 else names)
    data = np.array(file[chosen][...], dtype=np.float64)
    for _ in range(rng.choice([1, 1, 3])):
        data.flat[rng.randrange(data.size)] = rng.choice(NUMBERS)
    attributes = dict(file[chosen].attrs)
    kept = {key: value for key, value in attributes.items() if isinstance(value, (str, np.ndarray))}
    if rng.random() < 0.5:  # of another type, else of its own
        del file[chosen]
        file[chosen] = data
        for key, value in kept.items():
            if value.dtype.kind in "if" if isinstance(value, np.ndarray) else True:
                file[chosen].attrs[key] = value
        return f"{chosen} with odd numbers, as floats"
    with np.errstate(all="ignore"):
        file[chosen][...] = data.astype(file[chosen].dtype)
    return f"{chosen} with odd numbers"


def _name(rng: random.Random, file: Any, name: str) -> str:
    new = rng.choice(
        [b"\xff\xfe", b"\x1b[31m", b"", b"x" * 70_000, "\u202eabc".encode(), b"events"]
    )
    if new and new not in file and "/" not in name:
        file.id.move(name.encode(), new)
    return f"{name} is called {new!r:.30}"


def _type(rng: random.Random, file: Any, name: str) -> str:
    old = file[name]
    if not isinstance(old, h5py.Dataset) or old.dtype.kind not in "fi":
        return "nothing"
    data = old[...]
    del file[name]
    if rng.random() < 0.5:
        file["kind_of_numbers"] = np.dtype("f8")
        file.create_dataset(name, data.shape, file["kind_of_numbers"])
        return f"{name} of a named type"
    dtype: Any = rng.choice([h5py.vlen_dtype("f8"), h5py.ref_dtype, TEXT, np.dtype("(3,)f8")])
    file.create_dataset(name, data.shape, dtype)
    return f"{name} of {dtype}"


WAYS = [_attribute, _attribute, _missing, _shape, _group, _odd_values, _link, _elsewhere, _many]
WAYS += [_number, _number, _number, _name, _type]


def _names(file: Any) -> list[str]:
    names: list[str] = []
    file.visit(names.append)
    return names


def attack(rng: random.Random, folder: Path) -> str:
    """Change the content of a result, and use it."""
    files = rng.choice(originals())
    place(folder, {**files, SOUND: files[TARGET]})
    return use(rng, folder, change(rng, folder / TARGET))


def change(rng: random.Random, path: Path) -> str:
    """Change the content of a file; return a description of the change."""
    done = []
    with h5py.File(path, "r+") as file:
        for _ in range(rng.choice([1, 1, 2, 3])):
            if not (names := _names(file)):
                break
            name = rng.choice(names)
            if name in file:  # not a link to nowhere
                try:
                    done.append(rng.choice(WAYS)(rng, file, name))
                except Exception as error:
                    done.append(f"not done: {error}")  # HDF5 itself refuses it
    if rng.random() < 0.5:
        append_trailer(path)
        done.append("checksum anew")
    return "; ".join(done)


warm_up = originals
