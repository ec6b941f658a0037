"""The commands on scenarios, and the exit codes of all commands.

Every command is a thin layer over `import frictionsim`: it reads options, calls a function and
prints. Heavy imports happen when a function is called, so that --help is fast.
"""

from copy import copy
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import frictionsim as fs
from frictionsim.cli.app import (
    Application,
    AsJson,
    MaxSteps,
    MaxWall,
    NoClobber,
    OverridesOption,
    Process,
    Quiet,
    ResultFile,
    ScenarioFile,
    Scheduler,
    Verbose,
    WorkerCount,
    app,
    check_read_once,
    load_scenario,
    scenarios_in,
)
from frictionsim.cli.completion import backends as backends_of
from frictionsim.cli.messages import (
    ending_of,
    log_on_stderr,
    print_error,
    print_json,
    print_text,
    printed_by_typer,
    warn,
)
from frictionsim.errors import (
    EXIT_BAD_INPUT,
    EXIT_DEFECT,
    EXIT_DONE,
    ArgumentError,
    ScenarioError,
)

if TYPE_CHECKING:
    from frictionsim.scenario.settings import Scenario

MODULES = {
    "solve": "commands",
    "resume": "commands",
    "check": "commands",
    "static": "commands",
    "cost": "study_commands",
    "show": "file_commands",
    "compare": "file_commands",
    "plot": "plot_command",
    "new": "file_commands",
    "schema": "file_commands",
    "fit": "study_commands",
    "sweep": "study_commands",
    "report": "file_commands",
    "warm-up": "file_commands",
}
"""The module of each command, in the order of the help."""


def register_all() -> None:
    """Register the commands of all modules, in one order whichever was imported first."""
    for module in MODULES.values():
        import_module(f"frictionsim.cli.{module}")
    order = list(MODULES)
    app.registered_commands.sort(key=lambda command: order.index(_name_of(command)))


def _application(named: str) -> Application:
    """Return the application; with one command alone if it is named, for a fast start."""
    if named not in MODULES:
        register_all()
        return app
    import_module(f"frictionsim.cli.{MODULES[named]}")
    alone = copy(app)
    alone.registered_commands = [one for one in app.registered_commands if _name_of(one) == named]
    return alone


def _name_of(command: Any) -> str:
    return str(command.name or command.callback.__name__)


def run_command_line(arguments: list[str], runs_one_command: bool = False) -> int:
    """Run a command and return its exit code; errors are printed to stderr.

    Parameters
    ----------
    arguments : list of str
    runs_one_command : bool
        The process runs this command only: a wall-time limit may end it within C code.
    """
    Process.runs_one_command = runs_one_command
    if "" in arguments:
        print_error(
            f"argument {arguments.index('') + 1} is empty: is a shell variable unset?"
            " Expected a command, an option or a file"
        )
        return EXIT_BAD_INPUT
    try:
        with printed_by_typer(arguments):
            application = _application(arguments[0] if arguments else "")
            code = application(arguments, standalone_mode=False, prog_name="frictionsim")
    except BaseException as error:
        message, code = ending_of(error, arguments)
        if code == EXIT_DEFECT and "--debug" in arguments:
            raise
        if message:
            print_error(message)
        return code
    return code if isinstance(code, int) else EXIT_DONE


@app.command()
def solve(
    scenarios: Annotated[
        list[str],
        typer.Argument(
            metavar="SCENARIO",
            help="Scenarios in TOML, or names of shipped ones; - reads the standard input.",
            show_default=False,
        ),
    ],
    overrides: OverridesOption = None,
    output: Annotated[
        str | None,  # a path loses the slash that ends the name of a folder
        typer.Option(
            "-o",
            "--output",
            metavar="FILE",
            help="Result file, or a folder for results. [results/<scenario name>.h5]",
        ),
    ] = None,
    backend: Annotated[
        str | None,
        typer.Option(
            "--backend",
            metavar="NAME",
            help="Override the backend of the scenario.",
            autocompletion=backends_of,
        ),
    ] = None,
    max_wall: MaxWall = None,
    max_steps: MaxSteps = None,
    estimate_error: Annotated[
        bool,
        typer.Option("--estimate-error", help="Solve again more accurately and compare."),
    ] = False,
    no_clobber: NoClobber = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
    verbose: Verbose = 0,
) -> int:
    """Simulate scenarios, write result files and print summaries."""
    from frictionsim.api.solving import RunOptions

    options = RunOptions.among(locals())  # before anything is read
    check_read_once(scenarios)
    loaded = _load_all(scenarios, overrides, backend)

    from frictionsim.cli.job import Job, Report, run_jobs, targets_of

    targets = targets_of(scenarios, output, no_clobber)
    report = Report(as_json, quiet, verbose, several=len(scenarios) > 1)
    run_jobs(list(map(Job, loaded, scenarios, targets)), options, report)
    return report.exit_code


def _load_all(
    sources: list[str], overrides: list[str] | None, backend: str | None
) -> "list[Scenario]":
    """Read all scenarios before the first is solved; raise all their faults, each with its file."""
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


@app.command()
def resume(
    result: ResultFile,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="FILE", help="Result file. [replaces RESULT]"),
    ] = None,
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
    """
    from frictionsim.api.result import file_to_resume
    from frictionsim.api.solving import RunOptions
    from frictionsim.cli.job import Report, resume_job

    log_on_stderr(verbose)
    options = RunOptions.among(locals())
    file, incomplete = file_to_resume(result)
    if incomplete is None:
        from frictionsim.cli.study_commands import SweepPrinting, run_with

        limits = f"{result} is a sweep, whose runs have the limits of its scenario"
        _check_absent(f"it applies to a run, and {limits}", max_wall=max_wall, max_steps=max_steps)
        run = partial(
            fs.resume_sweep,
            file,
            output=output,
            no_clobber=no_clobber,
            workers=workers,
            dask=dask,
        )
        return run_with(run, SweepPrinting(str(result), None, as_json, quiet, verbose))
    _check_absent(f"it applies to a sweep, and {result} is a run", workers=workers, dask=dask)
    report = Report(as_json, quiet, verbose)
    resume_job(incomplete, output, options, report)
    report.close()
    return report.exit_code


def _check_absent(reason: str, **options: Any) -> None:
    for name, value in options.items():
        if value is not None:
            raise ArgumentError(name, f"{reason}; leave it out")


@app.command()
def check(
    scenarios: Annotated[
        list[str],
        typer.Argument(
            metavar="SCENARIO",
            help="Scenarios in TOML, names of shipped ones, or folders.",
            show_default=False,
        ),
    ],
    overrides: OverridesOption = None,
    as_json: AsJson = False,
) -> int:
    """Validate scenarios without running them."""
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
            warnings, effects = loaded.warnings(), loaded.effect_names
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


@app.command()
def static(
    scenario: ScenarioFile, overrides: OverridesOption = None, as_json: AsJson = False
) -> None:
    """Compute the forces and torques of impending motion."""
    loaded = load_scenario(scenario, overrides)
    quantities, warnings = fs.static(loaded), loaded.warnings()
    if as_json:
        from frictionsim.results import quantities_json

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
    else:
        from frictionsim.api.scenarios import statics_text

        print_text(statics_text(quantities, loaded))
        warn(warnings)
