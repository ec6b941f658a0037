"""The samples of a belt in memory."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from frictionsim.simulation.checkpoint import Arrays, require_array, unfit

MIN_CAPACITY = 256  # samples that there is memory for from the start
GROWTH = 1.5
SAMPLES = "samples."  # before the names of the arrays of a state


class SampleStore:
    """The samples of a run, one row of each array, of float64, for each of them."""

    def __init__(self) -> None:
        self._arrays: Arrays = {}  # with room for more
        self._count = 0

    def __len__(self) -> int:
        return self._count

    def extend(self, values: Mapping[str, Any]) -> None:
        """Add samples, (m, ...)."""
        end = self._count + len(values["time"])
        if not self._arrays:
            self._arrays = {n: np.empty((MIN_CAPACITY, *v.shape[1:])) for n, v in values.items()}
        if end > len(self._arrays["time"]):
            larger = max(int(GROWTH * self._count) + 1, end)
            for name, before in self._arrays.items():
                # One array after the other, so that two copies of all are never needed.
                self._arrays[name] = np.empty((larger, *before.shape[1:]))
                self._arrays[name][: self._count] = before[: self._count]
        for name, some in values.items():
            self._arrays[name][self._count : end] = some
        self._count = end

    def first(self, name: str) -> Any:
        """Return the first value of an array."""
        return self._arrays[name][0]

    def n_finite(self) -> int:
        """Return how many samples come before the first that is not finite."""
        sound = self._count
        for values in self._arrays.values():
            bad = np.flatnonzero(~np.isfinite(values[:sound]).reshape(sound, -1).all(axis=1))
            sound = int(bad[0]) if bad.size else sound
        return sound

    def channel(self, name: str, count: int) -> Any:
        """Return the first samples of an array, a view."""
        return self._arrays[name][:count]

    @property
    def names(self) -> list[str]:
        """The names of the arrays."""
        return list(self._arrays)

    def state(self) -> Arrays:
        """Return the samples; views, as a state is written or restored before they change."""
        return {f"{SAMPLES}{name}": self.channel(name, self._count) for name in self._arrays}

    def restore(self, state: Arrays, like: Mapping[str, Any]) -> None:
        """Take over the samples of another run of the same scenario; `like` is one of them."""
        if f"{SAMPLES}time" not in state:
            return
        self._count = len(require_array(state, f"{SAMPLES}time", np.float64, ndim=1))
        for name, value in like.items():
            shape = (self._count, *np.shape(value))
            values = require_array(state, SAMPLES + name, np.float64, ndim=len(shape))
            if values.shape != shape:
                raise unfit(SAMPLES + name)
            self._arrays[name] = values.copy()  # the state may be restored once more
