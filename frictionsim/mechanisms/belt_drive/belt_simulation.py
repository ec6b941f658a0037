"""The simulation of a belt drive: from step to step, with samples on the way."""

from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.errors import BudgetExceeded, Diverged
from frictionsim.mechanisms.belt_drive.channels import channels_of
from frictionsim.mechanisms.belt_drive.kernels import jit
from frictionsim.mechanisms.belt_drive.model import assemble
from frictionsim.mechanisms.belt_drive.sampling import observer_of
from frictionsim.results import SimulationResult
from frictionsim.simulation.checkpoint import (
    Arrays,
    dump_part,
    load_part,
    require_array,
    unfit,
)
from frictionsim.solvers.recording import SampleTimes

if TYPE_CHECKING:
    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario
    from frictionsim.results import Channel
    from frictionsim.simulation.monitor import RunMonitor

# Some hundredths of a second without a call of `on_step`: fewer steps of more bodies.
STEPS_BETWEEN_CALLS = 2000
BODIES_FOR_ALL_STEPS = 400
MAX_ENERGY_GAIN = 1.0  # of the energy that was stored at the start or put in since
TIME_TOLERANCE = 1e-12  # of a time: two that differ by less are the same


class BeltDrive:
    """The `Simulation` of a scenario of kind `belt_drive`."""

    def __init__(self, scenario: "BeltDriveScenario") -> None:
        self._scenario = scenario
        self._model = assemble(scenario)
        self._times = SampleTimes(scenario.solver.duration, scenario.interval)
        self._discontinuities = _discontinuities(scenario)
        self._observer = observer_of(scenario, self._model)
        module = import_module(scenario.pair.module)
        self._stepper = module.STEPPER(self._model, scenario.solver)
        self._observer.force_per_impulse = self._stepper.force_per_impulse
        self._started = False
        self._tried_before = 0  # steps, in the parts of the run before this one
        self.effects = scenario.effect_names
        self.channel_info: Mapping[str, Channel] = channels_of(scenario.mechanism.names)
        bodies = tuple(map(str, range(scenario.mechanism.belt.bodies)))
        self.axes = {"pulley": scenario.mechanism.names, "body": bodies, "joint": bodies}
        self.states = self._observer.states

    def sample_at(self, times: Sequence[float]) -> None:
        """Take samples at these times, s, instead of the regular ones; before `solve`."""
        self._times.give(times)

    def prepare(self, monitor: "RunMonitor") -> float:
        """Evaluate the start and compile all kernels of the run; return how long that took, s."""
        stepper = self._stepper
        with jit.announce_compilation(stepper.compile_seconds, monitor) as compilation:
            if not self._started:
                stepper.start()
            stepper.prepare()
        self._started = True
        return compilation.seconds

    def compile(self, monitor: "RunMonitor") -> float | None:
        """Compile all kernels of the run."""
        return self.prepare(monitor)

    def solve(self, on_step: Callable[[float], Any]) -> bool:
        """Step on; return whether there are kernels to `prepare` before the end."""
        stepper, times, end = self._stepper, self._times, self._scenario.solver.duration
        bodies = max(BODIES_FOR_ALL_STEPS, self._scenario.mechanism.belt.bodies)
        steps_per_call = max(1, STEPS_BETWEEN_CALLS * BODIES_FOR_ALL_STEPS // bodies)
        while True:
            while times.next <= stepper.t * (1.0 + TIME_TOLERANCE):
                t = times.next
                self._observer.sample(t, stepper.interpolate(t))
                times.advance()
                self._check_energy(t)
            if stepper.t >= end * (1.0 - TIME_TOLERANCE):
                return False
            if not stepper.prepared:
                return True
            on_step(stepper.t)
            steps = min(self._steps_left(stepper.t), steps_per_call)
            limit = min((t for t in self._discontinuities if t > stepper.t), default=end)
            stepper.advance(min(limit, end), times.next, steps)
            self._observer.check_belt(stepper)

    def _steps_left(self, t: float) -> int:
        """Return how many steps may be taken; stop where none is left."""
        solver = self._scenario.solver
        left = solver.max_steps - (self._steps_tried - self._tried_before)
        if left > 0:
            return left
        raise BudgetExceeded(
            f"limit of {solver.max_steps} steps reached at t = {t:.9g} s of the belt;"
            f" {self._scenario.budget_advice}, or give it fewer bodies"
        )

    @property
    def _steps_tried(self) -> int:
        steps, rejected, _ = self._stepper.statistics
        return int(steps + rejected)

    def _check_energy(self, t: float) -> None:
        """Stop where there is more energy than was stored or put in."""
        excess = self._observer.energy_gain
        if excess > MAX_ENERGY_GAIN:
            raise Diverged(
                f"at t = {t:.9g} s the belt has {excess:.3g} times the energy that it was given:"
                " the steps are unstable; give a smaller solver.step or solver.max_step, or a"
                " smaller rtol"
            )

    def statistics(self) -> tuple[int, int, int]:
        """Return steps, rejected steps and evaluations of the right-hand side so far."""
        steps, rejected, evaluations = self._stepper.statistics
        return steps, rejected, evaluations

    def state(self) -> Arrays | None:
        """Return all that the rest of the run depends on; None before the start."""
        if not self._started:
            return None
        parts = {f"stepping.{k}": v for k, v in self._stepper.checkpoint_arrays().items()}
        numbers = {name: np.array(v, dtype=np.float64) for name, v in parts.items()}
        return {**numbers, **dump_part(self._times, "times"), **self._observer.samples.state()}

    def restore(self, state: dict[str, Any]) -> None:
        """Take over the state of another simulation of the same scenario."""
        stepper, like = self._stepper, self._observer.sample_at_start()
        for name, array in stepper.checkpoint_arrays().items():
            values = require_array(state, f"stepping.{name}", np.float64, ndim=array.ndim)
            if values.shape != array.shape:
                raise unfit(f"stepping.{name}", "is of another type or shape")
            array[...] = values
        load_part(self._times, "times", state)
        self._observer.samples.restore(state, like)
        if len(self._observer.samples) != self._times.count:
            raise unfit("samples.time", "is of another type or shape")
        self._started, self._tried_before = True, self._steps_tried

    def observe(self) -> SimulationResult:
        """Return the samples so far, with the quantities and checks that follow from them."""
        return self._observer.observe()


def _discontinuities(scenario: "BeltDriveScenario") -> list[float]:
    """Return the times at which a drive or its derivative jumps, s: a step ends there."""
    from frictionsim.scenario.signal_tables import SpeedTable, signal_from

    times = set()
    for term in (term for drive in scenario.drive.values() for term in drive.terms):
        if isinstance(term, SpeedTable):
            continue
        signal, t = signal_from(term), 0.0
        while (t := signal.next_discontinuity(t)) < scenario.solver.duration:
            times.add(t)
    return sorted(times)
