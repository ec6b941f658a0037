"""The simulation of a belt drive: from step to step, with samples on the way."""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.errors import BudgetExceeded
from frictionsim.mechanisms.belt_drive.belt import BLOCK, Array, Belt, belt_of, initial_state
from frictionsim.mechanisms.belt_drive.compilation import seconds_of_compilation
from frictionsim.mechanisms.belt_drive.equilibrium import Rest, at_rest
from frictionsim.mechanisms.belt_drive.sampling import Observer
from frictionsim.mechanisms.belt_drive.schema import channels_of
from frictionsim.results import SimulationResult
from frictionsim.scenario.signal_tables import SpeedTable, signal_from
from frictionsim.simulation.checkpoint import Arrays, require_array, unfit
from frictionsim.solvers.recording import SampleTimes

if TYPE_CHECKING:
    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario
    from frictionsim.results import Channel
    from frictionsim.simulation.monitor import RunMonitor

# Some hundredths of a second without a call of `on_step`: fewer steps of more bodies.
STEPS_BETWEEN_CALLS = 2000
BODIES_FOR_ALL_STEPS = 400
MAX_COUNT = 2.0**53  # up to which a number of a checkpoint is an integer
TIME_TOLERANCE = 1e-12  # of a time: two that differ by less are the same


class BeltDrive:
    """The `Simulation` of a scenario of kind `belt_drive`."""

    def __init__(self, scenario: "BeltDriveScenario") -> None:
        self._scenario = scenario
        rest = at_rest(scenario)
        self._belt = belt_of(scenario, rest.body_length)
        self._start = initial_state(self._belt, rest.x, rest.y, rest.angle)
        self._stepper = stepper_of(scenario, self._belt, rest, self._start)
        self._observer = Observer(scenario, self._belt, rest, self._stepper.force_per_impulse)
        self._times = SampleTimes(scenario.solver.duration, scenario.interval)
        self._samples = 0  # so far
        self._discontinuities = _discontinuities(scenario)
        self._started = False
        self._tried_before = 0  # steps, in the parts of the run before this one
        self.effects = scenario.effect_names
        self.channel_info: Mapping[str, Channel] = channels_of(scenario.mechanism.names)
        bodies = tuple(map(str, range(self._belt.n)))
        pulleys = scenario.mechanism.names
        self.axes: Mapping[str, Any] = {"pulley": pulleys, "body": bodies, "joint": bodies}
        self.states = self._observer.states

    def sample_at(self, times: Sequence[float]) -> None:
        """Take samples at these times, s, instead of the regular ones; before `solve`."""
        self._times.give(times)

    def prepare(self, monitor: "RunMonitor") -> float:
        """Evaluate the start and compile the kernels; return how long these took, s."""
        stepper = self._stepper

        def work() -> None:
            if not self._started:
                stepper.start()
            stepper.compile()

        seconds = seconds_of_compilation(work, stepper.compile_seconds, monitor)
        self._started = True
        return seconds

    compile = prepare

    def solve(self, on_step: Callable[[float], Any]) -> None:
        """Step on to the end."""
        stepper, times, end = self._stepper, self._times, self._scenario.solver.duration
        per_call = STEPS_BETWEEN_CALLS * BODIES_FOR_ALL_STEPS
        per_call = max(1, per_call // max(BODIES_FOR_ALL_STEPS, self._belt.n))
        while True:
            while (t := times.at(self._samples)) <= stepper.t * (1.0 + TIME_TOLERANCE):
                self._observer.sample(t, stepper.interpolate(t))
                self._samples += 1
            if stepper.t >= end * (1.0 - TIME_TOLERANCE):
                self._observer.finish()
                return
            on_step(stepper.t)
            steps = min(self._steps_left(stepper.t), per_call)
            limit = min((t for t in self._discontinuities if t > stepper.t), default=end)
            stepper.advance(min(limit, end), times.at(self._samples), steps)
            self._observer.check_belt(stepper.t, stepper.interpolate(stepper.t))

    def _steps_left(self, t: float) -> int:
        """Return how many steps may be taken; stop where none is left."""
        solver = self._scenario.solver
        left = solver.max_steps - (self._steps_tried - self._tried_before)
        if left > 0:
            return left
        raise BudgetExceeded(
            f"limit of {solver.max_steps} steps reached at t = {t:.9g} s;"
            f" {self._scenario.budget_advice}, or give the belt fewer bodies"
        )

    @property
    def _steps_tried(self) -> int:
        steps, rejected, _ = self._stepper.statistics
        return steps + rejected

    def statistics(self) -> tuple[int, int, int]:
        """Return steps, rejected steps and evaluations of the right-hand side so far."""
        steps, rejected, evaluations = self._stepper.statistics
        return steps, rejected, evaluations

    def state(self) -> Arrays | None:
        """Return all that the rest of the run depends on; None before the start."""
        if not self._started:
            return None
        parts = {f"stepping.{k}": v for k, v in self._stepper.arrays().items()}
        numbers = {name: np.array(v, dtype=np.float64) for name, v in parts.items()}
        return {**numbers, **self._observer.state()}

    def restore(self, state: dict[str, Any]) -> None:
        """Take over the state of another simulation of the same scenario."""
        for name, array in self._stepper.arrays().items():
            values = require_array(state, f"stepping.{name}", np.float64, ndim=array.ndim)
            if values.shape != array.shape:
                raise unfit(f"stepping.{name}")
            if array.dtype.kind == "i" and not np.all((values >= 0.0) & (values <= MAX_COUNT)):
                raise unfit(f"stepping.{name}", "is out of range")
            array[...] = values
        self._check_runs()
        self._samples = self._observer.restore(state, self._start)
        self._started, self._tried_before = True, self._steps_tried

    def _check_runs(self) -> None:
        """Refuse runs of bodies that are none, through which kernels would write elsewhere."""
        belt = self._belt
        pulley, first, end = belt.runs[: belt.n_runs[0]].T
        inside = (pulley < belt.pul.shape[1]) & (first < end) & (end <= belt.full)
        in_blocks = (first % BLOCK == 0) & (end % BLOCK == 0)
        if belt.n_runs[0] > len(belt.runs) or not np.all(inside & in_blocks):
            raise unfit("stepping.runs", "is out of range")

    def observe(self) -> SimulationResult:
        """Return the samples so far, with the quantities and checks that follow from them."""
        result = self._observer.observe()
        warnings = (*result.warnings, *self._stepper.warnings)
        return result._replace(warnings=warnings)


def stepper_of(scenario: "BeltDriveScenario", belt: Belt, rest: Rest, start: Array) -> Any:
    """Return the belt between two steps of the scenario's method; numba is imported here."""
    if scenario.solver.backend == "moreau":
        from frictionsim.mechanisms.belt_drive.moreau import MoreauStepper

        return MoreauStepper(belt, start, rest, scenario.solver)
    from frictionsim.mechanisms.belt_drive.rkf45 import RKF45Stepper

    return RKF45Stepper(belt, start, rest, scenario.solver)


def _discontinuities(scenario: "BeltDriveScenario") -> list[float]:
    """Return the times at which a drive or its derivative jumps, s: a step ends there."""
    terms = (term for drive in scenario.drive.values() for term in drive.terms)
    signals = (signal_from(term) for term in terms if not isinstance(term, SpeedTable))
    times = {t for signal in signals for t in signal.knots}
    return sorted(t for t in times if 0.0 < t < scenario.solver.duration)
