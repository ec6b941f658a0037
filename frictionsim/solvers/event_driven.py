"""Event-driven integration: stick and slip phases are smooth, and their ends are located.

In a stick phase the state is constant; it ends where the applied torque first exceeds the static
limit. In a slip phase the kinetic friction has a fixed direction; it ends where the velocity
becomes zero. The static limit then decides the next phase; if the torque equals it, the contact
sticks.
"""

from math import copysign, inf
from typing import TYPE_CHECKING, Any, ClassVar

from frictionsim.results import BACKWARD, FORWARD, STICK
from frictionsim.solvers.base import ContactSolver
from frictionsim.solvers.common import (
    ChatteringDetector,
    Row,
    SampleBuffer,
    crossing_bracket,
    monotone_segment_end,
    rhs_with_friction,
    row,
    segment_end_at_rest,
)
from frictionsim.solvers.end_stops import StopContact
from frictionsim.solvers.root_finding import bracket_root
from frictionsim.solvers.runge_kutta_fehlberg import RungeKuttaFehlberg45
from frictionsim.solvers.state_values import DIRECTION, FLAG, NUMBER, TIME
from frictionsim.solvers.stepper import Rhs, State

if TYPE_CHECKING:
    from frictionsim.scenario.settings import SolverSettings
    from frictionsim.solvers.mechanism import DryFriction, Mechanism

# Resolution of the end of a slip phase, relative to the step.
RESOLUTION = 1e-12
# So many transitions within this time, s, are chattering.
CHATTERING_EVENTS = 100
CHATTERING_WINDOW = 1e-6
NEVER = -1.0  # s


class EventDrivenSolver(ContactSolver):
    """Event-driven solver.

    In a stick phase, a step is a segment on which the drive is monotone, and `y` is the state. In
    a slip phase, the integrator takes a step and holds the state.
    """

    stepper: RungeKuttaFehlberg45
    CHECKPOINT_FIELDS: ClassVar = {
        **ContactSolver.CHECKPOINT_FIELDS,
        "y": NUMBER,
        "mode": DIRECTION,
        "sampled_until": TIME,
        "phase_ends": FLAG,
        "direction": DIRECTION,
        "held": TIME._replace(low=NEVER),
        "segment_end": TIME,
    }

    def __init__(
        self, mechanism: "Mechanism", settings: "SolverSettings", buffer: SampleBuffer
    ) -> None:
        super().__init__(mechanism, settings, buffer)
        contact = self.contact
        self.chattering = ChatteringDetector(
            CHATTERING_WINDOW * min(1.0, settings.duration),
            CHATTERING_EVENTS,
            f"the contact '{contact.name}' changed its mode",
            "check whether the drive changes too fast"
            + (", or give a larger effects.end_stops.capture_speed" if self.stops else ""),
        )
        self.slip_rhs = {s: slip_rhs(mechanism, contact, s) for s in (FORWARD, BACKWARD)}
        self.y: State = mechanism.initial_state
        self.mode = STICK if mechanism.velocity == 0.0 else int(copysign(1, mechanism.velocity))
        self.sampled_until = 0.0  # end, exclusive, of the samples in the last step
        self.phase_ends = False  # the phase ends with the last step
        self.direction = STICK  # of the breakaway at the end of the stick phase
        self.held = NEVER  # last time at which the contact held
        self.segment_end = 0.0  # of the smooth segment in which the contact slides

    @property
    def checkpoint_parts(self) -> dict[str, object]:
        return {**super().checkpoint_parts, "chattering": self.chattering}

    def start(self) -> None:
        if self.stops is not None and self.stops.is_hit(self.y):
            self.hit_stop(self.stops)
        elif self.mode == STICK:
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
            if self.stops is not None and self.stops.is_hit(self.y):
                self.hit_stop(self.stops)
                return
            self.y[1] = 0.0
            self.switch_mode(self.mode_from_rest())

    def finish(self) -> None:
        if self.buffer.times.next <= self.end:
            self.sample(self.end)

    def switch_mode(self, mode: int) -> None:
        """Switch to the next mode and record the transition if the mode changes."""
        self.chattering.count(self.t)
        if mode != self.mode:
            held = self.held if self.mode == STICK else self.t
            self.change_mode(self.t, self.mode, mode, self.y, held)
            self.mode = mode
        if mode != STICK:
            self.begin_slip()

    def hit_stop(self, stops: StopContact) -> None:
        """Switch to the mode after an impact on a stop."""
        self.chattering.count(self.t)
        before, self.y = stops.before_impact(self.y), stops.after_impact(self.t, self.y)
        mode = -self.mode if self.y[1] != 0.0 else self.mode_from_rest()
        self.record_impact(before, self.mode, mode, self.y)
        self.mode = mode
        if mode != STICK:
            self.begin_slip()

    def begin_slip(self) -> None:
        self.stepper.start(self.slip_rhs[self.mode], self.t, self.y)
        self.segment_end = self.t

    def excess(self, t: float, s: int) -> float:
        """Return the applied torque in direction s minus the static limit, at rest, N m."""
        u, q = self.mechanism.drive(t), self.y[0]
        return s * self.mechanism.applied_torque(u, q, 0.0) - self.contact.static_limit(u, q)

    def excess_beyond_roundoff(self, t: float, s: int) -> float:
        """Return the excess minus the roundoff, N m; the contact holds unless it is positive."""
        return self.excess(t, s) - self.contact.roundoff(self.mechanism.drive(t), self.y[0])

    def mode_from_rest(self) -> int:
        """Return the mode that follows from rest at the present time."""
        directions = (FORWARD, BACKWARD)
        return next((s for s in directions if self.excess_beyond_roundoff(self.t, s) > 0.0), STICK)

    def stick(self) -> None:
        """Stick for a monotone segment of the drive, or up to the breakaway in it."""
        a = self.t
        b = segment_end_at_rest(self.mechanism, self.contact, self.y[0], a, self.end)
        self.sampled_until = b
        for s in (FORWARD, BACKWARD):
            if self.excess_beyond_roundoff(b, s) > 0.0:
                self.held, self.sampled_until = self.breakaway(a, b, s)
                self.direction = s
                self.phase_ends = True
                return

    def breakaway(self, a: float, b: float, s: int) -> tuple[float, float]:
        """Return the time of the breakaway in direction s within a monotone segment.

        Two adjacent times, s: the contact still holds at the first.
        """
        # If the torque equals the limit at a, ignore an excess that is roundoff.
        excess = self.excess if self.excess(a, s) <= 0.0 else self.excess_beyond_roundoff
        tie = self.contact.roundoff(self.mechanism.drive(a), self.y[0])
        return crossing_bracket(lambda t: excess(t, s), a, b, tie, self.end)

    def sample(self, t: float) -> None:
        """Record the state at t."""
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
        """Slide in direction s for a step, or up to the rest or impact within it."""
        stepper = self.stepper
        if stepper.t >= self.segment_end:
            self.segment_end = monotone_segment_end(
                self.mechanism, self.contact, stepper.t, self.end
            )
        crossing = self.advance(self.segment_end)
        rest = self.rest_within_step(s)
        until = min(stepper.t, rest)
        if self.stops is not None:
            impact = self.stops.impact_in_slip(stepper, s, until)
            rest, until = min(rest, impact), min(until, impact)
        self.phase_ends = rest != inf
        if not self.phase_ends:
            self.record_crossing(crossing)
        self.sampled_until = until

    def rest_within_step(self, s: int) -> float:
        """Return the time of the first stop in the last step; inf if there is none.

        The zero velocity at the start of a phase after a breakaway does not count.
        """
        stepper = self.stepper
        t_old, t1 = stepper.t_old, stepper.t

        def velocity(t: float) -> float:
            return s * stepper.interpolate(t)[1]

        if s * stepper.y[1] > 0.0:
            t1 = self.time_of_min_velocity(s)
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

    def time_of_min_velocity(self, s: int) -> float:
        """Return the time of the minimum velocity in the last step; inf if it stays positive."""
        stepper = self.stepper
        h = stepper.t - stepper.t_old
        v0, v1 = s * stepper.y_old[1], s * stepper.y[1]
        a0, a1 = s * stepper.f_old[1], s * stepper.f[1]
        if not a0 < 0.0 < a1:
            return inf
        # The velocity is above its tangents at both ends, hence above their intersection.
        if v0 + a0 * (v1 - v0 - a1 * h) / (a0 - a1) > 0.0:
            return inf
        rhs = self.slip_rhs[s]
        dy = [0.0] * len(stepper.y)

        def acceleration(t: float) -> float:
            rhs(t, stepper.interpolate(t), dy)
            return s * dy[1]

        return bracket_root(acceleration, stepper.t_old, stepper.t, RESOLUTION * h)[1]


SOLVER = EventDrivenSolver


def slip_rhs(mechanism: "Mechanism", contact: "DryFriction", s: Any) -> Rhs:
    """Return the right-hand side while the contact slides in direction s."""
    kinetic_limit = contact.kinetic_limit

    def friction(u: float, q: float, v: float, applied_torque: float) -> float:
        return -s * kinetic_limit(u, q, v, s)

    return rhs_with_friction(mechanism, friction)
