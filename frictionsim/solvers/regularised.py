"""Dry friction smoothed over a transition speed, for ordinary integrators: it creeps.

    T = -sign(v) F(|v|/v_t),   x = |v|/v_t

    F = L_s (3 x - x^3)/2                        x <= 1    up to the static limit L_s
    F = L_s + (L_k - L_s) d^2 (3 - 2 d)      1 < x <= 1.5, d = 2 (x - 1), down to the kinetic
    F = L_k                                1.5 < x

as Threlfall's curve and the joints of Adams have it [1]_. It is here to show what it costs: at
rest the body creeps at about v_t M/(1.5 L_s), the time constant there is v_t I/(1.5 L_s), and
the error of the motion is of the order of v_t. `regularised` steps it with our own integrator,
the others with SciPy's. What counts as stick is |v| < v_t.

References
----------
.. [1] D. C. Threlfall, "The inclusion of Coulomb friction in mechanisms programs with particular
   reference to DRAM", Mechanism and Machine Theory 13, 1978, 475-483.
"""

from typing import TYPE_CHECKING

from frictionsim.results import BACKWARD, FORWARD, STICK
from frictionsim.solvers.base import Solution, WithoutFriction
from frictionsim.solvers.common import Recording, Row, rates_with_friction, row
from frictionsim.solvers.root_finding import sign_change
from frictionsim.solvers.runge_kutta_fehlberg import State

if TYPE_CHECKING:
    from frictionsim.scenario.settings import Solver
    from frictionsim.solvers.mechanism import Contact, Mechanism

TRANSITION_SPEED = 1e-3  # rad/s, where the scenario does not give it
KINETIC_FROM = 1.5  # times the transition speed


def solution(mechanism: "Mechanism", settings: "Solver", recording: Recording) -> Solution:
    """Return what steps the smoothed law to settings.duration."""
    if mechanism.contact is None:
        return WithoutFriction(mechanism, settings, recording)
    return _Creeping(mechanism, mechanism.contact, settings, recording)


def smoothed_limit(x: float, static_limit: float, kinetic_limit: float) -> float:
    """Return the size of the friction at a speed of x transition speeds, N m.

    Parameters
    ----------
    x : float, not negative
    static_limit, kinetic_limit : float, N m
    """
    if x <= 1.0:
        return static_limit * (1.5 - 0.5 * x * x) * x
    if x >= KINETIC_FROM:
        return kinetic_limit
    d = (x - 1.0) / (KINETIC_FROM - 1.0)
    return static_limit + (kinetic_limit - static_limit) * d * d * (3.0 - 2.0 * d)


class _Creeping(Solution):
    """An integration of the smoothed law, and what it takes for stick."""

    SAVED = (*Solution.SAVED, "mode", "limit")

    def __init__(
        self, mechanism: "Mechanism", contact: "Contact", settings: "Solver", recording: Recording
    ) -> None:
        super().__init__(mechanism, settings, recording)
        self.contact = contact
        self.speed = settings.transition_speed or TRANSITION_SPEED
        self.rates = rates_with_friction(mechanism, self.friction)
        self.mode, self.limit = self.mode_at(mechanism.velocity), 0.0

    def friction(self, u: float, q: float, v: float, moment: float) -> float:
        """Return the friction torque, N m."""
        s = FORWARD if v > 0.0 else BACKWARD
        x = s * v / self.speed
        static = self.contact.static_limit(u, q) if x < KINETIC_FROM else 0.0
        kinetic = self.contact.kinetic_limit(u, q, v, s) if x > 1.0 else 0.0
        return -s * smoothed_limit(x, static, kinetic)

    def mode_at(self, v: float) -> int:
        """Return what a velocity counts as."""
        if abs(v) < self.speed:
            return STICK
        return FORWARD if v > 0.0 else BACKWARD

    def start(self) -> None:
        self.stepper.begin(self.rates, 0.0, self.mechanism.initial_state)

    def go_on(self) -> None:
        self.stepper.go_on(self.rates)

    def step(self) -> None:
        if self.t >= self.limit:
            self.limit = min(self.end, self.mechanism.drive.next_kink(self.t))
        passed = self.advance(self.limit)
        self.note_mode()
        self.note(passed)

    def mode_in_motion(self, direction: int) -> int:
        return self.mode_at(self.stepper.y[1])  # it may creep

    def note_mode(self) -> None:
        """Note the transition of the last step, if there was one."""
        stepper, before = self.stepper, self.mode
        mode = self.mode_at(stepper.y[1])
        if mode == before:
            return
        # It passes the transition speed on the way to slip or to stick.
        threshold = (mode or before) * self.speed
        direction = 1.0 if threshold > stepper.y0[1] else -1.0
        t = stepper.t
        if direction * (stepper.y0[1] - threshold) < 0.0:
            t = sign_change(
                lambda at: direction * (stepper.state_at(at)[1] - threshold), stepper.t0, stepper.t
            )[1]
        self.change_mode(t, before, mode, list(stepper.state_at(t)))
        self.mode = mode

    def sample(self, t: float) -> None:
        y = self.stepper.state_at(t)
        self.recording.add(self.row(t, y, self.mode_at(y[1])))

    def row(self, t: float, y: State, mode: int) -> Row:
        mechanism = self.mechanism
        u, q, v = mechanism.drive(t), y[0], y[1]
        moment = mechanism.moment(u, q, v)
        friction = self.friction(u, q, v, moment)
        acceleration = (moment + friction) / mechanism.inertia
        return row(t, u, y, acceleration, friction, mode)
