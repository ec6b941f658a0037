"""The commands on studies of many runs: cost, fit and sweep."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import frictionsim as fs
from frictionsim.cli.commands import command
from frictionsim.cli.runs import (
    RESULTS,
    STDIN,
    load_scenario,
    made_folder,
    run_sweep,
    stem_of,
)
from frictionsim.cli.terminal import (
    CommandMonitor,
    StatusLine,
    log_on_stderr,
    print_beside_files,
    print_data,
    print_error,
    warn,
)
from frictionsim.errors import InputError, OutputError, counted

if TYPE_CHECKING:
    from frictionsim.api.result import ResultBase
    from frictionsim.io.output_file import Kind

SECONDS_BETWEEN_UPDATES = 0.2  # of the number of runs of a fit


@command()
def cost(
    scenario: str,
    overrides: list[str] | None = None,
    csv: Path | None = None,
    plot: Path | None = None,
    no_clobber: bool = False,
    as_json: bool = False,
    **options: Any,
) -> int:
    """Measure error against run time, by friction law, backend and setting.

    SCENARIO --set
    --backends A,B      Use these backends. [all that apply]
    --laws A,B          Use these friction laws. [all that apply]
    --tolerances X,Y    Use these relative tolerances of adaptive backends. [1e-3,1e-5,...,1e-11;
                        of belts 1e-4,2e-6,1e-7]
    --bodies N,M        Compare belts of these numbers of bodies; none: time steps only. [0.4 to 4
                        times those of the scenario, up to 600]
    --models A,B        Compare these models of a belt: string, corrected, polygon. [all]
    --max-wall SECONDS  Stop each run after this wall time. [5]
    --repeats N         Time each setting at most so many times. [3]
    --csv FILE          Write the table as CSV.
    --plot FILE         Draw error against work, as .png, .pdf or .svg.
    --no-clobber --json
    """
    from frictionsim.api.studies import CostOptions, Study
    from frictionsim.api.studies import study as run_study
    from frictionsim.io.names import partial_name
    from frictionsim.io.output_file import COSTS, PICTURE, remove_unfinished

    log_on_stderr(0)
    loaded = load_scenario(scenario, overrides)
    with CommandMonitor() as monitor, StatusLine() as line:
        checked = CostOptions.of(progress=line, **options)
        _check_files({"--csv": (csv, COSTS), "--plot": (plot, PICTURE)}, no_clobber)
        study = Study(loaded.origin, *run_study(loaded, checked, monitor))
    done = study.status == "done"
    if not done:  # a whole table of another study stays
        csv, plot = (path and partial_name(path) for path in (csv, plot))
    files = {"table": (csv, study.save_csv), "picture": (plot, study.save_picture)}
    written = _write_and_print(study, files, as_json)
    if done:
        for path, kind in ((csv, COSTS), (plot, PICTURE)):
            if path is not None:
                remove_unfinished(partial_name(path), kind)
    else:
        within = f", in {' and '.join(written)}" if written else ""
        ended = f"study {study.status} {study.reason} of a run"
        print_error(f"{ended}; the results cover the settings before{within}")
    return study.exit_code


def _check_files(files: "Mapping[str, tuple[Path | None, Kind]]", no_clobber: bool) -> None:
    """Check, before a study runs, that its files by their options can be written."""
    from frictionsim.io.output_file import PICTURE, SCENARIO, check_apart, check_free, check_output

    wanted = {option: (path, kind) for option, (path, kind) in files.items() if path}
    check_apart({option: path for option, (path, _) in wanted.items()})
    for path, kind in wanted.values():
        if no_clobber or kind is SCENARIO:
            check_free(path, kind)
        if kind is PICTURE:
            from frictionsim.plots.style import check_picture

            check_picture(path)
        else:
            check_output(path, kind)


def _write_and_print(
    result: "ResultBase",
    files: "Mapping[str, tuple[Path | None, Callable[[Path], Any]]]",
    as_json: bool,
) -> list[str]:
    """Write the files that are wanted, and print the summary with the names of those written.

    `files` has, by the word for it, the path of each, None if it is not wanted, and what writes it.
    OutputError is raised if one cannot be written, after all else is done.
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
    named = {word: name for word, name in written.items() if name}
    # Where files are written, a standard output that cannot be is a warning.
    show = print_beside_files if named else print_data
    lines = (f"{word}: {name}" for word, name in named.items())
    show(result.to_json() | written if as_json else "\n".join((result.summary(), *lines)))
    if errors:
        raise OutputError("\n".join(errors))
    return list(named.values())


@command(channels="channel", quantities="quantity", units="unit")
def fit(
    scenario: str,
    overrides: list[str] | None = None,
    output: Path | None = None,
    plot: Path | None = None,
    no_clobber: bool = False,
    as_json: bool = False,
    **options: Any,
) -> int:
    """Fit keys of a scenario to measured data, with standard errors.

    SCENARIO
    --free KEY=LOW:HIGH[:START]  Fit a key within bounds; A,B for two keys of equal value. May be
                                 repeated. [start: that of the scenario]
    --data FILE                  Read the measured data from this CSV.
    --channel NAME[=COLUMN]      Fit to a measured channel, in this column. May be repeated.
    --quantity NAME=VALUE        Fit to a measured quantity; with --over NAME[=COLUMN]. May be
                                 repeated.
    --over KEY[=COLUMN]          Set a key by each row of the data, one run a row. May be repeated.
    --set
    --sigma NAME=VALUE           Take this standard deviation of a channel or quantity, in the unit
                                 of the data, or that in a column. May be repeated. [the scatter
                                 about the fit]
    --unit NAME=UNIT             Take the data of a channel in this unit: deg/s, rpm. May be
                                 repeated. [that of the heading, or of the channel]
    --time COLUMN                Take the times from this column. [time, or the first]
    --time-unit UNIT             Take the times in this unit: ms. [that of the heading, or s]
    --time-offset SECONDS        Add this to the times of the data. [0]
    --starts N                   Search from so many points of a scan. [3]
    --seed N                     Draw the scan and the bootstrap from this random seed. [0]
    --bootstrap N                Fit to so many resamples for intervals, at least 40. [0]
    -o, --output FILE            Write the fitted scenario, to a new file.
    --plot FILE                  Draw data, fit and residuals, as .png, .pdf or .svg.
    --no-clobber --json
    """
    from frictionsim.io.output_file import PICTURE, SCENARIO
    from frictionsim.scenario.options import column_of

    if "time" in options:
        options["time"] = column_of(options["time"])
    with StatusLine(SECONDS_BETWEEN_UPDATES) as line:
        loaded = load_scenario(scenario, overrides)
        _check_files({"-o": (output, SCENARIO), "--plot": (plot, PICTURE)}, no_clobber)
        options["progress"] = lambda runs: line(f"{runs} runs")
        result = fs.fit(loaded, **{"free": (), **options})
    files = {"output": (output, result.save_toml), "picture": (plot, result.save_picture)}
    _write_and_print(result, files, as_json)
    if result.not_identified and not as_json:
        named = ", ".join(result.not_identified)
        keys = counted(len(result.values), "key")
        warn([f"{len(result.not_identified)} of {keys} not identified: {named}"])
    warn(result.warnings if as_json else result.doubts)
    if result.status != "done":
        print_error(f"fit {result.status}: {result.reason}; do not trust the estimates")
    return result.exit_code


@command()
def sweep(
    scenario: str,
    overrides: list[str] | None = None,
    workers: int | None = None,
    dask: str | None = None,
    output: Path | None = None,
    csv: Path | None = None,
    no_clobber: bool = False,
    as_json: bool = False,
    quiet: bool = False,
    verbose: int = 0,
    **options: Any,
) -> int:
    """Run many combinations of values and write them to one file.

    SCENARIO           Scenario or its shipped name, or study with what is varied, in TOML; - reads
                       the standard input.
    --vary KEY=VALUES  Vary a key, or several keys of equal value (A,B=...): [0.1, 0.2],
                       lin(a, b, n), log(a, b, n); with --sample uniform(a, b), normal(m, s),
                       lognormal(m, s), triangular(a, c, b). May be repeated.
    --set
    --zip              Vary the keys together, not in all combinations.
    --sample N         Run a sample of N combinations from distributions.
    --method NAME      Draw the sample by sobol, lhs or random. [sobol]
    --seed N           Draw the sample from this random seed. [0]
    --indices          Run the N (keys + 2) combinations of Sobol indices.
    --workers --dask
    -o, --output FILE  Write the sweep to this file. [results/<name>-sweep.h5]
    --csv FILE         Write a table as CSV.
    --keep-series      Write the result of each run to the folder NAME.series beside NAME.h5.
    --no-clobber --json --quiet --verbose
    """
    from frictionsim.api.sweeping import study_from
    from frictionsim.io.output_file import SWEEP
    from frictionsim.sweeps.sweep_csv import files_of_sweep_in_csv

    if output == Path(STDIN):
        raise InputError("-o -: a sweep is written as HDF5, not printed; give a file name")
    source = load_scenario(scenario, overrides) if scenario == STDIN else scenario
    study = study_from(source, overrides, options)
    log_on_stderr(verbose)
    given: dict[str, Any] = {"no_clobber": no_clobber, "workers": workers, "dask": dask}
    with _target(output, scenario) as target:
        if csv is not None:
            tables = files_of_sweep_in_csv(csv, study.options.indices)
            files = {
                ("--csv" if path == csv else str(path)): (path, k) for path, k in tables.items()
            }
            _check_files({"-o": (target, SWEEP)} | files, no_clobber)
        warn(study.scenario.warnings())
        run = partial(fs.sweep, study, output=target, **given)
        return run_sweep(run, scenario, csv, as_json, quiet)


@contextmanager
def _target(output: Path | None, source: str) -> Iterator[Path]:
    """Return the context with the file to write; its new folder is removed if unused."""
    if output is not None:
        yield output
        return
    made = not RESULTS.is_dir()
    folder = made_folder()
    try:
        yield folder / f"{stem_of(source)}-sweep.h5"
    finally:
        if made:
            with suppress(OSError):  # there is something in it
                folder.rmdir()
