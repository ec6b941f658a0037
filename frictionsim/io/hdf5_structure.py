"""Checks of the structure of a result file, before any of its data are read.

Damage is told by the checksum before HDF5 opens a file. Structures that are refused here would read
other files (links, external and virtual storage), load code (filters that are not built in) or fill
memory.
"""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from math import prod
from typing import Any

import h5py
import numpy as np

from frictionsim.errors import InputError
from frictionsim.io.result_format import MAX_LABEL, MAX_TEXT
from frictionsim.results import Flags

NOT_HDF5 = "it is not a readable HDF5 file"
# DEFLATE's maximum ratio is 1032:1; a larger claim means a damaged file.
MAX_GZIP_RATIO = 1032
MAX_MEMBERS = 2000  # of all groups; a belt's checkpoint has some hundred
MAX_ATTRIBUTES = 64  # of one object
MAX_SCENARIO = 64 * 2**20  # it holds the data of CSV signals
LONG_TEXTS = ("scenario", "study", "segments", "order")
LABELS = ("units", "long_name")  # printed with numbers and drawn at axes
MAX_NAMES = 100_000
MAX_AXIS = 10**6
FREE_BYTES = 256 * 2**20  # that any file may claim, however small it is
FILTERS = {h5py.h5z.FILTER_DEFLATE: "gzip", h5py.h5z.FILTER_SHUFFLE: "shuffle"}
NUMBERS = (h5py.h5t.INTEGER, h5py.h5t.FLOAT, h5py.h5t.ENUM)


class CheckedFile:
    """An open file: what is read of it is checked first, and its data in memory are limited.

    Uncompressed data fill the file; channels of a long run stay in the file, which has all of them.

    ValueError or TypeError is raised if no file of frictionsim has such objects or data.
    """

    def __init__(self, root: Any) -> None:
        self.root = root
        size = root.id.get_filesize()
        self._free_stored = size
        self._free_bytes = min(MAX_GZIP_RATIO * size, FREE_BYTES + 2 * size)
        self._free_members = MAX_MEMBERS

    def claim(self, count: int, name: str) -> None:
        """Claim some bytes; raise ValueError if there are fewer."""
        self._free_bytes -= count
        if self._free_bytes < 0:
            raise ValueError(f"{name}: the file claims more data than it can hold")

    def members(self, group: Any) -> Iterator[tuple[str, Any]]:
        """Yield the names and objects of a group, which must be hard links within the file."""
        self._free_members -= len(group)
        if self._free_members < 0:
            raise ValueError("the file has too many datasets")
        for name in group:
            if len(name) > MAX_TEXT or not name.isprintable():  # false if it is not UTF-8
                raise ValueError("a name is not printable")
            if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                raise ValueError(f"{name} is a link to elsewhere")
            yield name, group[name]

    def datasets(self, group: Any) -> Iterator[tuple[str, Any]]:
        """Yield the names and members of a group, which must be datasets; none if it is None."""
        for name, item in self.members(group) if group is not None else ():
            yield name, checked_dataset(item, name)

    def texts_of(self, item: Any) -> dict[str, str]:
        """Return the scalar attributes of an object as printable text."""
        _check_attributes(item)
        return {
            name: self.text_of(item, name)
            for name in item.attrs
            if name.isprintable() and item.attrs.get_id(name).shape == ()
        }

    def text_of(self, item: Any, name: str) -> str:
        """Return a short attribute as text; bytes that are not UTF-8 are replaced.

        Labels are cut to one line of at most MAX_LABEL characters.
        """
        attribute = item.attrs.get_id(name)
        if attribute.shape != () or not _is_plain(attribute.get_type()):
            raise ValueError(f"{name} is not a text")
        value = item.attrs[name]
        text = str(value).encode("utf-8", "replace").decode()
        if len(text) > (MAX_SCENARIO if name in LONG_TEXTS else MAX_TEXT):
            raise ValueError(f"{name} is too long")
        if name in LABELS:  # drawing thousands of lines would take seconds
            text = " ".join(text[:MAX_LABEL].split())
        self.claim(4 * len(text), name)
        return text

    def flags_of(self, dataset: Any) -> Flags:
        """Return the meanings of the values of a dataset."""
        meanings = self.text_of(dataset, "flag_meanings").split()
        return tuple(zip(integers_of(dataset, "flag_values"), meanings, strict=True))

    def values_of(self, dataset: Any) -> Any:
        """Return the real numbers of a dataset as float64, or as integers of their type."""
        self.claim(dataset.nbytes, dataset.name)
        return rows_of(dataset, ...)

    def check_stored(self, dataset: Any) -> None:
        """Check that all samples of a channel that is read by rows are in the file.

        Samples that were never written take no space, and as long to read as others.
        """
        stored = dataset.id.get_storage_size()
        self._free_stored -= stored
        ratio = 1 if dataset.chunks is None else MAX_GZIP_RATIO
        is_whole = dataset.nbytes <= ratio * stored
        if dataset.chunks is not None:
            counts = (
                -(-size // chunk) for size, chunk in zip(dataset.shape, dataset.chunks, strict=True)
            )
            is_whole &= dataset.id.get_num_chunks() == prod(counts)
        if not is_whole or self._free_stored < 0:
            raise ValueError(f"{dataset.name}: not all samples are in the file")

    def names_of(self, dataset: Any) -> tuple[str, ...]:
        """Return the texts of a dataset."""
        if dataset.ndim != 1 or not holds_text(dataset):
            raise ValueError(f"{dataset.name} does not hold names")
        if dataset.size > MAX_NAMES:
            raise ValueError(f"{dataset.name} has too many names")
        self.claim(dataset.nbytes, dataset.name)
        names = []
        for start in range(0, dataset.size, 64):  # texts of any length may be in a file many times
            for text in dataset.asstr(errors="replace")[start : start + 64]:
                if len(text) > MAX_TEXT or not str(text).isprintable():
                    raise ValueError(f"{dataset.name}: a name is not printable")
                self.claim(4 * len(text), dataset.name)
                names.append(str(text))
        return tuple(names)


@contextmanager
def opened(path: str, what: str, why: Callable[[Exception], str]) -> Iterator[CheckedFile]:
    """Open a file; errors within the context become InputError with its name and a reason."""
    try:
        # Without locks: files are replaced as a whole, and some file systems do not grant one.
        with h5py.File(path, "r", locking=False) as file:
            yield CheckedFile(file)
    except InputError:
        raise
    except MemoryError:
        raise InputError(f"{path}: cannot read this {what}: it does not fit into memory") from None
    except Exception as error:  # any error of h5py about a malformed file
        raise InputError(f"{path}: cannot read this {what}: {why(error)}") from None


def check_version(file: CheckedFile, path: str, what: str, name: str, known: Sequence[int]) -> None:
    """Check that the format version of a file is known."""
    version = integers_of(file.root, name)[0]
    if version not in known:
        versions = f"version {known[0]}"
        if len(known) > 1:
            versions = f"versions {min(known)} to {max(known)}"
        raise InputError(
            f"{path}: cannot read this {what}: its format version is {version}, this program reads"
            f" {versions}"
        )


def checked_group(item: Any, name: str) -> Any:
    """Return a group; raise ValueError if it is none."""
    if not isinstance(item, h5py.Group):
        raise ValueError(f"{name} is not a group")
    _check_attributes(item)
    return item


def checked_dataset(item: Any, name: str) -> Any:
    """Return a dataset; raise ValueError if no result has one of its type and storage."""
    if not isinstance(item, h5py.Dataset):
        raise ValueError(f"{name} is not a dataset")
    _check_attributes(item)
    kind, storage = item.id.get_type(), item.id.get_create_plist()
    if kind.committed() or not _is_plain(kind):
        raise ValueError(f"{name} has values of a type that no result has")
    layout = storage.get_layout()
    if layout not in (h5py.h5d.COMPACT, h5py.h5d.CONTIGUOUS, h5py.h5d.CHUNKED):
        raise ValueError(f"{name} is a view of other data")
    if storage.get_external_count():
        raise ValueError(f"{name} is stored in other files")
    if any(storage.get_filter(i)[0] not in FILTERS for i in range(storage.get_nfilters())):
        raise ValueError(f"{name} is compressed in a way that no result is")
    return item


def _is_plain(kind: Any) -> bool:
    if kind.get_class() == h5py.h5t.STRING:
        return True
    return kind.get_class() in NUMBERS and kind.get_size() <= 16


def _check_attributes(item: Any) -> None:
    if len(item.attrs) > MAX_ATTRIBUTES:
        raise ValueError(f"{item.name} has too many attributes")


def integers_of(item: Any, name: str) -> list[int]:
    """Return an attribute of a few integers."""
    attribute = item.attrs.get_id(name)
    if attribute.get_storage_size() > MAX_TEXT or attribute.get_type().get_class() not in NUMBERS:
        raise ValueError(f"{name} does not hold integers")
    return [int(value) for value in np.atleast_1d(item.attrs[name]).tolist()]


def rows_of(dataset: Any, rows: Any) -> Any:
    """Return rows of a dataset of real numbers as `CheckedFile.values_of`."""
    if dataset.dtype.kind not in "fiub":
        raise TypeError(f"{dataset.name} does not hold real numbers")
    return np.asarray(dataset[rows]).astype(type_of(dataset), copy=False)


def holds_text(dataset: Any) -> bool:
    """Return whether a dataset holds text."""
    return h5py.check_string_dtype(dataset.dtype) is not None


def type_of(dataset: Any) -> Any:
    """Return the type of the values of a dataset in memory."""
    return dataset.dtype if dataset.dtype.kind == "i" else np.dtype(np.float64)
