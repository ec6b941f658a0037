"""Pictures of results and sweeps from Python."""

from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from frictionsim.api import result as results
from frictionsim.api.arguments import as_path
from frictionsim.api.opening import result_or_sweep
from frictionsim.errors import InputError
from frictionsim.io.atomic_write import check_no_clobber

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from frictionsim.io.sweep_table import SweepTable


def plot(
    result: "results.Result | xarray.Dataset | str | PathLike[str]",
    view: str | None = None,
    *,
    body: int | None = None,
    at: Mapping[str, Any] | None = None,
    ax: "Axes | None" = None,
) -> "Figure":
    """Draw a view of a result or a picture of a sweep, as `frictionsim plot` does.

    Parameters
    ----------
    result : results.Result, xarray.Dataset or path
        A dataset is that of a sweep, as `sweep` and `open_sweep` return it.
    view : str, optional
        Of a result one of the views of its kind; of a sweep a quantity, or several with commas
        between them. An unknown one is refused with those that there are.
    body : int, optional
        Number of the body of a belt, for the view `body`.
    at : mapping, optional
        By varied key of a grid, the one value of it that is drawn.
    ax : Axes, optional
        Draw in the place of these axes, which are removed: a view may have several panels.

    Returns
    -------
    Figure
        Of matplotlib, without pyplot: notebooks show it, ``figure.savefig(path)`` saves it.

    Raises
    ------
    InputError
        If there is no such view, or the result lacks channels of it.
    """
    found: results.Result | SweepTable
    if isinstance(result, results.Result):
        found = result
    elif hasattr(result, "data_vars"):
        from frictionsim.api.sweep_dataset import table_of

        found = table_of(result)
    else:
        opened = result_or_sweep(as_path("result", result))
        found = opened if isinstance(opened, results.Result) else opened.table
    if isinstance(found, results.Result):
        _check_no_choice(at)
        from frictionsim.plots import draw

        return draw(found.record, view, body, ax=ax)
    _check_no_body(body)
    from frictionsim.plots.sweep import draw_sweep

    return draw_sweep(found, quantities_of(view), at, ax=ax)


def quantities_of(view: str | None) -> list[str]:
    """Return the quantities that a view of a sweep names."""
    return [] if view is None else [name.strip() for name in view.split(",")]


def _check_no_choice(at: Mapping[str, Any] | None) -> None:
    if at:
        raise InputError(f"--at {next(iter(at))}: this is the result of a run; it is for sweeps")


def _check_no_body(body: int | None) -> None:
    if body is not None:
        raise InputError("'body' is for a view of the result of a run, this is a sweep")


def save_pictures(
    file: Path,
    path: Path | None,
    view: str | None,
    body: int | None,
    *,
    at: Mapping[str, Any],
    no_clobber: bool = False,
) -> tuple[list[Path], list[str]]:
    """Draw what a file holds, the result of a run or a sweep, into files.

    Parameters
    ----------
    file : Path
    path : Path or None
        By default FILE.png.
    view, body, at, no_clobber
        As of `save_views` and `save_pictures_of_sweep`.

    Returns
    -------
    list of Path
        The pictures that were written.
    list of str
        The reasons why other views were skipped.

    Raises
    ------
    InputError
        If nothing can be drawn.
    OutputError
        If a picture cannot be written.
    """
    found = result_or_sweep(file)
    path = path or file.with_suffix(".png")
    if isinstance(found, results.Result):
        _check_no_choice(at)
        return save_views(found, path, view, body, no_clobber=no_clobber)
    _check_no_body(body)
    return save_pictures_of_sweep(found.table, path, view, at, no_clobber=no_clobber)


def save_views(
    result: results.Result,
    path: Path,
    view: str | None,
    body: int | None,
    *,
    no_clobber: bool = False,
) -> tuple[list[Path], list[str]]:
    """Draw a view, or all of them, into files; each of all views into FILE-<view>.png.

    Parameters
    ----------
    result : Result
    path : Path
        Ends in .png, .pdf or .svg.
    view : str or None
        None is the first view of the kind, "all" all of them.
    body : int or None
        As of `plot`.
    no_clobber : bool
        Do not replace existing files.

    Returns
    -------
    list of Path
        The pictures that were written.
    list of str
        The reasons why other views were skipped.

    Raises
    ------
    InputError
        If no view can be drawn.
    OutputError
        If a picture cannot be written.
    """
    from frictionsim import plots
    from frictionsim.plots.picture_file import check_format, check_picture

    check_format(path)
    views = plots.views_of(result.kind)
    names = [plots.path_of(path, name) for name in views] if view == plots.ALL else [path]
    for name in names:
        if no_clobber:
            check_no_clobber(name)
        check_picture(name)
    if view == plots.ALL:
        return plots.plot_all(result.record, path, body)
    plots.plot(result.record, path, view, body)
    return [path], []


def save_pictures_of_sweep(
    table: "SweepTable",
    path: Path,
    view: str | None,
    at: Mapping[str, Any],
    *,
    no_clobber: bool = False,
) -> tuple[list[Path], list[str]]:
    """Draw a sweep into a file; with the view "all" each quantity into FILE-<quantity>.png.

    Parameters
    ----------
    table : SweepTable
    path : Path
        Ends in .png, .pdf or .svg.
    view : str or None
        Quantities with commas between them, or "all"; None is the first ones that vary.
    at : mapping
        As of `plot`.
    no_clobber : bool
        Do not replace existing files.

    Returns
    -------
    list of Path
        The pictures that were written.
    list of str
        The reasons why quantities were skipped.

    Raises
    ------
    InputError
        If there is no such quantity or value.
    OutputError
        If a picture cannot be written.
    """
    from frictionsim import plots
    from frictionsim.parameter_study.statistics import is_defined
    from frictionsim.plots.picture_file import check_format, check_picture, save
    from frictionsim.plots.sweep import draw_sweep

    check_format(path)
    wanted, reasons = {path: quantities_of(view)}, []
    if view == plots.ALL:
        names = [name for name in table.values if is_defined(table, name)]
        wanted = {plots.path_of(path, name): [name] for name in names}
        reasons = [
            f"{name} is not defined in any run" for name in table.values if name not in names
        ]
    for name in wanted:
        if no_clobber:
            check_no_clobber(name)
        check_picture(name)
    for name, quantities in wanted.items():
        save(draw_sweep(table, quantities, at), name)
    return list(wanted), reasons
