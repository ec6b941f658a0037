"""A run and its files, from the scenario to the exit code."""

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from frictionsim.cli.messages import print_error, print_json, warn
from frictionsim.cli.monitor import monitor_run
from frictionsim.errors import EXIT_DONE, InputError, OutputError
from frictionsim.io.destination import Destination
from frictionsim.simulation.simulate import run

if TYPE_CHECKING:
    from frictionsim.scenario.settings import Scenario
    from frictionsim.simulation.simulate import RunResult


class Job(NamedTuple):
    """A scenario to simulate, from its start or from a checkpoint, and where to.

    Attributes
    ----------
    source : str
        What it was read from, for the summary.
    """

    scenario: "Scenario"
    source: str
    destination: Destination
    max_wall: float | None = None
    checkpoint: dict[str, Any] | None = None
    estimate_error: bool = False
    no_clobber: bool = False


def simulate(job: Job, as_json: bool, quiet: bool) -> int:
    """Run a job, write its result, print its summary and return its exit code.

    Raises
    ------
    InputError, OutputError
        Before it has run; OutputError also if its result cannot be written.
    """
    if job.max_wall is not None and not job.max_wall > 0.0:
        raise InputError(f"--max-wall: expected a number above 0 s, got {job.max_wall:g}")
    destination = job.destination
    destination.check(job.no_clobber)
    known = job.scenario.warnings()
    warn(known)  # before the time to compute is spent
    with monitor_run(
        job.scenario.solver.duration, not (quiet or as_json), job.max_wall, quiet
    ) as on_step:
        result = run(job.scenario, on_step, _checkpoint_writer(destination), job.checkpoint)
        # In here: a first signal does not come in between.
        place = destination.write(result)
        errors = None
        if job.estimate_error and result.status == "done":
            from frictionsim.work_precision.error_estimate import estimate

            errors = estimate(result, on_step)
    warn(warning for warning in result.warnings if warning not in known)
    output = None if place is None else str(place)
    if as_json:
        from frictionsim.cli.json_output import run_json

        print_json(run_json(result, job.source, output, errors))
    elif not quiet:
        from frictionsim.cli.tables import print_run

        print_run(result, output, errors)
    if errors is not None and not errors.errors:
        print_error(f"warning: {errors.method}")
    return _report_end(result, place, destination) or (errors.exit_code if errors else EXIT_DONE)


def _checkpoint_writer(destination: Destination) -> "Callable[[RunResult], None]":
    """Return what writes a checkpoint; where that is not possible, the run is worth more."""
    said: set[str] = set()

    def write(part: "RunResult") -> None:
        try:
            destination.write(part)
        except OutputError as error:
            if str(error) not in said:
                print_error(f"warning: no checkpoint: {error}")
            said.add(str(error))

    return write


def _report_end(result: "RunResult", place: Path | None, destination: Destination) -> int:
    """Say what went wrong, and return the exit code of a run."""
    if result.status == "done":
        if result.reason:
            print_error(f"{result.reason}; do not trust {place}")
        return result.exit_code
    print_error(f"run {result.status}: {result.reason}")
    whole = destination.whole
    if place is None:
        print_error(f"nothing was computed, and nothing written: {whole} is as it was")
        return result.exit_code
    stays = f"; {whole} is as it was" if place != whole and whole.exists() else ""
    print_error(f"the samples up to there are in {place}, marked '{result.status}'{stays}")
    if result.checkpoint is not None:
        print_error(f"'frictionsim resume {place}' goes on from there")
    return result.exit_code
