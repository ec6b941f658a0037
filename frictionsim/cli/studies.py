"""The commands on studies of many runs: cost, fit and sweep."""

import gc
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

import frictionsim as fs
from frictionsim.cli.monitor import CommandMonitor, StatusLine, SweepMonitor
from frictionsim.cli.options import (
    RESULTS,
    STDIN,
    AsJson,
    NoClobber,
    OverridesOption,
    Quiet,
    ScenarioFile,
    Scheduler,
    Verbose,
    WorkerCount,
    app,
    default_folder,
    load_scenario,
    named_by_option,
    stem_of,
)
from frictionsim.cli.printing import (
    log_on_stderr,
    print_beside_files,
    print_data,
    print_error,
    warn,
)
from frictionsim.errors import (
    EXIT_SIGNAL,
    InputError,
    OutputError,
    counted,
)

if TYPE_CHECKING:
    from frictionsim.api.result_base import ResultBase
    from frictionsim.api.sweep_result import Sweep

# The option for an argument of `fs.fit` that has another name.
FIT_OPTIONS = {"channels": "channel", "quantities": "quantity", "units": "unit"}
SECONDS_BETWEEN_UPDATES = 0.2  # of the status line


class StudyFiles(NamedTuple):
    """The output files of a study; None for those not requested."""

    output: Path | None
    csv: Path | None
    plot: Path | None

    def check(self, no_clobber: bool, csv_kind: Any = None) -> None:
        """Check that the files can be written, before the study runs.

        The output must be a new file.
        """
        from frictionsim.io.output_file import (
            PICTURE,
            SCENARIO,
            check_apart,
            check_free,
            check_output,
        )

        options = ("-o", "--csv", "--plot")
        given = {option: path for option, path in zip(options, self, strict=True) if path}
        check_apart(given)
        if no_clobber:
            for option, path in given.items():
                check_free(path, {"--csv": csv_kind, "--plot": PICTURE}.get(option, SCENARIO))
        if self.plot is not None:
            from frictionsim.plots.style import check_picture

            check_picture(self.plot)
        if self.output is not None:
            check_free(self.output, SCENARIO)
            check_output(self.output, SCENARIO)
        if self.csv is not None:
            check_output(self.csv, csv_kind)


@app.command()
def cost(
    scenario: ScenarioFile,
    overrides: OverridesOption = None,
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
    bodies: Annotated[
        str | None,
        typer.Option(
            metavar="N,M", help="Belt meshes to compare (numbers of bodies); none: time steps only."
        ),
    ] = None,
    models: Annotated[
        str | None,
        typer.Option(metavar="A,B", help="Models of a belt: string, corrected, polygon. [all]"),
    ] = None,
    max_wall: Annotated[
        float | None,
        typer.Option(metavar="SECONDS", help="Limit the wall time of each run. [5]"),
    ] = None,
    repeats: Annotated[
        int | None,
        typer.Option(metavar="N", help="Maximum number of timed runs of each setting. [3]"),
    ] = None,
    csv: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Write the table as CSV.")
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Draw error against work: .png, .pdf or .svg."),
    ] = None,
    no_clobber: NoClobber = False,
    as_json: AsJson = False,
) -> int:
    """Measure error against run time, by friction law and backend.

    Each is run at several settings.
    """
    from frictionsim.api.studies import CostOptions, Study
    from frictionsim.api.studies import study as run_study
    from frictionsim.io.names import partial_name
    from frictionsim.io.output_file import COSTS, PICTURE, remove_unfinished

    log_on_stderr(0)
    loaded = load_scenario(scenario, overrides)
    files = StudyFiles(None, csv, plot)
    with (
        CommandMonitor(loaded.solver.duration, with_progress=False) as monitor,
        StatusLine() as line,
    ):
        options = CostOptions.among(locals(), progress=line)
        files.check(no_clobber, COSTS)
        study = Study(loaded.origin, *run_study(loaded, options, monitor))
    if study.status != "done":  # a whole table of another study stays
        csv, plot = (path and partial_name(path) for path in (csv, plot))
    _write_and_print(
        study, {"table": (csv, study.save), "picture": (plot, study.save_picture)}, as_json
    )
    if study.status == "done":
        for path, kind in ((csv, COSTS), (plot, PICTURE)):
            if path is not None:
                remove_unfinished(partial_name(path), kind)
    else:
        print_error(
            f"study {study.status} {study.reason} of a run; the results cover the settings before"
        )
    return study.exit_code


def _write_and_print(
    result: "ResultBase",
    files: "Mapping[str, tuple[Path | None, Callable[[Path], Any]]]",
    as_json: bool,
) -> None:
    """Write the files that are wanted, and print the summary with the names of those written.

    Parameters
    ----------
    files : mapping
        By the word for it, its path, None if it is not wanted, and what writes it.

    Raises
    ------
    OutputError
        If one cannot be written, after all else is done.
    """
    written: dict[str, str | None] = dict.fromkeys(files)
    errors = []
    for word, (path, write) in files.items():
        if path is not None:
            try:
                write(path)
                written[word] = str(path)
            except OutputError as error:
                errors.append(str(error))
    named = (f"{word}: {name}" for word, name in written.items() if name)
    # Where files are written, a standard output that cannot be is a warning.
    show = print_beside_files if any(written.values()) else print_data
    show(result.to_json() | written if as_json else "\n".join((result.summary(), *named)))
    if errors:
        raise OutputError("\n".join(errors))


@app.command()
def fit(
    scenario: ScenarioFile,
    free: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY=LOW:HIGH[:START]",
            help="Key to fit, with its bounds; A,B for two keys of equal value. May be repeated.",
        ),
    ] = None,
    data: Annotated[
        Path | None, typer.Option(metavar="FILE", help="Measured data in CSV.", show_default=False)
    ] = None,
    channels: Annotated[
        list[str] | None,
        typer.Option(
            "--channel",
            metavar="NAME[=COLUMN]",
            help="Measured channel, and its column in the data. May be repeated.",
        ),
    ] = None,
    quantities: Annotated[
        list[str] | None,
        typer.Option(
            "--quantity",
            metavar="NAME=VALUE",
            help="Measured quantity; with --over NAME[=COLUMN]. May be repeated.",
        ),
    ] = None,
    over: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KEY[=COLUMN]",
            help="Key set by each row of the data, and its column; one run per row. May be"
            " repeated.",
        ),
    ] = None,
    overrides: OverridesOption = None,
    sigma: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE",
            help="Standard deviation of a channel or quantity, in the unit of the data, or its"
            " column. [the scatter about the fit] May be repeated.",
        ),
    ] = None,
    units: Annotated[
        list[str] | None,
        typer.Option(
            "--unit",
            metavar="NAME=UNIT",
            help="Unit of the data of a channel, e.g. deg/s or rpm. May be repeated.",
        ),
    ] = None,
    time: Annotated[
        str | None, typer.Option(metavar="COLUMN", help="Column of the times. [time, or the first]")
    ] = None,
    time_unit: Annotated[
        str | None, typer.Option(metavar="UNIT", help="Unit of the times, e.g. ms. [s]")
    ] = None,
    time_offset: Annotated[
        float | None,
        typer.Option(metavar="SECONDS", help="Offset added to the times of the data. [0]"),
    ] = None,
    starts: Annotated[
        int | None,
        typer.Option(metavar="N", help="Number of local searches, from points of a scan. [3]"),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option(metavar="N", help="Random seed of the scan and of the bootstrap. [0]"),
    ] = None,
    bootstrap: Annotated[
        int | None,
        typer.Option(metavar="N", help="Number of bootstrap resamples for intervals. [0]"),
    ] = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="FILE", help="Write the fitted scenario; a new file."
        ),
    ] = None,
    plot: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Draw data, fit and residuals: .png, .pdf or .svg."),
    ] = None,
    no_clobber: NoClobber = False,
    as_json: AsJson = False,
) -> int:
    """Fit keys of a scenario to measured data, with standard errors."""
    from frictionsim.api.fitting import fit as fit_scenario
    from frictionsim.scenario.options import column_of

    with named_by_option(FIT_OPTIONS), StatusLine() as line:
        given: dict[str, Any] = {"sigma": sigma, "units": units, "time_unit": time_unit}
        given |= {"time_offset": time_offset, "starts": starts, "seed": seed}
        given |= {"bootstrap": bootstrap}
        loaded = load_scenario(scenario, overrides)
        StudyFiles(output, None, plot).check(no_clobber)
        result = fit_scenario(
            loaded,
            data=data,
            channels=channels or (),
            quantities=quantities or (),
            over=over or (),
            free=free or (),
            time=None if time is None else column_of(time),
            progress=_Updates(line),
            **{name: value for name, value in given.items() if value is not None},
        )
    writers = {"output": (output, result.save_toml), "picture": (plot, result.save_picture)}
    _write_and_print(result, writers, as_json)
    if result.not_identified and not as_json:
        named = ", ".join(result.not_identified)
        keys = counted(len(result.values), "key")
        warn([f"{len(result.not_identified)} of {keys} not identified: {named}"])
    warn(result.warnings if as_json else result.doubts)
    if result.status != "done":
        print_error(f"fit {result.status}: {result.reason}; do not trust the estimates")
    return result.exit_code


class _Updates:
    """Shows the number of runs of a fit several times per second."""

    def __init__(self, line: StatusLine) -> None:
        self._line, self._shown = line, 0.0

    def __call__(self, runs: int, /) -> None:
        if monotonic() - self._shown > SECONDS_BETWEEN_UPDATES:
            self._shown = monotonic()
            self._line(f"{runs} runs")


@app.command()
def sweep(
    source: Annotated[
        str,
        typer.Argument(
            metavar="SCENARIO",
            help="Scenario or its shipped name, or study with what is varied, in TOML; - reads the"
            " standard input.",
            show_default=False,
        ),
    ],
    vary: Annotated[
        list[str] | None,
        typer.Option(
            "--vary",
            metavar="KEY=VALUES",
            help="Vary a key, or several keys of equal value (A,B=...): [0.1, 0.2],"
            " lin(a, b, n), log(a, b, n); with --sample uniform(a, b), normal(m, s),"
            " lognormal(m, s), triangular(a, c, b). May be repeated.",
        ),
    ] = None,
    overrides: OverridesOption = None,
    zip: Annotated[
        bool, typer.Option("--zip", help="Vary the keys together, not in all combinations.")
    ] = False,
    sample: Annotated[
        int | None,
        typer.Option(metavar="N", help="Run a sample of N combinations from distributions."),
    ] = None,
    method: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Sampling method: sobol, lhs or random. [sobol]",
        ),
    ] = None,
    seed: Annotated[
        int | None, typer.Option(metavar="S", help="Random seed of the sample. [0]")
    ] = None,
    indices: Annotated[
        bool, typer.Option("--indices", help="Sample for Sobol indices: N (keys + 2) runs.")
    ] = False,
    workers: WorkerCount = None,
    dask: Scheduler = None,
    output: Annotated[
        Path | None,
        typer.Option(
            "-o", "--output", metavar="FILE", help="Sweep in HDF5. [results/<name>-sweep.h5]"
        ),
    ] = None,
    csv: Annotated[Path | None, typer.Option(metavar="FILE", help="Write a table as CSV.")] = None,
    keep_series: Annotated[
        bool,
        typer.Option("--keep-series", help="Save the result of each run in a folder FILE.series."),
    ] = False,
    no_clobber: NoClobber = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
    verbose: Verbose = 0,
) -> int:
    """Run many combinations of values and write them to one file."""
    from frictionsim.api.sweeping import SweepOptions, study_from

    options = SweepOptions.among(locals())
    if output == Path(STDIN):
        raise InputError("-o -: a sweep is written as HDF5, not printed; give a file name")
    study = study_from(
        source if source != STDIN else load_scenario(source, overrides), overrides, options
    )
    log_on_stderr(verbose)
    with _target(output, source) as target:
        _check_csv(csv, target, no_clobber, study.options.indices)
        warn(study.scenario.warnings())
        run = partial(
            fs.sweep, study, output=target, no_clobber=no_clobber, workers=workers, dask=dask
        )
        return run_sweep(run, source, csv, as_json, quiet)


def run_sweep(
    run: "Callable[..., Sweep]", source: str, csv: Path | None, as_json: bool, quiet: bool
) -> int:
    """Run a sweep, which takes `progress`, and print its summary; return the exit code."""
    gc.enable()  # off for short commands; a sweep may take days
    with SweepMonitor(not (quiet or as_json), quiet) as monitor:
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


@contextmanager
def _target(output: Path | None, source: str) -> Iterator[Path]:
    """Return the context with the file to write; its new folder is removed if unused."""
    if output is not None:
        yield output
        return
    made = not RESULTS.is_dir()
    folder = default_folder()
    try:
        yield folder / f"{stem_of(source)}-sweep.h5"
    finally:
        if made:
            with suppress(OSError):  # there is something in it
                folder.rmdir()


def _check_csv(csv: Path | None, target: Path, no_clobber: bool, indices: bool) -> None:
    if csv is None:
        return
    from frictionsim.io.output_file import check_apart, check_free, check_output
    from frictionsim.sweeps.sweep_csv import files_of_sweep_in_csv

    check_apart({"-o": target, "--csv": csv})
    for path, kind in files_of_sweep_in_csv(csv, indices).items():
        if no_clobber:
            check_free(path, kind)
        check_output(path, kind)
