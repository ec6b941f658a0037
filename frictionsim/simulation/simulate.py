"""Simulation of one scenario: returns its record."""

import logging
from collections.abc import Callable, Sequence
from time import perf_counter
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.errors import (
    OUT_OF_RANGE,
    BudgetExceeded,
    InputError,
    Interrupted,
    NonFinite,
    SolverError,
    overflow_refused,
)
from frictionsim.results import Record, SolverStatistics, defined, failures
from frictionsim.scenario.kinds import mechanism_module
from frictionsim.scenario.methods import METHODS
from frictionsim.simulation.checkpoint import require_array, require_same_arrays
from frictionsim.simulation.memory import check_memory
from frictionsim.simulation.monitor import RunMonitor, monitor_of
from frictionsim.simulation.record import recorded

if TYPE_CHECKING:
    from frictionsim.results import Quantities, SimulationResult
    from frictionsim.scenario.settings import Scenario
    from frictionsim.simulation.mechanism import Simulation


LOG = logging.getLogger(__name__)
OnStep = Callable[[float], Any]
OnCheckpoint = Callable[[Record], Any]

CHECKPOINT_INTERVAL = 60.0  # s of wall time, if a scenario gives none
CLOCKS = "solving", "compiling"
PAUSE = 20.0  # at least, between two checkpoints, in the time that the first took


def _log_scenario(scenario: "Scenario") -> None:
    solver = scenario.solver
    LOG.info(
        "scenario %s: kind %s, effects %s, law %s, backend %s",
        scenario.origin.source or scenario.title or scenario.kind,
        scenario.kind,
        ", ".join(scenario.effect_names) or "none",
        scenario.law or "none",
        solver.backend,
    )
    for override in scenario.origin.overrides:
        LOG.debug("overridden: %s", override)
    LOG.debug("limit: %d steps", solver.max_steps)


def _log_end(run: Record) -> None:
    if LOG.isEnabledFor(logging.DEBUG):
        for e in run.transitions:
            LOG.debug("event at t = %.9g s: %s from %s to %s", e.time, e.contact, *e.words)
        for name, check in run.checks.items():
            LOG.debug("audit %s: %.3g, limit %.3g", name, check.value, check.limit)
    statistics = run.statistics
    assert statistics is not None, "a run that was just solved has them"
    LOG.info(
        "run %s at t = %.9g s: samples %d, events %d, steps %d, rejected %d, wall time %.3g s",
        run.status,
        run.time[-1] if run.time.size else 0.0,
        run.time.size,
        len(run.transitions),
        statistics.steps,
        statistics.rejected,
        statistics.wall_seconds or 0.0,
    )


class RunSummary(NamedTuple):
    """How a run ended, and its quantities: what a sweep keeps of it, without a `Record`."""

    status: str
    reason: str
    failure: str
    warnings: tuple[str, ...]
    quantities: "Quantities"
    is_sound: bool  # whether the audit is passed


class _Termination(NamedTuple):
    status: str = "done"
    reason: str = ""
    failure: str = ""
    resumable: bool = False


def run(
    scenario: "Scenario",
    on_step: OnStep,
    on_checkpoint: OnCheckpoint | None = None,
    checkpoint: "dict[str, Any] | None" = None,
    max_steps: int | None = None,
    sample_times: "Sequence[float] | None" = None,
) -> Record:
    """Simulate a scenario.

    Parameters
    ----------
    scenario : Scenario
    on_step : callable
        A `RunMonitor`, or a function of the time after each step; it may show progress, or raise
        Interrupted.
    on_checkpoint : callable, optional
        Called with the results so far every `output.checkpoint` seconds of wall time, 60 if that
        is absent.
    checkpoint : dict of arrays, optional
        State of an earlier run of the scenario to resume from; it is emptied, to be no second copy.
    max_steps : int, optional
        Limit of steps of this part of the run, in the place of `solver.max_steps`. Like a limit of
        the wall time it is not recorded: the resumed run has the result of an unlimited one.
    sample_times : sequence of float, optional, s
        Times of the samples in the place of the regular ones, strictly increasing and within the
        run, which then cannot be resumed.

    Returns
    -------
    Record
        If the run failed or was interrupted, with the samples up to that time.
    """
    limited = scenario
    if max_steps is not None:
        solver = scenario.solver.model_copy(update={"max_steps": max_steps})
        limited = scenario.model_copy(update={"solver": solver})
    _log_scenario(limited)
    one = _Run(scenario, checkpoint, limited)
    if sample_times is not None:
        one.simulation.sample_at(sample_times)
    record = one.record(one.solve(on_step, on_checkpoint))
    _log_end(record)
    return record


def summary_of_run(scenario: "Scenario", monitor: RunMonitor) -> RunSummary:
    """Simulate a scenario as `run`, which makes channels and attributes as well."""
    one = _Run(scenario)
    outcome, data = one.solve(monitor), one.simulation.observe()
    status, reason, failure, _ = _judged(outcome, data)
    warnings, quantities = _warnings(scenario, data), defined(data.quantities)
    return RunSummary(status, reason, failure, warnings, quantities, not failures(data.checks))


class _Run:
    """The simulation of a scenario, with its wall time, s, and that before an interruption."""

    def __init__(
        self,
        scenario: "Scenario",
        checkpoint: "dict[str, Any] | None" = None,
        limited: "Scenario | None" = None,
    ) -> None:
        self.scenario, self.solving, self.compiling, self._since = scenario, 0.0, 0.0, 0.0
        with overflow_refused():
            self.simulation: Simulation = mechanism_module(scenario.kind).simulation(
                limited or scenario
            )
        check_memory(scenario, self.simulation, checkpoint or {})
        if checkpoint is not None:
            LOG.info("the run is resumed")
            self._restore(checkpoint)

    def _restore(self, checkpoint: "dict[str, Any]") -> None:
        """Load a state, check that it has nothing else in it, and empty it."""
        if not METHODS[self.scenario.solver.backend].resumable:
            raise InputError("its backend leaves no state to resume from")
        self.simulation.restore(checkpoint)
        for name in CLOCKS:
            setattr(self, name, float(require_array(checkpoint, f"clock.{name}", float, ndim=0)))
        require_same_arrays(checkpoint, self.state() or {})
        checkpoint.clear()

    def state(self) -> "dict[str, Any] | None":
        """Return the state to resume from; None if the backend does not support it."""
        state = self.simulation.state()
        if state is None:
            return None
        return state | {f"clock.{name}": np.array(getattr(self, name)) for name in CLOCKS}

    def solve(self, on_step: OnStep, on_checkpoint: OnCheckpoint | None = None) -> _Termination:
        step = self._watched(on_step, on_checkpoint)
        try:
            # A signal or a limit ends a compilation, and all, at once.
            self.compiling += self.simulation.prepare(monitor_of(on_step))
            LOG.info("the run starts")
            self._since = perf_counter()
            try:
                self.simulation.solve(step)
            finally:
                self._pause()
        except Interrupted as stop:
            return _Termination("interrupted", str(stop), resumable=True)
        except SolverError as error:
            resumable = isinstance(error, BudgetExceeded)
            return _Termination("failed", str(error), error.failure, resumable)
        except ArithmeticError:
            return _Termination("failed", OUT_OF_RANGE, NonFinite.failure)
        return _Termination()

    def _pause(self) -> float:
        now = perf_counter()
        self.solving += now - self._since
        return now

    def _watched(self, on_step: OnStep, on_checkpoint: OnCheckpoint | None) -> OnStep:
        """Return an `on_step` that also writes checkpoints.

        They are due every `output.checkpoint` seconds, and take at most a twentieth of the time.
        """
        interval = self.scenario.output.checkpoint
        if on_checkpoint is None or interval == 0.0:
            return on_step
        interval = interval or CHECKPOINT_INTERVAL
        due = perf_counter() + interval

        def watched(t: float) -> None:
            nonlocal due
            on_step(t)
            if perf_counter() >= due:
                began = self._pause()  # do not count the writing of the checkpoint
                reason = f"checkpoint at t = {t:.9g} s"
                record = self.record(_Termination("interrupted", reason, resumable=True))
                # With a number that is not finite the run will fail, and nothing can continue.
                if record.status == "interrupted":
                    on_checkpoint(record)
                self._since = perf_counter()
                due = self._since + max(interval, PAUSE * (self._since - began))

        return watched

    def record(self, outcome: _Termination) -> Record:
        """Return the results of a simulation that has stopped, or pauses."""
        scenario, simulation = self.scenario, self.simulation
        data = simulation.observe()
        status, reason, failure, resumable = _judged(outcome, data)
        warnings = "\n".join(_warnings(scenario, data))
        ended = {"status": status, "reason": reason, "failure": failure, "warnings": warnings}
        record = recorded(scenario, simulation, data)
        return record._replace(
            attributes=record.attributes | ended,
            statistics=SolverStatistics(
                *simulation.statistics(), simulation.states, self.solving, self.compiling
            ),
            checkpoint=self.state() if resumable else None,
        )


def _judged(outcome: _Termination, data: "SimulationResult") -> _Termination:
    """Return how a run ended, with what its samples and its audit say."""
    if data.non_finite_tail and outcome.failure != NonFinite.failure:
        reason = f"after t = {max(data.time, default=0.0):.9g} s {OUT_OF_RANGE}"
        return _Termination("failed", reason, NonFinite.failure)
    failed = failures(data.checks)
    if outcome.status == "done" and failed:
        return _Termination("done", f"self-audit failed: {failed}")
    return outcome


def _warnings(scenario: "Scenario", data: "SimulationResult") -> tuple[str, ...]:
    """Return the warnings about a scenario and its run, each once."""
    absent = [name for name in scenario.output.channels or () if name not in data.channels]
    missing = (
        f"output.channels: this scenario has no channel '{name}'; it is left out" for name in absent
    )
    return tuple(dict.fromkeys([*scenario.warnings(), *missing, *data.warnings]))
