"""Reports: HTML files that show results in a browser."""

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from frictionsim.api import result as results
from frictionsim.api.arguments import as_path
from frictionsim.io.atomic_write import check_no_clobber, write_atomically
from frictionsim.io.replaceable import REPORT, check_target

if TYPE_CHECKING:
    import xarray

    from frictionsim.api.studies import Study


def report(
    source: "results.Result | Study | xarray.Dataset | str | PathLike[str]",
    path: str | PathLike[str],
    *,
    no_clobber: bool = False,
) -> Path:
    """Write a report that any browser shows without a network, as `frictionsim report` does.

    Parameters
    ----------
    source : Result, Study, xarray.Dataset or path
        The result of a run, a table of `frictionsim cost` in CSV or HDF5, or a sweep.
    path : path
        Of the HTML file.
    no_clobber : bool
        Do not replace an existing file.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        If there is nothing to show.
    OutputError
        If the file cannot be written, or would replace one that is no report.
    """
    target = as_path("report", path)
    if no_clobber:
        check_no_clobber(target)
    check_target(target, REPORT)
    write_atomically(_html_of(source).encode(), target, REPORT.word)
    return target


def _html_of(source: Any) -> str:
    from frictionsim.api.study_reports import study_html

    html = study_html(source)
    if html is not None:
        return html
    if not isinstance(source, results.Result):
        source = results.open(as_path("result", source))
    return _html(source)


def _html(result: results.Result) -> str:
    from frictionsim.api.tables import as_html, summary
    from frictionsim.reports.page import page
    from frictionsim.reports.run_report import data_of

    title = result.title or result.kind
    return page(title, as_html(summary(result)), data_of([result.record]))
