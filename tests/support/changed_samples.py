"""Runs that stop before their end and go on with other samples: what their audit finds.

A run that was stopped has its samples so far in the state from which it is resumed: a row of
numbers for each, and one for each side of an event. At its end it is judged by all of them.
"""

from typing import Any

import numpy as np

import frictionsim as fs
from frictionsim.results import Check
from tests.support.scenarios import Scenario
from tests.support.stopped_runs import calls_of, stopping


def nearly_done(data: Scenario) -> fs.Result:
    """Return a run that stops before its last step, and has had events."""
    return fs.solve(data, progress=stopping(len(calls_of(data)) - 1))


class Samples:
    """The samples of a stopped run, to be changed: columns by name, as views."""

    def __init__(self, stopped: fs.Result) -> None:
        self._record, self._state = stopped.record, dict(stopped.record.checkpoint or {})
        self._columns = [name for name in self._state if name.startswith("samples.")]
        names = [name.removeprefix("samples.") for name in self._columns]
        self._places = {name: i for i, name in enumerate(names)}
        self._transitions = np.array(self._state["transitions"])  # time, modes, angle
        self._rows = np.column_stack([self._state[name] for name in self._columns])
        self._sides = np.array(self._state["sides"]).reshape(-1, 2, len(names))

    def __getitem__(self, name: str) -> Any:
        """Return a column, (n,)."""
        return self._rows[:, self._places[name]]

    def __setitem__(self, name: str, values: Any) -> None:
        self[name][:] = values

    def sides(self, name: str) -> Any:
        """Return a column before and after each event, (m, 2)."""
        return self._sides[:, :, self._places[name]]

    def event(self, number: int) -> tuple[float, int, int]:
        """Return time and modes before and after an event."""
        time, before, after, _ = self._transitions[number].tolist()
        return time, int(before), int(after)

    def shift_event(self, number: int, time: float) -> None:
        """Move an event in time, s."""
        self._transitions[number, 0] += time
        self.sides("time")[number] += time

    def keep_events(self, chosen: Any) -> None:
        """Forget the other events."""
        self._sides, self._transitions = self._sides[chosen], self._transitions[chosen]
        self._state["transitions.contact"] = self._state["transitions.contact"][chosen]

    def audit(self, data: Scenario | None = None) -> dict[str, Check]:
        """Resume the run, with other scenario data if given, and return its audit."""
        state = {
            **dict(zip(self._columns, self._rows.T, strict=True)),
            "sides": self._sides.ravel(),
            "transitions": self._transitions,
        }
        attributes = dict(self._record.attributes)
        if data is not None:
            attributes["scenario"] = fs.load(data).to_toml()
        changed = self._record._replace(checkpoint=self._state | state, attributes=attributes)
        done = fs.resume(fs.Result(changed))
        assert done.status == "done"
        return done.audit

    def failed(self) -> set[str]:
        return {name for name, check in self.audit().items() if not check.ok}
