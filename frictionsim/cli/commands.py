"""Arguments, streams and exit codes. No physics here; heavy imports stand inside the commands."""

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
    help="Simulate mechanisms in which dry friction decides.",
    epilog="Exit codes: 0 done, 1 solver failed or files differ, 2 bad input, 3 an audit failed,"
    " 4 result not written, 5 a budget is spent, 130/143 interrupted.",
    add_completion=False,
    rich_markup_mode=None,  # plain help starts in half the time
    pretty_exceptions_enable=False,
)

ScenarioFile = Annotated[Path, typer.Argument(help="Scenario in TOML.", show_default=False)]
ResultFile = Annotated[Path, typer.Argument(help="Result file in HDF5.", show_default=False)]
Overrides = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=VALUE", help="Override a key, as solver.rtol=1e-6."),
]
MaxWall = Annotated[
    float | None,
    typer.Option(metavar="SECONDS", help="Stop after so much time; the run can be resumed."),
]
NoClobber = Annotated[
    bool,
    typer.Option(
        "--no-clobber", help="Leave a file that is there: exit 4; not that which is resumed."
    ),
]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No table and no progress.")]


def run_command_line(arguments: list[str]) -> int:
    """Run a command and return its exit code; every error becomes a message on stderr."""
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
    except SystemExit as leave:  # the reader of a pipe has left
        return leave.code if isinstance(leave.code, int) else EXIT_DEFECT
    except MemoryError:
        print_error("out of memory; ask for fewer samples with a larger output.interval")
        return EXIT_SOLVER_FAILED
    except OSError as error:
        print_error(f"cannot print the output: {error.strerror}")
        return EXIT_NOT_WRITTEN
    except Exception as error:
        if "--debug" in arguments:
            raise
        print_error(
            f"a defect of this program: {type(error).__name__}: {error}\n"
            "please report it with the scenario; --debug before the command shows where it is"
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
    debug: Annotated[bool, typer.Option("--debug", help="Show where a defect is.")] = False,
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
        str | None, typer.Option("--backend", metavar="NAME", help="Instead of the scenario's.")
    ] = None,
    max_wall: MaxWall = None,
    max_steps: Annotated[
        int | None, typer.Option(metavar="N", help="Stop after so many steps: solver.max_steps.")
    ] = None,
    estimate_error: Annotated[
        bool, typer.Option("--estimate-error", help="Solve again, more exactly, and compare.")
    ] = False,
    no_clobber: NoClobber = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> int:
    """Simulate a scenario; write the result file and print the summary."""
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
        Path | None, typer.Option("-o", "--output", help="Result file. [in place of RESULT]")
    ] = None,
    max_wall: MaxWall = None,
    no_clobber: NoClobber = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> int:
    """Go on with an interrupted run, to the bits that it would have had.

    NAME.partial.h5 is replaced by NAME.h5 once the run is done.
    """
    from frictionsim.cli.job import Job, simulate
    from frictionsim.io import hdf5_reader
    from frictionsim.io.destination import Destination, whole_name
    from frictionsim.scenario.loading import scenario_from_result

    checkpoint = hdf5_reader.read_checkpoint(result)
    loaded = scenario_from_result(result, checkpoint.scenario)
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
            f"cannot make the folder '{folder}' here ({error.strerror}); name a file with -o"
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
    """Solve for impending motion: what lifts, what holds."""
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
    atol: Annotated[float, typer.Option(min=0.0, help="Absolute, in each unit.")] = 1e-9,
    time_atol: Annotated[float, typer.Option(min=0.0, help="Tolerance of event times, s.")] = 1e-6,
    ignore: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="Leave a channel out; energy_* works.")
    ] = None,
) -> int:
    """Compare a result with a golden one: exit 0 if they agree, 1 if they differ."""
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
        str | None, typer.Option(metavar="A,B", help="Methods, instead of all.")
    ] = None,
    laws: Annotated[
        str | None, typer.Option(metavar="A,B", help="Friction laws, instead of all.")
    ] = None,
    tolerances: Annotated[
        str | None, typer.Option(metavar="X,Y", help="Relative, of adaptive methods.")
    ] = None,
    max_wall: Annotated[float, typer.Option(help="Seconds that each run may take.")] = 5.0,
    repeats: Annotated[int, typer.Option(min=1, help="Runs that are timed, at most.")] = 3,
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
    """Solve with every friction law and method at a ladder of settings: what accuracy costs."""
    from frictionsim.scenario.loading import load

    loaded = load(scenario, overrides)

    from frictionsim.cli import cost_study
    from frictionsim.cli.study_table import print_study
    from frictionsim.work_precision.report import study_json

    options = cost_study.Options(
        backends, laws, tolerances, max_wall, repeats, output, csv, plot, no_clobber
    )
    found = cost_study.study_scenario(loaded, options)
    if as_json:
        print_json(study_json(found, str(scenario)))
    else:
        print_study(found)
    cost_study.write_files(found, options)
    if found.status != "done":
        print_error(f"study {found.status} {found.reason} of a run; what was measured is shown")
    return found.exit_code


@app.command()
def plot(
    result: ResultFile,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", help="Picture: .png, .pdf or .svg. [RESULT.png]"),
    ] = None,
    view: Annotated[
        str | None,
        typer.Option("--view", metavar="NAME", help="Instead of the kind's first; or 'all'."),
    ] = None,
    body: Annotated[
        int | None,
        typer.Option("--body", metavar="N", help="Body of a belt, for its view 'body'."),
    ] = None,
) -> None:
    """Draw a view of a result file, or all: each into FILE-<view>.png."""
    from frictionsim.io import hdf5_reader
    from frictionsim.plots import ALL, plot_all
    from frictionsim.plots import plot as draw

    found = hdf5_reader.read(result)
    target = output or result.with_suffix(".png")
    if view != ALL:
        draw(found, target, view, body)
        print(target)
        return
    pictures, reasons = plot_all(found, target, body)
    for picture in pictures:
        print(picture)
    for reason in reasons:
        print_error(f"left out: {reason}")
