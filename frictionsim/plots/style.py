"""What all pictures share: colours, lines, titles, keys, and how a picture is written."""

from collections.abc import Sequence
from pathlib import Path
from tomllib import TOMLDecodeError, loads
from typing import TYPE_CHECKING, Any
from warnings import catch_warnings, simplefilter

import matplotlib as mpl
from matplotlib.figure import Figure

from frictionsim.errors import InputError, OutputError

if TYPE_CHECKING:
    from frictionsim.io.hdf5_reader import Result

# Okabe and Ito: told apart also by colour-blind readers.
BLUE, ORANGE, GREEN, PURPLE, SKY, BLACK = (
    *("#0072B2", "#E69F00", "#009E73"),
    *("#CC79A7", "#56B4E9", "#000000"),
)
VERMILION, GREY, WINE = "#D55E00", "#777777", "#882255"
COLOURS = (BLUE, VERMILION, GREEN, PURPLE, SKY, BLACK, ORANGE, GREY)
DASHES: tuple[Any, ...] = ("-", (0, (6, 2)), (0, (6, 2, 1, 2)), (0, (2, 1.5)))  # told apart in grey
MAX_LINES = len(COLOURS)  # in one panel, where each has its own colour

Style = dict[str, Any]
"""How something is drawn, in the words of matplotlib."""

STICK_COLOUR = "#E5E5E5"
WIDTH = 8.0  # inches
KEY_ROW = 0.25  # inches
DOTS_PER_INCH = 100  # keeps also a picture full of events below 200 KB
FORMATS = (".png", ".pdf", ".svg")


def check_format(path: Path) -> None:
    """See that a picture can be written in the format that its name asks for.

    Raises
    ------
    InputError
    """
    if path.suffix.lower() not in FORMATS:
        raise InputError(f"{path}: pictures are written as {', '.join(FORMATS)}; name one of them")


def need(result: "Result", view: str, names: Sequence[str]) -> None:
    """See that a result has the channels that a view shows.

    Raises
    ------
    InputError
    """
    missing = [name for name in names if name not in result.channels]
    if missing:
        raise InputError(
            f"cannot draw the view '{view}': this result has no channel {', '.join(missing)};"
            f" the view needs {', '.join(names)} (see output.channels)"
        )


def scenario_of(result: "Result") -> dict[str, Any]:
    """Return the data of the scenario that a result is of.

    Raises
    ------
    InputError
    """
    try:
        return loads(result.attributes["scenario"])
    except TOMLDecodeError as error:
        raise InputError(f"cannot read the scenario in this result: {error}") from None


def given(result: "Result", *keys: str | int) -> Any:
    """Return what the scenario of a result has under keys.

    Raises
    ------
    InputError
        If it is not there.
    """
    value: Any = scenario_of(result)
    for key in keys:
        try:
            value = value[key]
        except (KeyError, TypeError, IndexError):
            where = ".".join(map(str, keys))
            raise InputError(f"the scenario in this result has no {where}") from None
    return value


def blank(result: "Result", height: float, *notes: str) -> Figure:
    """Return an empty picture that is entitled after a result.

    Parameters
    ----------
    result : Result
    height : float, inches
    notes : str
        What the title says besides.
    """
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    figure.suptitle(_title(result, notes), fontsize="medium", wrap=True)
    return figure


def _title(result: "Result", notes: Sequence[str]) -> str:
    attributes = result.attributes
    title = escape_mathtext(attributes["title"] or attributes["kind"])
    told = [f"backend {attributes['backend']}"]
    if attributes["status"] != "done":
        told.append(attributes["status"])
    elif attributes["reason"]:
        told.append("self-audit failed")
    return f"{title} ({'; '.join([*told, *notes])})"


def escape_mathtext(text: str) -> str:
    """Return a text of the user's so that it is not read as a formula."""
    return text.replace("$", r"\$")


def line(number: int) -> Style:
    """Return how the line of this number is drawn, told apart by colour and in grey print."""
    return {
        "color": COLOURS[number % len(COLOURS)],
        "linestyle": DASHES[(number + number // len(COLOURS)) % len(DASHES)],
        "linewidth": 1.5,
    }


def label(result: "Result", name: str, words: str = "") -> str:
    """Return the label of an axis that shows a channel, with its unit."""
    return f"{words or name.replace('_', ' ')},\n{unit(result, name)}"


def unit(result: "Result", name: str) -> str:
    """Return the unit of a channel as it is printed."""
    return result.units[name].replace("^2", "²")


def grid(axes: Any) -> None:
    """Have an axes that shows channels begin at its edge, over a thin grid."""
    axes.margins(x=0.0)
    axes.grid(linewidth=0.3)


def add_legend(figure: Figure, handles: Sequence[Any], columns: int = 4) -> None:
    """Put the key below the picture, which grows by as much."""
    if not handles:
        return
    rows = -(-len(handles) // columns)
    figure.set_figheight(figure.get_figheight() + KEY_ROW * rows)
    figure.legend(
        handles=handles,
        loc="outside lower center",
        ncols=min(columns, len(handles)),
        fontsize="small",
        frameon=False,
        handlelength=3.0,
    )


def save(figure: Figure, path: Path) -> None:
    """Write a picture, the same bytes for the same picture.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    try:
        # No date, no version, no random names.
        with mpl.rc_context({"svg.hashsalt": "frictionsim"}), catch_warnings():
            simplefilter("ignore")  # a title in letters that the font does not have
            figure.savefig(path, dpi=DOTS_PER_INCH, **_options(path))
    except OSError as error:
        raise OutputError(f"{path}: cannot write the picture: {error.strerror or error}") from None


def _options(path: Path) -> dict[str, Any]:
    options: dict[str, dict[str, Any]] = {
        ".png": {"metadata": {"Software": None}, "pil_kwargs": {"optimize": True}},
        ".pdf": {"metadata": {"CreationDate": None}},
        ".svg": {"metadata": {"Date": None}},
    }
    return options[path.suffix.lower()]
