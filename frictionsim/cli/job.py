"""Runs on the command line: simulate, print the summary and the end of the run."""

import os
from collections.abc import Callable, Sequence
from functools import partial
from os.path import exists, isdir
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import frictionsim as fs
from frictionsim.cli.app import STDIN, default_folder, stem_of
from frictionsim.cli.messages import (
    log_on_stderr,
    print_beside_files,
    print_continuation,
    print_error,
    warn,
)
from frictionsim.cli.monitor import CommandMonitor, EndingSignals
from frictionsim.errors import (
    EXIT_DONE,
    EXIT_SIGNAL,
    FrictionsimError,
    InputError,
    OutputError,
)
from frictionsim.io.names import partial_name, whole_name
from frictionsim.io.run_files import RunFiles

if TYPE_CHECKING:
    from frictionsim.api.solving import RunOptions
    from frictionsim.scenario.settings import Scenario

FOLDER_ENDS = ("/", os.sep)
SUFFIX = ".h5"


class Job(NamedTuple):
    """A scenario to simulate, and the file for its result."""

    scenario: "Scenario"
    source: str
    target: Path


class Report:
    """The output of runs on stdout, and the exit code: the highest of all runs.

    Parameters
    ----------
    as_json : bool
        Print JSON instead of tables.
    quiet : bool
        Print no summary and no progress.
    verbose : int
        0 logs warnings, 1 also information, 2 also details.
    several : bool
        Print the JSON as a list: there are several scenarios.
    """

    def __init__(self, as_json: bool, quiet: bool, verbose: int, several: bool = False) -> None:
        self._as_json, self.quiet, self.several = as_json, quiet, several
        self._objects: list[dict[str, Any]] = []
        self.exit_code = EXIT_DONE
        self.waiting = 0  # scenarios not started yet
        self._written = ""
        log_on_stderr(verbose, quiet)

    def run(
        self,
        scenario: "Scenario",
        source: str,
        whole: Path,
        max_wall: float | None,
        simulate: "Callable[[CommandMonitor], fs.Result]",
    ) -> None:
        """Run a scenario with stop signals, limit and progress; print its summary and its end.

        Parameters
        ----------
        scenario : Scenario
        source : str
            The scenario or result as given.
        whole : Path
            The file for the complete result.
        max_wall : float or None, s
        simulate : callable
            Runs it with a monitor, and writes the result.
        """
        known = scenario.warnings()
        warn(known, self._prefix(source))  # before the run, so that the user can stop it
        shown = not (self.quiet or self._as_json)
        duration, unfinished = scenario.solver.duration, partial_name(whole)
        # Written within the monitor, so that a first signal does not interrupt the writing.
        with (
            CommandMonitor(duration, shown, self.quiet, unfinished) as monitor,
            monitor.limited(max_wall, self._give_up),
        ):
            result = simulate(monitor)
        if monitor.signals.received and self.waiting:  # received while the result was written
            self.exit_code = EXIT_SIGNAL + monitor.signals.received
        self._written = "nothing was written"
        if result.path is not None:
            self._written = f"the result is in {result.path}"
        with EndingSignals(self._written, self.report_waiting):
            self.add(result, source, known, whole)

    def _give_up(self) -> None:
        """Print the results so far before the process ends within a run."""
        self.report_waiting()
        if self.several:
            self.close()

    def report_waiting(self) -> None:
        """Print the number of scenarios not started."""
        if self.waiting:
            print_error(f"not solved: {self.waiting} of the scenarios, after this one")

    def _prefix(self, source: str) -> str:
        return f"{source}: " if self.several else ""

    def add(self, result: "fs.Result", source: str, known: Sequence[str], whole: Path) -> None:
        """Print the summary, new warnings, and the end of a run."""
        new = (warning for warning in result.warnings if warning not in known)
        warn(new, self._prefix(source))
        if self._as_json:
            self._objects.append(result.to_json() | {"scenario": source})
        elif not self.quiet:
            print_beside_files(result.summary())
        if result.error_estimate and not result.errors:
            print_error(f"warning: {result.error_estimate}")
        _report_end(result, whole)
        self.exit_code = max(self.exit_code, result.exit_code)

    def add_error(self, error: FrictionsimError, source: str) -> None:
        """Print the error of one of several scenarios."""
        print_error(f"{source}: {str(error).removeprefix(f'{source}: ')}")
        self.exit_code = max(self.exit_code, error.exit_code)

    def close(self) -> None:
        """Print the JSON: one object, or a list of them if there are several scenarios."""
        if not self._as_json:
            return
        with EndingSignals("the results are written" if self.several else self._written):
            print_beside_files(self._objects if self.several else self._objects[0])


def run_jobs(jobs: Sequence[Job], options: "RunOptions", report: Report) -> None:
    """Run jobs one by one until one is interrupted; an error in one of several skips that one."""
    for number, job in enumerate(jobs, start=1):
        report.waiting = len(jobs) - number
        try:
            report.run(
                job.scenario,
                job.source,
                job.target,
                options.max_wall,
                partial(_solve, job, options),
            )
        except (InputError, OutputError) as error:
            if not report.several:
                raise
            report.add_error(error, job.source)
            continue
        if report.exit_code > EXIT_SIGNAL:
            report.report_waiting()
            break
    report.close()


def _solve(job: Job, options: "RunOptions", monitor: CommandMonitor) -> fs.Result:
    given = {**dict(options), "progress": monitor}
    return fs.solve(job.scenario, output=job.target, **given)


def resume_job(
    incomplete: fs.Result, output: Path | None, options: "RunOptions", report: Report
) -> None:
    """Resume a run, write its result and print its summary."""
    path = incomplete.path
    assert path is not None, "it is of a file"
    incomplete.load_checkpoint()  # raises first if the run cannot be resumed
    whole = output or whole_name(path)

    def simulate(monitor: CommandMonitor) -> fs.Result:
        return fs.resume(
            incomplete,
            output=output,
            no_clobber=options.no_clobber,
            max_wall=options.max_wall,
            max_steps=options.max_steps,
            progress=monitor,
        )

    report.run(incomplete.scenario, str(path), whole, options.max_wall, simulate)


def targets_of(sources: Sequence[str], output: str | None, no_clobber: bool) -> list[Path]:
    """Return the result file of each scenario; of several it is checked that all can be written.

    Parameters
    ----------
    sources : sequence of str
        Paths of scenarios, or "-".
    output : str or None
        A folder, which exists or ends with a slash; for one scenario a file otherwise.
    no_clobber : bool
        Do not replace existing files.
    """
    if output == STDIN:
        raise InputError("-o -: a result is written as HDF5, not printed; give a file name")
    is_folder = output is None or output.endswith(FOLDER_ENDS) or isdir(output)
    if output is not None and len(sources) == 1 and not is_folder:
        return [Path(output)]
    targets = _targets_in(_folder(None if output is None else Path(output)), sources)
    if len(sources) > 1:
        for target in targets:
            RunFiles(target).check(no_clobber)
    return targets


def _folder(output: Path | None) -> Path:
    """Return the folder for results; the default one is created."""
    if output is None:
        return default_folder()
    if not isdir(output):
        reason = "this is a file" if exists(output) else "there is no such folder, create it first"
        raise OutputError(f"{output}: expected a folder for the results; {reason}")
    return output


def _targets_in(folder: Path, sources: Sequence[str]) -> list[Path]:
    targets: dict[Path, str] = {}
    for source in sources:
        target = folder / f"{stem_of(source)}{SUFFIX}"
        if target in targets:
            raise InputError(
                f"{targets[target]} and {source} would both be written to {target}; solve them one"
                " by one, each with its -o"
            )
        targets[target] = source
    return list(targets)


def _report_end(result: "fs.Result", whole: Path) -> None:
    """Print the end of a run that is not done and sound."""
    if result.status == "done":
        if result.reason:
            print_error(f"{result.reason}; do not trust {result.path}")
        return
    print_error(f"run {result.status}: {result.reason}")
    place = result.path
    if place is None:
        print_error(f"no samples were computed; {whole} is unchanged")
        return
    unchanged = f"; {whole} is unchanged" if place != whole and whole.exists() else ""
    print_error(f"samples up to this time are in {place}, status '{result.status}'{unchanged}")
    print_continuation(result, result.checkpoint is not None)
