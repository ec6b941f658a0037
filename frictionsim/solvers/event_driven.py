"""Event-driven solution: stick and slip are smooth phases, their ends are located.

In a stick phase the state stands still; the phase ends where the moment first exceeds the
static limit. In a slip phase the kinetic friction has a fixed direction; the phase ends where
the velocity comes to zero. What follows is decided there with the static limit. A tie sticks.
"""

from math import copysign, inf
from typing import TYPE_CHECKING

from frictionsim.results import BACKWARD, FORWARD, STICK
from frictionsim.solvers.base import FrictionlessSolver, Solver
from frictionsim.solvers.common import (
    ChatteringDetector,
    Row,
    SampleBuffer,
    crossing_bracket,
    monotone_segment_end,
    rhs_with_friction,
    row,
)
from frictionsim.solvers.root_finding import bracket_root
from frictionsim.solvers.runge_kutta_fehlberg import Rhs, RungeKuttaFehlberg45, State

if TYPE_CHECKING:
    from frictionsim.scenario.settings import SolverSettings
    from frictionsim.solvers.mechanism import DryFriction, Mechanism

# The end of a slip phase is located to this share of the step that it falls in.
RESOLUTION = 1e-12
# A hundred transitions within a microsecond, fifty megahertz, are no motion of a mechanism.
CHATTERING_WINDOW = 1e-6
NEVER = -1.0  # s


def make_solver(mechanism: "Mechanism", settings: "SolverSettings", buffer: SampleBuffer) -> Solver:
    """Return what steps the mechanism to settings.duration, phase by phase."""
    if mechanism.contact is None:
        return FrictionlessSolver(mechanism, settings, buffer)
    return EventDrivenSolver(mechanism, mechanism.contact, settings, buffer)


class EventDrivenSolver(Solver):
    """The state of an event-driven run and the two kinds of phase that change it.

    In a stick phase a step is a piece along which the drive is monotone, and `y` the state. In a
    slip phase it is one of the integrator, which has the state.
    """

    stepper: RungeKuttaFehlberg45
    CHECKPOINT_FIELDS = (
        *Solver.CHECKPOINT_FIELDS,
        "y",
        "mode",
        "sampled_until",
        "phase_ends",
        "direction",
        "held",
        "segment_end",
    )

    def __init__(
        self,
        mechanism: "Mechanism",
        contact: "DryFriction",
        settings: "SolverSettings",
        buffer: SampleBuffer,
    ) -> None:
        super().__init__(mechanism, settings, buffer)
        self.contact = contact
        self.chattering = ChatteringDetector(
            CHATTERING_WINDOW * min(1.0, settings.duration),
            100,
            f"the contact '{contact.name}' changed its mode",
            "does the drive change faster than it should?",
        )
        self.slip_rhs = {s: _slip_rhs(mechanism, contact, s) for s in (FORWARD, BACKWARD)}
        self.y = mechanism.initial_state
        self.mode = STICK if mechanism.velocity == 0.0 else int(copysign(1, mechanism.velocity))
        self.sampled_until = 0.0  # up to here, excluded, the last step can be sampled
        self.phase_ends = False  # with it, the phase
        self.direction = STICK  # in which the stick ends
        self.held = NEVER  # up to when it did
        self.segment_end = 0.0  # of the smooth piece in which it slides

    @property
    def checkpoint_parts(self) -> dict[str, object]:
        return {**super().checkpoint_parts, "chattering": self.chattering}

    def start(self) -> None:
        if self.mode == STICK:
            self.switch_mode(self.mode_from_rest())
        else:
            self.begin_slip()

    def resume(self) -> None:
        if self.mode != STICK:
            self.stepper.resume(self.slip_rhs[self.mode])

    def covers(self, t: float) -> bool:
        return t < self.sampled_until

    def step(self) -> None:
        if self.mode == STICK:
            self.stick()
        else:
            self.slip(self.mode)

    def process_step(self) -> None:
        self.t = self.sampled_until
        if not self.phase_ends:
            return
        self.phase_ends = False
        if self.mode == STICK:
            self.switch_mode(self.direction)
        else:
            self.y = list(self.stepper.interpolate(self.t))
            self.y[1] = 0.0
            self.switch_mode(self.mode_from_rest())

    def finish(self) -> None:
        if self.buffer.times.next <= self.end:
            self.sample(self.end)

    def switch_mode(self, mode: int) -> None:
        """Take the mode that follows, and note the transition if it is one."""
        self.chattering.count(self.t)
        if mode != self.mode:
            held = self.held if self.mode == STICK else self.t
            self.change_mode(self.t, self.mode, mode, self.y, held)
            self.mode = mode
        if mode != STICK:
            self.begin_slip()

    def begin_slip(self) -> None:
        self.stepper.start(self.slip_rhs[self.mode], self.t, self.y)
        self.segment_end = self.t

    def excess(self, t: float, s: int) -> float:
        """Return how far the moment in direction s is above the static limit, at rest, N m."""
        u, q = self.mechanism.drive(t), self.y[0]
        return s * self.mechanism.applied_torque(u, q, 0.0) - self.contact.static_limit(u, q)

    def excess_beyond_roundoff(self, t: float, s: int) -> float:
        """Return how far it is above more than rounding, N m; up to there it is a tie and holds."""
        return self.excess(t, s) - self.contact.roundoff(self.mechanism.drive(t), self.y[0])

    def mode_from_rest(self) -> int:
        """Return the mode that the contact has at rest now."""
        directions = (FORWARD, BACKWARD)
        return next((s for s in directions if self.excess_beyond_roundoff(self.t, s) > 0.0), STICK)

    def stick(self) -> None:
        """Stand still for a piece of the drive, or up to the breakaway in it."""
        a = self.t
        b = monotone_segment_end(self.mechanism, self.contact, a, self.end)
        self.sampled_until = b
        for s in (FORWARD, BACKWARD):
            if self.excess_beyond_roundoff(b, s) > 0.0:
                self.held, self.sampled_until = self.breakaway(a, b, s)
                self.direction = s
                self.phase_ends = True
                return

    def breakaway(self, a: float, b: float, s: int) -> tuple[float, float]:
        """Return when the moment in direction s passes the static limit in a monotone piece.

        Two neighbouring times: it still holds at the first.
        """
        # From a tie at a, it breaks away where there is more to it than rounding.
        excess = self.excess if self.excess(a, s) <= 0.0 else self.excess_beyond_roundoff
        tie = self.contact.roundoff(self.mechanism.drive(a), self.y[0])
        return crossing_bracket(lambda t: excess(t, s), a, b, tie, self.end)

    def sample(self, t: float) -> None:
        """Record the state at t, which is at rest where the contact sticks."""
        y = self.y if self.mode == STICK else self.stepper.interpolate(t)
        self.buffer.add(self.row(t, y, self.mode))

    def row(self, t: float, y: State, mode: int) -> Row:
        u, q, v = self.mechanism.drive(t), y[0], y[1]
        applied_torque = self.mechanism.applied_torque(u, q, v)
        if mode == STICK:
            return row(t, u, y, 0.0, -applied_torque, STICK)
        friction = -mode * self.contact.kinetic_limit(u, q, v, mode)
        acceleration = (applied_torque + friction) / self.mechanism.inertia
        return row(t, u, y, acceleration, friction, mode)

    def slip(self, s: int) -> None:
        """Slide in direction s for a step, or up to the moment of rest in it."""
        stepper = self.stepper
        if stepper.t >= self.segment_end:
            self.segment_end = monotone_segment_end(
                self.mechanism, self.contact, stepper.t, self.end
            )
        crossing = self.advance(self.segment_end)
        rest = self.rest_within_step(s)
        self.phase_ends = rest != inf
        if not self.phase_ends:
            self.record_crossing(crossing)
        self.sampled_until = min(stepper.t, rest)

    def rest_within_step(self, s: int) -> float:
        """Return when the velocity first comes to zero in the last step; inf if it does not.

        A phase that has just broken away starts from zero; this zero is not its end.
        """
        stepper = self.stepper
        t_old, t1 = stepper.t_old, stepper.t

        def velocity(t: float) -> float:
            return s * stepper.interpolate(t)[1]

        if s * stepper.y[1] > 0.0:
            t1 = self.time_of_least_velocity(s)
            if t1 == inf or velocity(t1) > 0.0:
                return inf
        resolution = RESOLUTION * (t1 - t_old)
        if s * stepper.y_old[1] <= 0.0:
            width = t1 - t_old
            while velocity(t_old + width) <= 0.0:
                width *= 0.1
                if width <= resolution:
                    return t_old
            t_old += width
            if t_old >= t1:
                return t1
        return bracket_root(velocity, t_old, t1, resolution)[1]

    def time_of_least_velocity(self, s: int) -> float:
        """Return when the last step has its slowest moment; inf if it cannot be at rest there."""
        stepper = self.stepper
        h = stepper.t - stepper.t_old
        v0, v1 = s * stepper.y_old[1], s * stepper.y[1]
        a0, a1 = s * stepper.f_old[1], s * stepper.f[1]
        if not a0 < 0.0 < a1:
            return inf
        # The velocity stays above its tangents at both ends, hence above where these meet.
        if v0 + a0 * (v1 - v0 - a1 * h) / (a0 - a1) > 0.0:
            return inf
        rhs = self.slip_rhs[s]
        dy = [0.0] * len(stepper.y)

        def acceleration(t: float) -> float:
            rhs(t, stepper.interpolate(t), dy)
            return s * dy[1]

        return bracket_root(acceleration, stepper.t_old, stepper.t, RESOLUTION * h)[1]


def _slip_rhs(mechanism: "Mechanism", contact: "DryFriction", s: int) -> Rhs:
    kinetic_limit = contact.kinetic_limit

    def friction(u: float, q: float, v: float, applied_torque: float) -> float:
        return -s * kinetic_limit(u, q, v, s)

    return rhs_with_friction(mechanism, friction)
