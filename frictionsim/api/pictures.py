"""Pictures of results from Python."""

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING

from frictionsim.api import result as results
from frictionsim.api.arguments import as_path
from frictionsim.io.atomic_write import check_no_clobber

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


def plot(
    result: results.Result | str | PathLike[str],
    view: str | None = None,
    *,
    body: int | None = None,
    ax: "Axes | None" = None,
) -> "Figure":
    """Draw a view of a result, as `frictionsim plot` does.

    Parameters
    ----------
    result : results.Result or path
    view : str, optional
        One of the views of its kind; an unknown one is refused with those that there are.
    body : int, optional
        Number of the body of a belt, for the view `body`.
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
    from frictionsim.plots import draw

    found = (
        result if isinstance(result, results.Result) else results.open(as_path("result", result))
    )
    return draw(found.record, view, body, ax=ax)


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
