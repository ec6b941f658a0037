"""One run: a scenario goes in; channels, transitions, quantities, checks and counts come out."""

from collections.abc import Mapping
from math import inf
from time import perf_counter
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

from frictionsim.errors import (
    EXIT_AUDIT_FAILED,
    BudgetExceeded,
    Interrupted,
    NonFinite,
    SolverError,
)
from frictionsim.results import Channel, Check, Quantities, Transition, failures
from frictionsim.scenario.kinds import mechanism_module
from frictionsim.simulation.checkpoint import dump_part, load_part

if TYPE_CHECKING:
    from collections.abc import Callable

    from frictionsim.results import Array, SimulationResult
    from frictionsim.scenario.settings import Scenario
    from frictionsim.simulation.base import Simulation


OUT_OF_RANGE = (
    "a number is beyond the range of double precision; is a force or an inertia far too large or"
    " too small?"
)


class SolverStatistics(NamedTuple):
    """What a run took, in all its parts if it was interrupted.

    `wall_seconds` is the solving alone; `compile_seconds` is 0 where all kernels were there.
    """

    steps: int
    rejected: int
    rhs_evaluations: int
    states: int
    wall_seconds: float
    compile_seconds: float = 0.0


class RunResult(NamedTuple):
    """A run with its outcome, as plain data.

    Attributes
    ----------
    effects : tuple of str
        The effects that were simulated.
    channel_info : mapping of name to Channel
        For each channel, and maybe for more.
    axes : mapping of name to tuple of str
        The names of the members of each axis that a channel may have.
    time : (n,), s
    channels : dict of (n,) or (n, members of the channel's axis)
        Those to record: all, or those of `output.channels` that the scenario has.
    transitions : list of Transition
    quantities : Quantities
        The quantities of the summary.
    checks : dict of Check
        The audit.
    status : str
        `done`, `failed` or `interrupted`.
    reason : str
        Why it is not done; empty if it is.
    sides : dict of (m,)
        The recorded channels right before and right after each transition.
    exit_code : int
        Of the run itself, before any audit.
    warnings : tuple of str
        What a user should know before trusting the quantities: of the scenario, then of the run.
    failure : str
        The kind of a failure, such as `chattering`; empty if it has not failed.
    checkpoint : dict of arrays or None
        The state of the simulation, where a run that is not done can go on from it.
    """

    scenario: "Scenario"
    effects: tuple[str, ...]
    channel_info: Mapping[str, Channel]
    axes: Mapping[str, tuple[str, ...]]
    time: "Array"
    channels: dict[str, "Array"]
    transitions: list[Transition]
    quantities: Quantities
    checks: dict[str, Check]
    statistics: SolverStatistics
    status: str
    reason: str
    exit_code: int
    warnings: tuple[str, ...] = ()
    failure: str = ""
    checkpoint: "dict[str, Any] | None" = None
    sides: "Mapping[str, Array]" = MappingProxyType({})


class _Clock:
    """The seconds of solving and of compilation; of the parts before an interruption, too."""

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
    exit_code: int = 0
    failure: str = ""
    resumable: bool = False


def run(
    scenario: "Scenario",
    on_step: "Callable[[float], Any]",
    on_checkpoint: "Callable[[RunResult], Any] | None" = None,
    checkpoint: "dict[str, Any] | None" = None,
) -> RunResult:
    """Simulate a scenario.

    Parameters
    ----------
    scenario : Scenario
    on_step : callable
        Called with the time after each step; it may show progress, or raise Interrupted.
    on_checkpoint : callable, optional
        Called with the run so far every `output.checkpoint` seconds.
    checkpoint : dict of arrays, optional
        Of an earlier run of the scenario, which goes on from there.

    Returns
    -------
    Run
        Also of a run that failed or was interrupted, with the samples up to there.

    Raises
    ------
    InputError
        If the checkpoint is of another scenario.
    """
    simulation: Simulation = mechanism_module(scenario.kind).simulation(scenario)
    clock = _Clock()
    if checkpoint is not None:
        simulation.restore(checkpoint)
        load_part(clock, "clock", checkpoint)
    monitor = on_step
    if on_checkpoint is not None and scenario.output.checkpoint is not None:
        on_step = _with_checkpoints(scenario, simulation, on_step, on_checkpoint, clock)
    return _run_of(scenario, simulation, _solve(simulation, monitor, on_step, clock), clock)


def _with_checkpoints(
    scenario: "Scenario",
    simulation: "Simulation",
    on_step: "Callable[[float], Any]",
    on_checkpoint: "Callable[[RunResult], Any]",
    clock: _Clock,
) -> "Callable[[float], Any]":
    """Return an on_step that also hands on the run so far every so many seconds."""
    last, seconds = perf_counter(), scenario.output.checkpoint or inf

    def step_and_checkpoint(t: float) -> None:
        nonlocal last
        on_step(t)
        if perf_counter() - last >= seconds:
            clock.stop()  # to write is not to solve
            reason = f"checkpoint at t = {t:.9g} s"
            outcome = _Termination("interrupted", reason, resumable=True)
            on_checkpoint(_run_of(scenario, simulation, outcome, clock))
            last = perf_counter()
            clock.start()

    return step_and_checkpoint


def _solve(
    simulation: "Simulation",
    monitor: "Callable[[float], Any]",
    on_step: "Callable[[float], Any]",
    clock: _Clock,
) -> _Termination:
    try:
        clock.compiling += simulation.prepare(monitor)
        clock.start()
        try:
            simulation.solve(on_step)
        finally:
            clock.stop()
    except Interrupted as stop:
        return _Termination("interrupted", str(stop), stop.exit_code, resumable=True)
    except SolverError as error:
        resumable = isinstance(error, BudgetExceeded)
        return _Termination("failed", str(error), error.exit_code, error.failure, resumable)
    except ArithmeticError:
        return _Termination("failed", OUT_OF_RANGE, NonFinite.exit_code, NonFinite.failure)
    return _Termination()


def _run_of(
    scenario: "Scenario", simulation: "Simulation", outcome: _Termination, clock: _Clock
) -> RunResult:
    """Return a run with what its simulation shows."""
    seen = simulation.observe()
    if seen.non_finite_tail and outcome.failure != NonFinite.failure:
        reason = f"after t = {max(seen.time, default=0.0):.9g} s {OUT_OF_RANGE}"
        outcome = _Termination("failed", reason, NonFinite.exit_code, NonFinite.failure)
    failed = failures(seen.checks)
    if outcome.status == "done" and failed:
        outcome = _Termination("done", f"self-audit failed: {failed}", EXIT_AUDIT_FAILED)
    wanted = scenario.output.channels
    return RunResult(
        scenario=scenario,
        effects=simulation.effects,
        channel_info=simulation.channel_info,
        axes=simulation.axes,
        time=seen.time,
        channels={
            name: channel
            for name, channel in seen.channels.items()
            if wanted is None or name in wanted
        },
        transitions=seen.transitions,
        quantities=seen.quantities,
        checks=seen.checks,
        statistics=SolverStatistics(
            *simulation.statistics(), simulation.states, clock.solving, clock.compiling
        ),
        status=outcome.status,
        reason=outcome.reason,
        exit_code=outcome.exit_code,
        warnings=_warnings(scenario, simulation, seen),
        failure=outcome.failure,
        checkpoint=_checkpoint(simulation, clock) if outcome.resumable else None,
        sides={
            name: values
            for name, values in seen.sides.items()
            if wanted is None or name.rpartition("_")[0] in wanted
        },
    )


def _checkpoint(simulation: "Simulation", clock: _Clock) -> "dict[str, Any] | None":
    """Return what a run goes on from; None where it cannot."""
    state = simulation.state()
    return None if state is None else {**state, **dump_part(clock, "clock")}


def _warnings(
    scenario: "Scenario", simulation: "Simulation", seen: "SimulationResult"
) -> tuple[str, ...]:
    """Return what is odd about a scenario and its run, each once."""
    absent = [name for name in scenario.output.channels or () if name not in seen.channels]
    missing = (
        f"output.channels: this scenario has no channel '{name}'; it is left out" for name in absent
    )
    return tuple(dict.fromkeys([*scenario.warnings(), *missing, *seen.warnings]))
