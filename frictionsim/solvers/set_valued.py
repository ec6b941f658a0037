"""Adaptive RKF4(5) with the friction solved for inside the right-hand side: exact stick.

No switch is located. At rest the friction is what the applied moment asks for, cut off at the
limit: T = clip(-M) for one contact; the error estimate sees the jump where it lets go or takes
hold and shortens the steps across it. Between two steps the contact only remembers which way it
slid, because the limit that holds it is the static one and that of sliding the kinetic one.
"""

from math import copysign, inf, ulp
from typing import TYPE_CHECKING

from frictionsim.results import BACKWARD, FORWARD, STICK
from frictionsim.solvers.base import FrictionlessSolver, Solver
from frictionsim.solvers.common import (
    Row,
    SampleBuffer,
    crossing_bracket,
    monotone_segment_end,
    rhs_with_friction,
    row,
)
from frictionsim.solvers.root_finding import bracket_root
from frictionsim.solvers.runge_kutta_fehlberg import State

if TYPE_CHECKING:
    from frictionsim.scenario.settings import SolverSettings
    from frictionsim.solvers.mechanism import DryFriction, Mechanism

# Across a jump of the friction no step meets the tolerance: this many roundings of the time
# are short enough for what is left of the error to be rounding, too.
JUMP_ROUNDINGS = 16.0
NEVER = -1.0  # s


def make_solver(mechanism: "Mechanism", settings: "SolverSettings", buffer: SampleBuffer) -> Solver:
    """Return what steps the mechanism to settings.duration."""
    if mechanism.contact is None:
        return FrictionlessSolver(mechanism, settings, buffer)
    return SetValuedSolver(mechanism, mechanism.contact, settings, buffer)


class SetValuedSolver(Solver):
    """An integration with the memory of its contact: the direction of the last slip, or none."""

    CHECKPOINT_FIELDS = (*Solver.CHECKPOINT_FIELDS, "mode", "segment_end", "is_new")

    def __init__(
        self,
        mechanism: "Mechanism",
        contact: "DryFriction",
        settings: "SolverSettings",
        buffer: SampleBuffer,
    ) -> None:
        super().__init__(mechanism, settings, buffer)
        self.contact = contact
        self.rhs = rhs_with_friction(mechanism, self.friction)
        self.mode = STICK if mechanism.velocity == 0.0 else int(copysign(1, mechanism.velocity))
        self.segment_end = 0.0  # of the piece on which the drive is monotone
        self.is_new = False  # the last step: what it did to the contact is not yet looked at

    def friction(self, u: float, q: float, v: float, applied_torque: float) -> float:
        """Return the friction torque, N m, with the applied moment given."""
        return self.friction_in(self.mode_at(u, q, v, applied_torque), u, q, v, applied_torque)

    def friction_in(self, mode: int, u: float, q: float, v: float, applied_torque: float) -> float:
        """Return the friction torque of a mode, N m."""
        return (
            -applied_torque if mode == STICK else -mode * self.contact.kinetic_limit(u, q, v, mode)
        )

    def mode_at(self, u: float, q: float, v: float, applied_torque: float) -> int:
        """Return whether the contact slides and where to.

        While it goes on as remembered it slides. Once it has come to rest, or has been at rest,
        it is held as far as the static limit goes.
        """
        direction = self.mode or v
        if direction * v > 0.0:
            return FORWARD if direction > 0.0 else BACKWARD
        contact = self.contact
        if abs(applied_torque) <= contact.static_limit(u, q) + contact.roundoff(u, q):
            return STICK
        return FORWARD if applied_torque > 0.0 else BACKWARD

    def start(self) -> None:
        self.stepper.start(self.rhs, 0.0, self.mechanism.initial_state)
        if self.mode == STICK:
            self.switch_mode(self.mode_from_rest(0.0, self.stepper.y), 0.0, NEVER)

    def resume(self) -> None:
        self.stepper.resume(self.rhs)

    def step(self) -> None:
        stepper = self.stepper
        if stepper.t >= self.segment_end:
            # The drive is monotone up to there: no breakaway hides within a step.
            self.segment_end = monotone_segment_end(
                self.mechanism, self.contact, stepper.t, self.end
            )
        self.record_crossing(self.advance(self.segment_end, JUMP_ROUNDINGS * ulp(stepper.t)))
        self.is_new = True

    def process_step(self) -> None:
        if self.is_new:
            self.is_new = False
            self.remember()

    def remember(self) -> None:
        """Take over what the last step did to the contact, and start anew where it changed."""
        stepper = self.stepper
        v = stepper.y[1]
        if self.mode == STICK and v != 0.0:
            # The sign of v may be wrong: across a jump it is that of a weighted sum in which
            # some stages have the friction of before and some that of after.
            mode = self.mode_from_rest(stepper.t, stepper.y) or (FORWARD if v > 0.0 else BACKWARD)
            held, t = self.times_of_breakaway(mode)
            self.switch_mode(mode, t, held)
        elif self.mode != STICK and self.mode * v <= 0.0:
            t = self.time_of_rest()
            # Held there, it may have broken away again since; reversed there, it has not.
            mode = self.mode_from_rest(t, stepper.interpolate(t))
            self.switch_mode(mode or self.mode_from_rest(stepper.t, stepper.y), t)

    def switch_mode(self, mode: int, t: float, held: float = inf) -> None:
        """Note the transition at t, and start anew from where the step ended.

        `held` is when it was still in the mode before.
        """
        stepper = self.stepper
        before, self.mode = self.mode, mode
        turn = list(stepper.interpolate(t))
        if mode * stepper.y[1] <= 0.0:
            stepper.y[1] = 0.0  # at rest; what is left is below the tolerance
        if before == STICK and mode * (stepper.y[0] - stepper.y_old[0]) < 0.0:
            stepper.y[0] = stepper.y_old[0]  # as is a way against the motion
        if mode != before:
            # Where it sticks, before or after, the state is that of the whole stick to the bit.
            at_rest = stepper.y_old if before == STICK else stepper.y if mode == STICK else turn
            self.change_mode(t, before, mode, [at_rest[0], 0.0, *at_rest[2:]], held)
        stepper.start(self.rhs, stepper.t, stepper.y)

    def mode_from_rest(self, t: float, y: State) -> int:
        """Return the mode that the contact has at rest at a time and place."""
        u, q = self.mechanism.drive(t), y[0]
        return self.mode_at(u, q, 0.0, self.mechanism.applied_torque(u, q, 0.0))

    def times_of_breakaway(self, mode: int) -> tuple[float, float]:
        """Return when the moment passed the static limit in the last step, s.

        Two neighbouring times: it still held at the first.
        """
        stepper, mechanism = self.stepper, self.mechanism
        q = stepper.y_old[0]

        def excess(t: float) -> float:
            u = mechanism.drive(t)
            return mode * mechanism.applied_torque(u, q, 0.0) - self.contact.static_limit(u, q)

        if excess(stepper.t_old) > 0.0 or excess(stepper.t) <= 0.0:
            return stepper.t_old, stepper.t_old
        tie = self.contact.roundoff(mechanism.drive(stepper.t_old), q)
        return crossing_bracket(excess, stepper.t_old, stepper.t, tie, self.end)

    def time_of_rest(self) -> float:
        """Return when the velocity came to zero in the last step, s."""
        stepper, mode = self.stepper, self.mode
        if mode * stepper.y_old[1] <= 0.0:
            return stepper.t_old
        return bracket_root(lambda t: mode * stepper.interpolate(t)[1], stepper.t_old, stepper.t)[1]

    def sample(self, t: float) -> None:
        y = self.stepper.interpolate(t)
        u, q, v = self.mechanism.drive(t), y[0], y[1]
        mode = self.mode_at(u, q, v, self.mechanism.applied_torque(u, q, v))
        self.buffer.add(self.row(t, y, mode))

    def row(self, t: float, y: State, mode: int) -> Row:
        u, q, v = self.mechanism.drive(t), y[0], y[1]
        applied_torque = self.mechanism.applied_torque(u, q, v)
        friction = self.friction_in(mode, u, q, v, applied_torque)
        acceleration = (applied_torque + friction) / self.mechanism.inertia
        return row(t, u, y, acceleration, friction, mode)
