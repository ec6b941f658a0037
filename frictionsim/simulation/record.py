"""The record of a run, from its simulation, and its events, sticking phases and jumps."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.results import MODES, OPEN, OTHER_MODES, SLACK, STICK, TAUT, Record, defined
from frictionsim.solvers.system import STOP as END_STOP
from frictionsim.version import __version__

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from frictionsim.results import Channel, SimulationResult, Transition
    from frictionsim.scenario.settings import Scenario
    from frictionsim.simulation.mechanism import Simulation

BREAKAWAY, REST, REVERSAL = "breakaway", "comes to rest", "reverses"
# Of a pulley that no body touches, and of a span or rope with and without tension.
ENGAGEMENT: dict[float, str] = {
    value: word for value, word in MODES if value in (OPEN, TAUT, SLACK)
}
SLIPS, STICKS, IMPACT, LEFT = "slips", "sticks", "impact", "left"


def recorded(scenario: "Scenario", simulation: "Simulation", data: "SimulationResult") -> Record:
    """Return the results of a simulation, with the channels in `output.channels`.

    Integer channels are converted to integers. How the run ended is not in it yet.
    """
    wanted = scenario.output.channels
    info = {
        name: simulation.channel_info[name]
        for name in data.channels
        if name != "time" and (wanted is None or name in wanted)
    }
    channels = {name: _typed(channel, data.channels[name]) for name, channel in info.items()}
    axes = {channel.axis for channel in info.values() if channel.axis}
    return Record(
        attributes=scenario_attributes(scenario) | {"effects": " ".join(simulation.effects)},
        channels={"time": data.channels["time"]} | channels,
        units={"time": "s", **{name: channel.unit for name, channel in info.items()}},
        long_names={"time": "time", **{name: channel.long_name for name, channel in info.items()}},
        axes={"time": "", **{name: channel.axis for name, channel in info.items()}},
        members={axis: simulation.axes[axis] for axis in sorted(axes)},
        **_events(data.transitions, data.sides, info),
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
    fits_a_byte = channel.flags and all(abs(value) < 128 for value, _ in channel.flags)
    return np.int8 if fits_a_byte else np.int32


def _typed(channel: "Channel", values: Any) -> Any:
    return np.asarray(values).astype(stored_type(channel)) if channel.integer else values


def _events(
    transitions: "Sequence[Transition]", sides: "Mapping[str, Any]", info: "dict[str, Channel]"
) -> dict[str, Any]:
    """Return the events as arrays, and the names of their contacts."""
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
    for name, values in sides.items():
        channel = info.get(name.rpartition("_")[0])
        if channel is not None:
            events[name] = _typed(channel, values)
    return {"events": events, "contacts": contacts}


def with_jumps(result: Record, name: str) -> tuple[Any, Any]:
    """Return times and samples of a channel for a line with gaps at its jumps.

    They have both sides of each jump, and NaN between them; and the recorded value at each other
    event that has no sample. A channel of flags, such as a mode, has both values where it changes.
    """
    values = np.asarray(result.channels[name], dtype=float)
    if name in result.flags and values.ndim == 1:
        return _with_steps(result, result.channels["time"], values)
    return insert_jumps(result, name, result.channels["time"], values)


def _with_steps(result: Record, time: Any, values: Any) -> tuple[Any, Any]:
    """Return the samples of flags with both values at each change.

    It is at the event that goes with it, or else at the sample after it.
    """
    before = np.flatnonzero(np.diff(values))
    old, new, at = values[before], values[before + 1], np.array(time[before + 1], dtype=float)
    at_event, mode_from, mode_to = (result.events[of] for of in ("time", "mode_from", "mode_to"))
    # A sample at an event may have either mode.
    sample = np.clip(np.searchsorted(time, at_event, side="right") - 1, 0, len(time) - 1)
    fits = (values[sample] == mode_from) & (mode_from != mode_to)
    fits &= values[np.minimum(sample + 1, len(time) - 1)] == mode_to
    # Of several events the first.
    at[np.searchsorted(before, sample[fits][::-1])] = at_event[fits][::-1]
    places = np.repeat(before + 1, 2)
    time = np.insert(np.asarray(time, dtype=float), places, np.repeat(at, 2))
    return time, np.insert(values, places, np.column_stack([old, new]).ravel())


def insert_jumps(result: Record, name: str, time: Any, values: Any) -> tuple[Any, Any]:
    """Return samples of a channel, or some of them, with its values at events, as `with_jumps`."""
    if name == "angle" and "angle" in result.events:
        return _with_values(result, time, values, np.asarray(result.events["angle"], dtype=float))
    sides = [result.events.get(f"{name}_{side}") for side in ("before", "after")]
    if sides[0] is None or sides[1] is None:
        return time, values
    time, values = _with_values(
        result, time, values, np.where(sides[0] == sides[1], sides[1], np.nan)
    )
    jumps = sides[0] != sides[1]
    # Of several events at one time, the side before the first and that after the last.
    at, first = np.unique(result.events["time"][jumps], return_index=True)
    last = np.append(first[1:], np.count_nonzero(jumps))[: at.size] - 1
    others = ~np.isin(time, at)  # replace the sample at a jump, which is one of its sides
    time, values = time[others], values[others]
    places = np.repeat(np.searchsorted(time, at), 3)
    gap = np.full(at.shape, np.nan)
    jump = np.stack((sides[0][jumps][first], gap, sides[1][jumps][last]), axis=1).ravel()
    return np.insert(time, places, np.repeat(at, 3)), np.insert(values, places, jump)


def _with_values(result: Record, time: Any, values: Any, at_events: Any) -> tuple[Any, Any]:
    """Return samples with the values, but for NaN, at those events where the result has none."""
    every = np.asarray(result.channels["time"])
    events = np.asarray(result.events["time"])
    if not len(every):
        return time, values
    within = (events > every[0]) & (events < every[-1])
    missing = within & ~np.isin(events, every) & ~np.isnan(at_events)
    places = np.searchsorted(time, events[missing])
    return np.insert(time, places, events[missing]), np.insert(values, places, at_events[missing])


def sticking_phases(result: Record, contact: str | None = None) -> Iterator[tuple[float, float]]:
    """Yield start and end of each sticking phase of a contact, as of `Record.events_of`."""
    channel = "mode" if contact is None else OTHER_MODES[contact]
    if result.axes.get(channel) != "":  # no mode, or several contacts
        return
    time, chosen = result.channels["time"], result.events_of(contact)
    resting_since = time[0] if result.channels[channel][0] == 0 else None
    columns = (result.events[name][chosen] for name in ("time", "mode_from", "mode_to"))
    for at, before, mode in zip(*columns, strict=True):
        if mode == before:  # a switching surface was crossed, perhaps in creep
            continue
        if mode == 0:
            resting_since = at
        elif resting_since is not None:
            yield resting_since, at
            resting_since = None
    # A run that was stopped may have events after its last sample.
    if resting_since is not None and resting_since <= time[-1]:
        yield resting_since, time[-1]


def sticking_words(result: Record) -> str:
    """Return the words for sticking phases, in which a cord may move on the shaft that sticks."""
    return "sticking" if result.events_of().all() else "the shaft sticks"


def event_labels(result: Record) -> list[str]:
    """Return the label of each event: by its change of mode, or with the name of its contact."""
    columns = (result.events[name] for name in ("contact", "mode_from", "mode_to"))
    # Of a belt a contact is a pulley, on which the belt slips as a whole or not.
    several = result.attributes["kind"] == "belt_drive"
    return [
        _event_label(result.contacts[int(contact)], before, after, several)
        for contact, before, after in zip(*columns, strict=True)
    ]


def _event_label(contact: str, before: float, after: float, named: bool) -> str:
    if {before, after} & ENGAGEMENT.keys():
        name = contact.replace("_rope", " rope")
        return f"{name}: {IMPACT if before == after else ENGAGEMENT.get(after, 'closed')}"
    if contact == END_STOP:
        return f"{contact}: {LEFT if before == STICK else IMPACT if after != STICK else REST}"
    if before == after:
        return contact
    if named or contact in OTHER_MODES:
        change = STICKS if after == STICK else SLIPS if before == STICK else REVERSAL
        return f"{contact}: {change}"
    if after == 0:
        return REST
    return BREAKAWAY if before == 0 else REVERSAL
