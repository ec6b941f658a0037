"""Prescribed velocity: inverse dynamics gives the torque of the drive.

Of the first coordinate. It has no breakaway, and of one coordinate the unknowns are the position
and the energies, whatever the method. The torque of the drive follows from the equation of motion,

    u = inertia dv/dt - M_0 - T,   T = -s times the kinetic limit,

with the sum M_0 of all other torques. At rest the friction is indeterminate up to the static limit;
it is taken as zero.
"""

from math import inf, nextafter
from typing import Any, NamedTuple

from frictionsim.results import STICK
from frictionsim.scenario.kinetic_friction import in_motion
from frictionsim.scenario.signals import Signal
from frictionsim.solvers.events import Events
from frictionsim.solvers.loop import State, sign
from frictionsim.solvers.modes import KEEPS, REFINDS
from frictionsim.solvers.roots import bracket_root
from frictionsim.solvers.system import DryFriction, OneCoordinate

DRIVE = "drive"  # name of the event of a change of direction without a contact


class Segment(NamedTuple):
    """A time in which a velocity is smooth and of one sign, the direction; it has an end, s."""

    end: float = 0.0
    direction: int = STICK

    @classmethod
    def of(cls, velocity: Signal, t: float, end: float) -> "Segment":
        """Return the segment of a time in it and its end, s."""
        return cls(end, sign(velocity(0.5 * (t + end))))

    @classmethod
    def after(cls, velocity: Signal, t: float, end: float) -> "Segment":
        """Return the segment that begins at a time, s, and ends at another at the latest."""
        b = min(end, velocity.next_extremum(t))
        last = sign(velocity(b))
        # Signs, as a product of tiny velocities may underflow.
        if last and last * velocity(t) < 0.0:
            b = bracket_root(lambda x: last * velocity(x), t, b)[1]
        return cls.of(velocity, t, b)

    def acceleration(self, velocity: Signal, t: float) -> float:
        """Return the derivative; at the end, the one-sided derivative before it."""
        return velocity.derivative(min(t, nextafter(self.end, -inf)))


class OneAtSpeed(OneCoordinate):
    """A mechanism of one coordinate of given velocity, rad/s; a `System` without contacts.

    Its drive is what acts besides. A kinetic limit that depends on the load gets inertia dv/dt, the
    sum of all torques, as `applied`. Parameters are the velocity and those of `OneCoordinate`.
    """

    segment = Segment()  # of the velocity; `PrescribedEvents` gives it

    def __init__(self, velocity: Signal, *others: Any, **keywords: Any) -> None:
        super().__init__(*others, **keywords)
        # A segment ends at rest; a step that ends just before would have no direction.
        self.velocity, self.surfaces = velocity, in_motion(self.surfaces, 1)
        # Name of the event of a change of direction.
        self.turns = DRIVE if self.friction is None else self.friction.name
        self.contacts = ()

    def driven(self, u: Any, torque: float) -> Any:
        """Return what acts with the torque of the drive, N m; besides it acts u."""
        return torque

    def motion(self, t: float, q: float) -> tuple[Any, float, float, float]:
        """Return what acts with the drive, velocity, friction, N m, and acceleration."""
        v, s, friction = self.velocity(t), self.segment.direction, 0.0
        a, u = self.segment.acceleration(self.velocity, t), self.acting(t, q, v)
        total = self.inertia * a
        if self.friction is not None and s != STICK:
            friction = -s * self.friction.kinetic(u, q, v, s, total)
        return self.driven(u, total - self.torque(u, q, v) - friction), v, friction, a

    def use_friction(self, law: DryFriction | None) -> None:
        """Keep the kinetic limit: no law is needed."""

    def rates(self, t: float, y: list[float], modes: list[int]) -> list[float]:
        u, v, friction, a = self.motion(t, y[0])
        heat = [] if self.friction is None else [-friction * v]
        return [v, a, *self.powers(u, y[0], v), *heat]

    def recorded(self, t: float, y: list[float], modes: list[int]) -> list[float]:
        u, v, friction, a = self.motion(t, y[0])
        if self.friction is None:
            return self.numbers(t, u, (y[0], v, a), friction)
        at_rest = self.acting(t, y[0], 0.0)
        limit = self.friction.static(at_rest, y[0])
        margins = limit, limit, self.friction.roundoff(at_rest, y[0])
        return [*self.numbers(t, u, (y[0], v, a), friction, margins), self.segment.direction]

    def smooth_until(self, t: float, y: list[float], end: float) -> float:
        return min(end, self.drive.next_discontinuity(t))


class PrescribedEvents(Events):
    """Events of the contacts of other coordinates, while the velocity of the first is given.

    Modes are found anew where a segment of the velocity begins: its acceleration may jump there.
    The system has `velocity`, `segment` and `turns`, as of `OneAtSpeed`.
    """

    def begun(self, state: State) -> State:
        system, t, step, end = self.system, state.t, state.step, state.segment
        before = system.segment = Segment.of(system.velocity, step.t_old, end)
        if t >= end and t < self.end:
            y = self._with_velocity(t, state.y)
            row = self.recording.row(t, y, state.modes)
            end = system.smooth_until(t, y, self.end)
            after = system.segment = Segment.after(system.velocity, t, end)
            if step.y and before.direction != after.direction:
                change = before.direction, after.direction
                rows = [row, self.recording.row(t, y, state.modes)]
                self.recording.event(t, system.turns, change, y[0], rows)
            now, end = [REFINDS if mode == KEEPS else mode for mode in state.now], after.end
            step = step if state.modes else step._replace(y=[])  # which begins anew, too
            held = min(state.held, nextafter(t, -inf))
            state = state._replace(y=y, now=now, held=held, step=step)
        return super().begun(state)._replace(segment=end)

    def row(self, t: float, y: list[float], modes: list[int]) -> list[float]:
        return super().row(t, self._with_velocity(t, y), modes)

    def _with_velocity(self, t: float, y: list[float]) -> list[float]:
        """Return a state with the given velocity, without the errors of its integral."""
        n = self.system.coordinates
        return [*y[:n], self.system.velocity(t), *y[n + 1 :]]
