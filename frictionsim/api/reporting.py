"""Reports: HTML files that show results in a browser."""

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from frictionsim.api.opening import names_of, opened, results_of_one_kind
from frictionsim.api.result import Result
from frictionsim.api.studies import Study, study_parts
from frictionsim.api.sweep_result import Sweep, sweep_parts
from frictionsim.errors import ArgumentError, InputError
from frictionsim.io.output_file import (
    COSTS,
    REPORT,
    SWEEP_IN_CSV,
    check_free,
    check_output,
    write_file,
)
from frictionsim.scenario.arguments import as_path

if TYPE_CHECKING:
    import xarray

    from frictionsim.io.cost_table import CostTable

    ReportSource = Result | str | PathLike[str]

SUFFIXES = (".html", ".htm")
MAX_RESULTS = 8  # there are no more colours to tell them apart


def report(
    source: "ReportSource | Study | Sweep | xarray.Dataset | Sequence[ReportSource]",
    path: str | PathLike[str],
    *,
    no_clobber: bool = False,
) -> Path:
    """Write a report as one HTML file, which a browser shows offline.

    Parameters
    ----------
    source : Result, Study, Sweep, xarray.Dataset or path, or sequence of results and paths
        The result of a run, a table of `frictionsim cost` in CSV, or a sweep; several
        results of one kind are compared.
    path : path
        HTML file, which ends in .html or .htm.
    no_clobber : bool
        Do not replace an existing file.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If the suffix is not .html or .htm, a file is no result, there are none or more than 8, or
        results differ in kind or are given twice.
    OutputError
        If the file cannot be written, would replace one that is no report, or is there with
        `no_clobber`.
    """
    target = as_path("path", path)
    if target.suffix.lower() not in SUFFIXES:
        raise InputError(f"{target}: expected a file name that ends in .html or .htm")
    several = isinstance(source, Sequence) and not isinstance(source, str)
    sources: Any = source if several else [source]
    html = _html(sources)
    if no_clobber:
        check_free(target, REPORT)
    check_output(target, REPORT)
    # A text that a foreign program wrote may hold what UTF-8 cannot.
    write_file(target, html.encode("utf-8", "backslashreplace"), REPORT)
    return target


def _html(sources: Sequence[Any]) -> str:
    if not sources:
        raise ArgumentError("source", "expected a result or several, got none")
    if len(sources) > MAX_RESULTS:
        raise InputError(
            f"a report compares at most {MAX_RESULTS} results, got {len(sources)}; give fewer,"
            " or run them as a sweep"
        )
    if len(sources) == 1:
        return _html_of_one(sources[0])
    places = [_place(source) for source in sources]
    for number, (source, place) in enumerate(zip(sources, places, strict=True)):
        if place in places[:number]:
            raise InputError(f"{source}: this result is given twice; compare it with another one")
    runs = [opened(source, Result, argument="source") for source in sources]
    return _html_of_runs(results_of_one_kind(runs))


def _place(source: Any) -> Any:
    """Return what is the same of a result that is given twice."""
    if isinstance(source, Result):
        return id(source)
    path = as_path("source", source)
    try:
        return path.resolve()
    except (OSError, RuntimeError):  # a link that leads to itself
        return path


def _html_of_one(source: Any) -> str:
    if isinstance(source, str | PathLike):
        path = as_path("source", source)
        if path.is_file() and COSTS.recognises(path):
            from frictionsim.io.cost_table import read_csv

            return _html_of_costs(read_csv(path), str(path))
        if path.is_file() and path.suffix == ".csv":
            words = "neither a table of 'frictionsim cost' nor a result"
            if SWEEP_IN_CSV.recognises(path):
                words = "a sweep in CSV; give its file in HDF5"
            raise InputError(f"{path}: cannot make a report: this is {words}")
    content = opened(source, Result, Sweep, Study, argument="source")
    if isinstance(content, Study):
        return _html_of_costs(content.table, "")
    return _html_of_sweep(content) if isinstance(content, Sweep) else _html_of_runs([content])


def _html_of_costs(table: "CostTable", source: str) -> str:
    from frictionsim.reports.study import cost_page

    return cost_page(table, study_parts(table), source)


def _html_of_sweep(sweep: Sweep) -> str:
    import numpy as np

    from frictionsim.reports.study import sweep_page

    with np.errstate(all="ignore"):  # of a file that holds extreme numbers: they are shown
        parts = sweep_parts(sweep.table, sweep.path)
        return sweep_page(sweep.table, parts, str(sweep.path or ""))


def _html_of_runs(runs: Sequence[Result]) -> str:
    """Return the report of results, with a comparison of several."""
    from frictionsim.reports.run import run_report
    from frictionsim.reports.run_tables import ReportedRun

    return run_report([*map(ReportedRun, runs, names_of(runs))])
