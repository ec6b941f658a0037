"""The command `sweep`, and `resume` of a sweep."""

import gc
import os
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from time import monotonic
from types import FrameType
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from frictionsim.cli.app import (
    AsJson,
    NoClobber,
    Overrides,
    Quiet,
    Scheduler,
    Verbose,
    WorkerCount,
    app,
)
from frictionsim.cli.completion import sampling_methods
from frictionsim.cli.messages import print_beside_files, print_error, warn, warn_of_name
from frictionsim.cli.monitor import SECONDS_FOR_ONE_SIGNAL, STOP_SIGNALS
from frictionsim.cli.sources import STDIN, load_scenario
from frictionsim.errors import (
    EXIT_SIGNAL,
    ArgumentError,
    InputError,
    OutputError,
)
from frictionsim.io.terminal import is_terminal

if TYPE_CHECKING:
    from frictionsim.api.sweep_result import Sweep
    from frictionsim.api.sweep_run import SweepProgress

RESULTS = Path("results")
MARK = "-sweep"


class Files(NamedTuple):
    """The files to write."""

    output: Path | None
    csv: Path | None
    no_clobber: bool


class ExecutionOptions(NamedTuple):
    """How the runs are distributed."""

    workers: int | None
    dask: str | None


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
            help="Vary a key, or several that have one value, as A,B=...: [0.1, 0.2],"
            " lin(a, b, n), log(a, b, n); with --sample uniform(a, b), normal(m, s),"
            " lognormal(m, s), triangular(a, c, b).",
        ),
    ] = None,
    overrides: Overrides = None,
    together: Annotated[
        bool, typer.Option("--zip", help="Vary the keys together, not in all combinations.")
    ] = False,
    sample: Annotated[
        int | None, typer.Option(metavar="N", help="Draw a sample of N runs of distributions.")
    ] = None,
    method: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Sampling method: sobol, lhs or random. [sobol]",
            autocompletion=sampling_methods,
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
        typer.Option("--keep-series", help="Keep the result of each run in a folder FILE.series."),
    ] = False,
    no_clobber: NoClobber = False,
    as_json: AsJson = False,
    quiet: Quiet = False,
    verbose: Verbose = 0,
) -> int:
    """Run a scenario for many combinations of values and write them to one file."""
    from frictionsim.api.sweep_run import check_workers, run_study
    from frictionsim.api.sweeping import study_from

    check_workers(workers, dask)
    if output == Path(STDIN):
        raise InputError("-o -: a sweep is an HDF5 file, it is not printed; give a file name")
    given = {
        "zip": together, "sample": sample, "method": method, "seed": seed, "indices": indices,
        "keep_series": keep_series,
    }  # fmt: skip
    study = study_from(
        source if source != STDIN else load_scenario(source, overrides),
        _varied(vary or []),
        overrides,
        given,
    )
    files = Files(output, csv, no_clobber)

    def run(target: Path, progress: Any) -> "Sweep":
        return run_study(study, target, no_clobber, progress, workers, dask)

    with _target(output, source) as target:
        _check_csv(files, target, indices=study.sampling is not None and study.sampling.indices)
        warn(study.scenario.warnings())
        return _run(run, target, files, OutputOptions(source, as_json, quiet, verbose))


class OutputOptions(NamedTuple):
    """What is printed."""

    source: str
    as_json: bool
    quiet: bool
    verbose: int


def _varied(options: list[str]) -> dict[str, str]:
    """Return the values of --vary by key."""
    found: dict[str, str] = {}
    for option in options:
        key, sign, values = option.partition("=")
        key = key.strip()
        if not sign or not key:
            raise ArgumentError("vary", f"expected KEY=VALUES, as a.b=[1, 2], got '{option}'")
        if key in found:
            raise ArgumentError("vary", f"{key} is given twice; give all its values in one list")
        found[key] = values
    return found


@contextmanager
def _target(output: Path | None, source: str) -> Iterator[Path]:
    """Return the context with the file to write; a folder made for it is removed if unused."""
    if output is not None:
        yield output
        return
    made = not RESULTS.is_dir()
    try:
        RESULTS.mkdir(exist_ok=True)
    except OSError as error:
        raise OutputError(
            f"cannot create the folder '{RESULTS}' ({error.strerror}); give a file with -o"
        ) from None
    try:
        yield RESULTS / f"{'stdin' if source == STDIN else Path(source).stem}{MARK}.h5"
    finally:
        if made:
            with suppress(OSError):  # there is something in it
                RESULTS.rmdir()


def _check_csv(files: Files, target: Path, *, indices: bool) -> None:
    if files.csv is None:
        return
    from frictionsim.io.atomic_write import check_no_clobber
    from frictionsim.io.replaceable import check_apart, check_target, files_of_sweep_in_csv

    check_apart({"-o": target, "--csv": files.csv})
    for path, kind in files_of_sweep_in_csv(files.csv, indices).items():
        if files.no_clobber:
            check_no_clobber(path)
        check_target(path, kind)


def resume_sweep(path: Path, files: Files, ways: ExecutionOptions, shown: OutputOptions) -> int:
    """Do the runs that are left of a sweep, for the command `resume`.

    Returns
    -------
    int
        The exit code.
    """
    from frictionsim.api.sweep_run import check_workers, resume_study

    check_workers(*ways)

    def run(target: Path, progress: Any) -> "Sweep":
        return resume_study(path, files.output, files.no_clobber, progress, *ways)

    return _run(run, path, files, shown)


def _run(
    run: "Callable[[Path, Any], Sweep]", target: Path, files: Files, shown: OutputOptions
) -> int:
    """Run a sweep, and print what it comes to."""
    from frictionsim.cli.log_lines import log_on_stderr

    log_on_stderr(shown.verbose)
    gc.enable()  # the program does without, as its commands end soon; a sweep may take days
    with _Monitor(not (shown.quiet or shown.as_json)) as monitor:
        swept = run(target, monitor)
        if files.csv is not None:
            swept.save_csv(files.csv)
    _print(swept, files, shown)
    if monitor.signal:
        return EXIT_SIGNAL + monitor.signal
    return swept.exit_code


def _print(swept: "Sweep", files: Files, shown: OutputOptions) -> None:
    """Print the summary, and how many runs have failed."""
    if shown.as_json:
        csv = None if files.csv is None else str(files.csv)
        print_beside_files(swept.to_json() | {"scenario": shown.source, "csv": csv})
    elif not shown.quiet:
        print_beside_files(swept.summary())
    warn_of_name(swept.path)
    for failures in swept.failures:
        print_error(f"warning: {failures}")


class _Monitor:
    """The progress of a sweep: shows a bar, and ends the sweep at a stop signal.

    Before the first call there is nothing to keep: a signal ends the process at once.
    """

    def __init__(self, with_bar: bool) -> None:
        self.signal, self._signalled = 0, 0.0
        self._with_bar = with_bar and is_terminal(sys.stderr)
        self._bar: Any = None
        self._replaced: dict[int, Any] = {}

    def __enter__(self) -> "_Monitor":
        # Those of the program around it: within a sweep, that of `fs.sweep` may be in the place.
        self._before = {number: signal.getsignal(number) for number in STOP_SIGNALS}
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._replaced.items():
            signal.signal(number, handler)
        if self._bar is not None:
            self._bar.__exit__(None, None, None)

    def __call__(self, found: "SweepProgress") -> None:
        if found.checked >= found.total and not self._replaced:
            self._handle_signals()
        if self.signal:
            from frictionsim.api.sweep_run import SweepInterrupted

            raise SweepInterrupted(self.signal)
        if self._with_bar:
            if self._bar is None:
                from frictionsim.api.progress import SweepBar

                self._bar = SweepBar().__enter__()
            self._bar(found)

    def _handle_signals(self) -> None:
        for number, before in self._before.items():
            if before not in (signal.SIG_IGN, None):
                signal.signal(number, self._on_signal)
                self._replaced[number] = before

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        if self.signal:
            if monotonic() - self._signalled > SECONDS_FOR_ONE_SIGNAL:
                os._exit(EXIT_SIGNAL + number)  # the journal has what was done
            return
        self.signal, self._signalled = number, monotonic()
