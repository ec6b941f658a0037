"""The commands on scenarios: solve, resume, check and static."""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import frictionsim as fs
from frictionsim.cli.monitor import CommandMonitor
from frictionsim.cli.options import (
    AsJson,
    MaxSteps,
    MaxWall,
    NoClobber,
    OverridesOption,
    Quiet,
    ScenarioFile,
    Scheduler,
    Verbose,
    WorkerCount,
    check_read_once,
    command,
    load_scenario,
    scenarios_in,
    targets_of,
)
from frictionsim.cli.printing import (
    log_on_stderr,
    print_beside_files,
    print_end,
    print_error,
    print_json,
    print_text,
    warn,
)
from frictionsim.errors import (
    EXIT_DONE,
    EXIT_SIGNAL,
    ArgumentError,
    InputError,
    OutputError,
    ScenarioError,
)

if TYPE_CHECKING:
    from frictionsim.scenario.settings import Scenario


@command
def solve(
    scenarios: list[str],
    overrides: OverridesOption = None,
    output: str | None = None,  # a path loses the slash that ends the name of a folder
    backend: str | None = None,
    max_wall: MaxWall = None,
    max_steps: MaxSteps = None,
    estimate_error: bool = False,
    no_clobber: NoClobber = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
    verbose: Verbose = 0,
) -> int:
    """Simulate scenarios, write result files and print summaries.

    SCENARIO           Scenarios in TOML, or names of shipped ones; - reads the standard input.
    -o, --output FILE  Write the result to this file or folder. [results/<scenario name>.h5]
    --backend NAME     Override the backend of the scenario.
    --estimate-error   Solve again more accurately, and print how far the quantities differ.
    """
    log_on_stderr(verbose, quiet)
    loaded = _load_all(scenarios, overrides, backend)
    targets = targets_of(scenarios, output, no_clobber)
    runs = _Runs(as_json, quiet, several=len(scenarios) > 1)
    for number, (source, scenario, target) in enumerate(
        zip(scenarios, loaded, targets, strict=True), start=1
    ):
        run = partial(
            fs.solve,
            scenario,
            output=target,
            no_clobber=no_clobber,
            max_wall=max_wall,
            max_steps=max_steps,
            estimate_error=estimate_error,
        )
        stopped = runs.add(run, scenario, source, target)
        if stopped and number < len(scenarios):
            print_error(f"not solved: {len(scenarios) - number} of the scenarios, after this one")
            break
    return runs.close()


def _load_all(
    sources: list[str], overrides: list[str] | None, backend: str | None
) -> "list[Scenario]":
    """Read all scenarios before the first is solved; raise all their faults, each with its file."""
    check_read_once(sources)
    loaded, faults, several = [], [], len(sources) > 1
    for source in sources:
        try:
            loaded.append(load_scenario(source, overrides, backend))
        except ScenarioError as error:
            # Those of options name no file.
            faults += [f"{source}: {f}" if several and f[:2] == "--" else f for f in error.faults]
    if faults:
        raise ScenarioError(faults)
    return loaded


@command
def resume(
    result: Path,
    output: Path | None = None,
    max_wall: MaxWall = None,
    max_steps: MaxSteps = None,
    workers: WorkerCount = None,
    dask: Scheduler = None,
    no_clobber: NoClobber = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
    verbose: Verbose = 0,
) -> int:
    """Resume an interrupted run or sweep. The file is bit-identical to an uninterrupted one.

    Until it is done a run is NAME.partial.h5, a sweep NAME.partial.runs, which is taken if there
    is no NAME.h5.

    RESULT             Result or sweep that is not done.
    -o, --output FILE  Write the result to this file. [replaces RESULT]
    """
    from frictionsim.api.result import checkpoint_of, file_to_resume
    from frictionsim.io.names import whole_name

    log_on_stderr(verbose, quiet)
    file, incomplete = file_to_resume(result)
    files: dict[str, Any] = {"output": output, "no_clobber": no_clobber}
    if incomplete is None:
        limits = f"{result} is a sweep, whose runs have the limits of its scenario"
        _check_absent(f"it applies to a run, and {limits}", max_wall=max_wall, max_steps=max_steps)
        from frictionsim.cli.studies import run_sweep

        sweep = partial(fs.resume_sweep, file, workers=workers, dask=dask, **files)
        return run_sweep(sweep, str(result), None, as_json, quiet)
    _check_absent(f"it applies to a sweep, and {result} is a run", workers=workers, dask=dask)
    checkpoint_of(incomplete)  # raises first if the run cannot be resumed
    runs = _Runs(as_json, quiet)
    run = partial(fs.resume, incomplete, max_wall=max_wall, max_steps=max_steps, **files)
    runs.add(run, incomplete.scenario, str(result), output or whole_name(file))
    return runs.close()


def _check_absent(reason: str, **options: Any) -> None:
    for name, value in options.items():
        if value is not None:
            raise ArgumentError(name, f"{reason}; leave it out")


class _Runs:
    """Runs one after the other, with their output; the exit code is the highest of all.

    With `several` an error in one skips that one, and JSON is a list.
    """

    def __init__(self, as_json: bool, quiet: bool, several: bool = False) -> None:
        self._as_json, self._quiet, self._several = as_json, quiet, several
        self._objects: list[dict[str, Any]] = []
        self._exit_code = EXIT_DONE

    def add(
        self, run: "Callable[..., fs.Result]", scenario: "Scenario", source: str, whole: Path
    ) -> bool:
        """Run a scenario, and print its summary and its end; return whether a signal stopped it.

        `run` takes `progress`, and writes the complete result to the file `whole`.
        """
        known, prefix = scenario.warnings(), f"{source}: " if self._several else ""
        warn(known, prefix)  # before the run, so that the user can stop it
        shown = not (self._quiet or self._as_json)
        try:
            # Written within the monitor, so that a first signal does not interrupt the writing.
            with CommandMonitor(scenario.solver.duration, shown, self._quiet) as monitor:
                result = run(progress=monitor)
        except (InputError, OutputError) as error:
            if not self._several:
                raise
            print_error(f"{prefix}{str(error).removeprefix(prefix)}")
            self._exit_code = max(self._exit_code, error.exit_code)
            return False
        warn((one for one in result.warnings if one not in known), prefix)
        if self._as_json:
            self._objects.append(result.to_json() | {"scenario": source})
        elif not self._quiet:
            print_beside_files(result.summary())
        if result.error_estimate and not result.errors:
            print_error(f"warning: {result.error_estimate}")
        print_end(result, whole)
        received = monitor.signals.received  # it may have been while the result was written
        code = EXIT_SIGNAL + received if received and self._several else result.exit_code
        self._exit_code = max(self._exit_code, code)
        return bool(received)

    def close(self) -> int:
        """Print the JSON; return the exit code."""
        if self._as_json:
            print_beside_files(self._objects if self._several else self._objects[0])
        return self._exit_code


@command
def check(scenarios: list[str], overrides: OverridesOption = None, as_json: AsJson = False) -> int:
    """Validate scenarios without running them.

    SCENARIO  Scenarios in TOML, names of shipped ones, or folders; - reads the standard input.
    """
    from frictionsim.api.scenarios import warnings_before_run

    check_read_once(scenarios)
    code, reports = EXIT_DONE, []
    for source in scenarios_in(scenarios):
        data: dict[str, Any] = {"scenario": source, "ok": True, "faults": [], "warnings": []}
        try:
            loaded = load_scenario(source, overrides)
        except ScenarioError as error:
            if not as_json:
                print_error(str(error))
            data |= {"ok": False, "faults": error.faults}
            code = error.exit_code
        else:
            warnings, effects = warnings_before_run(loaded), loaded.effect_names
            if not as_json:
                named = ", ".join(effects) or "none"
                print_text(f"{source}: ok; effects {named}; backend {loaded.solver.backend}")
                warn(warnings, f"{source}: ")
            data |= {
                "overrides": loaded.origin.values,
                "warnings": warnings,
                "kind": loaded.kind,
                "effects": list(effects),
                "law": loaded.law or None,
                "backend": loaded.solver.backend,
            }
        reports.append(data)
    if as_json:
        print_json({"ok": code == EXIT_DONE, "scenarios": reports})
    return code


@command
def static(
    scenario: ScenarioFile, overrides: OverridesOption = None, as_json: AsJson = False
) -> None:
    """Compute the forces and torques of impending motion; of a belt its equilibrium."""
    from frictionsim.api.scenarios import statics_text
    from frictionsim.results import quantities_json

    loaded = load_scenario(scenario, overrides)
    quantities, warnings = fs.static(loaded), loaded.warnings()
    if not as_json:
        print_text(statics_text(quantities, loaded))
        warn(warnings)
        return
    print_json(
        {
            "scenario": scenario,
            "overrides": loaded.origin.values,
            "kind": loaded.kind,
            "quantities": quantities_json(quantities),
            "notes": list(quantities.notes),
            "warnings": list(warnings),
        }
    )
