"""The loop over the steps of one coordinate whose changes of mode do not end a step."""

from collections.abc import Callable
from math import inf, nextafter
from typing import Any

from frictionsim.solvers.events import State, smooth_step
from frictionsim.solvers.recording import Recording
from frictionsim.solvers.rkf45 import START, Tolerances, in_range


def sign(x: float) -> int:
    """Return -1, 0 or +1."""
    return (x > 0.0) - (x < 0.0)


class Loop:
    """The loop over steps, which end where the equations are not smooth, and the samples in them.

    Parameters
    ----------
    system : OneCoordinate
    tolerances : Tolerances
    recording : Recording
    end : float, s
    mode : int
        At the start.
    first : Step or ScipyStep
        Before the first step, of the method.

    Attributes
    ----------
    equations : System
        What is integrated.
    state : State
        As of `events.Events`.
    """

    def __init__(
        self,
        system: Any,
        tolerances: Tolerances,
        recording: Recording,
        end: float,
        mode: int,
        first: Any = START,
    ) -> None:
        self.system, self.tolerances, self.recording, self.end = system, tolerances, recording, end
        self.equations = system
        self.state = State(0.0, list(system.start), [mode], [], 0.0, 0, first, 0.0, 0, [])

    def begun(self, state: State) -> State:
        """Return the state with the end of the segment that begins there."""
        raise NotImplementedError

    def step(self, state: State) -> tuple[Any, Any]:
        """Return the next step, and the surface that it ends at if that is an event."""
        return smooth_step(self.equations, state.step, state.modes, state.segment, self.tolerances)

    def ended(self, state: State, step: Any) -> State:
        """Return the state after a step, whose samples are taken: its mode may change."""
        return state

    def mode_of(self, t: float, y: list[float], mode: int) -> int:
        """Return the mode of a sample at a time, s, within a step that began in a mode."""
        return mode

    def row(self, t: float, y: list[float], mode: int) -> list[float]:
        """Return the row of a state in a mode."""
        return self.recording.row(t, y, [mode])

    def run(self, on_step: Callable[[float], object]) -> None:
        """Integrate to the end; `on_step` is called with the time between steps."""
        state = self.state
        while state.t < self.end:
            if state.t >= state.segment:
                state = self.state = in_range(self.begun, state, self.tolerances)
            on_step(state.t)
            state = self.state = in_range(self._advanced, state, self.tolerances)
        beyond = nextafter(self.end, inf)  # with the sample at the end
        self.state = state._replace(samples=self._sampled(state, state.step, beyond))

    def _sampled(self, state: State, step: Any, end: float) -> int:
        """Record the samples before a time, s, within a step; return their number so far."""
        modes = state.modes

        def row(t: float) -> list[float]:
            y = step.at(self.equations, modes, t)
            return self.row(t, y, self.mode_of(t, y, modes[0]))

        return self.recording.until(end, state.samples, row)

    def _advanced(self, state: State) -> State:
        """Return the state after the next step."""
        step, crossed = self.step(state)
        samples = self._sampled(state, step, step.t)
        if crossed:
            name, before = crossed
            t, direction, mode = step.t, sign(step.y[1]), state.modes[0]
            sides = [self.row(t, y, self.mode_of(t, y, mode)) for y in (before, step.y)]
            self.recording.event(t, name, (direction, direction), step.y[0], sides)
        return self.ended(state._replace(t=step.t, y=step.y, samples=samples, step=step), step)
