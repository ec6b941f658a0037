"""Event-driven solution: stick and slip are smooth phases, their ends are located.

In a stick phase the state stands still; the phase ends where the moment first exceeds the
static limit. In a slip phase the kinetic friction has a fixed direction; the phase ends where
the velocity comes to zero. What follows is decided there with the static limit. A tie sticks.
"""

from math import copysign, inf
from typing import TYPE_CHECKING

from frictionsim.results import BACKWARD, FORWARD, STICK
from frictionsim.solvers.base import Solution, WithoutFriction
from frictionsim.solvers.common import (
    Recording,
    Row,
    StormGuard,
    end_of_piece,
    passing,
    rates_with_friction,
    row,
)
from frictionsim.solvers.root_finding import sign_change
from frictionsim.solvers.runge_kutta_fehlberg import Rates, RungeKuttaFehlberg45, State

if TYPE_CHECKING:
    from frictionsim.scenario.settings import Solver
    from frictionsim.solvers.mechanism import Contact, Mechanism

# The end of a slip phase is located to this share of the step that it falls in.
RESOLUTION = 1e-12
# A hundred transitions within a microsecond, fifty megahertz, are no motion of a mechanism.
STORM = 1e-6
NEVER = -1.0  # s


def solution(mechanism: "Mechanism", settings: "Solver", recording: Recording) -> Solution:
    """Return what steps the mechanism to settings.duration, phase by phase."""
    if mechanism.contact is None:
        return WithoutFriction(mechanism, settings, recording)
    return _StickSlip(mechanism, mechanism.contact, settings, recording)


class _StickSlip(Solution):
    """The state of an event-driven run and the two kinds of phase that change it.

    In a stick phase a step is a piece along which the drive is monotone, and `y` the state. In a
    slip phase it is one of the integrator, which has the state.
    """

    stepper: RungeKuttaFehlberg45
    SAVED = (*Solution.SAVED, "y", "mode", "known", "ends", "direction", "held", "limit")

    def __init__(
        self, mechanism: "Mechanism", contact: "Contact", settings: "Solver", recording: Recording
    ) -> None:
        super().__init__(mechanism, settings, recording)
        self.contact = contact
        self.storm = StormGuard(
            STORM * min(1.0, settings.duration),
            100,
            f"the contact '{contact.name}' changed its mode",
            "does the drive change faster than it should?",
        )
        self.slip_rates = {s: _slip_rates(mechanism, contact, s) for s in (FORWARD, BACKWARD)}
        self.y = mechanism.initial_state
        self.mode = STICK if mechanism.velocity == 0.0 else int(copysign(1, mechanism.velocity))
        self.known = 0.0  # up to here, excluded, the last step can be sampled
        self.ends = False  # with it, the phase
        self.direction = STICK  # in which the stick ends
        self.held = NEVER  # up to when it did
        self.limit = 0.0  # of the smooth piece in which it slides

    @property
    def saved_parts(self) -> dict[str, object]:
        return {**super().saved_parts, "storm": self.storm}

    def start(self) -> None:
        if self.mode == STICK:
            self.go_over(self.mode_from_rest())
        else:
            self.begin_slip()

    def go_on(self) -> None:
        if self.mode != STICK:
            self.stepper.go_on(self.slip_rates[self.mode])

    def is_known(self, t: float) -> bool:
        return t < self.known

    def step(self) -> None:
        if self.mode == STICK:
            self.stick()
        else:
            self.slip(self.mode)

    def settle(self) -> None:
        self.t = self.known
        if not self.ends:
            return
        self.ends = False
        if self.mode == STICK:
            self.go_over(self.direction)
        else:
            self.y = list(self.stepper.state_at(self.t))
            self.y[1] = 0.0
            self.go_over(self.mode_from_rest())

    def finish(self) -> None:
        if self.recording.times.next <= self.end:
            self.sample(self.end)

    def go_over(self, mode: int) -> None:
        """Take the mode that follows, and note the transition if it is one."""
        self.storm.note(self.t)
        if mode != self.mode:
            held = self.held if self.mode == STICK else self.t
            self.change_mode(self.t, self.mode, mode, self.y, held)
            self.mode = mode
        if mode != STICK:
            self.begin_slip()

    def begin_slip(self) -> None:
        self.stepper.begin(self.slip_rates[self.mode], self.t, self.y)
        self.limit = self.t

    def excess(self, t: float, s: int) -> float:
        """Return how far the moment in direction s is above the static limit, at rest, N m."""
        u, q = self.mechanism.drive(t), self.y[0]
        return s * self.mechanism.moment(u, q, 0.0) - self.contact.static_limit(u, q)

    def clear_excess(self, t: float, s: int) -> float:
        """Return how far it is above more than rounding, N m; up to there it is a tie and holds."""
        return self.excess(t, s) - self.contact.rounding(self.mechanism.drive(t), self.y[0])

    def mode_from_rest(self) -> int:
        """Return the mode that the contact has at rest now."""
        directions = (FORWARD, BACKWARD)
        return next((s for s in directions if self.clear_excess(self.t, s) > 0.0), STICK)

    def stick(self) -> None:
        """Stand still for a piece of the drive, or up to the breakaway in it."""
        a = self.t
        b = end_of_piece(self.mechanism, self.contact, a, self.end)
        self.known = b
        for s in (FORWARD, BACKWARD):
            if self.clear_excess(b, s) > 0.0:
                self.held, self.known = self.breakaway(a, b, s)
                self.direction = s
                self.ends = True
                return

    def breakaway(self, a: float, b: float, s: int) -> tuple[float, float]:
        """Return when the moment in direction s passes the static limit in a monotone piece.

        Two neighbouring times: it still holds at the first.
        """
        # From a tie at a, it breaks away where there is more to it than rounding.
        excess = self.excess if self.excess(a, s) <= 0.0 else self.clear_excess
        tie = self.contact.rounding(self.mechanism.drive(a), self.y[0])
        return passing(lambda t: excess(t, s), a, b, tie, self.end)

    def sample(self, t: float) -> None:
        """Record the state at t, which is at rest where the contact sticks."""
        y = self.y if self.mode == STICK else self.stepper.state_at(t)
        self.recording.add(self.row(t, y, self.mode))

    def row(self, t: float, y: State, mode: int) -> Row:
        u, q, v = self.mechanism.drive(t), y[0], y[1]
        moment = self.mechanism.moment(u, q, v)
        if mode == STICK:
            return row(t, u, y, 0.0, -moment, STICK)
        friction = -mode * self.contact.kinetic_limit(u, q, v, mode)
        acceleration = (moment + friction) / self.mechanism.inertia
        return row(t, u, y, acceleration, friction, mode)

    def slip(self, s: int) -> None:
        """Slide in direction s for a step, or up to the moment of rest in it."""
        stepper = self.stepper
        if stepper.t >= self.limit:
            self.limit = end_of_piece(self.mechanism, self.contact, stepper.t, self.end)
        passed = self.advance(self.limit)
        rest = self.rest_within_step(s)
        self.ends = rest != inf
        if not self.ends:
            self.note(passed)
        self.known = min(stepper.t, rest)

    def rest_within_step(self, s: int) -> float:
        """Return when the velocity first comes to zero in the last step; inf if it does not.

        A phase that has just broken away starts from zero; this zero is not its end.
        """
        stepper = self.stepper
        t0, t1 = stepper.t0, stepper.t

        def velocity(t: float) -> float:
            return s * stepper.state_at(t)[1]

        if s * stepper.y[1] > 0.0:
            t1 = self.time_of_least_velocity(s)
            if t1 == inf or velocity(t1) > 0.0:
                return inf
        resolution = RESOLUTION * (t1 - t0)
        if s * stepper.y0[1] <= 0.0:
            width = t1 - t0
            while velocity(t0 + width) <= 0.0:
                width *= 0.1
                if width <= resolution:
                    return t0
            t0 += width
            if t0 >= t1:
                return t1
        return sign_change(velocity, t0, t1, resolution)[1]

    def time_of_least_velocity(self, s: int) -> float:
        """Return when the last step has its slowest moment; inf if it cannot be at rest there."""
        stepper = self.stepper
        h = stepper.t - stepper.t0
        v0, v1 = s * stepper.y0[1], s * stepper.y[1]
        a0, a1 = s * stepper.rates0[1], s * stepper.rates1[1]
        if not a0 < 0.0 < a1:
            return inf
        # The velocity stays above its tangents at both ends, hence above where these meet.
        if v0 + a0 * (v1 - v0 - a1 * h) / (a0 - a1) > 0.0:
            return inf
        rates = self.slip_rates[s]
        dy = [0.0] * len(stepper.y)

        def acceleration(t: float) -> float:
            rates(t, stepper.state_at(t), dy)
            return s * dy[1]

        return sign_change(acceleration, stepper.t0, stepper.t, RESOLUTION * h)[1]


def _slip_rates(mechanism: "Mechanism", contact: "Contact", s: int) -> Rates:
    kinetic_limit = contact.kinetic_limit

    def friction(u: float, q: float, v: float, moment: float) -> float:
        return -s * kinetic_limit(u, q, v, s)

    return rates_with_friction(mechanism, friction)
