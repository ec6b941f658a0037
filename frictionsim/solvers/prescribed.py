"""Prescribed velocity: inverse dynamics gives the torque of the drive.

There is no breakaway, and the unknowns are the position and the energies, whatever the method. The
torque of the drive follows from the equation of motion,

    u = inertia dv/dt - M_0 - T,   T = -s times the kinetic limit,

with the sum M_0 of all other torques. At rest the friction is indeterminate up to the static limit;
it is taken as zero.
"""

from collections.abc import Callable
from math import inf, nextafter
from typing import Any

from frictionsim.results import STICK
from frictionsim.solvers.events import State, smooth_step
from frictionsim.solvers.recording import Recording
from frictionsim.solvers.rkf45 import START, Tolerances, in_range
from frictionsim.solvers.roots import bracket_root
from frictionsim.solvers.system import OneCoordinate

DRIVE = "drive"  # name of the event of a change of direction without a contact


class PrescribedMotion:
    """Solver over segments with a smooth velocity of one direction, the mode; also a `System`.

    Parameters
    ----------
    system : OneCoordinate
        `drive` is the velocity, and what acts is 0.
    tolerances : Tolerances
    recording : Recording
    end : float, s

    Attributes
    ----------
    state : State
        As of `events.Events`.
    """

    def __init__(
        self, system: OneCoordinate, tolerances: Tolerances, recording: Recording, end: float
    ) -> None:
        self.system, self.tolerances, self.recording, self.end = system, tolerances, recording, end
        self.coordinates, self.surfaces = 1, system.surfaces
        self.state = State(0.0, list(system.start), [STICK], [], 0.0, 0, START, 0.0, 0, [])
        self._segment = 0.0

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

    def run(self, on_step: Callable[[float], object]) -> None:
        """Integrate to the end; `on_step` is called with the time between steps."""
        state = self.state
        while state.t < self.end:
            if state.t >= state.segment:
                state = self.state = self._begun(state)
            self._segment = state.segment
            on_step(state.t)
            state = self.state = in_range(self._advanced, state, self.tolerances)
        if self.recording.times.at(state.samples) <= self.end:
            self._sample(self.end, state.y, state.modes)
            self.state = state._replace(samples=state.samples + 1)

    def _begun(self, state: State) -> State:
        """Return the state at the start of the next segment; record a change of direction."""
        system, t, (q, _, *energies) = self.system, state.t, state.y
        # The velocity is the given one, without the errors of its integral.
        y = [q, system.drive(t), *energies]
        before = self._row(t, y, state.modes) if state.step.y else []
        self._segment = segment = _segment_end(system.drive, t, self.end)
        middle = system.drive(0.5 * (t + segment))
        modes = [(middle > 0.0) - (middle < 0.0)]
        step = state.step.started(self, modes, t, y, self.tolerances)
        if before and modes != state.modes:
            name = DRIVE if system.friction is None else system.friction.name
            change = (state.modes[0], modes[0])
            self.recording.event(t, name, change, q, [before, self._row(t, y, modes)])
        return state._replace(y=y, modes=modes, step=step, segment=segment)

    def _advanced(self, state: State) -> State:
        """Return the state after the next step."""
        modes = state.modes
        step, crossed = smooth_step(self, state.step, modes, state.segment, self.tolerances)
        samples, t = state.samples, self.recording.times.at(state.samples)
        while t < step.t:
            self._sample(t, step.at(self, modes, t), modes)
            samples += 1
            t = self.recording.times.at(samples)
        if crossed:
            name, before = crossed
            sides = [self._row(step.t, y, modes) for y in (before, step.y)]
            self.recording.event(step.t, name, (modes[0], modes[0]), step.y[0], sides)
        return state._replace(t=step.t, y=step.y, samples=samples, step=step)

    def _row(self, t: float, y: list[float], modes: list[int]) -> list[float]:
        shown = modes if self.system.friction is not None else []
        return [t, y[0], self.system.drive(t), *y[2:], *self.recorded(t, y, modes), *shown]

    def _sample(self, t: float, y: list[float], modes: list[int]) -> None:
        self.recording.rows.extend(self._row(t, y, modes))


def _segment_end(drive: Any, t: float, end: float) -> float:
    """Return a time after t up to which the velocity is smooth and of one sign, s."""
    b = min(end, drive.next_extremum(t))
    last = (drive(b) > 0.0) - (drive(b) < 0.0)
    # Signs, as a product of tiny velocities may underflow.
    if last and last * drive(t) < 0.0:
        b = bracket_root(lambda x: last * drive(x), t, b)[1]
    return b
