"""The loop over the steps of a run, and the steps, which end where the equations are not smooth.

`events.Events` ends a step where a mode changes; `laws.Law` has the friction in the right-hand
side, and `prescribed.PrescribedMotion` has no unknown force.
"""

from collections.abc import Callable
from functools import partial
from math import inf, nextafter
from typing import Any, NamedTuple

from frictionsim.errors import Diverged
from frictionsim.solvers.modes import Modes
from frictionsim.solvers.recording import Recording
from frictionsim.solvers.rkf45 import START, Step, Tolerances, in_range
from frictionsim.solvers.roots import bracket_root

# Kinetic energy above this multiple of the energy input indicates an unstable integration.
MAX_ENERGY_RATIO = 100.0


def sign(x: float) -> int:
    """Return -1, 0 or +1."""
    return (x > 0.0) - (x < 0.0)


def may_pass_zero(step: Any, c: int, s: int) -> bool:
    """Return whether number c of the state, of sign s at both ends of a step, may be zero within.

    One that falls at first and rises at the end stays above the meeting of its tangents.
    """
    v_old, v, a_old, a = s * step.y_old[c], s * step.y[c], s * step.k_old[c], s * step.k[c]
    if not (v_old > 0.0 and a_old < 0.0 < a):
        return False
    return not v_old + a_old * (v - v_old - a * (step.t - step.t_old)) / (a_old - a) > 0.0


class State(NamedTuple):
    """All that a run needs to continue; times in s."""

    t: float
    y: list[float]  # positions, velocities, energies
    modes: Modes
    now: Modes  # that begin at t; `KEEPS` for no change, `REFINDS` if they are to be found
    held: float  # the last time at which the contacts held that are released at t
    at_stop: int  # the direction in which an end stop is hit at t, or `LEAVES_STOP`; 0 for none
    step: Step
    segment: float  # up to which the equations are smooth
    samples: int  # their number so far
    changes: list[float]  # times of the last changes


class Loop:
    """The loop over steps, and the samples in them.

    Parameters
    ----------
    system : System
    tolerances : Tolerances
    recording : Recording
        Takes samples and events.
    end : float, s
    first : Step or ScipyStep
        Before the first step, of the method.

    Attributes
    ----------
    state : State
        Complete between two turns: from the same state a run continues with the same bits.
    """

    def __init__(
        self,
        system: Any,
        tolerances: Tolerances,
        recording: Recording,
        end: float,
        first: Any = START,
    ) -> None:
        self.system, self.tolerances, self.recording, self.end = system, tolerances, recording, end
        self.state = State(0.0, list(system.start), [], [], 0.0, 0, first, 0.0, 0, [])

    def begun(self, state: State) -> State:
        """Return the state with what begins at its time: modes, and a segment of smooth steps."""
        raise NotImplementedError

    def step(self, state: State) -> tuple[Any, Any]:
        """Return the next step, and the surface that it ends at if that is an event."""
        return smooth_step(self.system, state.step, state.modes, state.segment, self.tolerances)

    def ended(self, state: State, step: Any) -> State:
        """Return the state after a step, whose samples are taken: its mode may change."""
        return state

    def row(self, t: float, y: list[float], modes: Modes) -> list[float]:
        """Return the row of a state within a step that began in these modes."""
        return self.recording.row(t, y, modes)

    def run(self, on_step: Callable[[float], object]) -> None:
        """Integrate to the end; `on_step` is called with the time between turns.

        Raises
        ------
        SolverError
            The state is that before the turn that failed.
        """
        while True:
            state = self.state = in_range(self.begun, self.state, self.tolerances)
            if state.t >= self.end:
                break
            on_step(state.t)
            self.state = in_range(self.turned, state, self.tolerances)
        beyond = nextafter(self.end, inf)  # with the sample at the end
        self.state = state._replace(samples=self.sampled(state, state.step, beyond))

    def turned(self, state: State) -> State:
        """Return the state after the next step."""
        step, crossed = self.step(state)
        samples = self.sampled(state, step, step.t)
        if crossed:
            self.record_crossing(crossed, step, state.modes)
        return self.ended(state._replace(t=step.t, y=step.y, samples=samples, step=step), step)

    def sampled(self, state: State, step: Any, end: float) -> int:
        """Record the samples before a time, s, within a step; return their number so far."""
        system, modes = self.system, state.modes
        return self.recording.until(
            end, state.samples, lambda t: self.row(t, step.at(system, modes, t), modes)
        )

    def record_crossing(self, crossed: tuple[str, list[float]], step: Any, modes: Modes) -> None:
        """Record that a step ends at a surface, with the state before it."""
        name, before = crossed
        direction = sign(step.y[1])
        sides = [self.row(step.t, y, modes) for y in (before, step.y)]
        self.recording.event(step.t, name, (direction, direction), step.y[0], sides)


def smooth_step(
    system: Any, before: Any, modes: Modes, segment: float, tolerances: Tolerances
) -> tuple[Any, Any]:
    """Return the next step, which ends at the first surface that it crosses.

    With it the name of the event and the state before it, if the surface is an event.

    Raises
    ------
    BudgetExceeded, NonFinite, StepUnderflow, Diverged
    """
    step = before.advanced(system, modes, segment, tolerances)
    while True:
        ended, crossed = _cut(system, step, modes)
        if ended is step:
            break
        shorter = before.repeated(ended, system, modes, segment, tolerances)
        if shorter is None:
            step = ended
            break
        step = shorter
    kinetic, supplied = system.kinetic_and_supplied(step.y)
    if kinetic > MAX_ENERGY_RATIO * (supplied + tolerances.atol / tolerances.rtol):
        raise Diverged(
            f"at t = {step.t:.9g} s the kinetic energy is {kinetic:.3g} J, but the energy input"
            f" only {supplied:.3g} J: {tolerances.subject} diverges; give a shorter solver.step or"
            " max_step"
        )
    return step, crossed


def _cut(system: Any, step: Any, modes: Modes) -> tuple[Any, Any]:
    """Return a step ended at the first surface that it crosses, and what `smooth_step` does."""
    crossed = None
    for surface in system.surfaces:
        if surface.beyond(step, step.t, step.y) > 0.0:
            beyond: Any = partial(_beyond, surface, step, system, modes)
            before, after = bracket_root(beyond, step.t_old, step.t)
            crossed = (surface.event, step.at(system, modes, before))
            step = step.cut(system, modes, after)
    return step, crossed if crossed and crossed[0] else None


def _beyond(surface: Any, step: Any, system: Any, modes: Modes, t: float) -> Any:
    return surface.beyond(step, t, step.at(system, modes, t))
