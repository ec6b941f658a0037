"""Prescribed velocity: inverse dynamics gives the torque of the drive.

This solver replaces every backend for such scenarios: there is no breakaway, and the unknowns are
the position and the energies. The drive torque u follows from the equation of motion,

    u = inertia dv/dt - applied_torque(0, q, v) - T,   T = -s kinetic_limit,

where u is a summand of the applied torque. At rest the friction torque is indeterminate up to the
static limit; it is taken as zero.
"""

from math import inf, nextafter
from typing import TYPE_CHECKING, ClassVar

from frictionsim.results import BACKWARD, FORWARD, STICK, Transition
from frictionsim.solvers.base import Solver
from frictionsim.solvers.common import Row, SampleBuffer, advance, row
from frictionsim.solvers.root_finding import bracket_root
from frictionsim.solvers.state_values import DIRECTION, TIME
from frictionsim.solvers.stepper import Rhs, State

if TYPE_CHECKING:
    from frictionsim.scenario.settings import SolverSettings
    from frictionsim.solvers.mechanism import Mechanism


class PrescribedMotionSolver(Solver):
    """Solver that integrates over segments with a smooth velocity of one direction, `mode`."""

    CHECKPOINT_FIELDS: ClassVar = {
        **Solver.CHECKPOINT_FIELDS,
        "mode": DIRECTION,
        "segment_end": TIME,
    }

    def __init__(
        self, mechanism: "Mechanism", settings: "SolverSettings", buffer: SampleBuffer
    ) -> None:
        super().__init__(mechanism, settings, buffer)
        self.mode, self.segment_end = STICK, 0.0

    def start(self) -> None:
        self.mode = self.next_direction(0.0)
        self.begin_segment(0.0, self.mechanism.initial_state)

    def resume(self) -> None:
        self.torques = _InverseDynamics(self.mechanism, self.mode, self.segment_end)
        self.stepper.resume(self.torques.rhs())

    def next_direction(self, t: float) -> int:
        """Set the end of the segment that starts at t, and return its direction."""
        self.segment_end = _segment_end(self.mechanism, t, self.end)
        return _sign(self.mechanism.drive(0.5 * (t + self.segment_end)))

    def begin_segment(self, t: float, y: State) -> None:
        self.torques = _InverseDynamics(self.mechanism, self.mode, self.segment_end)
        self.stepper.start(self.torques.rhs(), t, y)

    def switch_mode(self, t: float, y: State) -> None:
        """Start the next segment, and record the change of direction if there is one."""
        before, sample_before = self.mode, self.row(t, y, self.mode)
        self.mode = self.next_direction(t)
        self.begin_segment(t, y)
        if self.mode != before:
            contact = self.mechanism.contact
            name = contact.name if contact else "drive"
            y = self.stepper.y
            transition = Transition(t, name, before, self.mode, y[0])
            self.buffer.record_event(transition, sample_before, self.row(t, y, self.mode))

    def step(self) -> None:
        stepper = self.stepper
        if stepper.t >= self.segment_end:
            self.switch_mode(stepper.t, stepper.y)
        # No energy check: a prescribed motion cannot diverge.
        self.record_crossing(advance(stepper, self.mechanism, self.segment_end))
        self.t = stepper.t

    def covers(self, t: float) -> bool:
        return t < self.stepper.t or t <= self.stepper.t == self.end

    def sample(self, t: float) -> None:
        self.buffer.add(self.row(t, self.stepper.interpolate(t), self.mode))

    def row(self, t: float, y: State, mode: int) -> Row:
        u, velocity, friction, acceleration = self.torques.at(t, y[0])
        return row(t, u, [y[0], velocity, *y[2:]], acceleration, friction, mode)


class _InverseDynamics:
    """Velocity, friction and drive torque on a segment of one direction."""

    def __init__(self, mechanism: "Mechanism", direction: int, limit: float) -> None:
        self._mechanism, self._direction = mechanism, direction
        # The derivative at the end of the segment is the one-sided derivative before it.
        self._last = nextafter(limit, -inf)

    def at(self, t: float, q: float) -> tuple[float, float, float, float]:
        """Return drive torque, velocity, friction torque and acceleration."""
        mechanism, s = self._mechanism, self._direction
        v, a = mechanism.drive(t), mechanism.drive.derivative(min(t, self._last))
        friction = 0.0
        if mechanism.contact is not None and s != STICK:
            friction = -s * mechanism.contact.kinetic_limit(0.0, q, v, s)
        u = mechanism.inertia * a - mechanism.applied_torque(0.0, q, v) - friction
        return u, v, friction, a

    def rhs(self) -> Rhs:
        power_flows = tuple(enumerate(self._mechanism.power_flows.values(), start=2))
        heat = 2 + len(power_flows) if self._mechanism.contact is not None else 0

        def rhs(t: float, y: State, dy: State) -> None:
            u, v, friction, a = self.at(t, y[0])
            dy[0], dy[1] = v, a
            for i, power in power_flows:
                dy[i] = power(u, y[0], v)
            if heat:
                dy[heat] = -friction * v

        return rhs


def _segment_end(mechanism: "Mechanism", t: float, end: float) -> float:
    """Return a time after t up to which the velocity is smooth and of one sign, s."""
    drive = mechanism.drive
    b = min(end, drive.next_extremum(t))
    direction = _sign(drive(b))  # compare signs: a product of tiny velocities may underflow
    if _sign(drive(t)) * direction < 0:
        _, b = bracket_root(lambda x: direction * drive(x), t, b)
    return b


def _sign(v: float) -> int:
    return FORWARD if v > 0.0 else BACKWARD if v < 0.0 else STICK
