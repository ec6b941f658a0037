"""The record of a run, from its simulation."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.results import Record, defined
from frictionsim.simulation.stored_channel import StoredChannel
from frictionsim.version import __version__

if TYPE_CHECKING:
    from frictionsim.results import Channel, SimulationResult
    from frictionsim.scenario.settings import Scenario
    from frictionsim.simulation.base import Simulation


def recorded(scenario: "Scenario", simulation: "Simulation", data: "SimulationResult") -> Record:
    """Return the results of a simulation, with the channels in `output.channels`.

    Integer channels are converted to integers. How the run ended is not in it yet.
    """
    wanted = scenario.output.channels
    channels = {
        name: channel for name, channel in data.channels.items() if wanted is None or name in wanted
    }
    info = {name: simulation.channel_info[name] for name in channels}
    axes = {channel.axis for channel in info.values() if channel.axis}
    return Record(
        attributes=scenario_attributes(scenario) | {"effects": " ".join(simulation.effects)},
        channels={"time": data.time, **{n: _typed(info[n], v) for n, v in channels.items()}},
        units={"time": "s", **{name: channel.unit for name, channel in info.items()}},
        long_names={"time": "time", **{name: channel.long_name for name, channel in info.items()}},
        axes={"time": "", **{name: channel.axis for name, channel in info.items()}},
        members={axis: simulation.axes[axis] for axis in sorted(axes)},
        **_events(data, info),
        flags={name: channel.flags for name, channel in info.items() if channel.flags},
        quantities=defined(data.quantities),
        checks=data.checks,
    )


def scenario_attributes(scenario: "Scenario") -> dict[str, str]:
    """Return the attributes of a file that describe its scenario, as text."""
    return {
        "frictionsim_version": __version__,
        "scenario": scenario.to_toml(),
        "source": Path(scenario.origin.source).name,
        "overrides": "\n".join(scenario.origin.overrides),
        "command": scenario.origin.command,
        "kind": scenario.kind,
        "law": scenario.law,
        "backend": scenario.solver.backend,
        "title": scenario.title,
    }


def stored_type(channel: "Channel") -> Any:
    """Return the numpy type that a result file has for a channel."""
    if not channel.integer:
        return np.float64
    return np.int8 if _is_small(channel) else np.int32


def _typed(channel: "Channel", values: Any) -> Any:
    if not channel.integer:
        return values
    if isinstance(values, StoredChannel):
        return StoredChannel(values.source, values.name, values.shape, stored_type(channel))
    return np.asarray(values).astype(stored_type(channel))


def _is_small(channel: "Channel") -> bool:
    """Return whether the values of a channel are known to fit into a byte."""
    return bool(channel.flags) and all(abs(value) < 128 for value, _ in channel.flags)


def _events(data: "SimulationResult", info: "dict[str, Channel]") -> dict[str, Any]:
    """Return the events as arrays, and the names of their contacts."""
    transitions = data.transitions
    contacts = sorted({e.contact for e in transitions})
    number = {name: i for i, name in enumerate(contacts)}
    events = {
        "time": np.array([e.time for e in transitions], dtype=np.float64),
        "contact": np.array([number[e.contact] for e in transitions], dtype=np.int32),
        "mode_from": np.array([e.mode_from for e in transitions], dtype=np.int8),
        "mode_to": np.array([e.mode_to for e in transitions], dtype=np.int8),
    }
    if not transitions:  # the same as a file without events gives
        return {"events": events, "contacts": contacts}
    angles = [e.position for e in transitions]
    if None not in angles:
        events["angle"] = np.array(angles, dtype=np.float64)
    for name, values in data.sides.items():
        channel = info.get(name.rpartition("_")[0])
        if channel is not None:
            events[name] = _typed(channel, values)
    return {"events": events, "contacts": contacts}
