"""Pictures of results and sweeps: as figures from Python, in files as `frictionsim plot` does."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from pydantic import BeforeValidator, Field

from frictionsim.api import result as results
from frictionsim.api.result import result_or_sweep
from frictionsim.api.sweep_result import Sweep, quantities_of
from frictionsim.errors import ArgumentError, InputError
from frictionsim.io.output_file import ANIMATIONS, PICTURE, check_apart, check_free
from frictionsim.plots import (
    ALL,
    check_applies,
    check_overlaid,
    check_view,
    draw,
    draw_overlay,
    views_of,
    views_of_overlay,
    views_with_effects,
)
from frictionsim.plots.overlay import Overlaid, check_overlay
from frictionsim.plots.picture_file import check_format, check_picture, save
from frictionsim.plots.style import Appearance
from frictionsim.plots.sweep import draw_sweep
from frictionsim.plots.view import Extent
from frictionsim.scenario.options import as_list, as_path, by_name, text_of
from frictionsim.sweeps.statistics import is_defined

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from frictionsim.io.sweep_table import SweepTable

    PictureSource = results.Result | Sweep | xarray.Dataset | str | PathLike[str]
    Drawings = Mapping[Path, Callable[[], Figure]]


FIRST: tuple[None] = (None,)  # where no view is named


def _views_given(given: Any) -> tuple[str, ...]:
    views = [given] if isinstance(given, str) else as_list(given)
    for view in views:
        if not isinstance(view, str):
            raise ValueError(f"expected the name of a view, got {text_of(view)}")
    return tuple(views)


class PlotOptions(Appearance, Extent):
    """Options of `plot` and `animate`.

    Attributes
    ----------
    view : tuple of str
        Views of a result, also with commas between them; of a sweep quantities, one picture
        per entry. "all" draws each view or quantity.
    body, at
        As for `plot`.
    fps, speed
        As for `animate`.
    """

    view: Annotated[tuple[str, ...], BeforeValidator(_views_given)] = ()
    body: int | None = None
    at: Annotated[
        dict[str, Any], BeforeValidator(by_name("KEY=VALUE, e.g. mechanism.load=2000", str))
    ] = Field({})
    fps: float | None = None
    speed: float | None = None

    def check_for(self, drawn: str) -> None:
        """Raise ArgumentError if an option does not apply to a subject, a key of `APPLY`."""
        for name, field in type(self).model_fields.items():
            if name not in APPLY[drawn] and getattr(self, name) != field.default:
                fit = " or ".join(other for other, names in APPLY.items() if name in names)
                raise ArgumentError(name, f"it applies to {fit}, not to {drawn}")


APPEARANCE_OPTIONS, SHOWN = set(Appearance.model_fields), set(Extent.model_fields)
APPLY = {
    "the result of a run": APPEARANCE_OPTIONS | SHOWN | {"view", "body"},
    "several results": APPEARANCE_OPTIONS | SHOWN | {"view"},
    "a sweep": APPEARANCE_OPTIONS | {"view", "at"},
    "an animation": {"fps", "speed"},
}
"""The options that apply, by what is drawn."""


class SavedPictures(NamedTuple):
    """The written pictures and the skipped views.

    Attributes
    ----------
    pictures : list of Path
    skipped : list of str
        For each view left out of "all", the reason.
    """

    pictures: list[Path]
    skipped: list[str]


def save_pictures(
    files: Sequence[Path], path: Path | None, options: PlotOptions, *, no_clobber: bool = False
) -> SavedPictures:
    """Write pictures of the result of a run, of a sweep, or of several results.

    Parameters
    ----------
    files : sequence of Path
    path : Path or None
        Ends in .png, .pdf or .svg. Each of several views, or a single named view without a path,
        is written to FILE-<view>.png.
    options : PlotOptions
    no_clobber : bool
        Do not replace existing files.

    Raises
    ------
    InputError
        If nothing can be drawn, or two pictures would be one file.
    OutputError
        If a picture cannot be written.
    """
    if path is not None:
        check_format(path)
    results_by_name = [(str(file), result_or_sweep(file)) for file in files]
    place = _PictureTarget(path or _default(files), path is not None, no_clobber)
    (_, first), *others = results_by_name
    if others:
        options.check_for("several results")
        return _save_overlays(overlaid(results_by_name), place, options)
    if isinstance(first, Sweep):
        options.check_for("a sweep")
        return _save_sweep(first.table, place, options)
    options.check_for("the result of a run")
    return _save_views(first, place, options)


def _default(files: Sequence[Path]) -> Path:
    """Return the default path: FILE.png, A-B.png of two files, A-and-N-more.png of more."""
    first, others = files[0], files[1:]
    if not others:
        return first.with_suffix(".png")
    second = others[0].stem if len(others) == 1 else f"and-{len(others)}-more"
    return first.with_name(f"{first.stem}-{second}.png")


def _path_of(path: Path, view: str) -> Path:
    """Return the picture of a view if several are drawn: FILE-<view>.png for FILE.png."""
    return path.with_name(f"{path.stem}-{view}{path.suffix}")


class _PictureTarget(NamedTuple):
    """Target of pictures: `path`, `named` by the user or not."""

    path: Path
    named: bool
    no_clobber: bool

    def of(self, views: Sequence[str]) -> list[Path]:
        """Return the file of each view; without views that of the first.

        Raises
        ------
        InputError
            If two are the same.
        OutputError
            If one cannot be written.
        """
        if not views or (len(views) == 1 and self.named):
            paths = [self.path]
        else:
            names = [view.replace(",", "+").replace(" ", "") for view in views]
            check_apart(
                {
                    f"view {view} (number {number})": _path_of(self.path, name)
                    for number, (view, name) in enumerate(zip(views, names, strict=True), 1)
                }
            )
            paths = [_path_of(self.path, name) for name in names]
        self.check(paths)
        return paths

    def check(self, paths: Sequence[Path]) -> None:
        """Check that files can be written."""
        for path in paths:
            if self.no_clobber:
                check_free(path, PICTURE)
            check_picture(path)


def _views(options: PlotOptions) -> list[str]:
    """Return the requested views of a result."""
    views = [name.strip() for text in options.view for name in text.split(",")]
    _check_all_alone(views)
    return views


def _check_all_alone(views: Sequence[str]) -> None:
    if ALL in views and len(views) > 1:
        raise ArgumentError("view", f"expected '{ALL}' alone, got it beside other views")


def _save_views(
    result: results.Result, place: _PictureTarget, options: PlotOptions
) -> SavedPictures:
    views, known = _views(options), views_of(result.kind)
    if views == [ALL]:
        place.check([_path_of(place.path, name) for name in known])
        drawings = {}
        for name, of in views_with_effects(result.record, options).items():
            body, shown = options.body if of.body else None, of.applicable(options)
            drawings[_path_of(place.path, name)] = partial(
                draw, result.record, name, body, None, options, shown
            )
        return _save(drawings, options, skips=True)
    for view in views:
        check_view(result.kind, view)
        check_applies(result.kind, view, options)
    return _save(
        {
            path: partial(draw, result.record, view, options.body, None, options, options)
            for path, view in zip(place.of(views), views or FIRST, strict=True)
        },
        options,
    )


def _save_overlays(
    overlays: "Sequence[Overlaid]", place: _PictureTarget, options: PlotOptions
) -> SavedPictures:
    views = _views(options)
    kind = overlays[0].record.attributes["kind"]
    check_overlay(overlays)
    if views == [ALL]:
        views = views_of_overlay(kind)
    for view in views:
        check_overlaid(kind, view)
    return _save(
        {
            path: partial(draw_overlay, overlays, view, None, options, options)
            for path, view in zip(place.of(views), views or FIRST, strict=True)
        },
        options,
    )


def _save_sweep(table: "SweepTable", place: _PictureTarget, options: PlotOptions) -> SavedPictures:
    views, reasons = list(options.view), list[str]()
    _check_all_alone(views)
    if views == [ALL]:
        views = [name for name in table.values if is_defined(table, name)]
        reasons = [
            f"{name} is not defined in any run" for name in table.values if name not in views
        ]
        paths = [_path_of(place.path, name) for name in views]
        place.check(paths)
    else:
        paths = place.of(views)
    drawings = {
        path: partial(draw_sweep, table, quantities_of(view), options.at, None, options)
        for path, view in zip(paths, views or FIRST, strict=True)
    }
    return _save(drawings, options)._replace(skipped=reasons)


def _save(drawings: "Drawings", appearance: Appearance, skips: bool = False) -> SavedPictures:
    """Write pictures; where it `skips`, those that can be drawn, of which there must be one."""
    saved = SavedPictures([], [])
    for path, draw_figure in drawings.items():
        try:
            save(draw_figure(), path, appearance.dots_per_inch)
            saved.pictures.append(path)
        except InputError as error:
            if not skips or isinstance(error, ArgumentError):
                raise
            saved.skipped.append(str(error))
    if not saved.pictures and skips:
        raise InputError("\n".join(saved.skipped))
    return saved


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
        Called with the number of frames drawn and the total.

    Returns
    -------
    Path
        The animation.

    Raises
    ------
    InputError
        If the result cannot be animated, or MP4 lacks ffmpeg.
    OutputError
        If the file cannot be written, or would replace another kind of file.
    """
    from frictionsim.plots import animation

    options = PlotOptions.among(locals())
    target = as_path("animate", path)
    if no_clobber:
        check_free(target, ANIMATIONS[".gif"])
    animation.check_animation(target)
    if not isinstance(source, results.Result):
        source = results.open(as_path("result", source))
    name = str(source.path or "")
    animation.animate(source.record, target, options.fps, options.speed, progress, name)
    return target


def plot(
    result: "PictureSource | Sequence[PictureSource]",
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
        one kind are drawn over each other in a view over time, with a legend.
    view : str, optional
        Of a result one of the views of its kind; of a sweep a quantity, or several with commas
        between them. The error for an unknown view lists the known ones.
    body : int, optional
        Number of the body of a belt, for the view `body`.
    at : mapping, optional
        Value to draw of a varied key, by key; of a grid.
    ax : Axes, optional
        Draw in the place of these axes, which are removed: a view may have several panels.
    width, height : str, optional
        Of the picture, e.g. ``"84mm"``; the text keeps its size in points.
    dpi : float, optional
        Dots per inch.
    style : str, optional
        "paper", "talk", or "user" for the user's settings of matplotlib.
    title : bool
        False omits it.
    time : float, optional, s
        Time of the view, if it shows one instant.
    window : pair of float or None, optional, s
        Start and end of a view over time; None is the start or end of the run.
    channels : str or sequence of str, optional
        Channels of a view over time instead of the defaults.

    Returns
    -------
    Figure
        Of matplotlib, without pyplot: notebooks show it, ``figure.savefig(path)`` saves it.

    Raises
    ------
    InputError
        If there is no such view, or the result lacks channels of it; if an option is not valid
        or does not apply to the view.
    """
    options = PlotOptions.among(locals())
    source = _sources(result)
    if isinstance(source, list):
        options.check_for("several results")
        return draw_overlay(source, view, ax, options, options)
    if isinstance(source, results.Result):
        options.check_for("the result of a run")
        return draw(source.record, view, body, ax, options, options)
    options.check_for("a sweep")
    return draw_sweep(source, quantities_of(view), options.at, ax, options)


def _sources(source: Any) -> "results.Result | SweepTable | list[Overlaid]":
    """Return the result, the sweep, or the several named results to draw."""
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
        from frictionsim.api.dataset import sweep_table

        return sweep_table(source)
    opened = result_or_sweep(as_path("result", source))
    return opened if isinstance(opened, results.Result) else opened.table


def _name(source: Any, number: int) -> str:
    path = getattr(source, "path", source if isinstance(source, str | PathLike) else None)
    return str(path) if path is not None else f"result {number}"


def overlaid(named: "Sequence[tuple[str, results.Result | SweepTable | Sweep]]") -> Any:
    """Return several results to draw over each other.

    Raises
    ------
    InputError
        If there is a sweep among them.
    """
    for name, one in named:
        if not isinstance(one, results.Result):
            raise InputError(
                f"{name}: this is a sweep; only results of runs are drawn over each other; draw it"
                " alone"
            )
    return [Overlaid(name, one.record) for name, one in named if isinstance(one, results.Result)]
