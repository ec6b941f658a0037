"""Eq 30 of the paper as published, with its switch of abs and sign [1]_.

    I dw/dt = (-sign(w) r_k R + M) sign(|sign(|x| - x)| + |sign(w)|),   x = r_s - |M|/R

It is included for comparison; use the law `set-valued` for results. At rest and beyond the static
limit, sign(0) = 0 removes all friction for that evaluation. After the first motion, no numerical
step hits w = 0 again, so the static limit has no effect: where r_k R < |M| <= r_s R the body runs
back instead of sticking; where |M| < r_k R it chatters about rest.

References
----------
.. [1] "Analysis of friction systems on shafts", Int. J. Applied Engineering Research 13(11),
   2018, 8871-8881, eq 30.
"""

from typing import TYPE_CHECKING

from frictionsim.results import STICK
from frictionsim.solvers import one_contact_state as layout
from frictionsim.solvers.base import Solver, StateList
from frictionsim.solvers.common import ChatteringDetector, SampleBuffer, SampleRow

if TYPE_CHECKING:
    from frictionsim.scenario.settings import SolverSettings
    from frictionsim.solvers.mechanism import Mechanism

# 100 changes of direction within this fraction of the duration are chattering.
CHATTERING_WINDOW = 1e-4
# So are 1000 steps within this fraction: stages on both sides of v = 0 cancel, so v creeps
# without changing sign.
CREEP_WINDOW = 1e-6

ADVICE = (
    "eq 30 chatters instead of sticking; use law 'set-valued', or a fixed solver.step to show the"
    " chattering"
)


def sign(x: float) -> int:
    """Return -1, 0 or +1, as sign() in the paper."""
    return (x > 0.0) - (x < 0.0)


def switch(applied_torque: float, static_limit: float, velocity: float) -> int:
    """Return the factor of eq 30, 0 or 1; R x = r_s R - |M| replaces x, which has the same sign."""
    x = static_limit - abs(applied_torque)
    return sign(abs(sign(abs(x) - x)) + abs(sign(velocity)))


class PublishedSolver(Solver):
    """Solver for eq 30, which detects chattering of adaptive steps."""

    def __init__(
        self, mechanism: "Mechanism", settings: "SolverSettings", buffer: SampleBuffer
    ) -> None:
        super().__init__(mechanism, settings, buffer)
        name = self.contact.name
        changed = f"the contact '{name}' changed its mode"
        self.chattering = ChatteringDetector(
            CHATTERING_WINDOW * settings.duration, 100, changed, ADVICE
        )
        crept = f"the contact '{name}' made the solver creep"
        self.creep = ChatteringDetector(CREEP_WINDOW * settings.duration, 1000, crept, ADVICE)
        self.adaptive = settings.step is None
        self.mode = sign(mechanism.velocity)

    @property
    def checkpoint_parts(self) -> dict[str, object]:
        return {**super().checkpoint_parts, "chattering": self.chattering, "creep": self.creep}

    def friction(self, u: float, q: float, v: float, applied: float, kinetic: float) -> float:
        """Return the friction torque of eq 30, N m."""
        if switch(applied, self.system.static_limit(u, q), v) == 0:
            return -applied
        return -sign(v) * kinetic

    def friction_in(self, mode: int, u: float, q: float, v: float, applied: float) -> float:
        if mode == STICK:
            return super().friction_in(mode, u, q, v, applied)
        return -mode * self.system.kinetic_limit(u, q, v, mode)

    def step(self) -> None:
        stepper = self.stepper
        self.advance(self.end_of_segment())
        self.record_crossing()
        direction = sign(stepper.y[1])
        if direction != self.mode:
            self.record_reversal(direction)
            self.mode = direction
            if self.adaptive:
                self.chattering.count(stepper.t)
        if self.adaptive:
            self.creep.count(stepper.t)

    def record_reversal(self, direction: int) -> None:
        """Record a change of direction within the last step.

        The reversal is not located: the sample before it is at rest, after a rest at the start of
        the step; the sample after it is at the end of the step.
        """
        stepper, before = self.stepper, self.mode
        t, y = stepper.t, stepper.y
        q, _, *energies = stepper.y_old if before == STICK else y
        at_rest = self.row(t, [q, 0.0, *energies], before)
        self.record(layout.CONTACT_EVENT, at_rest, self.row(t, y, direction))

    def sample(self, t: float, y: StateList) -> SampleRow:
        return self.row(t, y, sign(y[1]))


SOLVER = PublishedSolver
