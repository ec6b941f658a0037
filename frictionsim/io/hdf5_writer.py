"""Write result files in HDF5.

A result file, format version 1, holds

    /                    attributes format_version, frictionsim_version, scenario (TOML with
                         overrides, defaults and CSV signals filled in), kind, backend, title,
                         status (done, failed, interrupted), reason (empty if done and sound),
                         failure (non_finite, diverged, step_underflow, chattering,
                         budget_exceeded, belt_off_pulleys; empty if not failed), warnings
                         (one per line)
    /time                (n,) s, the dimension scale of every channel; strictly increasing: every
                         output.interval and, with output.at_events, at every event. At an event a
                         channel has its value on the sticking side, else the value after the event
    /<channel>           (n,) the channels of the kind: angle, angular_velocity, ...; of belt drives
                         also (n, k), one column for each member of an axis: body, pulley, ...
    /<axis>              (k,) 0, 1, ..., the dimension scale of those columns; attribute `names`,
                         separated by blanks, if the members have names
    /energy_<name>       (n,) J, the energies of the scenario
    /mode                (n,) 0 sticking, +1 and -1 sliding; only with dry friction
    /events/time         (m,) s, the dimension scale of the transitions
    /events/contact      (m,) index into the attribute `flag_meanings`
    /events/mode_from, /events/mode_to    (m,)
    /events/angle        (m,) rad, position of the contact; not of belt drives
    /events/<channel>_before, /events/<channel>_after    (m,) immediately before and after the
                         event: all recorded channels except angle, mode and energies; not of belt
                         drives

    /checkpoint          the state of the solver to resume from, in arrays of float64 or bytes whose
                         names and meaning are internal to the solver, and the run time so far in s,
                         clock.solving and clock.compiling; attribute `digest`, the SHA-256 of
                         these, the scenario and the version, checked on resuming. Only if status
                         is interrupted or failure is budget_exceeded

The table of `frictionsim cost` has another layout: see `write_table`.

With `output.channels` a file has only those channels, time and events. All datasets outside of
/checkpoint are float64 with the attributes `units` and `long_name`; two-dimensional ones are
compressed. A complete file does not depend on when or where it was written: two runs of one
scenario give identical bytes, however often they were interrupted and resumed. The HDF5 data are
followed by a line with their CRC-32.
"""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

from frictionsim import __version__
from frictionsim.io.atomic_write import write_atomically
from frictionsim.io.checksum import checksum_trailer
from frictionsim.io.result_format import FORMAT_VERSION, numbered_members, state_digest
from frictionsim.scenario.loading import resolved_toml

if TYPE_CHECKING:
    from collections.abc import Iterable

    from frictionsim.results import Column
    from frictionsim.scenario.settings import Scenario
    from frictionsim.simulation.simulate import RunResult

CHUNK_BYTES = 128 * 1024
COMPRESSION = {"compression": "gzip", "compression_opts": 4}
MODES = {"flag_values": [-1.0, 0.0, 1.0], "flag_meanings": "sliding_backward stick sliding_forward"}


def write(run: "RunResult", path: Path) -> None:
    """Write a result file atomically: on any error the existing file is kept.

    Parameters
    ----------
    run : RunResult
    path : Path

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    image = _image(run)
    write_atomically(image + checksum_trailer(image), path)


def write_table(scenario: "Scenario", columns: "Iterable[Column]", status: str, path: Path) -> None:
    """Write the table of a work-precision study atomically.

    The file has the attributes of a result, and

        /cost/row            (k,) the dimension scale of the columns: one row for each setting
        /cost/<column>       (k,) backend, setting, overrides, status, reason as text; error,
                             wall_seconds, steps, ... as float64, nan if a value is unknown

    Parameters
    ----------
    scenario : Scenario
    columns : iterable of Column
    status : str
        `done` or `interrupted`.
    path : Path

    Raises
    ------
    OutputError
        If it cannot be written.
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
    # A core file without backing store is in memory only; its name is not used.
    with h5py.File("result.h5", "w", driver="core", backing_store=False) as file:
        _write_attributes(file, run.scenario, run.status, run.reason, run.failure)
        file.attrs["warnings"] = "\n".join(run.warnings)
        time = _add_scale(file, run.time, "time", "s", "time")
        axes: dict[str, Any] = {}
        for name, values in run.channels.items():
            unit, long_name, axis, *_ = run.channel_info[name]
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
        unit, long_name, *_ = run.channel_info[channel]
        _add(events, name, side_values, unit, f"{long_name}, right {side} the event", scale)


def _add_checkpoint(file: Any, state: dict[str, Any]) -> None:
    group = file.create_group("checkpoint")
    for name, values in state.items():
        group[name] = values
    group.attrs["digest"] = state_digest(dict(file.attrs), state)


def _add_axis(group: Any, name: str, members: tuple[str, ...]) -> Any:
    numbers = range(len(members))
    scale = _add_scale(group, numbers, name, "1", f"number of the {name.replace('_', ' ')}, from 0")
    if members != numbered_members(len(members)):
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
    """Return the storage options: contiguous for one dimension, else compressed chunks of rows."""
    if values.ndim < 2 or not values.size:
        return {}
    rows = min(len(values), max(1, CHUNK_BYTES // values[0].nbytes))
    return {"chunks": (rows, values.shape[1]), "shuffle": True, **COMPRESSION}
