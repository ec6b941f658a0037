"""Pictures of results and sweeps: as figures from Python, in files as `frictionsim plot` does."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, NamedTuple

from pydantic import AfterValidator, BeforeValidator, Field

from frictionsim.api.opening import (
    files_of,
    names_of,
    opened,
    result_or_sweep,
    results_of_one_kind,
)
from frictionsim.api.result import Result
from frictionsim.api.result import open as open_result
from frictionsim.api.sweep_result import Sweep, quantities_of
from frictionsim.errors import ArgumentError, InputError
from frictionsim.io.output_file import ANIMATIONS, PICTURE, check_apart, check_free
from frictionsim.plots import (
    ALL,
    applicable,
    check_count,
    draw,
    draw_several,
    view_of,
    view_of_several,
    views_of_several,
)
from frictionsim.plots.style import check_format, check_picture, drawn, save
from frictionsim.plots.sweep import draw_sweep
from frictionsim.scenario.arguments import as_path
from frictionsim.scenario.options import ColumnsOption, Names, Options, by_name
from frictionsim.scenario.schema import unit_field
from frictionsim.sweeps.statistics import is_constant, is_defined, sound_values

if TYPE_CHECKING:
    import xarray
    from matplotlib.figure import Figure, SubFigure

    PictureSource = Result | Sweep | xarray.Dataset | str | PathLike[str]

UNITS = {"mm": 25.4, "cm": 2.54, "in": 1.0, "pt": 72.0}  # per inch
MIN_LENGTH, MAX_LENGTH = 20.0 / 25.4, 2000.0 / 25.4  # inches
MIN_DPI, MAX_DPI = 10.0, 10_000.0
WHOLE = (None, None)


def _inches(text: Any) -> float:
    """Return a length of a picture in inches."""
    unit = str(text).strip()[-2:]
    try:
        if not isinstance(text, str) or unit not in UNITS:
            raise ValueError
        inches = float(text.strip().removesuffix(unit)) / UNITS[unit]
    except ValueError:
        wanted = "expected a length with its unit (mm, cm, in or pt), e.g. 84mm"
        raise ValueError(f"{wanted}, got {text!r:.60}") from None
    if not MIN_LENGTH <= inches <= MAX_LENGTH:  # also nan
        limits = f"{MIN_LENGTH * UNITS[unit]:.4g} to {MAX_LENGTH * UNITS[unit]:.4g} {unit}"
        raise ValueError(f"expected {limits}, got {text.strip():.60}")
    return inches


def _entries(given: Any) -> tuple[Any, ...]:
    is_one = isinstance(given, str) or not isinstance(given, Sequence)
    return (given,) if is_one else tuple(given)


def _start_and_stop(given: Any) -> Any:
    if not isinstance(given, Sequence) or isinstance(given, str) or len(given) != 2:
        raise ValueError(f"expected start and end in s, e.g. (0.5, 1.0), got {given!r:.60}")
    return tuple(given)


def _in_order(window: tuple[float | None, float | None]) -> tuple[float | None, float | None]:
    start, stop = window
    if start is not None and stop is not None and start >= stop:
        raise ValueError(f"expected a start before the end, got {start:g} s and {stop:g} s")
    return window


def _given_names(names: tuple[str, ...]) -> tuple[str, ...]:
    if not any(names):
        raise ValueError("expected names of channels, e.g. angle,drive_force; got none")
    return tuple(dict.fromkeys(filter(None, names)))


Length = Annotated[float, BeforeValidator(_inches)]
Window = tuple[float | None, float | None]


class PlotOptions(Options):
    """Options of `plot` and `animate`, as `plot` has them; sizes in inches.

    `view` has views of a result, also with commas between them; of a sweep quantities, one picture
    per entry. "all" draws each view or quantity.
    """

    view: Annotated[tuple[str, ...], BeforeValidator(_entries)] = ()
    body: int | None = None
    at: Annotated[
        dict[str, Any], BeforeValidator(by_name("KEY=VALUE, e.g. mechanism.load=2000", str))
    ] = Field({})
    time: float | None = unit_field("s", "Time of a view that shows one instant.", None)
    window: Annotated[Window, BeforeValidator(_start_and_stop), AfterValidator(_in_order)] = (
        unit_field("s", "Start and end of a view over time.", WHOLE)
    )
    channels: Annotated[Names, AfterValidator(_given_names)] = ()
    data: Any = None
    measured: ColumnsOption = Field({})
    units: Annotated[dict[str, str], BeforeValidator(by_name("NAME=UNIT", str))] = Field({})
    width: Length | None = None
    height: Length | None = None
    dpi: float | None = Field(None, ge=MIN_DPI, le=MAX_DPI)
    title: bool = True
    style: Literal["screen", "paper"] = "screen"
    fps: float | None = None
    speed: float | None = None

    def check_for(self, drawn: str) -> None:
        """Raise ArgumentError if an option does not apply to a subject, a key of `APPLY`."""
        for name, field in type(self).model_fields.items():
            value, default = getattr(self, name), field.default
            # A table of pandas, as `data` may be, has no truth value.
            given = value is not None if default is None else value != default
            if given and name not in APPLY[drawn]:
                fit = " or ".join(other for other, names in APPLY.items() if name in names)
                raise ArgumentError(name, f"it applies to {fit}, not to {drawn}")

    def shown_of(self, result: Result | None = None) -> dict[str, Any]:
        """What is given of the options of a view, with the measured values of a result."""
        given = {name: getattr(self, name) for name in ("time", "window", "channels", "body")}
        shown = {name: value for name, value in given.items() if value not in (None, WHOLE, ())}
        if result is None or not self.measured:
            if self.data is not None or self.units:
                raise ArgumentError("measured", "missing; expected channels that the data are of")
            return shown
        from frictionsim.fits.data import FitOptions, measured

        try:
            source = FitOptions.of(data=self.data, channels=self.measured, units=self.units)
            return shown | {"measured": measured(source, result.scenario, drawn=True).targets}
        except ArgumentError as error:
            name = "measured" if error.argument == "channels" else error.argument
            raise ArgumentError(name, error.text) from None

    def drawn(self, drawing: "Drawing", figure: "Figure | SubFigure | None" = None) -> Any:
        """Return a figure that is drawn in this size and style, or the given one."""
        sizes = {name: getattr(self, name) for name in ("width", "height", "dpi")}
        if figure is not None:
            for name, size in sizes.items():
                if size is not None:
                    raise ArgumentError(name, "it applies to a new picture, not to a given figure")
        return drawn(drawing, figure, **sizes, title=self.title, style=self.style)


SIZES = {"width", "height", "dpi", "title", "style"}
ONE = "the result of a run"
SEVERAL = "several results"
SWEEP = "a sweep"
ANIMATION = "an animation"
# The options that apply, by what is drawn.
APPLY = {
    ONE: SIZES | {"view", "body", "time", "window", "channels", "data", "measured", "units"},
    SEVERAL: SIZES | {"view", "time", "window", "channels"},
    SWEEP: SIZES | {"view", "at"},
    ANIMATION: {"fps", "speed"},
}

Drawing = Callable[..., Any]
"""Draws into a figure or subfigure, or a new one, and returns it."""


class _Subject(NamedTuple):
    """What is drawn: the drawing of a view, None for the first, and those of all views.

    Of a view that is left out of all there is the reason.
    """

    drawing: Callable[[str | None], Drawing]
    every: Callable[[], tuple[dict[str, Drawing], list[str]]]


def _subject(sources: Sequence[Any], options: PlotOptions) -> _Subject:
    """Return the subject of a picture: a result, several, or a sweep; check that options apply."""
    if len(sources) > 1:
        return _several(sources, options)
    one = sources[0]
    return _sweep(one, options) if isinstance(one, Sweep) else _result(one, options)


def _result(result: Result, options: PlotOptions) -> _Subject:
    options.check_for(ONE)
    shown = options.shown_of(result)

    def drawing(view: str | None, given: Mapping[str, Any] = shown) -> Drawing:
        view_of(result.kind, view, given)
        return partial(draw, result.record, view, **given)

    def every() -> tuple[dict[str, Drawing], list[str]]:
        views = applicable(result.record, shown)
        return {name: drawing(name, given) for name, given in views.items()}, []

    return _Subject(drawing, every)


def _several(results: Sequence[Any], options: PlotOptions) -> _Subject:
    options.check_for(SEVERAL)
    records = [one.record for one in results_of_one_kind(results)]
    for file, record in zip(files_of(results), records, strict=True):
        if not record.channels["time"].size:
            raise InputError(f"{file}: cannot draw this result: it has no samples")
    kind, names, shown = results[0].kind, names_of(results), options.shown_of()

    def drawing(view: str | None) -> Drawing:
        view_of_several(kind, view)
        view_of(kind, view, shown)
        several = partial(draw_several, records, names, view)
        return partial(several, channels=options.channels, window=options.window)

    return _Subject(drawing, lambda: ({view: drawing(view) for view in views_of_several(kind)}, []))


def _sweep(sweep: Sweep, options: PlotOptions) -> _Subject:
    options.check_for(SWEEP)
    table = sweep.table

    def drawing(view: str | None) -> Drawing:
        return partial(draw_sweep, table, quantities_of(view), options.at)

    def every() -> tuple[dict[str, Drawing], list[str]]:
        defined = [name for name in table.values if is_defined(table, name)]
        varying = [n for n in defined if not is_constant(sound_values(table, n))] or defined
        why = {True: "has one value in all runs", False: "is not defined in any run"}
        left_out = [f"{n} {why[n in defined]}" for n in table.values if n not in varying]
        return {name: drawing(name) for name in varying}, left_out

    return _Subject(drawing, every)


class SavedPictures(NamedTuple):
    """The written pictures, and for each view left out of "all" the reason."""

    pictures: list[Path]
    skipped: list[str]


def save_pictures(
    files: Sequence[Path], path: Path | None, options: PlotOptions, *, no_clobber: bool = False
) -> SavedPictures:
    """Write pictures of the result of a run, of a sweep, or of several results.

    Each of several views, or a single named view without a path, is written to FILE-<view>.png.
    InputError is raised if nothing can be drawn, or two pictures would be one file; OutputError if
    one cannot be written.
    """
    if path is not None:
        check_format(path)
    check_count(len(files))  # before they are read
    sources = [result_or_sweep(file) for file in files]
    subject, views = _subject(sources, options), list(options.view)
    if not isinstance(sources[0], Sweep):
        views = [name.strip() for view in views for name in view.split(",")]
    if wants_all := ALL in views:
        if len(views) > 1:
            raise ArgumentError("view", f"expected '{ALL}' alone, got it beside other views")
        drawings, skipped = subject.every()
    else:
        drawings, skipped = {view: subject.drawing(view) for view in views}, []
    saved = SavedPictures([], skipped)
    named = len(views) > 1 or wants_all or path is None
    targets = _paths(path or _default(files), list(drawings) if named else [])
    for target in targets:
        if no_clobber:
            check_free(target, PICTURE)
        check_picture(target)
    for target, drawing in zip(targets, drawings.values() or [subject.drawing(None)], strict=True):
        try:
            figure = options.drawn(drawing)
            save(figure, target, figure.get_dpi())
            saved.pictures.append(target)
        except InputError as error:  # a view that needs other channels is left out of all
            if not wants_all or isinstance(error, ArgumentError):
                raise
            skipped.append(str(error))
    if not saved.pictures:
        raise InputError("\n".join(skipped))
    return saved


def _default(files: Sequence[Path]) -> Path:
    """Return the default path: FILE.png, A-B.png of two files, A-and-N-more.png of more."""
    first, others = files[0], files[1:]
    if not others:
        return first.with_suffix(".png")
    second = others[0].stem if len(others) == 1 else f"and-{len(others)}-more"
    return first.with_name(f"{first.stem}-{second}.png")


def _paths(path: Path, views: Sequence[str]) -> list[Path]:
    """Return the file of each view, FILE-<view>.png for FILE.png; without views the path."""
    named = {
        f"view {view} (number {number})": path.with_name(
            f"{path.stem}-{view.replace(',', '+').replace(' ', '')}{path.suffix}"
        )
        for number, view in enumerate(views, 1)
    }
    check_apart(named)
    return list(named.values()) or [path]


def animate(
    source: "Result | str | PathLike[str]",
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
    target = as_path("path", path)
    if no_clobber:
        check_free(target, ANIMATIONS[".gif"])
    moving.check_animation(target)
    result = source if isinstance(source, Result) else open_result(as_path("source", source))
    name = str(result.path or "")
    moving.animate(result.record, target, options.fps, options.speed, progress, name)
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
    given = list(result) if isinstance(result, list | tuple) else [result]
    if not given:
        raise ArgumentError("result", "expected a result or several, got an empty list")
    check_count(len(given))
    drawing = _subject([opened(one, Result, Sweep) for one in given], options).drawing
    return options.drawn(drawing(",".join(options.view) or None), figure)
