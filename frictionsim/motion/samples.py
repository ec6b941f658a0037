"""The samples of a result that are the frames of a motion, and its channels there."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.display import CONTACT_WORDS, MAX_DRAWN
from frictionsim.errors import InputError
from frictionsim.motion.parts import Readout
from frictionsim.scenario.loading import scenario_from_result
from frictionsim.scenario.toml_data import scenario_of

if TYPE_CHECKING:
    from frictionsim.motion.parts import Array, Integers
    from frictionsim.results import Record

MAX_FRAMES = 601  # more make a file large, and a second has 30 to 60 of them
MAX_EVENTS = 300  # whose samples are frames besides; a motion with more chatters
REFUSED = "cannot show this result in motion"


def scenario_in(record: "Record") -> Any:
    """Return the scenario of a result."""
    return scenario_from_result(Path("result"), record.attributes)


def effect_in(record: "Record", name: str) -> Any:
    """Return an effect of the scenario of a result; None without it."""
    if name not in scenario_of(record).get("effects", {}):
        return None
    return getattr(scenario_in(record).effects, name)


class Samples:
    """Samples of a result, evenly spaced with those at events; `samples[name]` is a channel there.

    Or the only one of a number that is given.

    Attributes
    ----------
    record : Record
    numbers : (frames,) of int
    """

    def __init__(
        self, record: "Record", sample: int | None = None, count: int = MAX_FRAMES
    ) -> None:
        self.record = record
        time = np.asarray(self._channel("time"), dtype=float)
        if not len(time):
            raise InputError(f"{REFUSED}: it has no samples")
        if not np.all(np.diff(time) >= 0.0) or not np.all(np.abs(time) <= MAX_DRAWN):
            raise InputError(f"{REFUSED}: its times do not increase")
        if len(time) > count:
            wanted = np.linspace(time[0], time[-1], count)
            after = np.clip(np.searchsorted(time, wanted), 1, len(time) - 1)
            evenly = np.where(wanted - time[after - 1] < time[after] - wanted, after - 1, after)
        else:
            evenly = np.arange(len(time))
        at_events = np.searchsorted(time, np.asarray(record.events["time"])[:MAX_EVENTS])
        numbers = np.union1d(evenly, at_events[at_events < len(time)])
        # Two samples at one time are the sides of an event: the last of them is what follows it.
        numbers = numbers[np.diff(time[numbers], append=np.inf) > 0.0]
        self.numbers: Integers = numbers if sample is None else np.array([sample])
        self.time: Array = time[self.numbers]

    def __contains__(self, name: str) -> bool:
        """Return whether the result has a channel."""
        return name in self.record.channels

    def __getitem__(self, name: str) -> Any:
        """Return a channel, (frames,) or (frames, members of its axis)."""
        return self._checked(name, np.asarray(self._channel(name)[self.numbers]))

    def whole(self, name: str) -> Any:
        """Return a channel at all samples of the result, of which the first is its start."""
        return self._checked(name, np.asarray(self._channel(name)))

    def _checked(self, name: str, values: Any) -> Any:
        if values.dtype.kind == "f" and not np.all(np.abs(values) <= MAX_DRAWN):
            raise InputError(
                f"{REFUSED}: '{name}' has numbers that are not finite or above {MAX_DRAWN:g}"
            )
        return values

    def get(self, name: str, default: Any = None) -> Any:
        """Return a channel, or something else where the result has none of that name."""
        return self[name] if name in self else default  # noqa: SIM401  this is that function

    def _channel(self, name: str) -> Any:
        if name not in self:
            raise InputError(f"{REFUSED}: it has no channel {name} (see output.channels)")
        return self.record.channels[name]

    @property
    def still(self) -> "Array":
        """Zeros, (frames,)."""
        return np.zeros(len(self.time))

    def modes(self) -> "Integers | None":
        """Return the mode of the one contact, after the event of a frame; None if not recorded."""
        if "mode" not in self:
            return None
        modes, events = np.array(self["mode"], dtype=np.int64), self.record.events
        if len(events["time"]) and {"mode_from", "mode_to"} <= events.keys():
            old, new = (np.asarray(events[name]) for name in ("mode_from", "mode_to"))
            changes = (old != new) & self.record.events_of()
            if changes.any():
                last = np.searchsorted(events["time"][changes], self.time, side="right") - 1
                modes = np.where(last >= 0, new[changes][last], old[changes][0])
        return modes

    def contact(self, name: str = "contact") -> tuple[Readout, ...]:
        """Return what the one contact does, in words; nothing if it is not recorded."""
        modes = self.modes()
        return () if modes is None else (Readout(name, "1", modes.astype(float), CONTACT_WORDS),)

    def readouts(self, names: Mapping[str, str]) -> tuple[Readout, ...]:
        """Return the numbers beside a drawing: of the channels that there are, by their words."""
        units = self.record.units
        return tuple(
            Readout(words, units[name], self[name]) for name, words in names.items() if name in self
        )
