"""Appearance of pictures: size, resolution, colours, line styles, titles and legends.

The size is that of the picture; text keeps its size in points, and the layout adapts. A style is a
set of matplotlib's parameters: `paper` and `talk` change its defaults, `user` takes the parameters
of the user, of matplotlibrc or set in Python.
"""

from collections.abc import Mapping, Sequence
from math import sqrt
from textwrap import wrap
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
from matplotlib import rcParams
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter
from pydantic import BeforeValidator, Field

from frictionsim.display import COLOURS, DASHES, labelled, overrides_of, study_text, unit_text
from frictionsim.errors import InputError, unknown
from frictionsim.plots.picture_file import DOTS_PER_INCH, defaults, user_parameters
from frictionsim.plots.texts import LINE_SPACING, points_of, text_width, wrapped
from frictionsim.scenario.methods import SET_VALUED
from frictionsim.scenario.options import Options
from frictionsim.scenario.toml_data import scenario_of

if TYPE_CHECKING:
    from matplotlib.figure import SubFigure

    from frictionsim.results import Record


UNITS = {"mm": 25.4, "cm": 2.54, "in": 1.0, "pt": 72.0}  # per inch
MIN_LENGTH, MAX_LENGTH = 20.0 / 25.4, 2000.0 / 25.4  # inches
MIN_DPI, MAX_DPI = 10.0, 10_000.0
TEXT, LINE = 10.0, 1.5  # points, of text and lines where no style changes them

USER = "user"
# Widths of lines that a view gives are scaled, see `placement`.
STYLES: dict[str, dict[str, Any]] = {
    "paper": {
        "font.size": 8.0,
        "lines.linewidth": 0.95,
        "lines.markersize": 4.0,
        "axes.linewidth": 0.5,
        "axes.titlesize": "medium",
        "axes.labelpad": 2.0,
        "patch.linewidth": 0.6,
        "xtick.major.width": 0.5,
        "ytick.major.width": 0.5,
        "xtick.major.size": 2.5,
        "ytick.major.size": 2.5,
        "xtick.major.pad": 2.0,
        "ytick.major.pad": 2.0,
    },
    "talk": {
        "font.size": 16.0,
        "lines.linewidth": 2.95,
        "lines.markersize": 10.0,
        "axes.linewidth": 1.4,
        "patch.linewidth": 1.6,
        "xtick.major.width": 1.4,
        "ytick.major.width": 1.4,
        "xtick.major.size": 6.0,
        "ytick.major.size": 6.0,
    },
}


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
    if name not in (*STYLES, USER):
        raise ValueError(unknown("style", name, [*STYLES, USER]))
    return name


Length = Annotated[float, BeforeValidator(_inches)]


class Appearance(Options):
    """Size and style of a new picture.

    Attributes
    ----------
    width, height : float or None, inches
        Given as a text, a number with its unit; None is that of the view.
    dpi : float or None
        Dots per inch of a PNG; None is the usual number.
    title : bool
    style : str
        paper, talk or user; empty is the usual one.
    fitted : bool
        Labels are broken where they are too long, also in the usual size.
    """

    width: Length | None = None
    height: Length | None = None
    dpi: float | None = Field(None, ge=MIN_DPI, le=MAX_DPI)
    title: bool = True
    style: Annotated[str, BeforeValidator(_style)] = ""
    fitted: bool = False

    @property
    def dots_per_inch(self) -> float:
        """Dots per inch of a PNG."""
        return DOTS_PER_INCH if self.dpi is None else self.dpi

    @property
    def new_figure_option(self) -> str:
        """The name of an argument that only a new figure can have; empty if none is given."""
        given = {"width": self.width, "height": self.height, "dpi": self.dpi, "style": self.style}
        return next((name for name, value in given.items() if value), "")

    @property
    def is_usual(self) -> bool:
        """Whether nothing differs from the defaults."""
        return self.title and not self.fitted and not self.new_figure_option

    def parameters(self) -> dict[str, Any]:
        """Return matplotlib's parameters for this style."""
        if self.style == USER:
            # The picture has the size that is asked for, and its text is not cut; powers of ten
            # along axes, and an escaped $, are read as such.
            return user_parameters() | {
                "savefig.bbox": None,
                "figure.autolayout": False,
                "text.parse_math": True,
            }
        return defaults() | STYLES.get(self.style, {})


USUAL = Appearance()


LINE_STYLES: tuple[Any, ...] = tuple((0, dashes) if dashes else "-" for dashes in DASHES)
MAX_LINES = len(COLOURS)  # in one panel

Style = dict[str, Any]
"""Keyword arguments of a matplotlib line."""

WIDTH = 8.0  # inches, of a picture; labels and legends are arranged for it
LEGEND_ROW = 0.25  # inches
LABEL_WIDTH = 18  # characters beside a panel of channels
NO_BREAK = "\u00a0"  # a space
LEGEND_SIZE, HANDLE = "small", 3.0  # of the text, and length of a line in sizes of the text
POINTS = 72.0  # per inch
MIN_TEXT = 0.65  # of the usual size, where a subfigure is small
MIN_PANEL = 0.75  # of the usual height, where a figure is narrow
TITLE_SIZE = "medium"
FEW_DECADES = 100.0  # ratio, below which powers of ten are too few labels
EVEN_RATIO = 5.0  # below which 1, 2 and 5 times these may be a single label
MARGIN = 8.0  # points beside a legend or title


def require_channels(result: "Record", view: str, names: Sequence[str]) -> None:
    """Check that a result has the channels of a view.

    Parameters
    ----------
    names : sequence of str
        The channels.
    """
    missing = [name for name in names if name not in result.channels]
    if missing:
        raise InputError(
            f"cannot draw the view '{view}': this result has no channel {', '.join(missing)};"
            f" the view needs {', '.join(names)} (see output.channels)"
        )


def set_up(
    figure: "Figure | SubFigure",
    result: "Record",
    height: float,
    *notes: str,
    scaled: bool = True,
) -> float:
    """Give an empty figure the title of a result, and its height unless it is part of a figure.

    Parameters
    ----------
    height : float, inches
        In a figure of WIDTH with text of the usual size.
    *notes : str
        Further notes in the title.
    scaled : bool
        A figure that is less wide, or has smaller text, is less high.

    Returns
    -------
    float
        The height that there is relative to `height`, at most 1: small texts fit a low subfigure.
    """
    return set_title(figure, _title(result, notes), height, scaled)


def set_title(
    figure: "Figure | SubFigure", title: str, height: float, scaled: bool = True
) -> float:
    """Give an empty figure a title and a height, as `set_up`."""
    shown = wrapped(title, POINTS * width_of(figure) - 2.0 * MARGIN, TITLE_SIZE)
    figure.suptitle(shown, fontsize=TITLE_SIZE)
    if isinstance(figure, Figure):
        further = title_height(shown) - title_height(title)
        figure.set_figheight(height * (height_scale(figure) if scaled else 1.0) + further)
        return 1.0
    return min(1.0, float(figure.bbox.height / figure.dpi) / height)


def title_height(title: str) -> float:
    """Return the height of the lines of a title, inches."""
    return LINE_SPACING * points_of(TITLE_SIZE) / POINTS * (title.count("\n") + 1)


def width_of(figure: "Figure | SubFigure") -> float:
    """Return the width of a figure or subfigure, inches."""
    if isinstance(figure, Figure):
        return float(figure.get_figwidth())
    return float(figure.bbox.width / figure.dpi)


def text_scale() -> float:
    """Return the size of text relative to the usual one, in the style that is drawn with."""
    return float(rcParams["font.size"]) / TEXT


def relative_width(figure: "Figure | SubFigure") -> float:
    """Return the width of a figure or subfigure relative to WIDTH, for text of the usual size.

    The number of columns of a legend and of labels along an axis depends on it.
    """
    return width_of(figure) / WIDTH / text_scale()


def height_scale(figure: Figure) -> float:
    """Return the height of the panels of a figure relative to those in a figure of WIDTH."""
    size = text_scale()
    relative = width_of(figure) / WIDTH
    return max(sqrt(min(relative, 1.0) * size), MIN_PANEL * size) if relative < 1.0 else sqrt(size)


MAX_OVERRIDES, MAX_OVERRIDE = 3, 24  # in a title, and characters of the value of one


def short_overrides(attributes: Mapping[str, str], told: Sequence[str] = ()) -> list[str]:
    """Return the overrides of a result for its title, with as much of each key as tells them apart.

    `told` are words that the title has anyway, such as "backend rkf45".
    """
    overrides = overrides_of(attributes, MAX_OVERRIDE)
    overrides.pop("title", None)  # it is the title
    names = short_names(list(overrides))
    pairs = zip(names, overrides.values(), strict=True)
    texts = [f"{name} = {value}" for name, value in pairs if f"{name} {value}" not in told]
    more = len(texts) - MAX_OVERRIDES
    return [*texts[:MAX_OVERRIDES], f"{more} more set"] if more > 0 else texts


def short_names(names: Sequence[str]) -> list[str]:
    """Return the shortest ends of keys that tell them apart, and do not begin with a number."""
    return [_short_name(name, names) for name in names]


def _short_name(name: str, names: Sequence[str]) -> str:
    parts = name.split(".")
    for count in range(1, len(parts) + 1):
        end = ".".join(parts[-count:])
        same = [other for other in names if f".{other}".endswith(f".{end}")]
        if len(same) == 1 and not parts[-count].isdecimal():
            break
    return end


def _title(result: "Record", notes: Sequence[str]) -> str:
    attributes = result.attributes
    title = attributes["title"] or attributes["kind"]
    parts = [*_other_laws(result), f"backend {attributes['backend']}"]
    parts = [*short_overrides(attributes, parts), *parts]
    if attributes["status"] != "done":
        parts.append(attributes["status"])
    elif attributes["reason"]:
        parts.append("self-audit failed")
    return f"{title} ({'; '.join([*parts, *notes])})"


def _other_laws(result: "Record") -> list[str]:
    """Return the friction law, unless it is the default; none if the scenario is unreadable."""
    try:
        effects = scenario_of(result).get("effects", {})
    except InputError:
        return []
    tables = [table for table in effects.values() if isinstance(table, dict)]
    laws = {str(table["law"]) for table in tables if "law" in table}
    return [f"law {law}" for law in sorted(laws - {SET_VALUED})]


def line_style(number: int) -> Style:
    """Return the style of line `number`; colour and dashes differ, also for grey print."""
    return {
        "color": COLOURS[number % len(COLOURS)],
        "linestyle": LINE_STYLES[(number + number // len(COLOURS)) % len(LINE_STYLES)],
        "linewidth": 1.5,
    }


def label(result: "Record", name: str, words: str = "") -> str:
    """Return the axis label of a channel with its unit.

    Parameters
    ----------
    name : str
        The channel.
    words : str
        Text instead of the name.
    """
    return axis_label(words or name.replace("_", " "), result.units[name], LABEL_WIDTH)


def axis_label(words: str, unit: str = "", width: int = 0) -> str:
    """Return the label of an axis: a quantity and its unit, such as "force, N".

    Every axis, colour bar and key that names a quantity with a unit is labelled so. A number
    without unit has none.

    Parameters
    ----------
    words : str
        The quantity.
    unit : str
        "1" or empty for a number.
    width : int
        Of a line, in characters; a longer label is broken between words. 0 breaks nothing.
    """
    shown, text = unit_text(unit), labelled(words, unit)
    if width and max(map(len, text.split("\n"))) > width:
        if shown:  # beside the last word, if both fit in a line
            last = words[words.rfind(" ") + 1 :]
            space = NO_BREAK if len(f"{last}, {shown}") <= width else " "
            words += f",{space}{shown.replace(' ', NO_BREAK)}"
        lines = [part for line in words.split("\n") for part in wrap(line, width) or [""]]
        text = "\n".join(lines).replace(NO_BREAK, " ")
    return text


def grid(ax: Any) -> None:
    """Draw a thin grid, and remove the margins in x."""
    ax.margins(x=0.0)
    ax.grid(linewidth=0.3)


def set_log_ticks(axis: Any, ratio: float) -> None:
    """Label a logarithmic axis at powers of ten; a short one at 1, 2 and 5, or evenly.

    Parameters
    ----------
    axis : Axis
    ratio : float
        Of the largest to the least value along it.
    """
    if ratio < FEW_DECADES:
        even = ratio < EVEN_RATIO
        axis.set_major_locator(MaxNLocator(4) if even else LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(FuncFormatter(lambda value, _: study_text(value)))
    axis.set_minor_formatter(NullFormatter())


def shrink(text: Any, scale: float) -> None:
    """Give a text the size for a subfigure that is `scale` as high or wide as a picture."""
    text.set_size(min(1.0, max(MIN_TEXT, scale)) * text.get_size())


def add_legend(figure: "Figure | SubFigure", handles: Sequence[Any], columns: int = 4) -> None:
    """Add a legend at the lower edge of a figure or subfigure; a figure is made higher for it.

    Parameters
    ----------
    columns : int
        At most, in a figure of WIDTH; a narrower figure has fewer.
    """
    if not handles:
        return
    columns = min(columns, len(handles))
    if not isinstance(figure, Figure):
        columns = max(1, int(columns * min(1.0, relative_width(figure))))
    else:
        columns = _columns_that_fit(figure, handles, columns)
        lines = max(str(handle.get_label()).count("\n") + 1 for handle in handles)
        rows = lines * -(-len(handles) // columns)
        figure.set_figheight(figure.get_figheight() + LEGEND_ROW * text_scale() * rows)
    figure.legend(
        handles=handles,
        loc="outside lower center",
        ncols=columns,
        fontsize=LEGEND_SIZE,
        frameon=False,
        handlelength=HANDLE,
    )


def _columns_that_fit(figure: Figure, handles: Sequence[Any], columns: int) -> int:
    """Return the number of columns of a legend; break its labels if not even one fits."""
    size = points_of(LEGEND_SIZE)
    available = POINTS * width_of(figure) - 2.0 * MARGIN
    beside = (HANDLE + rcParams["legend.handletextpad"]) * size
    gap = rcParams["legend.columnspacing"] * size
    widths = [text_width(str(handle.get_label()), LEGEND_SIZE) + beside for handle in handles]
    for count in range(columns, 0, -1):
        parts = np.array_split(widths, count)  # one column after the other, as matplotlib does
        if sum(map(max, parts)) + gap * (count - 1) <= available:
            return count
    for handle in handles:
        handle.set_label(wrapped(str(handle.get_label()), available - beside, LEGEND_SIZE))
    return 1
