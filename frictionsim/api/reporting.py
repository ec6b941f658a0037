"""Reports: HTML files that show results in a browser."""

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from frictionsim.api import result as results
from frictionsim.api.result import result_or_sweep
from frictionsim.api.result_names import files_of, names_of
from frictionsim.api.studies import Study
from frictionsim.api.sweep_result import Sweep, sweep_parts
from frictionsim.errors import ArgumentError, InputError
from frictionsim.io.output_file import REPORT, check_free, check_output, write_file
from frictionsim.io.sweep_table import SweepTable
from frictionsim.scenario.options import as_path

if TYPE_CHECKING:
    import xarray

    from frictionsim.io.cost_table import CostTable
    from frictionsim.reports.run_tables import ReportedRun


def study_html(source: Any) -> str | None:
    """Return the report of a cost study, a sweep or a file; None of the result of a run.

    Parameters
    ----------
    source : object
        A Study, a Sweep or its dataset, or a path.

    Raises
    ------
    InputError
        If the file is damaged.
    """
    if isinstance(source, Study):
        return _costs_html(source.table, "")
    if isinstance(source, Sweep):
        return _sweep_html(source)
    if hasattr(source, "data_vars"):
        from frictionsim.api.dataset import sweep_table

        return _sweep_html(Sweep(sweep_table(source)))
    return None if isinstance(source, results.Result) else _file_html(as_path("result", source))


def _file_html(path: Path) -> str:
    from frictionsim.io.cost_table import read_csv
    from frictionsim.io.names import existing_name
    from frictionsim.io.output_file import COSTS, SWEEP_IN_CSV
    from frictionsim.io.sweep_file import read_any

    if path.is_file() and COSTS.recognises(path):
        table = read_csv(path)
        # A table of an earlier version does not name its study.
        named = table if table.title or table.kind else table._replace(title=path.name)
        return _costs_html(named, str(path))
    if path.is_file() and path.suffix == ".csv":
        words = "neither a table of 'frictionsim cost' nor a result"
        if SWEEP_IN_CSV.recognises(path):
            words = "a sweep in CSV; give its file in HDF5"
        raise InputError(f"{path}: cannot make a report: this is {words}")
    path = existing_name(path)
    content = read_any(path)
    if isinstance(content, SweepTable):
        return _sweep_html(Sweep(content, path))
    return _html_of_runs([results.Result(content, path)])


def _costs_html(table: "CostTable", source: str) -> str:
    from frictionsim.api.studies import study_parts
    from frictionsim.reports.study import cost_page

    return cost_page(table, study_parts(table), source)


def _sweep_html(sweep: Sweep) -> str:
    import numpy as np

    from frictionsim.reports.study import sweep_page

    with np.errstate(all="ignore"):  # of a file that holds extreme numbers: they are shown
        parts = sweep_parts(sweep.table, sweep.path)
        return sweep_page(sweep.table, parts, str(sweep.path or ""))


SUFFIXES = (".html", ".htm")
MAX_RESULTS = 8  # there are no more colours to tell them apart

ReportSource = results.Result | str | PathLike[str]


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
        If the suffix is not .html or .htm, a file is no result, or results differ in kind or are
        given twice.
    OutputError
        If the file cannot be written, or would replace one that is no report.
    """
    target = as_path("report", path)
    if target.suffix.lower() not in SUFFIXES:
        raise InputError(f"{target}: expected a file name that ends in .html or .htm")
    html = _html(source)
    if no_clobber:
        check_free(target, REPORT)
    check_output(target, REPORT)
    # A text that a foreign program wrote may hold what UTF-8 cannot.
    write_file(target, html.encode("utf-8", "backslashreplace"), REPORT)
    return target


def _html(source: Any) -> str:
    """Return the report of a source, by its type."""
    several = isinstance(source, Sequence) and not isinstance(source, str)
    sources = list(source) if several else [source]
    if len(sources) == 1:
        html = study_html(sources[0])
        if html is not None:
            return html
    return _html_of_runs(_opened(sources))


def _check_count(sources: Sequence[ReportSource]) -> None:
    if not sources:
        raise ArgumentError("result", "expected a result or several, got none")
    if len(sources) > MAX_RESULTS:
        raise InputError(
            f"a report compares at most {MAX_RESULTS} results, got {len(sources)}; give fewer,"
            " or run them as a sweep"
        )


def _opened(sources: Sequence[ReportSource]) -> list[results.Result]:
    """Return the given results; files are read.

    Raises
    ------
    InputError
        If a file is not a result, or given twice.
    """
    _check_count(sources)
    _check_apart(sources)
    return [_result_of(source) for source in sources]


def _result_of(source: ReportSource) -> results.Result:
    if isinstance(source, results.Result):
        return source
    opened = result_or_sweep(as_path("result", source))
    if isinstance(opened, Sweep):
        raise InputError(
            f"{source}: a sweep is not compared with results of runs; report it by itself, or vary"
            " more keys in one sweep"
        )
    return opened


def _check_apart(sources: Sequence[ReportSource]) -> None:
    """Check that no result is given twice."""
    keys = set()
    for source in sources:
        key = id(source) if isinstance(source, results.Result) else _place(source)
        if key in keys:
            raise InputError(f"{source}: this result is given twice; compare it with another one")
        keys.add(key)


def _place(source: str | PathLike[str]) -> Path:
    try:
        return as_path("result", source).resolve()
    except (OSError, RuntimeError):  # a link that leads to itself
        return as_path("result", source)


def _html_of_runs(runs: Sequence[results.Result]) -> str:
    """Return the report of results, with a comparison of several.

    Raises
    ------
    InputError
        If the results are of unlike kinds.
    """
    from frictionsim.reports.run import run_report

    kinds = list(dict.fromkeys(result.kind for result in runs))
    if len(kinds) > 1:
        a = next(result for result in runs if result.kind == kinds[0])
        b = next(result for result in runs if result.kind == kinds[1])
        raise InputError(
            f"cannot compare results of unlike kinds: {_name(a)} is of kind {a.kind},"
            f" {_name(b)} of kind {b.kind}; give results of one kind"
        )
    labels = names_of([run.record for run in runs], files_of([run.path for run in runs]))
    return run_report([_reported(*pair) for pair in zip(runs, labels, strict=True)])


def _name(result: results.Result) -> str:
    return str(result.path or result.title or "a result")


def _reported(result: results.Result, label: str) -> "ReportedRun":
    from frictionsim.reports.run_tables import ReportedRun

    try:
        effects = result.effects
    except InputError:  # of an old file whose scenario is not valid any more
        effects = ()
    estimate = result._estimate
    return ReportedRun(
        result.record,
        result.path,
        label,
        effects,
        result.errors,
        result.error_estimate,
        estimate.other_mesh if estimate else None,
    )
