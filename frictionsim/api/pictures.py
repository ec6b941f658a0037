"""Pictures of results and sweeps from Python."""

from collections.abc import Callable, Mapping, Sequence
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from frictionsim.api import result as results
from frictionsim.api.arguments import as_path
from frictionsim.api.sweep_result import Sweep, quantities_of, result_or_sweep, table_of
from frictionsim.errors import ArgumentError, InputError
from frictionsim.io.atomic_write import check_no_clobber

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from frictionsim.io.sweep_table import SweepTable
    from frictionsim.plots.overlay import Overlaid
    from frictionsim.plots.window import Extent

    Source = results.Result | Sweep | xarray.Dataset | str | PathLike[str]


def animate(
    source: "results.Result | str | PathLike[str]",
    path: str | PathLike[str],
    *,
    fps: float | None = None,
    speed: float | None = None,
    no_clobber: bool = False,
    progress: Callable[[int, int], None] | None = None,
) -> Path:
    """Write the mechanism of a result in motion, as `frictionsim plot --animate` does.

    Parameters
    ----------
    source : Result or path
        The result of a run.
    path : path
        Of the animation; it ends in .gif or .mp4, which needs the program ffmpeg.
    fps : float, optional
        Frames per second: 20 of a GIF, 30 of MP4.
    speed : float, optional
        Simulated seconds per second; by default the whole run takes 8 s.
    no_clobber : bool
        Do not replace an existing file.
    progress : callable, optional
        Is told the number of frames that are drawn, and of all.

    Returns
    -------
    Path
        The animation.

    Raises
    ------
    InputError
        If there is nothing to show, or no ffmpeg for MP4.
    OutputError
        If the file cannot be written, or would replace another kind of file.
    """
    from frictionsim.plots import animation

    target = as_path("animate", path)
    if no_clobber:
        check_no_clobber(target)
    animation.check_animation(target)
    if not isinstance(source, results.Result):
        source = results.open(as_path("result", source))
    animation.animate(source.record, target, fps, speed, progress, str(source.path or ""))
    return target


def plot(
    result: "Source | Sequence[Source]",
    view: str | None = None,
    *,
    body: int | None = None,
    at: Mapping[str, Any] | None = None,
    ax: "Axes | None" = None,
    width: str | None = None,
    height: str | None = None,
    dpi: float | None = None,
    style: str | None = None,
    title: bool = True,
    time: float | None = None,
    window: tuple[float | None, float | None] | None = None,
    channels: str | Sequence[str] | None = None,
) -> "Figure":
    """Draw a view of a result or a picture of a sweep, as `frictionsim plot` does.

    Parameters
    ----------
    result : Result, Sweep, xarray.Dataset or path; or a list of results
        A dataset is that of a sweep, or a part of it. Several results of
        one kind are drawn over each other, with a key, in a view over time.
    view : str, optional
        Of a result one of the views of its kind; of a sweep a quantity, or several with commas
        between them. An unknown one is refused with those that there are.
    body : int, optional
        Number of the body of a belt, for the view `body`.
    at : mapping, optional
        By varied key of a grid, the one value of it that is drawn.
    ax : Axes, optional
        Draw in the place of these axes, which are removed: a view may have several panels.
    width, height : str, optional
        Of the picture, as ``"84mm"``; the text keeps its size in points.
    dpi : float, optional
        Dots per inch.
    style : str, optional
        "paper", "talk", or "user" for the user's settings of matplotlib.
    title : bool
        False leaves it out.
    time : float, optional, s
        The instant that a view of one shows.
    window : pair of float or None, optional, s
        Start and end of what a view over time shows; None is the start or end of the run.
    channels : str or sequence of str, optional
        What a view over time draws instead of its own.

    Returns
    -------
    Figure
        Of matplotlib, without pyplot: notebooks show it, ``figure.savefig(path)`` saves it.

    Raises
    ------
    InputError
        If there is no such view, or the result lacks channels of it; if an option is not valid
        or does not apply to the view.

    Warns
    -----
    GlyphWarning
        If the fonts lack a character.
    """
    from warnings import warn

    from frictionsim.plots.appearance import appearance
    from frictionsim.plots.glyphs import GlyphWarning, faults_of
    from frictionsim.plots.window import extent

    look, shown = appearance(width, height, dpi, title, style), extent(time, window, channels)
    found = _found(result)
    if isinstance(found, list):
        check_no_choice(at)
        check_no_body(body, "these are several")
        from frictionsim.plots import draw_overlay

        figure = draw_overlay(found, view, ax, look, shown)
    elif isinstance(found, results.Result):
        check_no_choice(at)
        from frictionsim.plots import draw

        figure = draw(found.record, view, body, ax=ax, look=look, shown=shown)
    else:
        check_of_sweep(body, shown)
        from frictionsim.plots.sweep import draw_sweep

        figure = draw_sweep(found, quantities_of(view), at, ax=ax, look=look)
    for fault in getattr(figure, "faults", None) or (faults_of(figure) if ax is not None else ()):
        warn(fault, GlyphWarning, stacklevel=2)
    return figure


def _found(source: Any) -> "results.Result | SweepTable | list[Overlaid]":
    """Return what is drawn: a result, a sweep, or several results with their names."""
    if isinstance(source, list | tuple):
        if not source:
            raise ArgumentError("result", "expected a result or several, got an empty list")
        if len(source) > 1:
            return overlaid([(_name(one, i), _one(one)) for i, one in enumerate(source, 1)])
        (source,) = source
    return _one(source)


def _one(source: Any) -> "results.Result | SweepTable":
    if isinstance(source, results.Result):
        return source
    if isinstance(source, Sweep):
        return source.table
    if hasattr(source, "data_vars"):
        return table_of(source)
    opened = result_or_sweep(as_path("result", source))
    return opened if isinstance(opened, results.Result) else opened.table


def _name(source: Any, number: int) -> str:
    path = getattr(source, "path", source if isinstance(source, str | PathLike) else None)
    return str(path) if path is not None else f"result {number}"


def overlaid(found: "Sequence[tuple[str, results.Result | SweepTable | Sweep]]") -> Any:
    """Return several results as they are drawn over each other.

    Raises
    ------
    InputError
        If there is a sweep among them.
    """
    from frictionsim.plots.overlay import Overlaid

    for name, one in found:
        if not isinstance(one, results.Result):
            raise InputError(
                f"{name}: this is a sweep; only results of runs are drawn over each other, draw it"
                " alone"
            )
    return [Overlaid(name, one.record) for name, one in found if isinstance(one, results.Result)]


def check_no_choice(at: Mapping[str, Any] | None) -> None:
    if at:
        raise InputError(f"--at {next(iter(at))}: this is the result of a run; it is for sweeps")


def check_no_body(body: int | None, what: str) -> None:
    if body is not None:
        raise InputError(f"'body' is for a view of the result of a run, {what}")


def check_of_sweep(body: int | None, shown: "Extent") -> None:
    check_no_body(body, "this is a sweep")
    given = {"time": shown.time is not None, "window": shown.has_window}
    given |= {"channels": bool(shown.channels)}
    for name, is_given in given.items():
        if is_given:
            raise InputError(f"'{name}' is for a view of the result of a run, this is a sweep")
