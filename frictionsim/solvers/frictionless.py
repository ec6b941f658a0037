"""Integration of a mechanism without dry friction."""

from typing import Any, ClassVar, NamedTuple

from frictionsim.results import STICK
from frictionsim.solvers import one_contact_state as layout
from frictionsim.solvers.base import Solver, StateList
from frictionsim.solvers.common import direction_of


class _Frictionless(NamedTuple):
    """A system without its limits, as `one_contact_step` takes it."""

    system: Any
    drive: Any
    inertia: float

    def torques_and_powers(
        self, u: float, q: float, v: float, s: float
    ) -> tuple[float, float, tuple[float, ...]]:
        # Minus zero against s: the sum of torques and a friction of zero.
        return self.system.applied_torque(u, q, v), -0.0, self.system.powers(u, q, v)


class FrictionlessSolver(Solver):
    """Solver for a mechanism without dry friction: smooth between discontinuities."""

    CHECKPOINT_FIELDS: ClassVar = ("t", "started")  # it has no mode

    def new_law(self) -> Any:
        return _Frictionless(self.system, self.system.drive, self.system.inertia)

    def friction_in(self, mode: int, u: float, q: float, v: float, applied: float) -> float:
        return 0.0

    def step(self) -> None:
        limit = min(self.end, self.mechanism.drive.next_discontinuity(self.t))
        self.advance(self.end_of_rest_on_stop(limit))
        self.end_at_impact()
        self.record_crossing()

    def leave_stop(self, t: float, y: StateList, direction: int) -> None:
        self.record(layout.STOP_EVENT, self.row(t, y, STICK), self.row(t, y, direction))

    def process_step(self) -> None:
        if sides := self.impact():
            before, after = sides
            self.record_impact(before, after, (direction_of(before[1]), direction_of(after[1])))
