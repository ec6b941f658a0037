"""Integration of a mechanism without dry friction."""

from typing import Any

from frictionsim.results import STICK, Transition
from frictionsim.solvers.base import Solver, State
from frictionsim.solvers.common import direction_of
from frictionsim.solvers.end_stops import EVENT


class FrictionlessSolver(Solver):
    """Solver for a mechanism without dry friction: smooth between discontinuities."""

    def torques_and_powers(self, u: float, q: float, v: float) -> tuple[float, float, Any]:
        return self.system.applied_torque(u, q, v), 0.0, self.system.powers(u, q, v)

    def friction(self, u: float, q: float, v: float, applied: float, kinetic: float) -> float:
        return 0.0

    def step(self) -> None:
        limit = min(self.end, self.mechanism.drive.next_discontinuity(self.t))
        limit = self.end_of_rest_on_stop(limit)
        self.record_crossing(self.end_at_impact(self.advance(limit)))

    def leave_stop(self, t: float, y: State, direction: int) -> None:
        at_rest = self.row(t, y, STICK)
        self.buffer.record_event(
            Transition(t, EVENT, STICK, direction, y[0]), at_rest, (*at_rest[:6], direction, *y[2:])
        )

    def process_step(self) -> None:
        if sides := self.impact():
            before, after = sides
            self.record_impact(before, after, (direction_of(before[1]), direction_of(after[1])))
