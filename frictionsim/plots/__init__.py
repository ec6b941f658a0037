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
from frictionsim.plots.appearance import USUAL, Appearance
from frictionsim.plots.belt_geometry import middle_of_first_span
from frictionsim.plots.picture_file import check_format, save
from frictionsim.plots.placement import drawn_in
from frictionsim.plots.time_history import response
from frictionsim.plots.window import WHOLE, Extent, check_channels, until, within
from frictionsim.scenario.kinds import mechanism_module

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure

    from frictionsim.results import Record

__all__ = ["ALL", "BODY", "VIEWS", "Views", "draw", "plot", "plot_all", "save", "views_of"]

ALL, BODY, PATH = "all", "body", "path"
MAX_DRAWN = 1e100

Views = Mapping[str, Callable[..., None]]
"""Functions `view(result, figure, **options)` by name."""

VIEWS: Mapping[str, Views] = {
    "pulley": {"response": pulley.response},
    "marble_machine": {"response": response, "torque": marble_machine.torque},
    "epicyclic": {"response": response, "torque": epicyclic.torque, "path": epicyclic.path},
    "belt_drive": {
        "speeds": belt_time_history.speeds,
        "drive": belt_layout.drive,
        "tension": belt_time_history.tension,
        BODY: belt_time_history.body,
    },
}


# To what a part of a result applies; views of other packages are drawn whole.
OF_AN_INSTANT = {("belt_drive", "drive"), ("belt_drive", "tension"), ("epicyclic", PATH)}
OF_A_WINDOW = {
    *(("epicyclic", "torque"), ("marble_machine", "torque")),
    *(("belt_drive", "speeds"), ("belt_drive", BODY)),
}
OF_CHANNELS = {("belt_drive", "speeds")}


def applies(kind: str, view: str) -> tuple[bool, bool, bool]:
    """Return whether a view takes a time, a window of time, and channels."""
    of, over_time = (kind, view), _is_response(kind, view)
    return of in OF_AN_INSTANT, over_time or of in OF_A_WINDOW, over_time or of in OF_CHANNELS


def _is_response(kind: str, view: str) -> bool:
    """Return whether a view is the one over time that any kind has, or the pulley's."""
    return views_of(kind)[view] in (response, pulley.response)


def check_applies(kind: str, view: str, shown: Extent) -> None:
    """Check that a view can show a part of a result.

    Raises
    ------
    InputError
        If it cannot; with the views of the kind that can.
    """
    given = shown.time is not None, shown.has_window, bool(shown.channels)
    words = (
        "shows no single instant; a time (--time)",
        "does not go over time; a window of time (--from, --to)",
        "draws channels of its own; a choice of channels (--channels)",
    )
    for place, (wanted, text) in enumerate(zip(given, words, strict=True)):
        if not wanted or applies(kind, view)[place]:
            continue
        fit = [name for name in views_of(kind) if applies(kind, name)[place]]
        others = f"is for the view {' or '.join(map(repr, fit))}" if fit else "is for other kinds"
        raise InputError(f"the view '{view}' {text} {others}")


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
    look: Appearance = USUAL,
    shown: Extent = WHOLE,
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
    look : Appearance
        Size and style of a new figure.
    shown : Extent
        The time, window or channels that are drawn.

    Returns
    -------
    Figure
        The whole figure, also if the view is drawn into a part of it.

    Raises
    ------
    InputError
        If the view or body does not exist, the result lacks samples or channels of the view, the
        figure is not empty, or the axes cannot be replaced. Figure and axes are then as before.
        If what is to be shown does not apply to the view.
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
    check_applies(kind, view, shown)
    _check_numbers(result)
    options: dict[str, Any] = {} if body is None else {BODY: body}
    if view == BODY and body is None and shown.has_window and "pulley_index" in result.channels:
        # That of the run's start, whatever its window.
        options = {BODY: middle_of_first_span(result.channels["pulley_index"][0])}
    part = result
    if shown.time is not None:
        part = until(result, shown.time)
        if view == PATH:
            options, part = {"instant": part}, result
    elif shown.has_window:
        part = within(result, shown.start, shown.stop)
    if shown.channels:
        check_channels(result, shown.channels)
        options["channels"] = shown.channels
    arranged = look._replace(fitted=True) if shown.channels else look
    return drawn_in(lambda target: views[view](part, target, **options), figure, ax, look=arranged)


def _check_numbers(result: "Record") -> None:
    """Raise InputError if a number is so large that a scale of it would overflow."""
    for name, values in [*result.channels.items(), *result.events.items()]:
        if isinstance(values, np.ndarray) and values.dtype.kind == "f":  # not one left in its file
            finite = values[np.isfinite(values)]
            if finite.size and max(finite.max(), -finite.min()) > MAX_DRAWN:
                raise InputError(
                    f"cannot draw this result: '{name}' has numbers above {MAX_DRAWN:g}"
                )


def plot(
    result: "Record",
    path: Path,
    view: str | None = None,
    body: int | None = None,
) -> None:
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
