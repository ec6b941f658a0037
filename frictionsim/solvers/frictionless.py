"""Integration of a mechanism without dry friction."""

from typing import TYPE_CHECKING

from frictionsim.results import BACKWARD, FORWARD, STICK, Transition
from frictionsim.solvers.base import Solver
from frictionsim.solvers.common import Row, SampleBuffer, rhs_without_friction, row
from frictionsim.solvers.end_stops import EVENT
from frictionsim.solvers.stepper import State

if TYPE_CHECKING:
    from frictionsim.scenario.settings import SolverSettings
    from frictionsim.solvers.mechanism import Mechanism


def _direction(v: float) -> int:
    return FORWARD if v > 0.0 else BACKWARD if v < 0.0 else STICK


class FrictionlessSolver(Solver):
    """Solver for a mechanism without dry friction: smooth between discontinuities."""

    def __init__(
        self, mechanism: "Mechanism", settings: "SolverSettings", buffer: SampleBuffer
    ) -> None:
        super().__init__(mechanism, settings, buffer)
        self.rhs = rhs_without_friction(mechanism)

    def start(self) -> None:
        self.stepper.start(self.rhs, 0.0, self.mechanism.initial_state)
        self.process_step()

    def resume(self) -> None:
        self.stepper.resume(self.rhs)

    def step(self) -> None:
        limit = min(self.end, self.mechanism.drive.next_discontinuity(self.t))
        limit = self.end_of_rest_on_stop(limit, self.rhs)
        self.record_crossing(self.end_at_impact(self.advance(limit), self.rhs))

    def leave_stop(self, t: float, y: State, direction: int) -> None:
        at_rest = self.row(t, y, STICK)
        self.buffer.record_event(
            Transition(t, EVENT, STICK, direction, y[0]), at_rest, (*at_rest[:6], direction, *y[2:])
        )

    def process_step(self) -> None:
        stepper = self.stepper
        if self.stops is None or not self.stops.is_hit(stepper.y):
            return
        before = self.stops.before_impact(stepper.y)
        after = self.stops.after_impact(stepper.t, stepper.y)
        self.record_impact(before, _direction(before[1]), _direction(after[1]), after)
        stepper.start(self.rhs, stepper.t, after)

    def sample(self, t: float) -> None:
        self.buffer.add(self.row(t, self.stepper.interpolate(t), STICK))

    def row(self, t: float, y: State, mode: int) -> Row:
        mechanism = self.mechanism
        u = mechanism.drive(t)
        acceleration = mechanism.applied_torque(u, y[0], y[1]) / mechanism.inertia
        return row(t, u, y, acceleration, 0.0, mode)
