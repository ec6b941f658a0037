"""Eq 30 of the paper as it is printed, with its switch of abs and sign [1]_.

    I dw/dt = (-sign(w) r_k R + M) sign(|sign(|x| - x)| + |sign(w)|),   x = r_s - |M|/R

It is here to show what it does; use `events` for results. At rest and beyond the static limit
sign(0) = 0 takes all friction away for that evaluation. After the first motion a numerical step
never hits w = 0 again, so that the static limit is out of use: where r_k R < |M| <= r_s R
the body should stop and stay, and runs back instead; where |M| < r_k R it chatters about rest.

References
----------
.. [1] "Analysis of friction systems on shafts", Int. J. Applied Engineering Research 13(11),
   2018, 8871-8881, eq 30.
"""

from typing import TYPE_CHECKING

from frictionsim.results import STICK, Transition
from frictionsim.solvers.base import Solution, WithoutFriction
from frictionsim.solvers.common import (
    Recording,
    Row,
    StormGuard,
    end_of_piece,
    rates_with_friction,
    row,
)
from frictionsim.solvers.runge_kutta_fehlberg import State

if TYPE_CHECKING:
    from frictionsim.scenario.settings import Solver
    from frictionsim.solvers.mechanism import Contact, Mechanism

# A hundred changes of direction within this share of the run are no motion, but chatter.
STORM = 1e-4
# Nor are a thousand steps within this share: stages of both signs then cancel in each of them,
# and the velocity creeps without changing its own.
CRAWL = 1e-6

ADVICE = (
    "eq 30 chatters where it should stick; backend 'events' or 'rkf45' sticks, and a fixed"
    " solver.step shows the chatter"
)


def sign(x: float) -> int:
    """Return -1, 0 or +1, as the paper's sign() has it."""
    return (x > 0.0) - (x < 0.0)


def switch(moment: float, static_limit: float, velocity: float) -> int:
    """Return the factor of eq 30, 0 or 1; R x = r_s R - |M| has the sign of x and no division."""
    x = static_limit - abs(moment)
    return sign(abs(sign(abs(x) - x)) + abs(sign(velocity)))


def solution(mechanism: "Mechanism", settings: "Solver", recording: Recording) -> Solution:
    """Return what steps eq 30 to settings.duration, adaptively or with steps of settings.step."""
    if mechanism.contact is None:
        return WithoutFriction(mechanism, settings, recording)
    return _Eq30(mechanism, mechanism.contact, settings, recording)


class _Eq30(Solution):
    """An integration of eq 30, which stops where adaptive steps chatter about rest without end."""

    SAVED = (*Solution.SAVED, "mode", "limit")

    def __init__(
        self, mechanism: "Mechanism", contact: "Contact", settings: "Solver", recording: Recording
    ) -> None:
        super().__init__(mechanism, settings, recording)
        self.contact = contact
        changed = f"the contact '{contact.name}' changed its mode"
        self.storm = StormGuard(STORM * settings.duration, 100, changed, ADVICE)
        crept = f"the contact '{contact.name}' let the solver creep on"
        self.crawl = StormGuard(CRAWL * settings.duration, 1000, crept, ADVICE)
        self.adaptive = settings.step is None
        self.rates = rates_with_friction(mechanism, self.friction)
        self.mode, self.limit = sign(mechanism.velocity), 0.0

    @property
    def saved_parts(self) -> dict[str, object]:
        return {**super().saved_parts, "storm": self.storm, "crawl": self.crawl}

    def friction(self, u: float, q: float, v: float, moment: float) -> float:
        """Return the friction torque of eq 30, N m."""
        if switch(moment, self.contact.static_limit(u, q), v) == 0:
            return -moment
        s = sign(v)
        return -s * self.contact.kinetic_limit(u, q, v, s)

    def start(self) -> None:
        self.stepper.begin(self.rates, 0.0, self.mechanism.initial_state)

    def go_on(self) -> None:
        self.stepper.go_on(self.rates)

    def step(self) -> None:
        stepper = self.stepper
        if stepper.t >= self.limit:
            self.limit = end_of_piece(self.mechanism, self.contact, stepper.t, self.end)
        self.note(self.advance(self.limit))
        direction = sign(stepper.y[1])
        if direction != self.mode:
            self.turn(direction)
            self.mode = direction
            if self.adaptive:
                self.storm.note(stepper.t)
        if self.adaptive:
            self.crawl.note(stepper.t)

    def turn(self, direction: int) -> None:
        """Record the change of direction that the last step has brought.

        Where in the step it turned is not looked for: before the turn it is at rest, at the start
        of the step where it was until then, and after it, it is at the end of the step.
        """
        stepper, before = self.stepper, self.mode
        t, y = stepper.t, stepper.y
        q, _, *energies = stepper.y0 if before == STICK else y
        self.recording.event(
            Transition(t, self.contact.name, before, direction, y[0]),
            self.row(t, [q, 0.0, *energies], before),
            self.row(t, y, direction),
        )

    def sample(self, t: float) -> None:
        y = self.stepper.state_at(t)
        self.recording.add(self.row(t, y, sign(y[1])))

    def row(self, t: float, y: State, mode: int) -> Row:
        u, q, v = self.mechanism.drive(t), y[0], y[1]
        moment = self.mechanism.moment(u, q, v)
        if mode == STICK:
            torque = self.friction(u, q, v, moment)
        else:
            torque = -mode * self.contact.kinetic_limit(u, q, v, mode)
        acceleration = (moment + torque) / self.mechanism.inertia
        return row(t, u, y, acceleration, torque, mode)
