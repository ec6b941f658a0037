"""The commands and their options. Heavy imports are inside the commands, so that --help is fast."""

import sys
from pathlib import Path
from signal import SIGINT
from typing import Annotated

import typer

from frictionsim import __version__
from frictionsim.cli.messages import print_error, print_json, warn
from frictionsim.errors import (
    EXIT_BAD_INPUT,
    EXIT_DEFECT,
    EXIT_DIFFERENT,
    EXIT_DONE,
    EXIT_NOT_WRITTEN,
    EXIT_SIGNAL,
    EXIT_SOLVER_FAILED,
    FrictionsimError,
    InputError,
    OutputError,
    ScenarioError,
)

app = typer.Typer(
    name="frictionsim",
    help="Simulate mechanisms governed by dry friction.",
    epilog="Exit codes: 0 done, 1 solver failed or files differ, 2 bad input, 3 audit failed,"
    " 4 result not written, 5 step or time limit reached, 130/143 interrupted.",
    add_completion=False,
    rich_markup_mode=None,  # halves the start-up time of --help
    pretty_exceptions_enable=False,
)

ScenarioFile = Annotated[Path, typer.Argument(help="Scenario in TOML.", show_default=False)]
ResultFile = Annotated[Path, typer.Argument(help="Result file in HDF5.", show_default=False)]
Overrides = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Override a key, e.g. solver.rtol=1e-6."),
]
MaxWall = Annotated[
    float | None,
    typer.Option(metavar="SECONDS", help="Limit the wall time; the run can be resumed."),
]
NoClobber = Annotated[
    bool,
    typer.Option(
        "--no-clobber", help="Do not replace existing files (exit 4), except a resumed result."
    ),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="Print no summary and no progress.")]


def run_command_line(arguments: list[str]) -> int:
    """Run a command and return its exit code; errors are printed to stderr."""
    try:
        code = app(arguments, standalone_mode=False, prog_name="frictionsim")
    except FrictionsimError as error:
        print_error(str(error))
        return error.exit_code
    except typer.TyperException as error:
        print_error(f"{error.format_message().rstrip('.')}; see --help")
        return EXIT_BAD_INPUT
    except (KeyboardInterrupt, typer.Abort):
        return EXIT_SIGNAL + SIGINT
    except SystemExit as stop:  # raised on a broken pipe
        return stop.code if isinstance(stop.code, int) else EXIT_DEFECT
    except MemoryError:
        print_error("out of memory; a larger output.interval records fewer samples")
        return EXIT_SOLVER_FAILED
    except OSError as error:
        print_error(f"cannot print the output: {error.strerror}")
        return EXIT_NOT_WRITTEN
    except Exception as error:
        if "--debug" in arguments:
            raise
        print_error(
            f"internal error: {type(error).__name__}: {error}\n"
            "please report it with the scenario; --debug before the command shows the traceback"
        )
        return EXIT_DEFECT
    return code if isinstance(code, int) else EXIT_DONE


def _show_version(wanted: bool) -> None:
    if wanted:
        print(__version__)
        raise typer.Exit


@app.callback(invoke_without_command=True)
def program(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, help="Show the version.")
    ] = False,
    debug: Annotated[
        bool, typer.Option("--debug", help="Show the traceback of an internal error.")
    ] = False,
) -> None:
    if context.invoked_subcommand is None:
        print(context.get_help(), file=sys.stderr)
        raise typer.Exit(EXIT_BAD_INPUT)


@app.command()
def solve(
    scenario: ScenarioFile,
    overrides: Overrides = None,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Result file. [results/<scenario name>.h5]"),
    ] = None,
    backend: Annotated[
        str | None,
        typer.Option("--backend", metavar="NAME", help="Override the backend of the scenario."),
    ] = None,
    max_wall: MaxWall = None,
    max_steps: Annotated[
        int | None, typer.Option(metavar="N", help="Limit the steps; sets solver.max_steps.")
    ] = None,
    estimate_error: Annotated[
        bool,
        typer.Option("--estimate-error", help="Solve again more accurately and compare."),
    ] = False,
    no_clobber: NoClobber = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> int:
    """Simulate a scenario, write the result file and print the summary."""
    from frictionsim.scenario.loading import load

    if max_steps is not None:
        overrides = [*(overrides or []), f"solver.max_steps={max_steps}"]
    loaded = load(scenario, overrides, backend)

    from frictionsim.cli.job import Job, simulate
    from frictionsim.io.destination import Destination

    job = Job(
        loaded,
        str(scenario),
        Destination(output or _default_target(scenario)),
        max_wall,
        estimate_error=estimate_error,
        no_clobber=no_clobber,
    )
    return simulate(job, as_json=as_json, quiet=quiet)


@app.command()
def resume(
    result: ResultFile,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Result file. [replaces RESULT]")
    ] = None,
    max_wall: MaxWall = None,
    no_clobber: NoClobber = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> int:
    """Resume an interrupted run; the result is bit-identical to that of an uninterrupted run.

    When the run is done, NAME.partial.h5 is replaced by NAME.h5.
    """
    from frictionsim.cli.job import Job, simulate
    from frictionsim.io import hdf5_reader
    from frictionsim.io.destination import Destination, whole_name
    from frictionsim.scenario.loading import scenario_from_result

    checkpoint = hdf5_reader.read_checkpoint(result)
    loaded = scenario_from_result(result, checkpoint.attributes)
    job = Job(
        loaded,
        str(result),
        Destination(output or whole_name(result), resumed=result),
        max_wall,
        checkpoint.state,
        no_clobber=no_clobber,
    )
    try:
        return simulate(job, as_json=as_json, quiet=quiet)
    except InputError as error:
        raise InputError(f"{result}: cannot resume this run: {error}") from None


def _default_target(scenario: Path) -> Path:
    folder = Path("results")
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise OutputError(
            f"cannot create the folder '{folder}' ({error.strerror}); give a result file with -o"
        ) from None
    return folder / f"{scenario.stem}.h5"


@app.command()
def check(
    scenarios: Annotated[list[Path], typer.Argument(help="Scenarios in TOML.", show_default=False)],
    overrides: Overrides = None,
) -> int:
    """Validate scenarios without running them."""
    from frictionsim.scenario.loading import load

    code = EXIT_DONE
    for path in scenarios:
        try:
            loaded = load(path, overrides)
        except ScenarioError as error:
            print_error(str(error))
            code = error.exit_code
        else:
            effects = ", ".join(loaded.effect_names) or "none"
            print(f"{path}: ok; effects {effects}; backend {loaded.solver.backend}")
            warn(loaded.warnings(), f"{path}: ")
    return code


@app.command()
def static(scenario: ScenarioFile, overrides: Overrides = None, as_json: AsJson = False) -> None:
    """Compute the forces and torques of impending motion."""
    from frictionsim.scenario.kinds import mechanism_module
    from frictionsim.scenario.loading import load

    loaded = load(scenario, overrides)
    quantities = mechanism_module(loaded.kind).statics(loaded)
    if as_json:
        from frictionsim.results import quantities_json

        print_json(
            {
                "scenario": str(scenario),
                "kind": loaded.kind,
                "quantities": quantities_json(quantities),
            }
        )
    else:
        from frictionsim.cli.tables import print_quantities

        print_quantities(quantities)


@app.command()
def compare(
    result: ResultFile,
    golden: ResultFile,
    rtol: Annotated[float, typer.Option(min=0.0, help="Relative tolerance.")] = 1e-6,
    atol: Annotated[
        float, typer.Option(min=0.0, help="Absolute tolerance, in the unit of each channel.")
    ] = 1e-9,
    time_atol: Annotated[float, typer.Option(min=0.0, help="Tolerance of event times, s.")] = 1e-6,
    ignore: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Channel or pattern (energy_*) to leave out."),
    ] = None,
) -> int:
    """Compare a result with a reference result; exit 0 if they agree, 1 if they differ."""
    from frictionsim.cli.tables import print_comparison
    from frictionsim.io.comparison import compare as compare_files

    comparison = compare_files(result, golden, rtol, atol, time_atol, ignore or [])
    print_comparison(comparison)
    return EXIT_DONE if comparison.same else EXIT_DIFFERENT


@app.command()
def cost(
    scenario: ScenarioFile,
    overrides: Overrides = None,
    backends: Annotated[
        str | None, typer.Option(metavar="A,B", help="Backends to use. [all that apply]")
    ] = None,
    laws: Annotated[
        str | None, typer.Option(metavar="A,B", help="Friction laws to use. [all that apply]")
    ] = None,
    tolerances: Annotated[
        str | None,
        typer.Option(metavar="X,Y", help="Relative tolerances of adaptive backends."),
    ] = None,
    max_wall: Annotated[float, typer.Option(help="Limit the wall time of each run, s.")] = 5.0,
    repeats: Annotated[
        int, typer.Option(min=1, help="Maximum number of timed runs of each setting.")
    ] = 3,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Write the table as HDF5.")
    ] = None,
    csv: Annotated[Path | None, typer.Option(help="Write the table as CSV.")] = None,
    plot: Annotated[
        Path | None, typer.Option(help="Draw error against work: .png, .pdf or .svg.")
    ] = None,
    no_clobber: NoClobber = False,
    as_json: AsJson = False,
) -> int:
    """Measure error against run time for every friction law and backend at several settings."""
    from frictionsim.scenario.loading import load

    loaded = load(scenario, overrides)

    from frictionsim.cli import cost_study
    from frictionsim.cli.study_table import print_study
    from frictionsim.work_precision.report import study_json

    options = cost_study.Options(
        backends, laws, tolerances, max_wall, repeats, output, csv, plot, no_clobber
    )
    study = cost_study.study_scenario(loaded, options)
    if as_json:
        print_json(study_json(study, str(scenario)))
    else:
        print_study(study)
    cost_study.write_files(study, options)
    if study.status != "done":
        print_error(
            f"study {study.status} {study.reason} of a run; the results cover the settings before"
        )
    return study.exit_code


@app.command()
def plot(
    result: ResultFile,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Picture: .png, .pdf or .svg. [RESULT.png]"),
    ] = None,
    view: Annotated[
        str | None,
        typer.Option("--view", metavar="NAME", help="View to draw, or 'all'. [the first]"),
    ] = None,
    body: Annotated[
        int | None,
        typer.Option("--body", metavar="N", help="Number of the body for the view 'body'."),
    ] = None,
) -> None:
    """Draw a view of a result file; --view all draws each view into FILE-<view>.png."""
    from frictionsim.io import hdf5_reader
    from frictionsim.plots import ALL, plot_all
    from frictionsim.plots import plot as draw

    data = hdf5_reader.read(result)
    target = output or result.with_suffix(".png")
    if view != ALL:
        draw(data, target, view, body)
        print(target)
        return
    pictures, reasons = plot_all(data, target, body)
    for picture in pictures:
        print(picture)
    for reason in reasons:
        print_error(f"view skipped: {reason}")
