"""Pictures of result files; the only package that imports matplotlib.

A kind of mechanism has one or more views, each a function that draws a result; the first is the
default. For a kind that is not in VIEWS, the channels are drawn over time.
"""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from frictionsim.errors import InputError
from frictionsim.plots import belt_layout, belt_time_history, epicyclic, marble_machine, pulley
from frictionsim.plots.style import check_format, save
from frictionsim.plots.time_history import response
from frictionsim.scenario.kinds import KINDS

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from frictionsim.results import Record

ALL, BODY = "all", "body"

Views = Mapping[str, Callable[..., "Figure"]]
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


def views_of(kind: str) -> Views:
    """Return the views of a kind by name, the default first.

    Raises
    ------
    InputError
        If the kind is unknown.
    """
    if kind in VIEWS:
        return VIEWS[kind]
    if kind not in KINDS:
        raise InputError(
            f"cannot draw a result of kind '{kind}'; known: {', '.join({**VIEWS, **KINDS})}"
        )
    return {"response": response}


def plot(result: "Record", path: Path, view: str | None = None, body: int | None = None) -> None:
    """Draw a view of a result.

    Parameters
    ----------
    result : Result
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
    kind = result.attributes["kind"]
    views = views_of(kind)
    view = view or next(iter(views))
    if view not in views:
        known = ", ".join([*views, ALL])
        raise InputError(f"unknown view '{view}' of kind '{kind}'; known: {known}")
    if body is not None and view != BODY:
        raise InputError(f"the view '{view}' shows no single body; use --body with '{BODY}'")
    if not result.channels["time"].size:
        raise InputError("cannot draw this result: it has no samples")
    figure = views[view](result) if body is None else views[view](result, body)
    save(figure, path)


def plot_all(result: "Record", path: Path, body: int | None = None) -> tuple[list[Path], list[str]]:
    """Draw all views of a result, each into its own file: FILE-<view>.png for FILE.png.

    Parameters
    ----------
    result : Result
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
        picture = path.with_name(f"{path.stem}-{view}{path.suffix}")
        try:
            plot(result, picture, view, body if view == BODY else None)
        except InputError as error:
            reasons.append(str(error))
        else:
            written.append(picture)
    if not written:
        raise InputError("\n".join(reasons))
    return written, reasons
