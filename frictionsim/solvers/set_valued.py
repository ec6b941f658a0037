"""Adaptive RKF4(5) with set-valued friction inside the right-hand side: sticking is exact.

No switch is located. At rest, friction balances the applied torque up to the static limit,
T = clip(-M); at breakaway and stop the error estimate detects the jump and shortens the steps.
Between two steps the contact stores its direction of sliding, which decides whether the static or
the kinetic limit applies.
"""

from math import inf
from typing import ClassVar

from frictionsim.results import BACKWARD, FORWARD, STICK
from frictionsim.solvers import one_contact_state as layout
from frictionsim.solvers.base import Solver, StateList
from frictionsim.solvers.common import SampleRow, direction_of
from frictionsim.solvers.one_contact import breakaway
from frictionsim.solvers.one_contact_location import excess
from frictionsim.solvers.root_finding import bracket_root


class SetValuedSolver(Solver):
    """Solver with set-valued friction; `mode` is the direction of sliding, or STICK."""

    CHECKPOINT_FIELDS: ClassVar = (*Solver.CHECKPOINT_FIELDS, "is_new")
    # Such a step leaves an error of the order of the roundoff.
    JUMP_ULPS: ClassVar[float] = 16.0
    is_new: bool = False  # the mode is not yet updated after the last step

    def friction(self, u: float, q: float, v: float, applied: float, kinetic: float) -> float:
        mode = self.mode_at(u, q, v, applied)
        if mode * v > 0.0:
            return -mode * kinetic
        return self.friction_in(mode, u, q, v, applied)

    def friction_in(self, mode: int, u: float, q: float, v: float, applied: float) -> float:
        return -applied if mode == STICK else -mode * self.system.kinetic_limit(u, q, v, mode)

    def mode_at(self, u: float, q: float, v: float, applied_torque: float) -> int:
        """Return the mode of the contact.

        It slides if the velocity has the stored direction. Otherwise, or after a rest, it sticks
        up to the static limit.
        """
        direction = self.mode or v
        if direction * v > 0.0:
            return FORWARD if direction > 0.0 else BACKWARD
        system = self.system
        if abs(applied_torque) <= system.static_limit(u, q) + system.roundoff(u, q):
            return STICK
        return FORWARD if applied_torque > 0.0 else BACKWARD

    def start(self) -> None:
        self.mode = direction_of(self.mechanism.velocity)
        self.stepper.start(0.0, self.mechanism.initial_state)
        if not self.hit_stop() and self.mode == STICK:
            self.switch_mode(self.mode_from_rest(0.0, self.stepper.y), 0.0, layout.NEVER)

    def step(self) -> None:
        stepper = self.stepper
        # The drive is monotone on the segment, so that no breakaway is missed within a step.
        self.advance(self.end_of_segment())
        slowest = self.time_of_possible_rest()
        if slowest < inf:
            # Take the step again, to there: a rest between its stages would go unnoticed.
            stepper.start(stepper.t_old, stepper.y_old)
            self.advance(slowest)
        if self.mode != STICK:  # from rest on a stop the body only leaves it
            self.end_at_impact()
        self.record_crossing()
        self.is_new = True

    def next_segment_end(self) -> float:
        end = super().next_segment_end()
        if self.mode == STICK:
            return self.system.first_excess(self.stepper.y[0], self.t, end)
        return end

    def time_of_possible_rest(self) -> float:
        """Return when the last step was slowest, s, if it may have been at rest there; else inf.

        While it slides in one direction, slower at first and faster at the end, the velocity stays
        above its tangents at both ends. Where these meet below zero, the cubic through both ends
        has its minimum about where the velocity has.
        """
        stepper, s = self.stepper, self.mode
        v_old, v = s * stepper.y_old[1], s * stepper.y[1]
        a_old, a = (s * acceleration for acceleration in stepper.accelerations)
        if s == STICK or not (v_old > 0.0 and v > 0.0 and a_old < 0.0 < a):
            return inf
        h = stepper.t - stepper.t_old
        if v_old + a_old * (v - v_old - a * h) / (a_old - a) > 0.0:
            return inf
        # v_old + a_old x + c x^2 + d x^3 with x = t - t_old; its slope is zero once after a fall.
        c = (3.0 * (v - v_old) / h - 2.0 * a_old - a) / h
        d = (a_old + a - 2.0 * (v - v_old) / h) / (h * h)
        x = -a_old / (c + (c * c - 3.0 * a_old * d) ** 0.5)
        t: float = stepper.t_old + x
        return t if stepper.t_old < t < stepper.t else inf

    def process_step(self) -> None:
        if self.is_new:
            self.is_new = False
            self.update_mode()
            self.hit_stop()

    def update_mode(self) -> None:
        """Update the mode after the last step, and restart the integrator if it changed."""
        stepper = self.stepper
        v = stepper.y[1]
        if self.mode == STICK and v != 0.0:
            # The sign of v may be wrong: across a jump, some stages have the friction before it
            # and some the friction after it.
            mode = self.mode_from_rest(stepper.t, stepper.y) or (FORWARD if v > 0.0 else BACKWARD)
            held, t = self.times_of_breakaway(mode)
            self.switch_mode(mode, t, held)
        elif self.mode != STICK and self.mode * v <= 0.0:
            t = self.time_of_rest()
            # If it sticks at the stop, it may have broken away again within the step.
            mode = self.mode_from_rest(t, stepper.interpolate(t))
            self.switch_mode(mode or self.mode_from_rest(stepper.t, stepper.y), t)

    def switch_mode(self, mode: int, t: float, held: float = inf) -> None:
        """Record the transition at t, and restart the integrator at the end of the step.

        Parameters
        ----------
        mode : int
        t : float, s
        held : float, s
            See `change_mode`.
        """
        stepper = self.stepper
        before, self.mode = self.mode, mode
        at_switch, y_old, y = stepper.interpolate(t), stepper.y_old, stepper.y
        if mode * y[1] <= 0.0:
            y[1] = 0.0  # the velocity is below the tolerance
        if before == STICK and mode * (y[0] - y_old[0]) < 0.0:
            # Displacement against the new direction is below the tolerance; discard it.
            y[0] = y_old[0]
        if mode != before:
            # The state of the whole sticking phase is bit-identical.
            at_rest = y_old if before == STICK else y
            if STICK not in (before, mode):
                at_rest = at_switch
            self.change_mode(t, before, mode, [at_rest[0], 0.0, *at_rest[2:]], held)
        stepper.start(stepper.t, y)
        self.end_segment_at_rest()

    def end_segment_at_rest(self) -> None:
        """Begin a segment at rest: where the contact breaks away depends on the position."""
        if self.mode == STICK:
            self.segment_end = self.stepper.t

    def hit_stop(self) -> bool:
        """Switch to the mode after an impact on a stop, if there is one; return whether."""
        sides = self.impact()
        if sides is None:
            return False
        before, y = sides
        mode_before, self.mode = self.mode, STICK
        self.mode = direction_of(y[1]) or self.mode_from_rest(self.stepper.t, y)
        self.record_impact(before, y, (mode_before, self.mode))
        self.segment_end = self.stepper.t  # as above
        return True

    def mode_from_rest(self, t: float, y: StateList) -> int:
        """Return the mode that follows from rest at time t, s, in the position of y."""
        u, q = self.system.drive.at(t), y[0]
        return self.mode_at(u, q, 0.0, self.system.applied_torque(u, q, 0.0))

    def times_of_breakaway(self, mode: int) -> tuple[float, float]:
        """Return the time of the breakaway in the last step, s.

        Two adjacent times: the contact still holds at the first.
        """
        stepper, problem = self.stepper, self._problem
        s, a, b = problem.state, stepper.t_old, stepper.t
        s[layout.Y] = s[layout.Y_OLD]
        if excess(self.system, s, a, mode) > 0.0 or excess(self.system, s, b, mode) <= 0.0:
            return a, a
        return breakaway(self.system, problem.run, s, mode, a, b)

    def time_of_rest(self) -> float:
        """Return the time at which the velocity became zero in the last step, s."""
        stepper, mode = self.stepper, self.mode
        if mode * stepper.y_old[1] <= 0.0:
            return stepper.t_old
        return bracket_root(lambda t: mode * stepper.interpolate(t)[1], stepper.t_old, stepper.t)[1]

    def sample(self, t: float, y: StateList) -> SampleRow:
        u, q, v = self.system.drive.at(t), y[0], y[1]
        return self.row(t, y, self.mode_at(u, q, v, self.system.applied_torque(u, q, v)))


SOLVER = SetValuedSolver
