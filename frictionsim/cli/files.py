"""The commands on files: show, compare, plot, report, new and schema; and warm-up."""

from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import frictionsim as fs
from frictionsim.cli.commands import command
from frictionsim.cli.terminal import (
    CommandMonitor,
    StatusLine,
    log_on_stderr,
    print_beside_files,
    print_data,
    print_end,
    print_error,
    warn,
)
from frictionsim.errors import EXIT_DIFFERENT, EXIT_DONE, ArgumentError, InputError
from frictionsim.io.terminal import ReaderGone, Stdout

if TYPE_CHECKING:
    from frictionsim.api.sweep_result import Sweep


@command()
def show(
    result: list[Path],
    as_json: bool = False,
    csv: bool = False,
    scenario: bool = False,
    study: bool = False,
    output: Path | None = None,
    **chosen: Any,
) -> None:
    """Print the summary of a result or sweep again.

    RESULT...             Result or sweep in HDF5; several results are shown side by side, and
                          their JSON is a list.
    --json
    --csv                 Print the channels, or the runs of a sweep, as CSV.
    -o, --output FILE     Write the CSV to this file. [prints it]
    --channels NAME,NAME  Choose the channels of the CSV. [all]
    --from SECONDS        Leave out earlier samples of the CSV. [start of the run]
    --to SECONDS          Leave out later samples of the CSV. [end of the run]
    --scenario            Print the scenario as TOML.
    --study               Print the study of a sweep as TOML.
    """
    from frictionsim.api.opening import result_or_sweep, side_by_side

    log_on_stderr(0)
    forms = as_json + csv + scenario + study
    if forms > 1:
        raise InputError("show: give one of --json, --csv, --scenario and --study")
    for name in [] if csv else [*(["output"] if output else []), *chosen]:
        raise ArgumentError(name, "it applies to --csv")
    if len(result) > 1:
        if as_json:
            print_data([result_or_sweep(path).to_json() for path in result])
            return
        if forms:
            raise InputError("show: several results have no --csv, --scenario or --study")
        results = list(map(fs.open, result))
        print_data(side_by_side(results))
        for one in results:
            warn(one.warnings, f"{one.path}: ")
        return
    content = result_or_sweep(result[0])
    if scenario or study:
        if study and isinstance(content, fs.Result):
            raise InputError(f"{result[0]}: --study is for sweeps, this is the result of a run")
        print_data(content.to_toml("study" if study else "scenario"))
        return
    if as_json:
        print_data(content.to_json())
    elif csv:
        _print_csv(content, output, chosen)
    else:
        print_data(content.summary())
    if isinstance(content, fs.Result):
        warn(content.warnings)
        print_end(content, None)
    elif content.missing_runs:
        print_error(content.missing_runs)


def _print_csv(content: "fs.Result | Sweep", output: Path | None, chosen: dict[str, Any]) -> None:
    """Print a result or sweep as CSV, or write it to a file."""
    if chosen and not isinstance(content, fs.Result):
        raise InputError("show: --channels, --from and --to are for the result of a run")
    if output is not None:
        print_data(str(content.save_csv(output, **chosen)))
        return
    from frictionsim.io.result_csv import write_lines as write_samples
    from frictionsim.sweeps.sweep_csv import write_lines as write_runs

    stdout = Stdout()
    with suppress(ReaderGone):
        if isinstance(content, fs.Result):
            write_samples(content.record, stdout, **chosen)
        else:
            write_runs(content.table, stdout)
        stdout.flush()


@command()
def compare(result: Path, golden: Path, as_json: bool = False, **options: Any) -> int:
    """Compare a result with a reference result. Exit 0 if they agree, 1 if they differ.

    RESULT               Result in HDF5.
    GOLDEN               Reference result in HDF5.
    --rtol NUMBER        Allow this relative difference. [1e-6]
    --atol NUMBER        Allow this difference, in the unit of each row. [1e-9]
    --time-atol SECONDS  Allow this difference of times. [1e-6]
    --ignore NAME        Ignore a channel, a quantity, or those of a pattern: energy_*. May be
                         repeated.
    --json
    """
    from frictionsim.api.comparing import comparison_parts
    from frictionsim.document import as_json as json_of
    from frictionsim.document import as_text

    log_on_stderr(0)
    comparison = fs.compare(result, golden, **options)
    parts = comparison_parts(comparison)
    if as_json:
        print_data({"result": str(result), "golden": str(golden), **json_of(parts)})
    else:
        print_data(as_text(parts))
    return EXIT_DONE if comparison.same else EXIT_DIFFERENT


@command(measured="channel", units="unit", window="from and --to", title="no-title")
def plot(
    result: list[Path],
    output: Path | None = None,
    animate: Path | None = None,
    start: float | None = None,
    stop: float | None = None,
    no_title: bool = False,
    no_clobber: bool = False,
    as_json: bool = False,
    **options: Any,
) -> None:
    """Draw views of a result or sweep. Named views are written to FILE-<view>.png.

    RESULT...             Result or sweep in HDF5; several results are drawn over each other.
    -o, --output FILE     Write the picture to this .png, .pdf or .svg. [RESULT.png]
    --view NAME           Draw this view, or 'all'; of a sweep: quantities. May be repeated. [the
                          first]
    --body N              Draw this body in the view 'body'.
    --at KEY=VALUE        Draw a varied key of a sweep at this value. May be repeated.
    --time SECONDS        Draw this instant. [last sample]
    --from SECONDS        Begin the time window here. [start of the run]
    --to SECONDS          End the time window here. [end of the run]
    --channels NAME,NAME  Draw these channels over time. [default of the kind]
    --data FILE           Read measured or digitised values from this CSV.
    --channel NAME[=COLUMN]  Draw this channel, with these values as points. May be repeated.
    --unit NAME=UNIT      Take the data of a channel in this unit: deg/s, rpm. May be repeated.
                          [that of the heading, or of the channel]
    --width LENGTH        Set the width of the picture, in mm, cm, in or pt: 84mm. [that of the
                          view]
    --height LENGTH       Set the height of the picture, in these units. [that of the view]
    --dpi NUMBER          Set the dots per inch of a PNG. [100]
    --style NAME          Draw for screen or paper. [screen]
    --animate FILE        Write an animation (.gif or .mp4) instead of a picture.
    --fps X               Draw so many frames per second. [20 of .gif, 30 of .mp4]
    --speed X             Show so many simulated seconds per second. [the run takes 8 s]
    --no-title            Leave out the title.
    --no-clobber --json
    """
    log_on_stderr(0)
    from frictionsim.api.pictures import ANIMATION, PlotOptions, SavedPictures, save_pictures

    checked = PlotOptions.of(window=(start, stop), title=not no_title, **options)
    if animate is None:
        done = save_pictures(result, output, checked, no_clobber=no_clobber)
    else:
        if output is not None:
            raise ArgumentError("output", "it does not apply to an animation")
        checked.check_for(ANIMATION)
        if len(result) > 1:
            raise ArgumentError(
                "animate",
                f"expected one result, got {len(result)}; 'frictionsim report' shows several"
                " moving side by side",
            )
        with StatusLine() as line:
            options |= {"progress": lambda frame, count: line(f"frame {frame} of {count}")}
            animation = fs.animate(result[0], animate, no_clobber=no_clobber, **options)
        done = SavedPictures([animation], [])
    pictures = list(map(str, done.pictures))
    if as_json:
        named = str(result[0]) if len(result) == 1 else list(map(str, result))
        print_beside_files({"result": named, "pictures": pictures, "skipped": done.skipped})
    else:
        print_beside_files("\n".join(pictures))
        for reason in done.skipped:
            print_error(f"view skipped: {reason}")


@command()
def report(
    result: list[Path], output: Path | None = None, no_clobber: bool = False, quiet: bool = False
) -> None:
    """Write a report as one HTML file, which a browser shows offline.

    RESULT...          Result or sweep in HDF5, or table of `cost` in CSV; several results of one
                       kind are compared.
    -o, --output FILE  Write the report to this file. [RESULT.html, of the first]
    --no-clobber --quiet
    """
    log_on_stderr(0)
    # A path without a name, e.g. '/', is refused when it is read.
    target = output or result[0].parent / f"{result[0].stem or 'report'}.html"
    written = fs.report(list(result), target, no_clobber=no_clobber)
    if not quiet:
        print_beside_files(str(written))


@command(listed="list")
def new(kind: str | None = None, file: Path | None = None, listed: bool = False) -> None:
    """Write a commented scenario to start from. An existing file is not replaced.

    With FILE, the schema for editors is written beside it, as KIND.schema.json.

    [KIND]  Kind of mechanism, or name of a shipped scenario.
    [FILE]  Scenario to write. [prints it]
    --list  List the kinds and the shipped scenarios.
    """
    from frictionsim.api.scenarios import list_of_scenarios, write_with_schema

    log_on_stderr(0)  # a faulty plug-in is skipped with a warning
    if listed:
        if kind is not None:
            raise InputError(f"new: expected no argument beside --list, got '{kind}'")
        print_data(list_of_scenarios())
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
        print_data(text.rstrip("\n"))
        return
    files, warnings = write_with_schema(file, text)
    warn(warnings)
    print_beside_files("\n".join(map(str, files)))


@command()
def schema(kind: str | None = None) -> None:
    """Print the JSON schema of scenarios, for editors and other tools.

    [KIND]  Kind of mechanism. [all kinds]
    """
    log_on_stderr(0)
    print_data(fs.schema(kind))


@command()
def warm_up(kind: str | None = None, quiet: bool = False) -> None:
    """Compile the kernels of shipped belts in advance, for containers and CI.

    [KIND]  Kind of mechanism. [all kinds]
    --quiet
    """
    from frictionsim.api.scenarios import warming

    total, has_kernels = 0.0, False
    with CommandMonitor(quiet=True) as monitor:
        for scenario, backend, seconds in warming(kind, monitor):
            total, has_kernels = total + seconds, True
            if not quiet:
                took = f"compiled in {seconds:.1f} s" if seconds else "compiled already"
                print_beside_files(f"{scenario}, {backend}: {took}")
    if not quiet:
        print_beside_files(f"{total:.1f} s of compilation" if has_kernels else "nothing to compile")
