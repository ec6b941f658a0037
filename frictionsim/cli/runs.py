"""The commands on scenarios: solve, resume, check and static; and where scenarios and results are.

A scenario is a file, the name of a shipped one, or "-" for the standard input.
"""

import gc
import sys
from collections.abc import Callable, Sequence
from functools import partial
from os import sep
from os.path import exists, isdir
from pathlib import Path
from typing import TYPE_CHECKING, Any

import frictionsim as fs
from frictionsim.cli.commands import command
from frictionsim.cli.terminal import (
    CommandMonitor,
    log_on_stderr,
    print_beside_files,
    print_data,
    print_end,
    print_error,
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
    from frictionsim.api.sweep_result import Sweep
    from frictionsim.scenario.settings import Scenario

STDIN = "-"
RESULTS = Path("results")  # the folder of results by default


@command()
def solve(
    scenario: list[str],
    overrides: list[str] | None = None,
    output: str | None = None,  # a path loses the slash that ends the name of a folder
    backend: str | None = None,
    no_clobber: bool = False,
    as_json: bool = False,
    quiet: bool = False,
    verbose: int = 0,
    **limits: Any,
) -> int:
    """Simulate scenarios, write result files and print summaries.

    SCENARIO...        Scenarios in TOML, or names of shipped ones; - reads the standard input.
    --set
    -o, --output PATH  Write the result to this file or folder. [results/<scenario name>.h5]
    --backend NAME     Override the backend of the scenario.
    --max-wall --max-steps
    --estimate-error   Solve again more accurately, and print how far the quantities differ.
    --no-clobber --json --quiet --verbose
    """
    log_on_stderr(verbose, quiet)
    loaded = _load_all(scenario, overrides, backend)
    targets = _targets(scenario, output, no_clobber)
    runs = [
        (
            partial(fs.solve, one, output=target, no_clobber=no_clobber, **limits),
            one,
            source,
            target,
        )
        for source, one, target in zip(scenario, loaded, targets, strict=True)
    ]
    return _run_all(runs, as_json, quiet)


@command()
def resume(
    result: Path,
    output: Path | None = None,
    no_clobber: bool = False,
    as_json: bool = False,
    quiet: bool = False,
    verbose: int = 0,
    **options: Any,
) -> int:
    """Resume an interrupted run or sweep. The file is bit-identical to an uninterrupted one.

    Until it is done a run is NAME.partial.h5, a sweep NAME.partial.runs, which is taken if there
    is no NAME.h5.

    RESULT             Result or sweep that is not done.
    -o, --output FILE  Write the result to this file. [replaces RESULT]
    --max-wall --max-steps --workers --dask --no-clobber --json --quiet --verbose
    """
    from frictionsim.api.opening import file_to_resume
    from frictionsim.api.result import checkpoint_of
    from frictionsim.io.names import whole_name

    log_on_stderr(verbose, quiet)
    file, incomplete = file_to_resume(result)
    if incomplete is None:
        foreign, of = ("max_wall", "max_steps"), "a run"
        what = "a sweep, whose runs have the limits of its scenario"
    else:
        foreign, of, what = ("workers", "dask"), "a sweep", "a run"
    for name in (name for name in foreign if name in options):
        raise ArgumentError(name, f"it applies to {of}, and {result} is {what}; leave it out")
    options |= {"output": output, "no_clobber": no_clobber}
    if incomplete is None:
        sweep = partial(fs.resume_sweep, file, **options)
        return run_sweep(sweep, str(result), None, as_json, quiet)
    checkpoint_of(incomplete)  # raises first if the run cannot be resumed
    run = partial(fs.resume, incomplete, **options)
    whole = output or whole_name(file)
    return _run_all([(run, incomplete.scenario, str(result), whole)], as_json, quiet)


def _run_all(
    runs: "Sequence[tuple[Callable[..., fs.Result], Scenario, str, Path]]",
    as_json: bool,
    quiet: bool,
) -> int:
    """Run one after the other, and print their summaries and ends; return the highest exit code.

    A run takes `progress`; beside it are its scenario, what the user calls that, and the file of
    the complete result. Of several an error in one skips that one, and JSON is a list.
    """
    several, code, documents = len(runs) > 1, EXIT_DONE, list[dict[str, Any]]()
    for number, (run, scenario, source, whole) in enumerate(runs, 1):
        known, prefix = scenario.warnings(), f"{source}: " if several else ""
        warn(known, prefix)  # before the run, so that the user can stop it
        try:
            # Written within the monitor, so that a first signal does not interrupt the writing.
            shown = not (quiet or as_json)
            with CommandMonitor(scenario.solver.duration, shown, quiet) as monitor:
                result = run(progress=monitor)
        except (InputError, OutputError) as error:
            if not several:
                raise
            print_error(f"{prefix}{str(error).removeprefix(prefix)}")
            code = max(code, error.exit_code)
            continue
        warn((one for one in result.warnings if one not in known), prefix)
        if as_json:
            documents.append(result.to_json() | {"scenario": source})
        elif not quiet:
            print_beside_files(result.summary())
        if result.error_estimate and not result.errors:
            print_error(f"warning: {result.error_estimate}")
        print_end(result, whole)
        received = monitor.signals.received  # it may have been while the result was written
        code = max(code, EXIT_SIGNAL + received if received and several else result.exit_code)
        if received:
            if left := len(runs) - number:
                print_error(f"not solved: {left} of the scenarios, after this one")
            break
    if as_json:
        print_beside_files(documents if several else documents[0])
    return code


def run_sweep(
    run: "Callable[..., Sweep]", source: str, csv: Path | None, as_json: bool, quiet: bool
) -> int:
    """Run a sweep, which takes `progress`, and print its summary; return the exit code."""
    gc.enable()  # off for short commands; a sweep may take days
    with CommandMonitor(None, not (quiet or as_json), quiet) as monitor:
        swept = run(progress=monitor)
        if csv is not None:
            swept.save_csv(csv)
    if as_json:
        named = None if csv is None else str(csv)
        print_beside_files(swept.to_json() | {"scenario": source, "csv": named})
    elif not quiet:
        print_beside_files(swept.summary())
    for failures in swept.failures:
        print_error(f"warning: {failures}")
    received = monitor.signals.received
    return EXIT_SIGNAL + received if received else swept.exit_code


@command()
def check(scenario: list[str], overrides: list[str] | None = None, as_json: bool = False) -> int:
    """Validate scenarios without running them.

    SCENARIO...  Scenarios in TOML, names of shipped ones, or folders; - reads the standard input.
    --set --json
    """
    from frictionsim.api.scenarios import warnings_before_run

    _check_read_once(scenario)
    code, reports = EXIT_DONE, []
    for source in _within_folders(scenario):
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
                print_data(f"{source}: ok; effects {named}; backend {loaded.solver.backend}")
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
        print_data({"ok": code == EXIT_DONE, "scenarios": reports})
    return code


@command()
def static(scenario: str, overrides: list[str] | None = None, as_json: bool = False) -> None:
    """Compute the forces and torques of impending motion; of a belt its equilibrium.

    SCENARIO --set --json
    """
    from frictionsim.api.scenarios import statics_text
    from frictionsim.results import quantities_json

    loaded = load_scenario(scenario, overrides)
    quantities, warnings = fs.static(loaded), loaded.warnings()
    if not as_json:
        print_data(statics_text(quantities, loaded))
        warn(warnings)
        return
    print_data(
        {
            "scenario": scenario,
            "overrides": loaded.origin.values,
            "kind": loaded.kind,
            "quantities": quantities_json(quantities),
            "notes": list(quantities.notes),
            "warnings": list(warnings),
        }
    )


def load_scenario(
    source: str, overrides: list[str] | None = None, backend: str | None = None
) -> "Scenario":
    """Read and validate a scenario, as `frictionsim.load`; "-" is the standard input."""
    if source != STDIN:
        return fs.load(source, overrides, backend)
    from frictionsim.scenario.origin import STDIN_NAME
    from frictionsim.scenario.toml_data import NoUsableText, read_text

    if sys.stdin is None:
        raise InputError("-: the standard input is closed; expected a scenario in TOML")
    try:
        text = read_text(sys.stdin.buffer)
    except NoUsableText as error:
        raise ScenarioError([f"-: {error}"]) from None
    except UnicodeDecodeError as error:
        at = f"got invalid UTF-8 at byte {error.start}"
        raise ScenarioError(
            [f"-: expected a scenario in TOML on the standard input, {at}"]
        ) from None
    return fs.loads(text, overrides, backend, name=STDIN_NAME)


def _load_all(
    sources: list[str], overrides: list[str] | None, backend: str | None
) -> "list[Scenario]":
    """Read all scenarios before the first is solved; raise all their faults, each with its file."""
    _check_read_once(sources)
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


def _check_read_once(sources: Sequence[str]) -> None:
    if sources.count(STDIN) > 1:
        raise InputError("-: given twice; the standard input can be read only once")


def _within_folders(sources: Sequence[str]) -> list[str]:
    """Return the sources, with the scenarios of each folder instead of the folder."""
    scenarios = []
    for source in sources:
        is_folder = source != STDIN and isdir(source)
        inside = sorted(map(str, Path(source).rglob("*.toml"))) if is_folder else [source]
        if not inside:
            raise InputError(f"{source}: this folder has no scenario (*.toml)")
        scenarios += inside
    return scenarios


def stem_of(source: str) -> str:
    """Return the name of a result by default, without its suffix."""
    return "stdin" if source == STDIN else Path(source).stem


def made_folder(folder: Path = RESULTS) -> Path:
    """Return a folder for results, which is made."""
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        reason = "this is a file" if exists(folder) else error.strerror
        raise OutputError(
            f"cannot create the folder '{folder}' ({reason}); give another with -o"
        ) from None
    return folder


def _targets(sources: Sequence[str], output: str | None, no_clobber: bool) -> list[Path]:
    """Return the result file of each scenario; of several it is checked that all can be written.

    The output is a folder, which exists or ends with a slash; for one scenario a file otherwise.
    The folder is made, if there is one to make it in.
    """
    if output == STDIN:
        raise InputError("-o -: a result is written as HDF5, not printed; give a file name")
    is_folder = output is None or output.endswith(("/", sep)) or isdir(output)
    if output is not None and len(sources) == 1 and not is_folder:
        return [Path(output)]
    folder = RESULTS if output is None else Path(output)
    targets: dict[Path, str] = {}
    for source in sources:
        target = folder / f"{stem_of(source)}.h5"
        if target in targets:
            raise InputError(
                f"{targets[target]} and {source} would both be written to {target}; solve them one"
                " by one, each with its -o"
            )
        targets[target] = source
    made_folder(folder)
    if len(sources) > 1:
        from frictionsim.io.run_files import RunFiles

        for target in targets:
            RunFiles(target).check(no_clobber)
    return list(targets)
