"""The commands on files: show, compare, new and schema."""

from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import frictionsim as fs
from frictionsim.cli.app import AsJson, NoClobber, Quiet, ResultFile, app
from frictionsim.cli.completion import kinds, kinds_and_scenarios
from frictionsim.cli.messages import (
    log_on_stderr,
    print_beside_files,
    print_continuation,
    print_error,
    print_json,
    print_text,
    warn,
)
from frictionsim.cli.monitor import CommandMonitor, EndingSignals
from frictionsim.errors import EXIT_DIFFERENT, EXIT_DONE, InputError
from frictionsim.io.terminal import ReaderGone, Stdout

if TYPE_CHECKING:
    from frictionsim.api.sweep_result import Sweep


@app.command()
def report(
    result: Annotated[
        list[Path],
        typer.Argument(
            metavar="RESULT...",
            help="Result files in HDF5; several of one kind are compared.",
            show_default=False,
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="FILE", help="Report in HTML. [RESULT.html, of the first]"
        ),
    ] = None,
    no_clobber: NoClobber = False,
    quiet: Quiet = False,
) -> None:
    """Write a report as one HTML file, which a browser shows offline.

    RESULT is a run, several runs of one kind, a sweep, or a table of `cost` in HDF5 or CSV.
    """
    log_on_stderr(0)
    # A path without a name, e.g. '/', is refused when it is read.
    target = output or result[0].parent / f"{result[0].stem or 'report'}.html"
    with EndingSignals("files already written are kept", activity="writing the report"):
        written = fs.report(list(result), target, no_clobber=no_clobber)
    if not quiet:
        print_beside_files(str(written))


@app.command("warm-up")
def warm_up(
    kind: Annotated[
        str | None,
        typer.Argument(help="Kind of mechanism. [all]", show_default=False),
    ] = None,
    quiet: Quiet = False,
) -> None:
    """Compile the kernels of shipped belts in advance. For containers and CI."""
    from frictionsim.api.scenarios import warming

    total, has_kernels = 0.0, False
    with CommandMonitor(1.0, with_progress=False, quiet=True) as monitor:
        for scenario, backend, seconds in warming(kind, monitor):
            total, has_kernels = total + seconds, True
            if not quiet:
                took = f"compiled in {seconds:.1f} s" if seconds else "compiled already"
                print_beside_files(f"{scenario}, {backend}: {took}")
    if not quiet:
        print_beside_files(f"{total:.1f} s of compilation" if has_kernels else "nothing to compile")


def show_sweep(
    sweep: "Sweep",
    *,
    as_json: bool = False,
    as_csv: bool = False,
    scenario: bool = False,
    study: bool = False,
) -> None:
    """Print the summary of a sweep, or the output that an option selects.

    Parameters
    ----------
    sweep : Sweep
    as_json, as_csv, scenario, study : bool
        The options of `frictionsim show`; at most one is true.
    """
    if scenario or study:
        print_text(sweep.to_toml("study" if study else "scenario"))
        return
    if as_json:
        print_json(sweep.to_json())
    elif as_csv:
        stdout = Stdout()
        with suppress(ReaderGone):
            sweep.write_csv(stdout)
            stdout.flush()
    else:
        print_text(sweep.summary())
    if sweep.missing_runs:
        print_error(sweep.missing_runs)


@app.command()
def show(
    result: ResultFile,
    as_json: AsJson = False,
    as_csv: Annotated[bool, typer.Option("--csv", help="Print channels, or runs, as CSV.")] = False,
    scenario: Annotated[
        bool, typer.Option("--scenario", help="Print the scenario as TOML.")
    ] = False,
    study: Annotated[
        bool, typer.Option("--study", help="Print the study of a sweep as TOML.")
    ] = False,
) -> None:
    """Print the summary of a result or sweep again."""
    if as_json + as_csv + scenario + study > 1:
        raise InputError("show: give one of --json, --csv, --scenario and --study")
    from frictionsim.api.result import result_or_sweep

    log_on_stderr(0)
    content = result_or_sweep(result)
    if not isinstance(content, fs.Result):
        show_sweep(content, as_json=as_json, as_csv=as_csv, scenario=scenario, study=study)
        return
    if study:
        raise InputError(f"{result}: --study is for sweeps, this is the result of a run")
    if as_json:
        print_json(content.to_json())
    elif as_csv:
        from frictionsim.api.result import write_channels

        stdout = Stdout()
        with suppress(ReaderGone):
            write_channels(content.record, stdout)
            stdout.flush()
    elif scenario:
        print_text(content.record.attributes["scenario"].rstrip("\n"))
        return
    else:
        print_text(content.summary())
    warn(content.warnings)
    _print_end(content)


def _print_end(result: "fs.Result") -> None:
    """Print the end of a run that is unfinished or failed its audit, as `solve` does."""
    if result.status == "done":
        if result.reason:
            print_error(f"{result.reason}; do not trust {result.path}")
        return
    print_error(f"run {result.status}: {result.reason}")
    has_checkpoint = False
    with suppress(InputError):
        has_checkpoint = bool(result.load_checkpoint())
    print_continuation(result, has_checkpoint)


@app.command()
def compare(
    result: ResultFile,
    golden: Annotated[
        Path, typer.Argument(metavar="GOLDEN", help="Reference result.", show_default=False)
    ],
    rtol: Annotated[
        float | None, typer.Option(metavar="NUMBER", help="Relative tolerance. [1e-6]")
    ] = None,
    atol: Annotated[
        float | None,
        typer.Option(metavar="NUMBER", help="Absolute tolerance, in the unit of each row. [1e-9]"),
    ] = None,
    time_atol: Annotated[
        float | None, typer.Option(metavar="NUMBER", help="Tolerance of times, s. [1e-6]")
    ] = None,
    ignore: Annotated[
        list[str] | None,
        typer.Option(metavar="NAME", help="Channel, quantity or pattern (energy_*) to ignore."),
    ] = None,
    as_json: AsJson = False,
) -> int:
    """Compare a result with a reference result. Exit 0 if they agree, 1 if they differ."""
    log_on_stderr(0)
    from frictionsim.api.comparing import compare, comparison_parts
    from frictionsim.document import as_json as json_of
    from frictionsim.document import as_text

    given = {"rtol": rtol, "atol": atol, "time_atol": time_atol, "ignore": ignore}
    options: dict[str, Any] = {name: one for name, one in given.items() if one is not None}
    comparison = compare(result, golden, **options)
    parts = comparison_parts(comparison)
    if as_json:
        print_json({"result": str(result), "golden": str(golden), **json_of(parts)})
    else:
        print_text(as_text(parts))
    return EXIT_DONE if comparison.same else EXIT_DIFFERENT


@app.command()
def new(
    kind: Annotated[
        str | None,
        typer.Argument(
            help="Kind of mechanism, or name of a shipped scenario.",
            show_default=False,
            autocompletion=kinds_and_scenarios,
        ),
    ] = None,
    file: Annotated[
        Path | None, typer.Argument(help="Scenario to write. [prints it]", show_default=False)
    ] = None,
    listed: Annotated[
        bool, typer.Option("--list", help="List the kinds and the shipped scenarios.")
    ] = False,
) -> None:
    """Write a commented scenario to start from. An existing file is not replaced.

    With FILE, the schema for editors is written beside it, as KIND.schema.json.
    """
    log_on_stderr(0)  # a faulty plug-in is skipped with a warning
    if listed:
        if kind is not None:
            raise InputError(f"new: expected no argument beside --list, got '{kind}'")
        from frictionsim.api.scenarios import list_of_scenarios

        print_text(list_of_scenarios())
        return
    if kind is None:
        raise InputError("new: KIND is missing; 'frictionsim new --list' lists the kinds")
    if Path(kind).suffix == ".toml":
        raise InputError(
            f"new: expected the kind before the file, got '{kind}'; 'frictionsim new pulley {kind}'"
            " writes a pulley, 'frictionsim new --list' lists the kinds"
        )
    text = fs.new(kind)
    if file is None:
        print_text(text.rstrip("\n"))
        return
    from frictionsim.api.scenarios import write_with_schema

    files, warnings = write_with_schema(file, text)
    warn(warnings)
    print_beside_files("\n".join(map(str, files)))


@app.command()
def schema(
    kind: Annotated[
        str | None,
        typer.Argument(
            help="Kind of mechanism. [all kinds]", show_default=False, autocompletion=kinds
        ),
    ] = None,
) -> None:
    """Print the JSON schema of scenarios, for editors and other tools."""
    log_on_stderr(0)
    print_json(fs.schema(kind))
