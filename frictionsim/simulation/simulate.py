"""One run: a scenario goes in; channels, transitions, quantities, checks and counts come out."""

from collections.abc import Mapping
from time import perf_counter
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

from frictionsim.errors import BudgetSpent, Interrupted, NotFinite, SolverError
from frictionsim.results import Channel, Check, Quantities, Transition
from frictionsim.scenario.kinds import module_of
from frictionsim.simulation.checkpoint import exported, restore

if TYPE_CHECKING:
    from collections.abc import Callable

    from frictionsim.results import Array, Observed
    from frictionsim.scenario.settings import Scenario
    from frictionsim.simulation.base import Simulation


OUT_OF_RANGE = (
    "a number is beyond the range of double precision; is a force or an inertia far too large or"
    " too small?"
)


class Counts(NamedTuple):
    """What a run took, in all its parts if it was interrupted.

    `wall_seconds` is the solving alone; `compile_seconds` is 0 where all kernels were there.
    """

    steps: int
    rejected: int
    rhs_evaluations: int
    states: int
    wall_seconds: float
    compile_seconds: float = 0.0


class Run(NamedTuple):
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
        The kind of a failure, such as `event_storm`; empty if it has not failed.
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
    counts: Counts
    status: str
    reason: str
    exit_code: int
    warnings: tuple[str, ...] = ()
    failure: str = ""
    checkpoint: "dict[str, Any] | None" = None
    sides: "Mapping[str, Array]" = MappingProxyType({})


class _Clock:
    """The seconds of solving and of compilation; of the parts before an interruption, too."""

    SAVED = ("solving", "compiling")

    def __init__(self) -> None:
        self.solving = self.compiling = 0.0
        self._since = 0.0

    def start(self) -> None:
        self._since = perf_counter()

    def stop(self) -> None:
        self.solving += perf_counter() - self._since


class _Outcome(NamedTuple):
    """How a run ended."""

    status: str = "done"
    reason: str = ""
    exit_code: int = 0
    failure: str = ""
    can_go_on: bool = False


def run(
    scenario: "Scenario",
    poll: "Callable[[float], Any]",
    keep: "Callable[[Run], Any] | None" = None,
    checkpoint: "dict[str, Any] | None" = None,
) -> Run:
    """Simulate a scenario.

    Parameters
    ----------
    scenario : Scenario
    poll : callable
        Called with the time after each step; it may show progress, or raise Interrupted.
    keep : callable, optional
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
    simulation: Simulation = module_of(scenario.kind).simulation(scenario)
    clock = _Clock()
    if checkpoint is not None:
        simulation.restore(checkpoint)
        restore(clock, "clock", checkpoint)
    watcher = poll
    if keep is not None and scenario.output.checkpoint is not None:
        poll = _keeping(scenario, simulation, poll, keep, scenario.output.checkpoint, clock)
    return _run_of(scenario, simulation, _solve(simulation, watcher, poll, clock), clock)


def _keeping(
    scenario: "Scenario",
    simulation: "Simulation",
    poll: "Callable[[float], Any]",
    keep: "Callable[[Run], Any]",
    seconds: float,
    clock: _Clock,
) -> "Callable[[float], Any]":
    """Return a poll that also has the run so far kept every so many seconds."""
    last = perf_counter()

    def poll_and_keep(t: float) -> None:
        nonlocal last
        poll(t)
        if perf_counter() - last >= seconds:
            clock.stop()  # to write is not to solve
            reason = f"checkpoint at t = {t:.9g} s"
            outcome = _Outcome("interrupted", reason, can_go_on=True)
            keep(_run_of(scenario, simulation, outcome, clock))
            last = perf_counter()
            clock.start()

    return poll_and_keep


def _solve(
    simulation: "Simulation",
    watcher: "Callable[[float], Any]",
    poll: "Callable[[float], Any]",
    clock: _Clock,
) -> _Outcome:
    try:
        clock.compiling += simulation.prepare(watcher)
        clock.start()
        try:
            simulation.solve(poll)
        finally:
            clock.stop()
    except Interrupted as stop:
        return _Outcome("interrupted", str(stop), stop.exit_code, can_go_on=True)
    except SolverError as error:
        can_go_on = isinstance(error, BudgetSpent)
        return _Outcome("failed", str(error), error.exit_code, error.failure, can_go_on)
    except ArithmeticError:
        return _Outcome("failed", OUT_OF_RANGE, NotFinite.exit_code, NotFinite.failure)
    return _Outcome()


def _run_of(
    scenario: "Scenario", simulation: "Simulation", outcome: _Outcome, clock: _Clock
) -> Run:
    """Return a run with what its simulation shows."""
    seen = simulation.observe()
    if seen.unsound and outcome.failure != NotFinite.failure:
        reason = f"after t = {max(seen.time, default=0.0):.9g} s {OUT_OF_RANGE}"
        outcome = _Outcome("failed", reason, NotFinite.exit_code, NotFinite.failure)
    wanted = scenario.output.channels
    return Run(
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
        counts=Counts(*simulation.counts(), simulation.states, clock.solving, clock.compiling),
        status=outcome.status,
        reason=outcome.reason,
        exit_code=outcome.exit_code,
        warnings=_warnings(scenario, simulation, seen),
        failure=outcome.failure,
        checkpoint=_checkpoint(simulation, clock) if outcome.can_go_on else None,
        sides={
            name: values
            for name, values in seen.sides.items()
            if wanted is None or name.rpartition("_")[0] in wanted
        },
    )


def _checkpoint(simulation: "Simulation", clock: _Clock) -> "dict[str, Any] | None":
    """Return what a run goes on from; None where it cannot."""
    state = simulation.state()
    return None if state is None else {**state, **exported(clock, "clock")}


def _warnings(scenario: "Scenario", simulation: "Simulation", seen: "Observed") -> tuple[str, ...]:
    """Return what is odd about a scenario and its run, each once."""
    absent = [name for name in scenario.output.channels or () if name not in seen.channels]
    missing = (
        f"output.channels: this scenario has no channel '{name}'; it is left out" for name in absent
    )
    return tuple(dict.fromkeys([*scenario.warnings(), *missing, *seen.warnings]))
