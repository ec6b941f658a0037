"""Prescribed velocity: inverse dynamics gives the torque of the drive.

There is no breakaway, and the unknowns are the position and the energies, whatever the method. The
torque of the drive follows from the equation of motion,

    u = inertia dv/dt - M_0 - T,   T = -s times the kinetic limit,

with the sum M_0 of all other torques. At rest the friction is indeterminate up to the static limit;
it is taken as zero.
"""

from math import inf, nextafter
from typing import Any

from frictionsim.results import STICK
from frictionsim.solvers.loop import Loop, State, sign
from frictionsim.solvers.roots import bracket_root
from frictionsim.solvers.system import OneCoordinate

DRIVE = "drive"  # name of the event of a change of direction without a contact


class PrescribedMotion(Loop):
    """The loop over segments of a smooth velocity of one direction, the mode; also a `System`.

    Parameters
    ----------
    system : OneCoordinate
        `drive` is the velocity, and what acts is 0.
    others
        As of `Loop`.
    """

    def __init__(self, system: OneCoordinate, *others: Any) -> None:
        super().__init__(system, *others)
        self.equations, self.coordinates, self.surfaces = self, 1, system.surfaces
        self.state, self._segment = self.state._replace(modes=[STICK]), 0.0

    def motion(self, t: float, q: float, s: int) -> tuple[float, float, float, float]:
        """Return the torque of the drive, N m, velocity, friction, N m, and acceleration."""
        drive, system = self.system.drive, self.system
        # The derivative at the end of the segment is the one-sided derivative before it.
        v, a = drive(t), drive.derivative(min(t, nextafter(self._segment, -inf)))
        applied, friction = system.torque(0.0, q, v), 0.0
        if system.friction is not None and s != STICK:
            friction = -s * system.friction.kinetic(0.0, q, v, s, applied)
        return system.inertia * a - applied - friction, v, friction, a

    def rates(self, t: float, y: list[float], modes: list[int]) -> list[float]:
        """Return dy/dt."""
        u, v, friction, a = self.motion(t, y[0], modes[0])
        powers = self.system.powers(u, y[0], v)
        heat = [] if self.system.friction is None else [-friction * v]
        return [v, a, *powers, *heat]

    def recorded(self, t: float, y: list[float], modes: list[int]) -> list[float]:
        """Return what is recorded with a sample."""
        u, v, friction, a = self.motion(t, y[0], modes[0])
        margins, contact = None, self.system.friction
        if contact is not None:
            limit = contact.static(0.0, y[0])
            margins = (limit, limit, contact.roundoff(0.0, y[0]))
        return self.system.numbers(t, u, (y[0], v, a), friction, margins)

    def kinetic_and_supplied(self, y: list[float]) -> tuple[float, float]:
        """Return nothing: a prescribed motion cannot diverge."""
        return 0.0, 1.0

    def begun(self, state: State) -> State:
        """Return the state in the direction of the next segment; record a change of it."""
        if state.t < state.segment or state.t >= self.end:
            return state
        system, t, (q, _, *energies) = self.system, state.t, state.y
        # The velocity is the given one, without the errors of its integral.
        y = [q, system.drive(t), *energies]
        before = self.row(t, y, state.modes) if state.step.y else []
        self._segment = segment = _segment_end(system.drive, t, self.end)
        mode = sign(system.drive(0.5 * (t + segment)))
        step = state.step.started(self, [mode], t, y, self.tolerances)
        if before and mode != state.modes[0]:
            name = DRIVE if system.friction is None else system.friction.name
            change = (state.modes[0], mode)
            self.recording.event(t, name, change, q, [before, self.row(t, y, [mode])])
        return state._replace(y=y, modes=[mode], step=step, segment=segment)

    def step(self, state: State) -> tuple[Any, Any]:
        self._segment = state.segment
        return super().step(state)

    def row(self, t: float, y: list[float], modes: list[int]) -> list[float]:
        shown = [] if self.system.friction is None else modes
        return [t, y[0], self.system.drive(t), *y[2:], *self.recorded(t, y, modes), *shown]


def _segment_end(drive: Any, t: float, end: float) -> float:
    """Return a time after t up to which the velocity is smooth and of one sign, s."""
    b = min(end, drive.next_extremum(t))
    last = sign(drive(b))
    # Signs, as a product of tiny velocities may underflow.
    if last and last * drive(t) < 0.0:
        b = bracket_root(lambda x: last * drive(x), t, b)[1]
    return b
