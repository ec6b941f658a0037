"""Colours, line styles, titles and legends of all pictures."""

import re
from collections.abc import Sequence
from textwrap import wrap
from typing import TYPE_CHECKING, Any

from matplotlib.figure import Figure

from frictionsim.errors import InputError
from frictionsim.scenario.methods import SET_VALUED
from frictionsim.scenario.recorded import scenario_of

if TYPE_CHECKING:
    from matplotlib.figure import SubFigure

    from frictionsim.results import Record

# Okabe and Ito: colour-blind safe.
BLUE, ORANGE, GREEN, PURPLE, SKY, BLACK = (
    *("#0072B2", "#E69F00", "#009E73"),
    *("#CC79A7", "#56B4E9", "#000000"),
)
VERMILION, GREY, WINE = "#D55E00", "#777777", "#882255"
COLOURS = (BLUE, VERMILION, GREEN, PURPLE, SKY, BLACK, ORANGE, GREY)
DASHES: tuple[Any, ...] = ("-", (0, (6, 2)), (0, (6, 2, 1, 2)), (0, (2, 1.5)))  # for grey print
MAX_LINES = len(COLOURS)  # in one panel

Style = dict[str, Any]
"""Keyword arguments of a matplotlib line."""

STICK_COLOUR = "#E5E5E5"
WIDTH = 8.0  # inches, of a picture; labels and legends are arranged for it
LEGEND_ROW = 0.25  # inches
LABEL_WIDTH = 18  # characters beside a panel of channels
RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
MIN_TEXT = 0.65  # of the usual size, where a subfigure is small


def require_channels(result: "Record", view: str, names: Sequence[str]) -> None:
    """Check that a result has the channels of a view.

    Parameters
    ----------
    result : Record
    view : str
    names : sequence of str
        The channels.

    Raises
    ------
    InputError
        If one is missing.
    """
    missing = [name for name in names if name not in result.channels]
    if missing:
        raise InputError(
            f"cannot draw the view '{view}': this result has no channel {', '.join(missing)};"
            f" the view needs {', '.join(names)} (see output.channels)"
        )


def set_up(figure: "Figure | SubFigure", result: "Record", height: float, *notes: str) -> float:
    """Give an empty figure the title of a result, and its height unless it is part of a figure.

    Parameters
    ----------
    figure : Figure or SubFigure
    result : Record
    height : float, inches
    *notes : str
        Further notes in the title.

    Returns
    -------
    float
        The height that there is relative to `height`, at most 1: small texts fit a low subfigure.
    """
    figure.suptitle(_title(result, notes), fontsize="medium", wrap=True)
    if isinstance(figure, Figure):
        figure.set_figheight(height)
        return 1.0
    return min(1.0, float(figure.bbox.height / figure.dpi) / height)


def relative_width(figure: "Figure | SubFigure") -> float:
    """Return the width of a figure or subfigure relative to WIDTH."""
    if isinstance(figure, Figure):
        return figure.get_figwidth() / WIDTH
    return float(figure.bbox.width / figure.dpi) / WIDTH


def _title(result: "Record", notes: Sequence[str]) -> str:
    attributes = result.attributes
    title = escape_mathtext(attributes["title"] or attributes["kind"])
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
    return [f"law {escape_mathtext(law)}" for law in sorted(laws - {SET_VALUED})]


def escape_mathtext(text: str) -> str:
    """Return a text of the user with $ escaped, so that it is not read as a formula."""
    return text.replace("$", r"\$")


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
    """Return what is along an axis: a quantity and its unit, as "force, N".

    Every axis, colour bar and key that names a quantity with a unit is labelled so. A number
    without unit has none.

    Parameters
    ----------
    words : str
        The quantity; $ in it is no formula.
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
    return escape_mathtext(text)


def unit_text(unit: str) -> str:
    """Return a unit for display: raised exponents; empty for a number, whose unit is 1."""
    if unit == "1":
        return ""
    return re.sub(r"\^(-?\d+)", lambda power: power[1].translate(RAISED), unit)


def with_unit(value: str, unit: str) -> str:
    """Return a number with its unit, as "200 N"; without unit the number alone."""
    shown = unit_text(unit)
    return f"{value} {shown}" if shown else value


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
    columns = max(1, int(columns * min(1.0, relative_width(figure))))
    if isinstance(figure, Figure):
        rows = -(-len(handles) // columns)
        figure.set_figheight(figure.get_figheight() + LEGEND_ROW * rows)
    figure.legend(
        handles=handles,
        loc="outside lower center",
        ncols=min(columns, len(handles)),
        fontsize="small",
        frameon=False,
        handlelength=3.0,
    )
