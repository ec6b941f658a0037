"""One run of a sweep, with only the samples that its quantities need."""

from pathlib import Path
from typing import Any

from frictionsim.errors import FrictionsimError, OutputError
from frictionsim.io.names import partial_name
from frictionsim.io.result_writer import write
from frictionsim.io.sweep_table import AUDIT_FAILED, DONE, FAILED
from frictionsim.results import failures
from frictionsim.scenario.settings import Scenario
from frictionsim.simulation.combinations import Combinations
from frictionsim.simulation.monitor import RunMonitor
from frictionsim.simulation.simulate import RunSummary, run, summary_of_run
from frictionsim.sweeps.outcomes import RunOutcome

INTERNAL = "internal_error"
DIGITS = 7  # of the number in the name of a result
NO_MONITOR = RunMonitor()


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
        if target is not None:
            return _outcome(_summary_with_result(scenario, target, monitor))
        reduced = without_samples(scenario)
        done = summary_of_run(reduced, monitor)
        if done.status == "failed" and reduced is not scenario:
            done = summary_of_run(scenario, monitor)  # with the samples up to the failure
        return _outcome(done)
    except OutputError:
        raise
    except FrictionsimError as error:
        return RunOutcome(FAILED, {}, getattr(error, "failure", ""), str(error))
    except Exception as error:  # the study continues, and reports the error of this run
        reason = f"internal error: {type(error).__name__}: {error}".replace("\n", " ")
        return RunOutcome(FAILED, {}, INTERNAL, reason)


def _summary_with_result(scenario: Scenario, target: Path, monitor: RunMonitor) -> RunSummary:
    """Run a scenario with all its samples, and write its result."""
    done = run(scenario, monitor)
    write(done, target if done.status == "done" else partial_name(target))
    is_sound = not failures(done.checks)
    ended = done.status, done.reason, done.failure
    return RunSummary(*ended, done.warnings, done.quantities, is_sound)


def _outcome(done: RunSummary) -> RunOutcome:
    status = FAILED if done.status != "done" else DONE if done.is_sound else AUDIT_FAILED
    # Those about sampling are not of the runs of a sweep.
    warnings = [text for text in done.warnings if not text.startswith("output.interval")]
    return RunOutcome(status, done.quantities, done.failure, done.reason, "\n".join(warnings))


def without_samples(scenario: Scenario) -> Scenario:
    """Return the scenario that samples start, events and end only, unless it needs samples."""
    if scenario.needs_samples:
        return scenario
    changed = {"interval": scenario.solver.duration, "at_events": True, "checkpoint": None}
    return scenario.model_copy(update={"output": scenario.output.model_copy(update=changed)})
