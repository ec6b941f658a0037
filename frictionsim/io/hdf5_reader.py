"""Read result files in HDF5 and check them; `hdf5_writer` documents the format."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import h5py
import numpy as np

from frictionsim import __version__
from frictionsim.errors import InputError
from frictionsim.io.checksum import checksum_mismatch
from frictionsim.io.result_format import FORMAT_VERSION, numbered_members, state_digest
from frictionsim.results import Record

ATTRIBUTES = (
    "backend",
    "frictionsim_version",
    "kind",
    "reason",
    "scenario",
    "status",
    "title",
)
GROUPS = ("events", "checkpoint")
# DEFLATE's maximum ratio is 1032:1; a larger claim means a damaged file.
MAX_GZIP_RATIO = 1032


def read(path: Path) -> Record:
    """Read a result file.

    Raises
    ------
    InputError
        If it does not exist, is not HDF5, not a frictionsim result, or of another format version.
    """
    with _opened(path) as file:
        return _read(file)


def may_be_done(path: Path) -> bool:
    """Return whether a file holds a complete result or cannot be read; false for an empty file."""
    try:
        empty = path.stat().st_size == 0
    except OSError:  # no such file
        return False
    try:
        if empty or checksum_mismatch(path):
            return not empty
        with h5py.File(path, "r") as file:
            return _text(file.attrs["status"]) not in ("interrupted", "failed")
    except (OSError, KeyError, TypeError, ValueError, AttributeError, RuntimeError):
        return True


class Checkpoint(NamedTuple):
    """The data to resume a run: its scenario as TOML and the state of its solver."""

    scenario: str
    state: dict[str, Any]


def read_checkpoint(path: Path) -> Checkpoint:
    """Read the checkpoint of a result file.

    Raises
    ------
    InputError
        As `read`; or if the run is done, has no checkpoint, or was written by another version.
    """
    with _opened(path) as file:
        attributes = _attributes(file)
        reason = _resume_obstacle(file, attributes)
        if reason:
            raise InputError(f"{path}: cannot resume this run: {reason}")
        state = {name: _check_size(item)[...] for name, item in file["checkpoint"].items()}
        if file["checkpoint"].attrs["digest"] != state_digest(attributes, state):
            raise InputError(f"{path}: cannot resume this run: its checkpoint is damaged")
    return Checkpoint(attributes["scenario"], state)


def _resume_obstacle(file: Any, attributes: dict[str, str]) -> str:
    if attributes["status"] == "done":
        return "it is done"
    if attributes["frictionsim_version"] != __version__:
        return (
            f"it was written by version {attributes['frictionsim_version']}, this is {__version__};"
            " solve its scenario again"
        )
    if "checkpoint" not in file:
        return f"it has no checkpoint ({attributes['status']}: {attributes['reason']})"
    return ""


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """Open a result file; errors within the context become InputError with the file's name."""
    try:
        if checksum_mismatch(path):
            raise InputError(
                f"{path}: cannot read this result: it is damaged (its checksum does not match)"
            )
        with h5py.File(path, "r") as file:
            version = file.attrs["format_version"]
            if version != FORMAT_VERSION:
                raise InputError(
                    f"{path}: cannot read this result: its format version is {version}, this"
                    f" program reads version {FORMAT_VERSION}"
                )
            if "cost" in file:
                raise InputError(
                    f"{path}: this is a table of `frictionsim cost`, not the result of a run"
                )
            yield file
    except OSError as error:
        raise InputError(f"{path}: cannot read this result: {_why_not_open(path)}") from error
    except (KeyError, TypeError, ValueError, AttributeError, RuntimeError) as error:
        raise InputError(
            f"{path}: cannot read this result: it is HDF5, but not a frictionsim result"
        ) from error


def _why_not_open(path: Path) -> str:
    if path.is_dir():
        return "this is a folder; give the name of a result file"
    return "it is not a readable HDF5 file" if path.is_file() else "there is no such file"


def _attributes(file: Any) -> dict[str, str]:
    """Return the root attributes; raise KeyError if a required one is missing."""
    missing = [name for name in ATTRIBUTES if name not in file.attrs]
    if missing:
        raise KeyError(*missing)
    return {key: _text(value) for key, value in file.attrs.items()}


def _read(file: Any) -> Record:
    attributes = _attributes(file)
    every = {name: _check_size(item) for name, item in file.items() if name not in GROUPS}
    scales = {name for name, item in every.items() if item.is_scale and name != "time"}
    datasets = {name: item for name, item in every.items() if name not in scales}
    events = {name: _values(_check_size(item)) for name, item in file["events"].items()}
    contacts = _text(file["events/contact"].attrs["flag_meanings"]).split()
    result = Record(
        attributes=attributes,
        channels={name: _values(item) for name, item in datasets.items()},
        units={name: _text(item.attrs["units"]) for name, item in datasets.items()},
        long_names={name: _text(item.attrs["long_name"]) for name, item in datasets.items()},
        axes={name: _axis_of(item) for name, item in datasets.items()},
        members={name: _members(every[name]) for name in sorted(scales)},
        events=events,
        contacts=contacts,
    )
    _check_shapes(result)
    return result


def _text(value: Any) -> str:
    """Return an attribute as printable text; bytes that are not UTF-8 are replaced."""
    return str(value).encode("utf-8", "replace").decode()


def _axis_of(dataset: Any) -> str:
    """Return the axis of the columns of a dataset; empty if it has no columns."""
    return next(iter(dataset.dims[1].keys()), "") if dataset.ndim > 1 else ""


def _members(scale: Any) -> tuple[str, ...]:
    names = scale.attrs.get("names")
    members = numbered_members(scale.size) if names is None else tuple(_text(names).split())
    if scale.shape != (len(members),):
        raise ValueError(f"{scale.name} is not an axis")
    return members


def _check_shapes(result: Record) -> None:
    """Check that all channels have the length of the time, and that contacts have names."""
    for channels, axes in ((result.channels, result.axes), (result.events, {})):
        n = channels["time"].size
        for name, values in channels.items():
            axis = axes.get(name, "")
            if values.shape != ((n, len(result.members[axis])) if axis else (n,)):
                raise ValueError(f"{name} is not a channel over time")
    contact, *_ = (result.events[name] for name in ("contact", "mode_from", "mode_to"))
    if not np.all(np.isin(contact, np.arange(len(result.contacts)))):
        raise ValueError("an event has a contact without a name")


def _check_size(dataset: Any) -> Any:
    """Return a dataset; raise ValueError if it claims more data than its file can hold."""
    size = dataset.file.id.get_filesize()
    if not isinstance(dataset, h5py.Dataset) or dataset.nbytes > MAX_GZIP_RATIO * size:
        raise ValueError(f"{dataset.name} is not a channel")
    return dataset


def _values(dataset: Any) -> Any:
    if dataset.dtype.kind not in "fiub":
        raise TypeError(f"{dataset.name} does not hold real numbers")
    return np.asarray(dataset[...], dtype=np.float64)
