"""Pictures of result files; the only package that imports matplotlib.

A kind of mechanism has one or more views, each a function that draws a result into an empty
figure or subfigure: `view(result, figure, **options)`. The first is the default. A kind that is not
in VIEWS may have a mapping VIEWS in its module; without one, its channels are drawn over time.

`draw` returns a matplotlib figure, which needs no pyplot: a notebook shows it as the value of a
cell, `figure.savefig(path)` saves it, and it can be pickled. Threads may draw and save different
figures at once; `save` and `plot` write the same bytes as in one thread.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import frictionsim.plots.parameters  # noqa: F401  says what matplotlib lacks
from frictionsim.errors import InputError
from frictionsim.plots import belt_layout, belt_time_history, epicyclic, marble_machine, pulley
from frictionsim.plots.picture_file import check_format, save
from frictionsim.plots.placement import drawn_in
from frictionsim.plots.time_history import response
from frictionsim.scenario.kinds import mechanism_module

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure

    from frictionsim.results import Record

__all__ = ["ALL", "BODY", "VIEWS", "Views", "draw", "plot", "plot_all", "save", "views_of"]

ALL, BODY = "all", "body"
MAX_DRAWN = 1e100

Views = Mapping[str, Callable[..., None]]
"""Functions `view(result, figure, **options)` by name."""

VIEWS: Mapping[str, Views] = {
    "pulley": {"response": pulley.response},
    "marble_machine": {"response": response, "torque": marble_machine.torque},
    "epicyclic": {
        "response": epicyclic.response,
        "torque": epicyclic.torque,
        "path": epicyclic.path,
    },
    "belt_drive": {
        "speeds": belt_time_history.speeds,
        "drive": belt_layout.drive,
        "tension": belt_time_history.tension,
        BODY: belt_time_history.body,
    },
}


def views_of(kind: str) -> Views:
    """Return the views of a kind by name, the default first.

    Raises
    ------
    InputError
        If the kind is unknown.
    """
    if kind in VIEWS:
        return VIEWS[kind]
    try:
        module = mechanism_module(kind)
    except InputError as error:
        raise InputError(f"cannot draw this result: {error}") from None
    own: Views = getattr(module, "VIEWS", {})
    return {"response": response, **own}


def draw(
    result: "Record",
    view: str | None = None,
    body: int | None = None,
    figure: "Figure | SubFigure | None" = None,
    ax: Any = None,
) -> "Figure":
    """Draw a view of a result as a matplotlib figure.

    Show it as the value of a notebook's cell; save it with `figure.savefig("a.png")`. In a figure
    with constrained layout (`plt.subplots(2, 2, layout="constrained")`) the view is arranged again
    when the figure changes; in others once, when it is drawn. A part of a figure should be at least
    5 inches wide and high.

    Parameters
    ----------
    result : Record
    view : str, optional
        One of `views_of` the kind; the default is the first.
    body : int, optional
        Number of the body of a belt that the view `body` shows.
    figure : Figure or SubFigure, optional
        An empty one to draw into; a Figure gets the height of the view. The default is a new one.
    ax : Axes, optional
        Empty Axes of a grid, as of `plt.subplots`: the view takes their place.

    Returns
    -------
    Figure
        The whole figure, also if the view is drawn into a part of it.

    Raises
    ------
    InputError
        If the view or body does not exist, the result lacks samples or channels of the view, the
        figure is not empty, or the axes cannot be replaced. Figure and axes are then as before.
    """
    kind = result.attributes["kind"]
    views = views_of(kind)
    view = view or next(iter(views))
    if view not in views:
        raise InputError(f"unknown view '{view}' of kind '{kind}'; known: {', '.join(views)}")
    if body is not None and view != BODY:
        raise InputError(f"the view '{view}' shows no single body; 'body' is for the view '{BODY}'")
    if not result.channels["time"].size:
        raise InputError("cannot draw this result: it has no samples")
    _check_numbers(result)
    options = {} if body is None else {BODY: body}
    return drawn_in(lambda target: views[view](result, target, **options), figure, ax)


def _check_numbers(result: "Record") -> None:
    """Raise InputError if a number is so large that a scale of it would overflow."""
    for name, values in [*result.channels.items(), *result.events.items()]:
        if isinstance(values, np.ndarray) and values.dtype.kind == "f":  # not one left in its file
            finite = values[np.isfinite(values)]
            if finite.size and max(finite.max(), -finite.min()) > MAX_DRAWN:
                raise InputError(
                    f"cannot draw this result: '{name}' has numbers above {MAX_DRAWN:g}"
                )


def plot(result: "Record", path: Path, view: str | None = None, body: int | None = None) -> None:
    """Write the picture of a view of a result.

    Parameters
    ----------
    result : Record
    path : Path
        Ends in .png, .pdf or .svg.
    view : str, optional
        One of `views_of` the kind; the default is the first.
    body : int, optional
        Number of the body of a belt that the view `body` shows.

    Raises
    ------
    InputError
        If the format, view or body does not exist, or the result lacks channels of the view.
    OutputError
        If the picture cannot be written.
    """
    check_format(path)
    save(draw(result, view, body), path)


def path_of(path: Path, view: str) -> Path:
    """Return the picture of a view if all views are drawn: FILE-<view>.png for FILE.png."""
    return path.with_name(f"{path.stem}-{view}{path.suffix}")


def plot_all(result: "Record", path: Path, body: int | None = None) -> tuple[list[Path], list[str]]:
    """Draw all views of a result, each into its own file: FILE-<view>.png for FILE.png.

    Parameters
    ----------
    result : Record
    path : Path
        Ends in .png, .pdf or .svg.
    body : int, optional
        As in `plot`.

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
    check_format(path)
    written, reasons = [], []
    for view in views_of(result.attributes["kind"]):
        picture = path_of(path, view)
        try:
            plot(result, picture, view, body if view == BODY else None)
        except InputError as error:
            reasons.append(str(error))
        else:
            written.append(picture)
    if not written:
        raise InputError("\n".join(reasons))
    return written, reasons
