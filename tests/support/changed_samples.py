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
    """The samples of a stopped run, to be changed: (n, width), and those at events, (m, 2, width).

    A row has the time, the drive, the coordinates, their rates and accelerations, forces, modes and
    integrated energies; that of a transition its time, the modes before and after, and the angle.
    """

    def __init__(self, stopped: fs.Result) -> None:
        self._record, self._state = stopped.record, dict(stopped.checkpoint or {})
        self.transitions = self._numbers("transitions")
        self.sides = self._numbers("buffer.sides").reshape(len(self.transitions), 2, -1)
        self.rows = self._numbers("buffer.rows").reshape(-1, self.sides.shape[2])

    def _numbers(self, name: str) -> Any:
        return np.array(self._state[name])

    def keep_events(self, chosen: Any) -> None:
        """Forget the other events."""
        self.sides, self.transitions = self.sides[chosen], self.transitions[chosen]
        self._state["transitions.contact"] = self._state["transitions.contact"][chosen]

    def audit(self, data: Scenario | None = None) -> dict[str, Check]:
        """Resume the run, with other scenario data if given, and return its audit."""
        state = {
            "buffer.rows": self.rows.ravel(),
            "buffer.sides": self.sides.ravel(),
            "transitions": self.transitions,
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
