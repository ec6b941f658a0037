"""Simulation of one scenario: returns its record."""

import logging
from collections.abc import Callable, Sequence
from functools import partial
from math import inf
from time import perf_counter
from typing import TYPE_CHECKING, Any, NamedTuple

from frictionsim.errors import (
    OUT_OF_RANGE,
    BudgetExceeded,
    InputError,
    Interrupted,
    NonFinite,
    SolverError,
    overflow_refused,
)
from frictionsim.results import MODES, Record, SolverStatistics, defined, failures
from frictionsim.scenario.kinds import mechanism_module
from frictionsim.scenario.methods import METHODS
from frictionsim.simulation.checkpoint import (
    dump_part,
    load_part,
    require_same_arrays,
)
from frictionsim.simulation.memory import MemoryWatch, check_memory
from frictionsim.simulation.monitor import RunMonitor, monitor_of
from frictionsim.simulation.record import recorded

if TYPE_CHECKING:
    from frictionsim.results import Quantities, SimulationResult
    from frictionsim.scenario.settings import Scenario
    from frictionsim.simulation.base import Simulation


def log_scenario(scenario: "Scenario") -> None:
    """Log the scenario and its settings."""
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


def log_end(run: "Record") -> None:
    """Log how a run ended."""
    if LOG.isEnabledFor(logging.DEBUG):
        modes = dict(MODES)
        for e in run.transitions:
            before, after = modes[e.mode_from], modes[e.mode_to]
            LOG.debug("event at t = %.9g s: %s from %s to %s", e.time, e.contact, before, after)
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


LOG = logging.getLogger(__name__)

CHECKPOINT_INTERVAL = 60.0  # s of wall time, if a scenario gives none
PAUSE = 20.0  # at least, between two checkpoints, in the time that the first took


class _Clock:
    """Wall time of solving and of compiling, s, including the parts before an interruption."""

    CHECKPOINT_FIELDS = ("solving", "compiling")

    def __init__(self) -> None:
        self.solving = self.compiling = 0.0
        self._since = 0.0

    def start(self) -> None:
        self._since = perf_counter()

    def stop(self) -> None:
        self.solving += perf_counter() - self._since


class _Termination(NamedTuple):
    """How a run ended."""

    status: str = "done"
    reason: str = ""
    failure: str = ""
    resumable: bool = False


def run(
    scenario: "Scenario",
    on_step: "Callable[[float], Any]",
    on_checkpoint: "Callable[[Record], Any] | None" = None,
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
    limited = _with_limit(scenario, max_steps)
    log_scenario(limited)
    with overflow_refused():
        simulation: Simulation = mechanism_module(scenario.kind).simulation(limited)
    clock = _Clock()
    check_memory(scenario, simulation, checkpoint or {})
    if sample_times is not None:
        simulation.sample_at(sample_times)
    if checkpoint is not None:
        LOG.info("the run is resumed")
        _restore(simulation, clock, checkpoint, scenario)
    monitor, on_step = monitor_of(on_step), _watching_memory(on_step)
    if on_checkpoint is not None:
        keep = partial(_keep, scenario, simulation, on_checkpoint, clock)
        on_step = _with_checkpoints(scenario, on_step, keep, clock)
    outcome = _solve(simulation, monitor, on_step, clock)
    done = _run_of(scenario, simulation, outcome, clock)
    log_end(done)
    return done


class RunSummary(NamedTuple):
    """How a run ended, and its quantities: what a sweep keeps of it, without a `Record`."""

    status: str
    reason: str
    failure: str
    warnings: tuple[str, ...]
    quantities: "Quantities"
    is_sound: bool  # whether the audit is passed


def summary_of_run(scenario: "Scenario", monitor: RunMonitor) -> RunSummary:
    """Simulate a scenario as `run`, which makes channels and attributes as well."""
    with overflow_refused():
        simulation: Simulation = mechanism_module(scenario.kind).simulation(scenario)
    check_memory(scenario, simulation, {})
    outcome = _solve(simulation, monitor, _watching_memory(monitor), _Clock())
    data = simulation.observe()
    status, reason, failure, _ = _judged(outcome, data)
    warnings, quantities = _warnings(scenario, simulation, data), defined(data.quantities)
    return RunSummary(status, reason, failure, warnings, quantities, not failures(data.checks))


def _with_limit(scenario: "Scenario", max_steps: int | None) -> "Scenario":
    """Return a scenario with another limit of steps."""
    if max_steps is None:
        return scenario
    solver = scenario.solver.model_copy(update={"max_steps": max_steps})
    return scenario.model_copy(update={"solver": solver})


def _restore(
    simulation: "Simulation", clock: _Clock, checkpoint: "dict[str, Any]", scenario: "Scenario"
) -> None:
    """Load a state, and check that it has nothing else in it."""
    if not METHODS[scenario.solver.backend].resumable:
        raise InputError("its backend leaves no state to resume from")
    simulation.restore(checkpoint)
    load_part(clock, "clock", checkpoint)
    require_same_arrays(checkpoint, _checkpoint(simulation, clock) or {})
    checkpoint.clear()


def _keep(
    scenario: "Scenario",
    simulation: "Simulation",
    on_checkpoint: "Callable[[Record], Any]",
    clock: _Clock,
    t: float,
) -> None:
    """Write a checkpoint at a time of the run."""
    reason = f"checkpoint at t = {t:.9g} s"
    outcome = _Termination("interrupted", reason, resumable=True)
    record = _run_of(scenario, simulation, outcome, clock)
    # With a number that is not finite the run will fail, and there is nothing to continue.
    if record.status == "interrupted":
        on_checkpoint(record)


def _watching_memory(on_step: "Callable[[float], Any]") -> "Callable[[float], Any]":
    """Return an `on_step` that also looks at the memory."""
    watch = MemoryWatch()

    def step_and_look(t: float) -> None:
        on_step(t)
        watch.look(t)

    return step_and_look


def _with_checkpoints(
    scenario: "Scenario",
    on_step: "Callable[[float], Any]",
    keep: "Callable[[float], Any]",
    clock: _Clock,
) -> "Callable[[float], Any]":
    """Return an `on_step` that also writes checkpoints.

    They are due every `output.checkpoint` seconds, and take at most a twentieth of the time.
    """
    interval = scenario.output.checkpoint
    interval = CHECKPOINT_INTERVAL if interval is None else interval or inf
    due = perf_counter() + interval

    def step_and_checkpoint(t: float) -> None:
        nonlocal due
        on_step(t)
        began = perf_counter()
        if began >= due:
            clock.stop()  # do not count the writing of the checkpoint
            keep(t)
            ended = perf_counter()
            due = ended + max(interval, PAUSE * (ended - began))
            clock.start()

    return step_and_checkpoint


def _solve(
    simulation: "Simulation",
    monitor: RunMonitor,
    on_step: "Callable[[float], Any]",
    clock: _Clock,
) -> _Termination:
    try:
        # A signal or a limit ends a compilation, and all, at once.
        clock.compiling += simulation.prepare(monitor)
        LOG.info("the run starts")
        clock.start()
        try:
            simulation.solve(on_step)
        finally:
            clock.stop()
    except Interrupted as stop:
        return _Termination("interrupted", str(stop), resumable=True)
    except SolverError as error:
        resumable = isinstance(error, BudgetExceeded)
        return _Termination("failed", str(error), error.failure, resumable)
    except ArithmeticError:
        return _Termination("failed", OUT_OF_RANGE, NonFinite.failure)
    return _Termination()


def _run_of(
    scenario: "Scenario",
    simulation: "Simulation",
    outcome: _Termination,
    clock: _Clock,
) -> Record:
    """Return the results of a simulation that has stopped, or pauses."""
    data = simulation.observe()
    outcome = _judged(outcome, data)
    record = recorded(scenario, simulation, data)
    ended = {
        "status": outcome.status,
        "reason": outcome.reason,
        "failure": outcome.failure,
        "warnings": "\n".join(_warnings(scenario, simulation, data)),
    }
    return record._replace(
        attributes=record.attributes | ended,
        statistics=SolverStatistics(
            *simulation.statistics(), simulation.states, clock.solving, clock.compiling
        ),
        checkpoint=_checkpoint(simulation, clock) if outcome.resumable else None,
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


def _checkpoint(simulation: "Simulation", clock: _Clock) -> "dict[str, Any] | None":
    """Return the state to resume from; None if the backend does not support it."""
    state = simulation.state()
    return None if state is None else {**state, **dump_part(clock, "clock")}


def _warnings(
    scenario: "Scenario", simulation: "Simulation", data: "SimulationResult"
) -> tuple[str, ...]:
    """Return the warnings about a scenario and its run, each once."""
    absent = [name for name in scenario.output.channels or () if name not in data.channels]
    missing = (
        f"output.channels: this scenario has no channel '{name}'; it is left out" for name in absent
    )
    return tuple(dict.fromkeys([*scenario.warnings(), *missing, *data.warnings]))
