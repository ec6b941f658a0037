"""Regularised dry friction, for ordinary integrators: it creeps instead of sticking.

    T = -sign(v) F(|v|/v_t)

with Threlfall's curve F, see `friction_curve`. It is here to show what it costs: at
rest the body creeps at about v_t M/(1.5 L_s), the time constant there is v_t I/(1.5 L_s), and
the error of the motion is of the order of v_t. `rkf45` steps it with our own integrator, the
other methods with SciPy's. What counts as stick is |v| < v_t.
"""

from frictionsim.results import BACKWARD, FORWARD, STICK
from frictionsim.solvers.base import Solver, StateList
from frictionsim.solvers.common import SampleRow, direction_of
from frictionsim.solvers.friction_curve import KINETIC_FROM, friction_curve
from frictionsim.solvers.root_finding import bracket_root


class RegularisedSolver(Solver):
    """Solver with regularised friction; speeds below the transition speed count as sticking."""

    def start(self) -> None:
        self.mode = self.mode_at(self.mechanism.velocity)
        super().start()

    def friction(self, u: float, q: float, v: float, applied: float, kinetic: float) -> float:
        s = FORWARD if v > 0.0 else BACKWARD
        x = s * v / self.contact.transition_speed
        static = self.system.static_limit(u, q) if x < KINETIC_FROM else 0.0
        return -s * friction_curve(x, static, kinetic if x > 1.0 else 0.0)

    def mode_at(self, v: float) -> int:
        """Return the mode that a velocity counts as."""
        return STICK if abs(v) < self.contact.transition_speed else direction_of(v)

    def step(self) -> None:
        self.advance(self.end_of_rest_on_stop(self.end_of_segment()))
        self.end_at_impact()
        self.record_mode_change()
        self.record_crossing()

    def next_segment_end(self) -> float:
        return min(self.end, self.mechanism.drive.next_discontinuity(self.t))

    def process_step(self) -> None:
        if sides := self.impact():
            before, self.mode = self.mode, self.mode_at(sides[1][1])
            self.record_impact(*sides, (before, self.mode))

    def mode_in_motion(self, direction: int) -> int:
        return self.mode_at(self.stepper.y[1])  # it may creep

    def record_mode_change(self) -> None:
        """Record the transition in the last step, if there is one."""
        stepper, before = self.stepper, self.mode
        mode = self.mode_at(stepper.y[1])
        if mode == before:
            return
        # The transition is where the velocity passes the transition speed.
        threshold = (mode or before) * self.contact.transition_speed
        direction = 1.0 if threshold > stepper.y_old[1] else -1.0
        t = stepper.t
        if direction * (stepper.y_old[1] - threshold) < 0.0:
            t = bracket_root(
                lambda at: direction * (stepper.interpolate(at)[1] - threshold),
                stepper.t_old,
                stepper.t,
            )[1]
        self.change_mode(t, before, mode, stepper.interpolate(t))
        self.mode = mode

    def sample(self, t: float, y: StateList) -> SampleRow:
        return self.row(t, y, self.mode_at(y[1]))


SOLVER = RegularisedSolver
