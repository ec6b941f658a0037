"""`frictionsim cost`: interprets the options, runs the study and writes its files."""

import sys
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from frictionsim.cli.monitor import monitor_run
from frictionsim.errors import InputError, OutputError, unknown
from frictionsim.io.atomic_write import check_no_clobber, check_writable
from frictionsim.scenario.kinds import mechanism_module
from frictionsim.scenario.methods import laws_of, methods_of
from frictionsim.scenario.variants import TOLERANCES, Setting
from frictionsim.work_precision import settings as ladder
from frictionsim.work_precision.report import write_csv
from frictionsim.work_precision.study import Study, study

if TYPE_CHECKING:
    from frictionsim.scenario.settings import Scenario


class Options(NamedTuple):
    """The options of the command line, not yet interpreted."""

    backends: str | None
    laws: str | None
    tolerances: str | None
    max_wall: float
    repeats: int
    output: Path | None
    csv: Path | None
    plot: Path | None
    no_clobber: bool = False


def study_scenario(scenario: "Scenario", options: Options) -> Study:
    """Run the study that the options ask for.

    Parameters
    ----------
    scenario : Scenario
    options : Options

    Returns
    -------
    Study

    Raises
    ------
    InputError, OutputError
        If an option is invalid or a file cannot be written; before anything is run.
    SolverError
        If all reference runs fail.
    """
    if not isfinite(options.max_wall) or options.max_wall <= 0.0:
        raise InputError(f"--max-wall: expected a number above 0 s, got {options.max_wall:g}")
    tolerances = _tolerances(options.tolerances)
    methods = _named("--backends", "backend", options.backends, methods_of(scenario.PAIRS))
    laws = _named("--laws", "friction law", options.laws, laws_of(scenario.PAIRS))
    _check_targets(options)
    kind = mechanism_module(scenario.kind)
    metrics = _metrics(kind, scenario)
    settings = [
        setting
        for setting in _ladders(kind, scenario, tolerances)
        if setting.backend in methods and (not setting.law or setting.law in laws)
    ]
    rtol = min(tolerances) * ladder.REFERENCE_REFINEMENT
    with (
        monitor_run(scenario.solver.duration, with_progress=False, max_wall=None) as on_step,
        _StatusLine() as show,
    ):
        return study(
            scenario,
            settings,
            _references(kind, scenario, rtol),
            metrics,
            options.max_wall,
            options.repeats,
            on_step,
            show,
        )


def write_files(result: Study, options: Options) -> None:
    """Write the files that the options ask for.

    Parameters
    ----------
    result : Study
    options : Options

    Raises
    ------
    OutputError
    """
    if options.output is not None:
        from frictionsim.io import hdf5_writer
        from frictionsim.work_precision.report import columns

        hdf5_writer.write_table(result.scenario, columns(result), result.status, options.output)
    if options.csv is not None:
        write_csv(result, options.csv)
    if options.plot is not None:
        from frictionsim.plots.work_precision import draw

        draw(result, options.plot)


def _ladders(kind: Any, scenario: "Scenario", tolerances: tuple[float, ...]) -> list[Setting]:
    if hasattr(kind, "ladders"):
        found: list[Setting] = kind.ladders(scenario, tolerances)
        return found
    return ladder.ladders(scenario, tolerances, kind.build(scenario))


def _references(kind: Any, scenario: "Scenario", rtol: float) -> tuple[Setting, ...]:
    if hasattr(kind, "references"):
        found: tuple[Setting, ...] = kind.references(scenario, rtol)
        return found
    return ladder.references(scenario, kind.build(scenario), rtol)


def _metrics(kind: Any, scenario: "Scenario") -> Any:
    if not hasattr(kind, "METRICS"):
        raise InputError(f"cost: the kind '{scenario.kind}' defines no error metrics")
    return kind.METRICS


def _tolerances(text: str | None) -> tuple[float, ...]:
    if text is None:
        return TOLERANCES
    try:
        found = tuple(float(part) for part in text.split(","))
    except ValueError:
        raise InputError(
            f"--tolerances: expected numbers separated by commas, as 1e-3,1e-6, got '{text}'"
        ) from None
    if not all(ladder.TIGHTEST <= rtol <= ladder.LOOSEST for rtol in found):
        raise InputError(
            f"--tolerances: expected numbers from {ladder.TIGHTEST:g} to {ladder.LOOSEST:g},"
            f" got '{text}'"
        )
    return tuple(sorted(set(found), reverse=True))


def _named(option: str, what: str, text: str | None, known: tuple[str, ...]) -> tuple[str, ...]:
    """Return the names in the value of an option; all known ones without a value."""
    if text is None:
        return known
    names = tuple(part.strip() for part in text.split(","))
    for name in names:
        if name not in known:
            raise InputError(f"{option}: {unknown(what, name, list(known))}")
    return names


def _check_targets(options: Options) -> None:
    """Check that the files can be written, before the study runs."""
    if options.no_clobber:
        for target in (options.output, options.csv, options.plot):
            if target is not None:
                check_no_clobber(target)
    if options.output is not None:
        check_writable(options.output)
    if options.plot is not None and options.plot.suffix.lower() not in (".png", ".pdf", ".svg"):
        raise InputError(f"{options.plot}: expected a picture name that ends in .png, .pdf or .svg")
    for target in (options.csv, options.plot):
        if target is not None and not target.parent.is_dir():
            raise OutputError(f"{target}: cannot write here: there is no folder '{target.parent}'")
        if target is not None and target.is_dir():
            raise OutputError(f"{target}: this is a folder; give a file name")


class _StatusLine:
    """Shows the current setting in one line of a terminal; the line is erased at the end."""

    def __enter__(self) -> "_StatusLine":
        self._shown = sys.stderr.isatty()
        return self

    def __call__(self, text: str) -> None:
        if self._shown:
            print(f"\r\x1b[K{text}", end="", file=sys.stderr, flush=True)

    def __exit__(self, *_: object) -> None:
        if self._shown:
            print("\r\x1b[K", end="", file=sys.stderr, flush=True)
