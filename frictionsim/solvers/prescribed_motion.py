"""Prescribed velocity: inverse dynamics gives the torque of the drive.

This solver replaces every backend for such scenarios: there is no breakaway, and the unknowns are
the position and the energies. The drive torque u follows from the equation of motion,

    u = inertia dv/dt - applied_torque(0, q, v) - T,   T = -s kinetic_limit,

where u is a summand of the applied torque. At rest the friction torque is indeterminate up to the
static limit; it is taken as zero.
"""

from math import inf, nextafter
from typing import TYPE_CHECKING, Any, NamedTuple

from frictionsim.results import STICK
from frictionsim.solvers import one_contact_state as layout
from frictionsim.solvers.base import Solver, StateList
from frictionsim.solvers.common import SampleRow, direction_of
from frictionsim.solvers.root_finding import bracket_root

if TYPE_CHECKING:
    from frictionsim.solvers.mechanism import Mechanism


class _TimeAsDrive:
    """The time as the drive of a system."""

    def at(self, t: float) -> float:
        return t


class _InverseDynamics(NamedTuple):
    """The equation of a given motion, as `one_contact_step` takes it; u is the time."""

    solver: "PrescribedMotionSolver"
    inertia: float
    drive: _TimeAsDrive = _TimeAsDrive()

    def torques_and_powers(
        self, t: float, q: float, v: float, s: float
    ) -> tuple[float, float, tuple[float, ...]]:
        u, velocity, friction, acceleration = self.solver.motion_at(t, q)
        powers = self.solver.system.powers(u, q, velocity)
        return self.inertia * acceleration - friction, -s * friction, powers


class PrescribedMotionSolver(Solver):
    """Solver that integrates over segments with a smooth velocity of one direction, `mode`."""

    def new_law(self) -> Any:
        return _InverseDynamics(self, self.system.inertia)

    def motion_at(self, t: float, q: float) -> tuple[float, float, float, float]:
        """Return drive torque, velocity, friction torque and acceleration."""
        drive, system, s = self.mechanism.drive, self.system, self.mode
        # The derivative at the end of the segment is the one-sided derivative before it.
        v, a = drive(t), drive.derivative(min(t, nextafter(self.segment_end, -inf)))
        friction = 0.0
        if self.contact is not None and s != STICK:
            friction = -s * system.kinetic_limit(0.0, q, v, s)
        u = system.inertia * a - system.applied_torque(0.0, q, v) - friction
        return u, v, friction, a

    def start(self) -> None:
        self.mode = self.next_direction(0.0)
        self.stepper.start(0.0, self.mechanism.initial_state)

    def next_direction(self, t: float) -> int:
        """Set the end of the segment that starts at t, and return its direction."""
        self.segment_end = _segment_end(self.mechanism, t, self.end)
        return direction_of(self.mechanism.drive(0.5 * (t + self.segment_end)))

    def switch_mode(self, t: float, y: StateList) -> None:
        """Start the next segment, and record the change of direction if there is one."""
        before, sample_before = self.mode, self.row(t, y, self.mode)
        self.mode = self.next_direction(t)
        self.stepper.start(t, y)
        if self.mode != before:
            self.record(layout.CONTACT_EVENT, sample_before, self.row(t, y, self.mode))

    def step(self) -> None:
        stepper = self.stepper
        if stepper.t >= self.segment_end:
            # The velocity is the given one, without the errors of its integral.
            q, _, *energies = stepper.y
            self.switch_mode(stepper.t, [q, self.mechanism.drive(stepper.t), *energies])
        self.advance(self.segment_end)
        self.record_crossing()

    def check_energy(self) -> None:
        """Accept any: a prescribed motion cannot diverge."""

    def covers(self, t: float) -> bool:
        return t < self.stepper.t or t <= self.stepper.t == self.end

    def row(self, t: float, y: StateList, mode: int) -> SampleRow:
        u, velocity, friction, acceleration = self.motion_at(t, y[0])
        return (t, u, y[0], velocity, acceleration, friction, mode, *y[2:])


def _segment_end(mechanism: "Mechanism", t: float, end: float) -> float:
    """Return a time after t up to which the velocity is smooth and of one sign, s."""
    drive = mechanism.drive
    b = min(end, drive.next_extremum(t))
    direction = direction_of(drive(b))  # compare signs: a product of tiny velocities may underflow
    if direction_of(drive(t)) * direction < 0:
        _, b = bracket_root(lambda x: direction * drive(x), t, b)
    return b
