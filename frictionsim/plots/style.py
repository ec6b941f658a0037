"""Colours, line styles, titles and legends of all pictures."""

from collections.abc import Sequence
from math import sqrt
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib import rcParams
from matplotlib.figure import Figure

from frictionsim.display import COLOURS, unit_text
from frictionsim.errors import InputError
from frictionsim.plots.appearance import TEXT
from frictionsim.plots.text_size import LINE_SPACING, points_of, text_width, wrapped
from frictionsim.scenario.methods import SET_VALUED
from frictionsim.scenario.toml_data import scenario_of

if TYPE_CHECKING:
    from matplotlib.figure import SubFigure

    from frictionsim.results import Record

DASHES: tuple[Any, ...] = ("-", (0, (6, 2)), (0, (6, 2, 1, 2)), (0, (2, 1.5)))  # for grey print
MAX_LINES = len(COLOURS)  # in one panel

Style = dict[str, Any]
"""Keyword arguments of a matplotlib line."""

STICK_COLOUR = "#E5E5E5"
WIDTH = 8.0  # inches, of a picture; labels and legends are arranged for it
LEGEND_ROW = 0.25  # inches
LABEL_WIDTH = 18  # characters beside a panel of channels
LEGEND_SIZE, HANDLE = "small", 3.0  # of the text, and length of a line in sizes of the text
POINTS = 72.0  # per inch
MIN_TEXT = 0.65  # of the usual size, where a subfigure is small
MIN_PANEL = 0.75  # of the usual height, where a figure is narrow
TITLE_SIZE = "medium"
MARGIN = 8.0  # points beside a legend or title


def require_channels(result: "Record", view: str, names: Sequence[str]) -> None:
    """Check that a result has the channels of a view.

    Parameters
    ----------
    result : Record
    view : str
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
    figure : Figure or SubFigure
    result : Record
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

    What fits beside each other depends on it: columns of legends, labels along an axis.
    """
    return width_of(figure) / WIDTH / text_scale()


def height_scale(figure: Figure) -> float:
    """Return how high the panels of a figure are, relative to those in a figure of WIDTH."""
    size = text_scale()
    relative = width_of(figure) / WIDTH
    return max(sqrt(min(relative, 1.0) * size), MIN_PANEL * size) if relative < 1.0 else sqrt(size)


def _title(result: "Record", notes: Sequence[str]) -> str:
    attributes = result.attributes
    title = attributes["title"] or attributes["kind"]
    parts = [*_other_laws(result), f"backend {attributes['backend']}"]
    if attributes["status"] != "done":
        parts.append(attributes["status"])
    elif attributes["reason"]:
        parts.append("self-audit failed")
    return f"{title} ({'; '.join([*parts, *notes])})"


def _other_laws(result: "Record") -> list[str]:
    """Return the friction law of a result, unless it is the default; none if it cannot be told."""
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
        "linestyle": DASHES[(number + number // len(COLOURS)) % len(DASHES)],
        "linewidth": 1.5,
    }


def label(result: "Record", name: str, words: str = "") -> str:
    """Return the axis label of a channel with its unit.

    Parameters
    ----------
    result : Record
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
        Of a line, in characters; a longer label is broken between words, and before the unit, never
        within that. 0 breaks nothing.
    """
    shown = unit_text(unit)
    text = f"{words}, {shown}" if shown else words
    if width and max(map(len, text.split("\n"))) > width:
        lines = [part for line in words.split("\n") for part in wrap(line, width) or [""]]
        text = "\n".join(lines)
        if shown:
            joined = len(lines[-1]) + 2 + len(shown) <= width and len(lines) > 1
            text += f", {shown}" if joined else f",\n{shown}"
    return text


def grid(ax: Any) -> None:
    """Draw a thin grid, and remove the margins in x."""
    ax.margins(x=0.0)
    ax.grid(linewidth=0.3)


def shrink(text: Any, scale: float) -> None:
    """Give a text the size for a subfigure that is `scale` as high or wide as a picture."""
    text.set_size(min(1.0, max(MIN_TEXT, scale)) * text.get_size())


def add_legend(figure: "Figure | SubFigure", handles: Sequence[Any], columns: int = 4) -> None:
    """Add a legend at the lower edge of a figure or subfigure; a figure is made higher for it.

    Parameters
    ----------
    figure : Figure or SubFigure
    handles : sequence of matplotlib artists
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
    """Return how many columns a legend can have; break its labels if not even one fits."""
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
