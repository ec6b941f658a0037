"""One run on the command line: simulate, write the result, print the summary, return a code."""

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
    """A scenario to simulate and where to write its result.

    Attributes
    ----------
    scenario : Scenario
    source : str
        Path that the scenario was read from, for the summary.
    destination : Destination
    max_wall : float or None, s
        Limit of the wall time.
    checkpoint : dict of arrays or None
        State to resume from.
    estimate_error : bool
        Solve a second time to estimate the errors of the quantities.
    no_clobber : bool
        Do not replace existing files.
    """

    scenario: "Scenario"
    source: str
    destination: Destination
    max_wall: float | None = None
    checkpoint: dict[str, Any] | None = None
    estimate_error: bool = False
    no_clobber: bool = False


def simulate(job: Job, as_json: bool, quiet: bool) -> int:
    """Run a job, write its result and print its summary.

    Parameters
    ----------
    job : Job
    as_json : bool
        Print JSON instead of tables.
    quiet : bool
        Print no summary and no progress.

    Returns
    -------
    int
        The exit code.

    Raises
    ------
    InputError, OutputError
        Before the run, if the job is invalid; OutputError also if the result cannot be written.
    """
    if job.max_wall is not None and not job.max_wall > 0.0:
        raise InputError(f"--max-wall: expected a number above 0 s, got {job.max_wall:g}")
    destination = job.destination
    destination.check(job.no_clobber)
    known = job.scenario.warnings()
    warn(known)  # before the run, so that the user can stop it
    with monitor_run(
        job.scenario.solver.duration, not (quiet or as_json), job.max_wall, quiet
    ) as on_step:
        result = run(job.scenario, on_step, _checkpoint_writer(destination), job.checkpoint)
        # Written within the monitor, so that a first signal does not interrupt the writing.
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
    """Return the callback that writes checkpoints; a failed write only warns."""
    reported: set[str] = set()

    def write(part: "RunResult") -> None:
        try:
            destination.write(part)
        except OutputError as error:
            if str(error) not in reported:
                print_error(f"warning: checkpoint not written: {error}")
            reported.add(str(error))

    return write


def _report_end(result: "RunResult", place: Path | None, destination: Destination) -> int:
    """Print how a run ended if it is not done, and return its exit code."""
    if result.status == "done":
        if result.reason:
            print_error(f"{result.reason}; do not trust {place}")
        return result.exit_code
    print_error(f"run {result.status}: {result.reason}")
    whole = destination.whole
    if place is None:
        print_error(f"no samples were computed; {whole} is unchanged")
        return result.exit_code
    unchanged = f"; {whole} is unchanged" if place != whole and whole.exists() else ""
    print_error(f"samples up to this time are in {place}, status '{result.status}'{unchanged}")
    if result.checkpoint is not None:
        print_error(f"'frictionsim resume {place}' continues the run")
    return result.exit_code
