"""The integrator of a friction law in the right-hand side: the method of `one_contact_step`."""

from array import array
from typing import Any

from frictionsim.solvers import one_contact_state as layout
from frictionsim.solvers.one_contact_step import (
    advance,
    repeats_shorter,
    start_segment,
    truncate,
    write_inside,
)
from frictionsim.solvers.problems import Problem

DIRECTION = 1.0  # of sliding, which a law does not ask for


class LawStepper:
    """Error-controlled integration over smooth segments.

    `start` starts a segment, `advance` takes one accepted step from (t_old, y_old) to (t, y), and
    `interpolate` returns the state within that step.

    Parameters
    ----------
    law : named tuple
        As a system, see `frictionsim.solvers.base.Law`.
    problem : Problem
        With the state, which it changes.
    """

    def __init__(self, law: Any, problem: Problem) -> None:
        self._law, self._problem = law, problem
        self._s, self._states = problem.state, problem.run.states
        self._s[layout.MODE] = DIRECTION

    def _numbers(self, place: int) -> list[float]:
        return self._s[place : place + self._states].tolist()

    @property
    def t_old(self) -> float:
        """Start of the last step, s."""
        return self._s[layout.T_OLD]

    @property
    def t(self) -> float:
        """End of the last step, s."""
        return self._s[layout.T_NEW]

    @property
    def y_old(self) -> list[float]:
        """The state at the start of the last step."""
        return self._numbers(layout.Y_OLD)

    @property
    def y(self) -> list[float]:
        """The state at its end."""
        return self._numbers(layout.Y_NEW)

    @property
    def accelerations(self) -> tuple[float, float]:
        """The accelerations at start and end of the last step, rad/s^2."""
        return self._s[layout.F_OLD + 1], self._s[layout.F_NEW + 1]

    @property
    def steps(self) -> int:
        """Accepted steps."""
        return int(self._s[layout.STEPS])

    @property
    def rejected(self) -> int:
        """Rejected steps."""
        return int(self._s[layout.REJECTED])

    @property
    def nfev(self) -> int:
        """Evaluations of the right-hand side."""
        return int(self._s[layout.EVALUATIONS])

    def start(self, t: float, y: list[float]) -> None:
        """Start a segment at (t, y), with a new initial step size."""
        self._s[layout.Y : layout.Y + len(y)] = array("d", y)
        start_segment(self._law, self._problem.run, self._s, t)

    def advance(self, limit: float) -> None:
        """Take one accepted step that ends at `limit`, s, at the latest."""
        advance(self._law, self._problem.run, self._s, DIRECTION, limit)

    def truncate(self, t: float) -> None:
        """End the last step at a time inside it."""
        truncate(self._law, self._problem.run, self._s, DIRECTION, t)

    def repeat_shorter(self) -> bool:
        """Undo the last step, which was truncated, if its error is too large; return whether."""
        return repeats_shorter(self._law, self._problem.run, self._s, DIRECTION)

    def interpolate(self, t: float) -> list[float]:
        """Return the state at a time within the last step."""
        write_inside(self._law, self._problem.run, self._s, DIRECTION, t)
        return self._numbers(layout.INSIDE)
