"""Eq 30 of the paper as it is printed, with its switch of abs and sign [1]_.

    I dw/dt = (-sign(w) r_k R + M) sign(|sign(|x| - x)| + |sign(w)|),   x = r_s - |M|/R

It is here to show what it does; use the law `set-valued` for results. At rest and beyond the
static limit sign(0) = 0 takes all friction away for that evaluation. After the first motion a
numerical step never hits w = 0 again, so that the static limit is out of use: where
r_k R < |M| <= r_s R the body should stop and stay, and runs back instead; where |M| < r_k R it
chatters about rest.

References
----------
.. [1] "Analysis of friction systems on shafts", Int. J. Applied Engineering Research 13(11),
   2018, 8871-8881, eq 30.
"""

from typing import TYPE_CHECKING

from frictionsim.results import STICK, Transition
from frictionsim.solvers.base import FrictionlessSolver, Solver
from frictionsim.solvers.common import (
    ChatteringDetector,
    Row,
    SampleBuffer,
    monotone_segment_end,
    rhs_with_friction,
    row,
)
from frictionsim.solvers.runge_kutta_fehlberg import State

if TYPE_CHECKING:
    from frictionsim.scenario.settings import SolverSettings
    from frictionsim.solvers.mechanism import DryFriction, Mechanism

# A hundred changes of direction within this share of the run are no motion, but chatter.
CHATTERING_WINDOW = 1e-4
# Nor are a thousand steps within this share: stages of both signs then cancel in each of them,
# and the velocity creeps without changing its own.
CREEP_WINDOW = 1e-6

ADVICE = (
    "eq 30 chatters where it should stick; law 'set-valued' sticks, and a fixed solver.step"
    " shows the chatter"
)


def sign(x: float) -> int:
    """Return -1, 0 or +1, as the paper's sign() has it."""
    return (x > 0.0) - (x < 0.0)


def switch(applied_torque: float, static_limit: float, velocity: float) -> int:
    """Return the factor of eq 30, 0 or 1; R x = r_s R - |M| has the sign of x and no division."""
    x = static_limit - abs(applied_torque)
    return sign(abs(sign(abs(x) - x)) + abs(sign(velocity)))


def make_solver(mechanism: "Mechanism", settings: "SolverSettings", buffer: SampleBuffer) -> Solver:
    """Return what steps eq 30 to settings.duration, adaptively or with steps of settings.step."""
    if mechanism.contact is None:
        return FrictionlessSolver(mechanism, settings, buffer)
    return PublishedSolver(mechanism, mechanism.contact, settings, buffer)


class PublishedSolver(Solver):
    """An integration of eq 30, which stops where adaptive steps chatter about rest without end."""

    CHECKPOINT_FIELDS = (*Solver.CHECKPOINT_FIELDS, "mode", "segment_end")

    def __init__(
        self,
        mechanism: "Mechanism",
        contact: "DryFriction",
        settings: "SolverSettings",
        buffer: SampleBuffer,
    ) -> None:
        super().__init__(mechanism, settings, buffer)
        self.contact = contact
        changed = f"the contact '{contact.name}' changed its mode"
        self.chattering = ChatteringDetector(
            CHATTERING_WINDOW * settings.duration, 100, changed, ADVICE
        )
        crept = f"the contact '{contact.name}' let the solver creep on"
        self.creep = ChatteringDetector(CREEP_WINDOW * settings.duration, 1000, crept, ADVICE)
        self.adaptive = settings.step is None
        self.rhs = rhs_with_friction(mechanism, self.friction)
        self.mode, self.segment_end = sign(mechanism.velocity), 0.0

    @property
    def checkpoint_parts(self) -> dict[str, object]:
        return {**super().checkpoint_parts, "chattering": self.chattering, "creep": self.creep}

    def friction(self, u: float, q: float, v: float, applied_torque: float) -> float:
        """Return the friction torque of eq 30, N m."""
        if switch(applied_torque, self.contact.static_limit(u, q), v) == 0:
            return -applied_torque
        s = sign(v)
        return -s * self.contact.kinetic_limit(u, q, v, s)

    def start(self) -> None:
        self.stepper.start(self.rhs, 0.0, self.mechanism.initial_state)

    def resume(self) -> None:
        self.stepper.resume(self.rhs)

    def step(self) -> None:
        stepper = self.stepper
        if stepper.t >= self.segment_end:
            self.segment_end = monotone_segment_end(
                self.mechanism, self.contact, stepper.t, self.end
            )
        self.record_crossing(self.advance(self.segment_end))
        direction = sign(stepper.y[1])
        if direction != self.mode:
            self.turn(direction)
            self.mode = direction
            if self.adaptive:
                self.chattering.count(stepper.t)
        if self.adaptive:
            self.creep.count(stepper.t)

    def turn(self, direction: int) -> None:
        """Record the change of direction that the last step has brought.

        Where in the step it turned is not looked for: before the turn it is at rest, at the start
        of the step where it was until then, and after it, it is at the end of the step.
        """
        stepper, before = self.stepper, self.mode
        t, y = stepper.t, stepper.y
        q, _, *energies = stepper.y_old if before == STICK else y
        self.buffer.record_event(
            Transition(t, self.contact.name, before, direction, y[0]),
            self.row(t, [q, 0.0, *energies], before),
            self.row(t, y, direction),
        )

    def sample(self, t: float) -> None:
        y = self.stepper.interpolate(t)
        self.buffer.add(self.row(t, y, sign(y[1])))

    def row(self, t: float, y: State, mode: int) -> Row:
        u, q, v = self.mechanism.drive(t), y[0], y[1]
        applied_torque = self.mechanism.applied_torque(u, q, v)
        if mode == STICK:
            torque = self.friction(u, q, v, applied_torque)
        else:
            torque = -mode * self.contact.kinetic_limit(u, q, v, mode)
        acceleration = (applied_torque + torque) / self.mechanism.inertia
        return row(t, u, y, acceleration, torque, mode)
