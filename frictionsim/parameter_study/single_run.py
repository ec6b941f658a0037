"""Runs of a sweep, alone or together, with only the samples that the quantities need."""

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.errors import EXIT_AUDIT_FAILED, FrictionsimError, OutputError
from frictionsim.parameter_study.block import (
    AUDIT_FAILED,
    DONE,
    FAILED,
    RunBlock,
    RunOutcome,
    block_of,
)
from frictionsim.results import Record
from frictionsim.scenario.settings import Scenario
from frictionsim.simulation.combinations import Combinations
from frictionsim.simulation.monitor import RunMonitor
from frictionsim.simulation.simulate import run

if TYPE_CHECKING:
    from frictionsim.simulation.many_runs import Observed

INTERNAL = "internal_error"
DIGITS = 7  # of the number in the name of a result
NO_MONITOR = RunMonitor()


class Task(NamedTuple):
    """Some consecutive runs."""

    first: int  # the number of the first one
    values: Sequence[tuple[Any, ...]]  # of the varied keys in each


def run_task(
    combinations: Combinations,
    task: Task,
    series: Path | None = None,
    monitor: RunMonitor = NO_MONITOR,
) -> RunBlock:
    """Run some combinations, together if possible.

    The result of each run is written to the folder of a series. The monitor is called with the time
    after each step of each run.
    """
    outcomes: list[tuple[Any, RunOutcome]] = []
    if series is None:
        outcomes = outcomes_together(combinations, task.values, monitor)
    alone = np.ones(len(task.values), dtype=bool)
    for runs, _ in outcomes:
        alone[runs] = False
    for number in np.flatnonzero(alone).tolist():
        target = None if series is None else series / f"run-{task.first + number:0{DIGITS}d}.h5"
        outcome = outcome_of(combinations, task.values[number], target, monitor)
        outcomes.append((number, outcome))
    return block_of(task.first, outcomes)


def outcomes_together(
    combinations: Combinations, values: Sequence[tuple[Any, ...]], monitor: RunMonitor = NO_MONITOR
) -> list[tuple[Any, RunOutcome]]:
    """Run many combinations at once; return their outcomes, without those that must run alone.

    The numbers equal those of single runs to the last bit; see `frictionsim.simulation.many_runs`.
    The monitor is called between runs, with 0 s.
    """
    from frictionsim.simulation.many_runs import prepared, run_many

    outcomes = list[tuple[Any, RunOutcome]]()
    for runs, group in combinations.groups(values, prepared):
        observed = run_many(
            group,
            len(runs),
            lambda number, runs=runs: combinations.scenario(values[runs[number]]),  # type: ignore[misc]
            monitor,
        )
        if observed is not None:
            outcomes += _outcomes_of(runs, group.warnings or (), observed)
    return outcomes


def _outcomes_of(
    runs: Any, warnings: Iterable[str], observed: "Observed"
) -> Iterator[tuple[Any, RunOutcome]]:
    alike = observed.sound.copy()
    alike[[*observed.warnings]] = False
    parts = [(np.flatnonzero(alike), warnings)]
    parts += [(np.array([number]), texts) for number, texts in observed.warnings.items()]
    for chosen, texts in parts:
        quantities = {
            name: q if np.ndim(q.value) == 0 else q._replace(value=np.asarray(q.value)[chosen])  # type: ignore[arg-type]
            for name, q in observed.quantities.items()
        }
        if len(chosen):
            outcome = RunOutcome(DONE, quantities, warnings=_lasting(dict.fromkeys(texts)))
            yield runs[chosen], outcome


def outcome_of(
    combinations: Combinations,
    values: tuple[Any, ...],
    target: Path | None = None,
    monitor: RunMonitor = NO_MONITOR,
) -> RunOutcome:
    """Run one combination; a failed run has an outcome, too.

    The target is the file for its result, with all samples.
    """
    try:
        scenario = combinations.scenario(values)
        reduced = scenario if target is not None else without_samples(scenario)
        done = run(reduced, monitor)
        if done.status == "failed" and reduced is not scenario:
            done = run(scenario, monitor)  # with the samples up to the failure
        if target is not None:
            from frictionsim.io.names import partial_name
            from frictionsim.io.result_writer import write

            write(done, target if done.status == "done" else partial_name(target))
    except OutputError:
        raise
    except FrictionsimError as error:
        return RunOutcome(FAILED, {}, getattr(error, "failure", ""), str(error))
    except Exception as error:  # the study continues, and reports the error of this run
        reason = f"internal error: {type(error).__name__}: {error}".replace("\n", " ")
        return RunOutcome(FAILED, {}, INTERNAL, reason)
    return _outcome(scenario, done)


def without_samples(scenario: Scenario) -> Scenario:
    """Return the scenario that samples start, events and end only, unless it needs samples."""
    if scenario.needs_samples:
        return scenario
    changed = {"interval": scenario.solver.duration, "at_events": True, "checkpoint": None}
    return scenario.model_copy(update={"output": scenario.output.model_copy(update=changed)})


def _outcome(scenario: Scenario, done: Record) -> RunOutcome:
    status = DONE if done.status == "done" else FAILED
    if done.exit_code == EXIT_AUDIT_FAILED:
        status = AUDIT_FAILED
    warnings = _lasting(done.warnings)
    return RunOutcome(status, done.quantities, done.failure, done.reason, warnings)


def _lasting(warnings: Iterable[str]) -> str:
    """Return the warnings of a run, one per line, without those about sampling."""
    return "\n".join(text for text in warnings if not text.startswith("output.interval"))
