"""Pictures of results and sweeps: as figures from Python, in files as `frictionsim plot` does."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from math import inf, isfinite
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

from pydantic import BeforeValidator, Field

from frictionsim.api import result as results
from frictionsim.api.result import result_or_sweep
from frictionsim.api.result_names import names_of
from frictionsim.api.sweep_result import Sweep, quantities_of
from frictionsim.errors import ArgumentError, InputError, unknown
from frictionsim.io.output_file import ANIMATIONS, PICTURE, check_apart, check_free
from frictionsim.plots import (
    ALL,
    applicable,
    check_count,
    check_several,
    draw,
    draw_several,
    view_of,
    view_of_several,
    views_of,
    views_of_several,
)
from frictionsim.plots.style import (
    SCREEN,
    STYLES,
    check_format,
    check_picture,
    drawn,
    save,
)
from frictionsim.plots.sweep import draw_sweep
from frictionsim.scenario.options import (
    ColumnsOption,
    Options,
    as_list,
    as_path,
    by_name,
    text_of,
)
from frictionsim.sweeps.statistics import is_constant, is_defined, sound_values

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure, SubFigure

    from frictionsim.io.sweep_table import SweepTable

    PictureSource = results.Result | Sweep | xarray.Dataset | str | PathLike[str]
    Drawings = Mapping[Path, Callable[..., Any]]


SAME, UNDEFINED = "has one value in all runs", "is not defined in any run"
FIRST: tuple[None] = (None,)  # where no view is named
UNITS = {"mm": 25.4, "cm": 2.54, "in": 1.0, "pt": 72.0}  # per inch
MIN_LENGTH, MAX_LENGTH = 20.0 / 25.4, 2000.0 / 25.4  # inches
MIN_DPI, MAX_DPI = 10.0, 10_000.0


def _inches(text: Any) -> float:
    """Return a length of a picture in inches."""
    wanted = "expected a length with its unit (mm, cm, in or pt), e.g. 84mm"
    if not isinstance(text, str):
        raise ValueError(f"{wanted}, got {text!r:.60}")
    unit = next((unit for unit in UNITS if text.strip().endswith(unit)), "")
    try:
        number = float(text.strip().removesuffix(unit))
    except ValueError:
        raise ValueError(f"{wanted}, got '{text:.60}'") from None
    if not unit:
        raise ValueError(f"{wanted}, got '{text:.60}' without a unit")
    inches = number / UNITS[unit]
    if not MIN_LENGTH <= inches <= MAX_LENGTH:  # also nan
        limits = f"{MIN_LENGTH * UNITS[unit]:.4g} to {MAX_LENGTH * UNITS[unit]:.4g} {unit}"
        raise ValueError(f"expected {limits}, got {text.strip():.60}")
    return inches


def _style(name: Any) -> Any:
    if name not in STYLES:
        raise ValueError(unknown("style", name, list(STYLES)))
    return name


def _window(given: Any) -> tuple[float | None, float | None]:
    try:
        start, stop = given
    except (TypeError, ValueError):
        raise ValueError(
            f"expected start and end in s, e.g. (0.5, 1.0), got {given!r:.60}"
        ) from None
    start, stop = _second(start), _second(stop)
    if start is not None and stop is not None and start >= stop:
        raise ValueError(f"expected a start before the end, got {start:g} s and {stop:g} s")
    return start, stop


def _second(value: Any) -> float | None:
    if value is None:
        return None
    try:
        number = float(value)
    except (TypeError, ValueError):
        number = inf
    if isinstance(value, str | bool) or not isfinite(number):
        raise ValueError(f"expected a time in s, got {value!r:.60}")
    return number


def _channels(given: Any) -> tuple[str, ...]:
    names = given.split(",") if isinstance(given, str) else given
    if not isinstance(names, Sequence) or not all(isinstance(name, str) for name in names):
        raise ValueError(f"expected names of channels, e.g. angle,drive_force, got {given!r:.60}")
    wanted = tuple(dict.fromkeys(name.strip() for name in names if name.strip()))
    if not wanted:
        raise ValueError("expected names of channels, e.g. angle,drive_force; got none")
    return wanted


def _views_given(given: Any) -> tuple[str, ...]:
    views = [given] if isinstance(given, str) else as_list(given)
    for view in views:
        if not isinstance(view, str):
            raise ValueError(f"expected the name of a view, got {text_of(view)}")
    return tuple(views)


Length = Annotated[float, BeforeValidator(_inches)]
WHOLE = (None, None)


class PlotOptions(Options):
    """Options of `plot` and `animate`, as `plot` has them.

    Attributes
    ----------
    view : tuple of str
        Views of a result, also with commas between them; of a sweep quantities, one picture
        per entry. "all" draws each view or quantity.
    width, height : float or None, inches
        Given as a text, a number with its unit; None is that of the view.
    """

    view: Annotated[tuple[str, ...], BeforeValidator(_views_given)] = ()
    body: int | None = None
    at: Annotated[
        dict[str, Any], BeforeValidator(by_name("KEY=VALUE, e.g. mechanism.load=2000", str))
    ] = Field({})
    time: Annotated[float | None, BeforeValidator(_second)] = None
    window: Annotated[tuple[float | None, float | None], BeforeValidator(_window)] = WHOLE
    channels: Annotated[tuple[str, ...], BeforeValidator(_channels)] = ()
    data: Any = None
    measured: ColumnsOption = Field({})
    units: Annotated[dict[str, str], BeforeValidator(by_name("NAME=UNIT", str))] = Field({})
    width: Length | None = None
    height: Length | None = None
    dpi: float | None = Field(None, ge=MIN_DPI, le=MAX_DPI)
    title: bool = True
    style: Annotated[str, BeforeValidator(_style)] = SCREEN
    fps: float | None = None
    speed: float | None = None

    def check_for(self, drawn: str) -> None:
        """Raise ArgumentError if an option does not apply to a subject, a key of `APPLY`."""
        for name, field in type(self).model_fields.items():
            if name not in APPLY[drawn] and getattr(self, name) != field.default:
                fit = " or ".join(other for other, names in APPLY.items() if name in names)
                raise ArgumentError(name, f"it applies to {fit}, not to {drawn}")

    @property
    def shown(self) -> dict[str, Any]:
        """What is given of the options of a view."""
        given = {"time": self.time, "window": self.window, "channels": self.channels}
        given["body"] = self.body
        return {name: value for name, value in given.items() if value not in (None, WHOLE, ())}

    def shown_of(self, result: results.Result) -> dict[str, Any]:
        """What is given of the options of a view, with measured values of channels of a result."""
        if not self.measured:
            if self.data is not None:
                raise ArgumentError("measured", "missing; expected channels that the data are of")
            return self.shown
        from frictionsim.fits.data import FitOptions, measured

        try:
            source = FitOptions.of(data=self.data, channels=self.measured, units=self.units)
            return self.shown | {"measured": measured(source, result.scenario, drawn=True).targets}
        except ArgumentError as error:
            name = "measured" if error.argument == "channels" else error.argument
            raise ArgumentError(name, error.text) from None

    def drawn(self, draw: Callable[..., Any], figure: "Figure | SubFigure | None" = None) -> Any:
        """Return a figure that is drawn in this size and style, or the given one."""
        sizes = {name: getattr(self, name) for name in ("width", "height", "dpi")}
        if figure is not None:
            for name in (name for name, given in sizes.items() if given):
                raise ArgumentError(name, "is of a new picture; leave it out with a figure")
        return drawn(draw, figure, **sizes, title=self.title, style=self.style)


SIZES = {"width", "height", "dpi", "title", "style"}
APPLY = {
    "the result of a run": SIZES
    | {"view", "body", "time", "window", "channels", "data", "measured", "units"},
    "several results": SIZES | {"view", "time", "window", "channels"},
    "a sweep": SIZES | {"view", "at"},
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
    check_count(len(files))  # before they are read
    results_by_name = [(str(file), result_or_sweep(file)) for file in files]
    place = _PictureTarget(path or _default(files), path is not None, no_clobber)
    (_, first), *others = results_by_name
    if others:
        options.check_for("several results")
        return _save_several(results_by_name, place, options)
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
        drawings = {
            _path_of(place.path, name): partial(draw, result.record, name, **given)
            for name, given in applicable(result.record, options.shown_of(result)).items()
        }
        return _save(drawings, options, skips=True)
    shown = options.shown_of(result)
    for view in views:
        view_of(result.kind, view, shown)
    return _save(
        {
            path: partial(draw, result.record, view, **shown)
            for path, view in zip(place.of(views), views or FIRST, strict=True)
        },
        options,
    )


def _save_several(
    named: Sequence[tuple[str, Any]], place: _PictureTarget, options: PlotOptions
) -> SavedPictures:
    views, (records, names) = _views(options), _named_records(named)
    kind = records[0].attributes["kind"]
    if views == [ALL]:
        views = views_of_several(kind)
    for view in views:
        view_of_several(kind, view)
    return _save(
        {
            path: partial(_several, records, names, view, options)
            for path, view in zip(place.of(views), views or FIRST, strict=True)
        },
        options,
    )


def _several(
    records: Any, names: Any, view: str | None, options: PlotOptions, figure: Any = None
) -> Any:
    view_of(records[0].attributes["kind"], view, options.shown)
    return draw_several(records, names, view, figure, options.channels, options.window)


def _named_records(named: Sequence[tuple[str, Any]]) -> tuple[list[Any], list[str]]:
    """Return the records of results of one kind, and what tells them apart."""
    for name, one in named:
        if not isinstance(one, results.Result):
            raise InputError(
                f"{name}: this is a sweep; only results of runs are drawn over each other; draw it"
                " alone"
            )
    records, files = [one.record for _, one in named], [name for name, _ in named]
    check_several(records, files)
    return records, names_of(records, files)


def _save_sweep(table: "SweepTable", place: _PictureTarget, options: PlotOptions) -> SavedPictures:
    views, reasons = list(options.view), list[str]()
    _check_all_alone(views)
    if views == [ALL]:
        defined = [name for name in table.values if is_defined(table, name)]
        views = [n for n in defined if not is_constant(sound_values(table, n))] or defined
        reasons = [
            f"{name} {SAME if name in defined else UNDEFINED}"
            for name in table.values
            if name not in views
        ]
        paths = [_path_of(place.path, name) for name in views]
        place.check(paths)
    else:
        paths = place.of(views)
    drawings = {
        path: partial(draw_sweep, table, quantities_of(view), options.at)
        for path, view in zip(paths, views or FIRST, strict=True)
    }
    return _save(drawings, options)._replace(skipped=reasons)


def _save(drawings: "Drawings", options: PlotOptions, skips: bool = False) -> SavedPictures:
    """Write pictures; where it `skips`, those that can be drawn, of which there must be one."""
    saved = SavedPictures([], [])
    for path, draw_figure in drawings.items():
        try:
            figure = options.drawn(draw_figure)
            save(figure, path, figure.get_dpi())
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
    import frictionsim.plots.mechanism as moving

    options = PlotOptions.among(locals())
    target = as_path("animate", path)
    if no_clobber:
        check_free(target, ANIMATIONS[".gif"])
    moving.check_animation(target)
    if not isinstance(source, results.Result):
        source = results.open(as_path("result", source))
    name = str(source.path or "")
    moving.animate(source.record, target, options.fps, options.speed, progress, name)
    return target


def plot(
    result: "PictureSource | Sequence[PictureSource]",
    view: str | None = None,
    *,
    body: int | None = None,
    at: Mapping[str, Any] | None = None,
    figure: "Figure | SubFigure | None" = None,
    width: str | None = None,
    height: str | None = None,
    dpi: float | None = None,
    style: str | None = None,
    title: bool = True,
    time: float | None = None,
    window: tuple[float | None, float | None] | None = None,
    channels: str | Sequence[str] | None = None,
    data: "str | PathLike[str] | Mapping[str, Any] | None" = None,
    measured: "str | Sequence[str] | Mapping[str, str | int] | None" = None,
    units: Mapping[str, str] | None = None,
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
    figure : Figure or SubFigure, optional
        An empty one that is drawn into, as of ``figure.subfigures(1, 2)``; its figure should have
        ``layout="constrained"``.
    width, height : str, optional
        Of the picture, e.g. ``"84mm"``; the text keeps its size in points.
    dpi : float, optional
        Dots per inch.
    style : str, optional
        "screen" or "paper", with smaller type and thinner lines.
    title : bool
        False omits it.
    time : float, optional, s
        Time of the view, if it shows one instant.
    window : pair of float or None, optional, s
        Start and end of a view over time; None is the start or end of the run.
    channels : str or sequence of str, optional
        Channels of a view over time instead of the defaults.
    data : path or mapping of sequences, optional
        A CSV file of measured or digitised values, or its columns by name. The times are in the
        column `time`, or else in the first of a file.
    measured : str, sequence of str, or mapping, optional
        Channels of which the data are drawn as points, with their columns, as of `fit`.
    units : mapping, optional
        Units of the data by channel, if neither those of the headings nor of the channels.

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
    sources = list(result) if isinstance(result, list | tuple) else [result]
    if not sources:
        raise ArgumentError("result", "expected a result or several, got an empty list")
    if len(sources) > 1:
        check_count(len(sources))
        options.check_for("several results")
        opened = [(_name(one, i), _one(one)) for i, one in enumerate(sources, 1)]
        records, names = _named_records(opened)
        return options.drawn(partial(_several, records, names, view, options), figure)
    source = _one(sources[0])
    if isinstance(source, results.Result):
        options.check_for("the result of a run")
        shown = options.shown_of(source)
        return options.drawn(partial(draw, source.record, view, **shown), figure)
    options.check_for("a sweep")
    return options.drawn(partial(draw_sweep, source, quantities_of(view), options.at), figure)


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
