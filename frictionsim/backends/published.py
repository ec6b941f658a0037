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

from frictionsim.backends.base import (
    Recording,
    StormGuard,
    end_of_piece,
    rates_with_friction,
)
from frictionsim.backends.solution import Solution, WithoutFriction
from frictionsim.series import Transition

if TYPE_CHECKING:
    from frictionsim.mechanisms.base import Contact, Mechanism
    from frictionsim.parameters import Solver

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
        self.recording.note(self.advance(self.limit), stepper)
        direction = sign(stepper.y[1])
        if direction != self.mode:
            self.recording.transitions.append(
                Transition(stepper.t, self.contact.name, self.mode, direction, stepper.y[0])
            )
            self.mode = direction
            if self.adaptive:
                self.storm.note(stepper.t)
        if self.adaptive:
            self.crawl.note(stepper.t)

    def sample(self, t: float) -> None:
        y = self.stepper.state_at(t)
        u, q, v = self.mechanism.drive(t), y[0], y[1]
        moment = self.mechanism.moment(u, q, v)
        torque = self.friction(u, q, v, moment)
        acceleration = (moment + torque) / self.mechanism.inertia
        self.recording.add(t, u, y, acceleration, torque, sign(v))
