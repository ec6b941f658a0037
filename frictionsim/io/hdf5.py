"""Result files in HDF5: the only module that imports h5py.

A result file, format version 1, holds

    /                    attributes format_version, frictionsim_version, scenario (TOML with
                         overrides, defaults and CSV signals filled in), kind, backend, title,
                         status (done, failed, interrupted), reason (empty if all is well),
                         failure (the kind of it: not_finite, blow_up, step_underflow, event_storm,
                         budget, left_pulleys; empty if it has not failed), warnings (one a line)
    /time                (n,) s, the dimension scale of every channel: strictly increasing, each
                         output.interval and, with output.at_events, at each event. There a channel
                         has the value of the side that sticks, where there is one, else of after it
    /<channel>           (n,) the channels of the kind: angle, angular_velocity, ...; of a kind of
                         many parts (n, k), a column for each member of an axis: body, pulley, ...
    /<axis>              (k,) 0, 1, ..., the dimension scale of those columns; attribute `names`,
                         joined by blanks, where the members have names
    /energy_<name>       (n,) J, the energies that the scenario has
    /mode                (n,) 0 sticking, +1 and -1 sliding; only with dry friction
    /events/time         (m,) s, the dimension scale of the transitions
    /events/contact      (m,) index into the attribute `flag_meanings`
    /events/mode_from, /events/mode_to    (m,)
    /events/angle        (m,) rad, where the contact went over; not of a kind of many parts
    /events/<channel>_before, /events/<channel>_after    (m,) right before and right after the
                         event: all recorded channels but angle, mode and energies; not of a kind
                         of many parts

    /checkpoint          where the run can go on: the state of its solver, in arrays of float64 or
                         bytes whose names and meaning are the solver's own, and the seconds that
                         it has taken, clock.solving and clock.compiling; attribute `digest`,
                         SHA-256 of them, of the scenario and of the version, which a resumption
                         compares. Only where status is interrupted or failure is budget

The table of `frictionsim cost` is a file of another layout: see `write_table`.

With `output.channels` a file has those channels only, time and events. All datasets outside of
/checkpoint are float64 with the attributes `units` and `long_name`; those of two dimensions are
compressed. Nothing in a file that is done depends on when or where it was made: two runs of one
scenario give identical bytes, however often they were interrupted and resumed. Behind the end of
the HDF5 data stands a line with the CRC-32 of all before it.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import h5py
import numpy as np

from frictionsim import __version__
from frictionsim.errors import InputError
from frictionsim.io.atomic_write import write_atomically
from frictionsim.io.checksum import checksum_mismatch, checksum_trailer
from frictionsim.scenario.loading import resolved_toml

if TYPE_CHECKING:
    from collections.abc import Iterable

    from frictionsim.results import Column
    from frictionsim.scenario.settings import Scenario
    from frictionsim.simulation.simulate import RunResult

FORMAT_VERSION = 1
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
CHUNK_BYTES = 128 * 1024
# The method of gzip does not compress better: a dataset that claims more is not all there.
MAX_GZIP_RATIO = 1032
COMPRESSION = {"compression": "gzip", "compression_opts": 4}
MODES = {"flag_values": [-1.0, 0.0, 1.0], "flag_meanings": "sliding_backward stick sliding_forward"}


def write(run: "RunResult", path: Path) -> None:
    """Write a result file, whole or not at all; whatever goes wrong, an older one stays.

    Raises
    ------
    OutputError
    """
    image = _image(run)
    write_atomically(image + checksum_trailer(image), path)


def write_table(scenario: "Scenario", columns: "Iterable[Column]", status: str, path: Path) -> None:
    """Write a table of settings of one scenario, whole or not at all.

    The file has the attributes of a result, and

        /cost/row            (k,) the dimension scale of the columns: a row for each setting
        /cost/<column>       (k,) backend, setting, overrides, status, reason as text; error,
                             wall_seconds, steps, ... as float64, nan where a value is not known

    Raises
    ------
    OutputError
    """
    with h5py.File("result.h5", "w", driver="core", backing_store=False) as file:
        _write_attributes(file, scenario, status)
        group = file.create_group("cost")
        for number, (name, unit, long_name, values) in enumerate(columns):
            if number == 0:
                scale = _add_scale(group, range(len(values)), "row", "1", "number of the row")
            if unit:
                _add(group, name, values, unit, long_name, scale)
                continue
            texts = group.create_dataset(name, data=values, dtype=h5py.string_dtype())
            texts.attrs["long_name"] = long_name
            texts.dims[0].attach_scale(scale)
        file.flush()
        image = bytes(file.id.get_file_image())
    write_atomically(image + checksum_trailer(image), path)


def _image(run: "RunResult") -> bytes:
    """Return the bytes of the result file of a run."""
    # A core file without backing store never touches the disk; its name is only a label.
    with h5py.File("result.h5", "w", driver="core", backing_store=False) as file:
        _write_attributes(file, run.scenario, run.status, run.reason, run.failure)
        file.attrs["warnings"] = "\n".join(run.warnings)
        time = _add_scale(file, run.time, "time", "s", "time")
        axes: dict[str, Any] = {}
        for name, values in run.channels.items():
            unit, long_name, axis = run.channel_info[name]
            if axis and axis not in axes:
                axes[axis] = _add_axis(file, axis, run.axes[axis])
            scales = (time, axes[axis]) if axis else (time,)
            dataset = _add(file, name, values, unit, long_name, *scales)
            if name == "mode":
                dataset.attrs.update(MODES)
        _add_transitions(file.create_group("events"), run)
        if run.checkpoint is not None:
            _add_checkpoint(file, run.checkpoint)
        file.flush()
        return bytes(file.id.get_file_image())


def _write_attributes(
    file: Any, scenario: "Scenario", status: str, reason: str = "", failure: str = ""
) -> None:
    """Set the root attributes."""
    file.attrs["format_version"] = FORMAT_VERSION
    file.attrs["frictionsim_version"] = __version__
    file.attrs["scenario"] = resolved_toml(scenario)
    file.attrs["kind"] = scenario.kind
    file.attrs["backend"] = scenario.solver.backend
    file.attrs["title"] = scenario.title
    file.attrs["status"] = status
    file.attrs["reason"] = reason
    file.attrs["failure"] = failure


def _add_transitions(events: Any, run: "RunResult") -> None:
    transitions = run.transitions
    names = sorted({transition.contact for transition in transitions})
    scale = _add_scale(events, [e.time for e in transitions], "time", "s", "time of the transition")
    contact = _add(
        events,
        "contact",
        [names.index(e.contact) for e in transitions],
        "1",
        "contact, index into flag_meanings",
        scale,
    )
    contact.attrs["flag_values"] = np.arange(len(names), dtype=np.float64)
    contact.attrs["flag_meanings"] = " ".join(names)
    for name, values in (
        ("mode_from", [e.mode_from for e in transitions]),
        ("mode_to", [e.mode_to for e in transitions]),
    ):
        dataset = _add(events, name, values, "1", name.replace("_", " "), scale)
        dataset.attrs.update(MODES)
    angles = [e.position for e in transitions]
    if None not in angles:
        _add(events, "angle", angles, "rad", "angle at the transition", scale)
    for name, side_values in run.sides.items():
        channel, _, side = name.rpartition("_")
        unit, long_name, _ = run.channel_info[channel]
        _add(events, name, side_values, unit, f"{long_name}, right {side} the event", scale)


def _add_checkpoint(file: Any, state: dict[str, Any]) -> None:
    group = file.create_group("checkpoint")
    for name, values in state.items():
        group[name] = values
    group.attrs["digest"] = _digest(dict(file.attrs), state)


def _digest(attributes: dict[str, Any], state: dict[str, Any]) -> str:
    """Return a sum that changes with any bit of a state or of the scenario that it belongs to."""
    from hashlib import sha256

    digest = sha256()
    for key in ("scenario", "kind", "frictionsim_version"):
        digest.update(repr(str(attributes[key])).encode())
    for name in sorted(state):
        values = state[name]
        digest.update(repr((name, values.dtype.str, values.shape)).encode())
        digest.update(values.tobytes())
    return digest.hexdigest()


def _add_axis(group: Any, name: str, members: tuple[str, ...]) -> Any:
    numbers = range(len(members))
    scale = _add_scale(group, numbers, name, "1", f"number of the {name.replace('_', ' ')}, from 0")
    if members != _numbered(len(members)):
        scale.attrs["names"] = " ".join(members)
    return scale


def _add_scale(group: Any, values: Any, name: str, unit: str, long_name: str) -> Any:
    scale = _add(group, name, values, unit, long_name)
    scale.make_scale(name)
    return scale


def _add(group: Any, name: str, values: Any, unit: str, long_name: str, *scales: Any) -> Any:
    values = np.asarray(values, dtype=np.float64)
    dataset = group.create_dataset(name, data=values, **_storage(values))
    dataset.attrs["units"] = unit
    dataset.attrs["long_name"] = long_name
    for dimension, scale in zip(dataset.dims, scales, strict=False):
        dimension.attach_scale(scale)
    return dataset


def _storage(values: Any) -> dict[str, Any]:
    """Return how a dataset is stored: whole if it is small, else compressed chunks of rows."""
    if values.ndim < 2 or not values.size:
        return {}
    rows = min(len(values), max(1, CHUNK_BYTES // values[0].nbytes))
    return {"chunks": (rows, values.shape[1]), "shuffle": True, **COMPRESSION}


def _numbered(count: int) -> tuple[str, ...]:
    """Return the names of members that have none."""
    return tuple(map(str, range(count)))


class Result(NamedTuple):
    """A result file, read whole.

    Attributes
    ----------
    attributes : dict of str
    channels : dict of (n,) or (n, k) arrays, `time` among them
    units, long_names : dict of str
    axes : dict of str
        What the columns of a channel belong to; empty for a channel of (n,).
    members : dict of tuple of str
        The names of the members of each axis, or their numbers.
    events : dict of (m,) arrays, `time` among them
    contacts : list of str
        What the indices of `events["contact"]` stand for.
    """

    attributes: dict[str, str]
    channels: dict[str, Any]
    units: dict[str, str]
    long_names: dict[str, str]
    axes: dict[str, str]
    members: dict[str, tuple[str, ...]]
    events: dict[str, Any]
    contacts: list[str]


def read(path: Path) -> Result:
    """Read a result file.

    Raises
    ------
    InputError
        If it is not there, not HDF5, not of frictionsim, or of another format version.
    """
    with _opened(path) as file:
        return _read(file)


def may_be_done(path: Path) -> bool:
    """Return whether a file holds a result that is done, or something that cannot be told.

    An empty file holds nothing.
    """
    try:
        empty = path.stat().st_size == 0
    except OSError:  # nothing can be there
        return False
    try:
        if empty or checksum_mismatch(path):
            return not empty
        with h5py.File(path, "r") as file:
            return _text(file.attrs["status"]) not in ("interrupted", "failed")
    except (OSError, KeyError, TypeError, ValueError, AttributeError, RuntimeError):
        return True


class Checkpoint(NamedTuple):
    """What a run can go on from: its scenario as TOML, and the state of its solver."""

    scenario: str
    state: dict[str, Any]


def read_checkpoint(path: Path) -> Checkpoint:
    """Read what a result file has for its run to go on.

    Raises
    ------
    InputError
        As `read`; or if the run is done, cannot go on, or is of another version of the program.
    """
    with _opened(path) as file:
        attributes = _attributes(file)
        reason = _resume_obstacle(file, attributes)
        if reason:
            raise InputError(f"{path}: cannot resume this run: {reason}")
        state = {name: _check_size(item)[...] for name, item in file["checkpoint"].items()}
        if file["checkpoint"].attrs["digest"] != _digest(attributes, state):
            raise InputError(f"{path}: cannot resume this run: its checkpoint is damaged")
    return Checkpoint(attributes["scenario"], state)


def _resume_obstacle(file: Any, attributes: dict[str, str]) -> str:
    if attributes["status"] == "done":
        return "it is done"
    if attributes["frictionsim_version"] != __version__:
        return (
            f"it is of version {attributes['frictionsim_version']}, this is {__version__}; solve"
            " its scenario anew"
        )
    if "checkpoint" not in file:
        return f"it has no checkpoint ({attributes['status']}: {attributes['reason']})"
    return ""


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """Open a result file of this format; what is wrong with it in here is said of the file."""
    try:
        if checksum_mismatch(path):
            raise InputError(f"{path}: cannot read this result: it is damaged")
        with h5py.File(path, "r") as file:
            version = file.attrs["format_version"]
            if version != FORMAT_VERSION:
                raise InputError(
                    f"{path}: format version {version} of a result, this program reads"
                    f" {FORMAT_VERSION}"
                )
            if "cost" in file:
                raise InputError(f"{path}: this is a table of `frictionsim cost`, not of a run")
            yield file
    except OSError as error:
        raise InputError(f"{path}: cannot read this result: {_why_not_open(path)}") from error
    except (KeyError, TypeError, ValueError, AttributeError, RuntimeError) as error:
        raise InputError(
            f"{path}: cannot read this result: it is HDF5, but not of frictionsim"
        ) from error


def _why_not_open(path: Path) -> str:
    if path.is_dir():
        return "this is a folder; give the name of a result file"
    return "it is not a readable HDF5 file" if path.is_file() else "there is no such file"


def _attributes(file: Any) -> dict[str, str]:
    """Return the root attributes, all that there must be among them."""
    missing = [name for name in ATTRIBUTES if name not in file.attrs]
    if missing:
        raise KeyError(*missing)
    return {key: _text(value) for key, value in file.attrs.items()}


def _read(file: Any) -> Result:
    attributes = _attributes(file)
    found = {name: _check_size(item) for name, item in file.items() if name not in GROUPS}
    scales = {name for name, item in found.items() if item.is_scale and name != "time"}
    datasets = {name: item for name, item in found.items() if name not in scales}
    events = {name: _values(_check_size(item)) for name, item in file["events"].items()}
    contacts = _text(file["events/contact"].attrs["flag_meanings"]).split()
    result = Result(
        attributes=attributes,
        channels={name: _values(item) for name, item in datasets.items()},
        units={name: _text(item.attrs["units"]) for name, item in datasets.items()},
        long_names={name: _text(item.attrs["long_name"]) for name, item in datasets.items()},
        axes={name: _axis_of(item) for name, item in datasets.items()},
        members={name: _members(found[name]) for name in sorted(scales)},
        events=events,
        contacts=contacts,
    )
    _check_shapes(result)
    return result


def _text(value: Any) -> str:
    """Return an attribute as text that can be printed, also where its bytes are none."""
    return str(value).encode("utf-8", "replace").decode()


def _axis_of(dataset: Any) -> str:
    """Return what the columns of a dataset belong to; empty if it has no columns."""
    return next(iter(dataset.dims[1].keys()), "") if dataset.ndim > 1 else ""


def _members(scale: Any) -> tuple[str, ...]:
    names = scale.attrs.get("names")
    members = _numbered(scale.size) if names is None else tuple(_text(names).split())
    if scale.shape != (len(members),):
        raise ValueError(f"{scale.name} is no axis")
    return members


def _check_shapes(result: Result) -> None:
    """See that all channels are over one time, and events name contacts that there are."""
    for channels, axes in ((result.channels, result.axes), (result.events, {})):
        n = channels["time"].size
        for name, values in channels.items():
            axis = axes.get(name, "")
            if values.shape != ((n, len(result.members[axis])) if axis else (n,)):
                raise ValueError(f"{name} is not a channel over time")
    contact, *_ = (result.events[name] for name in ("contact", "mode_from", "mode_to"))
    if not np.all(np.isin(contact, np.arange(len(result.contacts)))):
        raise ValueError("an event is of a contact without a name")


def _check_size(dataset: Any) -> Any:
    """Return a dataset, unless it claims more than its file can hold."""
    size = dataset.file.id.get_filesize()
    if not isinstance(dataset, h5py.Dataset) or dataset.nbytes > MAX_GZIP_RATIO * size:
        raise ValueError(f"{dataset.name} is no channel")
    return dataset


def _values(dataset: Any) -> Any:
    if dataset.dtype.kind not in "fiub":
        raise TypeError(f"{dataset.name} is not of real numbers")
    return np.asarray(dataset[...], dtype=np.float64)
