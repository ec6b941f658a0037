"""The commands on files: show, compare, plot, report, new and schema; and warm-up."""

from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import frictionsim as fs
from frictionsim.cli.monitor import CommandMonitor, StatusLine
from frictionsim.cli.options import (
    AsJson,
    NoClobber,
    Quiet,
    ResultFile,
    app,
    named_by_option,
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
    EXIT_DIFFERENT,
    EXIT_DONE,
    ArgumentError,
    InputError,
)
from frictionsim.io.terminal import ReaderGone, Stdout

if TYPE_CHECKING:
    from frictionsim.api.pictures import PlotOptions
    from frictionsim.api.sweep_result import Sweep


@app.command()
def show(
    result: Annotated[
        list[Path],
        typer.Argument(
            metavar="RESULT",
            help="Result or sweep in HDF5; several results are shown side by side.",
            show_default=False,
        ),
    ],
    as_json: AsJson = False,
    as_csv: Annotated[bool, typer.Option("--csv", help="Print channels, or runs, as CSV.")] = False,
    output: Annotated[
        Path | None,
        typer.Option("-o", "--output", metavar="FILE", help="Write the CSV to a file."),
    ] = None,
    channels: Annotated[
        str | None, typer.Option(metavar="NAME,NAME", help="Channels of the CSV. [all]")
    ] = None,
    start: Annotated[
        float | None, typer.Option("--from", metavar="SECONDS", help="First time of the CSV.")
    ] = None,
    stop: Annotated[
        float | None, typer.Option("--to", metavar="SECONDS", help="Last time of the CSV.")
    ] = None,
    scenario: Annotated[
        bool, typer.Option("--scenario", help="Print the scenario as TOML.")
    ] = False,
    study: Annotated[
        bool, typer.Option("--study", help="Print the study of a sweep as TOML.")
    ] = False,
) -> None:
    """Print the summary of a result or sweep again."""
    from frictionsim.api.result import result_or_sweep, side_by_side

    log_on_stderr(0)
    if as_json + as_csv + scenario + study > 1:
        raise InputError("show: give one of --json, --csv, --scenario and --study")
    chosen: dict[str, Any] = {"output": output, "channels": channels, "from": start, "to": stop}
    for name, value in chosen.items():
        if value is not None and not as_csv:
            raise ArgumentError(name, "it applies to --csv")
    if len(result) > 1:
        if as_json + as_csv + scenario + study:
            raise InputError("show: several results have no --json, --csv, --scenario or --study")
        results = list(map(fs.open, result))
        print_text(side_by_side(results))
        for one in results:
            warn(one.warnings, f"{one.path}: ")
        return
    content = result_or_sweep(result[0])
    if study and isinstance(content, fs.Result):
        raise InputError(f"{result[0]}: --study is for sweeps, this is the result of a run")
    if isinstance(content, fs.Result) and scenario:
        print_text(content.record.attributes["scenario"].rstrip("\n"))
        return
    if not isinstance(content, fs.Result) and (scenario or study):
        print_text(content.to_toml("study" if study else "scenario"))
        return
    if as_json:
        print_json(content.to_json())
    elif as_csv:
        _print_csv(content, output, channels, start, stop)
    else:
        print_text(content.summary())
    if isinstance(content, fs.Result):
        warn(content.warnings)
        print_end(content, None)
    elif content.missing_runs:
        print_error(content.missing_runs)


def _print_csv(
    content: "fs.Result | Sweep",
    output: Path | None,
    channels: str | None,
    start: float | None,
    stop: float | None,
) -> None:
    """Print a result or sweep as CSV, or write it to a file."""
    chosen: dict[str, Any] = {}
    if isinstance(content, fs.Result):
        names = None if channels is None else [name.strip() for name in channels.split(",")]
        chosen = {"channels": names, "start": start, "stop": stop}
    elif channels or start is not None or stop is not None:
        raise InputError("show: --channels, --from and --to are for the result of a run")
    if output is not None:
        content.save_csv(output, **chosen)
        print_text(str(output))
        return
    stdout = Stdout()
    with suppress(ReaderGone):
        content.write_csv(stdout, **chosen)
        stdout.flush()


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
        typer.Option(
            metavar="NAME",
            help="Channel, quantity or pattern (energy_*) to ignore. May be repeated.",
        ),
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
def plot(
    result: Annotated[
        list[Path],
        typer.Argument(
            metavar="RESULT",
            help="Result or sweep in HDF5; several results are drawn over each other.",
            show_default=False,
        ),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="FILE", help="Picture: .png, .pdf or .svg. [RESULT.png]"
        ),
    ] = None,
    view: Annotated[
        list[str] | None,
        typer.Option(
            "--view",
            metavar="NAME",
            help="View to draw, or 'all'; for a sweep: quantities. [the first] May be repeated.",
        ),
    ] = None,
    body: Annotated[
        int | None,
        typer.Option("--body", metavar="N", help="Number of the body for the view 'body'."),
    ] = None,
    at: Annotated[
        list[str] | None,
        typer.Option(
            "--at",
            metavar="KEY=VALUE",
            help="Value to draw of a varied key of a sweep. May be repeated.",
        ),
    ] = None,
    time: Annotated[
        float | None,
        typer.Option(
            "--time", metavar="SECONDS", help="Time of the instant to draw. [last sample]"
        ),
    ] = None,
    start: Annotated[
        float | None,
        typer.Option("--from", metavar="SECONDS", help="Start of the time window."),
    ] = None,
    stop: Annotated[
        float | None, typer.Option("--to", metavar="SECONDS", help="End of the time window.")
    ] = None,
    channels: Annotated[
        str | None,
        typer.Option(metavar="NAME,NAME", help="Channels to plot over time. [default of the kind]"),
    ] = None,
    width: Annotated[
        str | None,
        typer.Option(metavar="LENGTH", help="Width of the picture in mm, cm, in or pt: 84mm."),
    ] = None,
    height: Annotated[
        str | None,
        typer.Option(metavar="LENGTH", help="Height of the picture. [that of the view]"),
    ] = None,
    dpi: Annotated[
        float | None, typer.Option(metavar="NUMBER", help="Dots per inch of a PNG. [100]")
    ] = None,
    style: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="screen or paper. [screen]",
        ),
    ] = None,
    animate: Annotated[
        Path | None,
        typer.Option(
            "--animate",
            metavar="FILE",
            help="Write an animation (.gif or .mp4) instead of a picture.",
        ),
    ] = None,
    fps: Annotated[
        float | None,
        typer.Option("--fps", metavar="N", help="Frames per second. [20 of .gif, 30 of .mp4]"),
    ] = None,
    speed: Annotated[
        float | None,
        typer.Option(
            "--speed", metavar="X", help="Simulated seconds per second. [the run takes 8 s]"
        ),
    ] = None,
    no_title: Annotated[bool, typer.Option("--no-title", help="Leave out the title.")] = False,
    no_clobber: NoClobber = False,
    as_json: AsJson = False,
) -> None:
    """Draw views of a result or sweep. Named views are written to FILE-<view>.png."""
    log_on_stderr(0)
    with named_by_option({"window": "from and --to", "title": "no-title"}):
        from frictionsim.api.pictures import PlotOptions, SavedPictures, save_pictures

        options = PlotOptions.among(locals(), window=(start, stop), title=not no_title)
        if animate is None:
            done = save_pictures(result, output, options, no_clobber=no_clobber)
        else:
            if output is not None:
                raise ArgumentError("output", "it does not apply to an animation")
            options.check_for("an animation")
            if len(result) > 1:
                raise ArgumentError(
                    "animate",
                    f"expected one result, got {len(result)}; 'frictionsim report'"
                    " shows several moving side by side",
                )
            done = SavedPictures([_animated(result[0], animate, options, no_clobber)], [])
    pictures = list(map(str, done.pictures))
    if as_json:
        named = str(result[0]) if len(result) == 1 else list(map(str, result))
        print_beside_files({"result": named, "pictures": pictures, "skipped": done.skipped})
    else:
        print_beside_files("\n".join(pictures))
        for reason in done.skipped:
            print_error(f"view skipped: {reason}")


def _animated(result: Path, path: Path, options: "PlotOptions", no_clobber: bool) -> Path:
    """Write an animation, with its progress on a terminal."""
    with StatusLine() as line:
        return fs.animate(
            result,
            path,
            fps=options.fps,
            speed=options.speed,
            no_clobber=no_clobber,
            progress=lambda done, count: line(f"frame {done} of {count}"),
        )


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
    written = fs.report(list(result), target, no_clobber=no_clobber)
    if not quiet:
        print_beside_files(str(written))


@app.command()
def new(
    kind: Annotated[
        str | None,
        typer.Argument(
            help="Kind of mechanism, or name of a shipped scenario.",
            show_default=False,
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
        typer.Argument(help="Kind of mechanism. [all kinds]", show_default=False),
    ] = None,
) -> None:
    """Print the JSON schema of scenarios, for editors and other tools."""
    log_on_stderr(0)
    print_json(fs.schema(kind))


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
