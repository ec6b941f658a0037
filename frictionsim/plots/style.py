"""Appearance of pictures: size, two styles, titles, legends; and the writing of files."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from textwrap import fill
from typing import TYPE_CHECKING, Any
from warnings import catch_warnings, simplefilter

import numpy as np
from matplotlib import rc_context, rcdefaults, rcParams
from matplotlib.figure import Figure, FigureBase

from frictionsim.display import (
    COLOURS,
    DASHES,
    MAX_DRAWN,
    SYMBOLS,
    labelled,
    overrides_of,
    short_names,
    with_unit,
)
from frictionsim.errors import ArgumentError, InputError, OutputError
from frictionsim.io.output_file import PICTURE, check_output, check_replaceable, write_file
from frictionsim.io.terminal import visible
from frictionsim.scenario.kinds import unit_of
from frictionsim.scenario.methods import SET_VALUED
from frictionsim.scenario.origin import heading_of
from frictionsim.scenario.toml_data import scenario_of

if TYPE_CHECKING:
    from matplotlib.figure import SubFigure

    from frictionsim.results import Record

WIDTH = 8.0  # inches, of a picture
MIN_PANEL = 0.65  # of the usual height, in a narrow picture
LETTER = 0.56  # mean width of a letter, in sizes of the text
POINTS = 72.0  # per inch
LEGEND_ROW = 1.9  # height of a row of the legend, in sizes of the text
NO_BREAK = "\u00a0"  # a space
LEGEND_WIDTH = 44  # letters of a line of the legend
LABEL_WIDTH = 18  # letters beside a panel
DOTS_PER_INCH = 100
MAX_PIXELS = 100_000_000  # 400 MB while it is drawn
TITLE = "title"  # names the title of a picture, which may be left out

COMMON: Any = {
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,  # it would move a part of tick labels into a corner
    "axes.titlesize": "medium",
    "figure.titlesize": "medium",
    "grid.linewidth": 0.3,
    "legend.fontsize": "small",
    "legend.frameon": False,
    "legend.handlelength": 3.0,
    # Text that can be searched and changed: fonts as TrueType, text of SVG as text.
    "pdf.fonttype": 42,
    "svg.fonttype": "none",
    "svg.hashsalt": "frictionsim",  # else names of elements are random
}
STYLES: dict[str, Any] = {
    "screen": COMMON,
    "paper": COMMON
    | {
        "font.size": 8.0,
        "lines.linewidth": 1.0,
        "lines.markersize": 4.0,
        "axes.linewidth": 0.5,
        "axes.labelpad": 2.0,
        "patch.linewidth": 0.6,
        "xtick.major.width": 0.5,
        "ytick.major.width": 0.5,
        "xtick.major.size": 2.5,
        "ytick.major.size": 2.5,
    },
}
SCREEN = "screen"

LINES = tuple((0, dashes) if dashes else "-" for dashes in DASHES)
MAX_LINES = len(COLOURS)  # in one panel
MARKERS = tuple(SYMBOLS)
Look = dict[str, Any]
"""Keyword arguments of an artist."""
LIMIT: Look = {"color": "black", "linestyle": (0, (3, 2)), "linewidth": 0.8}


@contextmanager
def styled(name: str = SCREEN) -> Iterator[None]:
    """Draw in a style, whatever the settings of the user are."""
    with rc_context():
        rcdefaults()
        rcParams.update(STYLES[name])
        yield


def line_look(number: int) -> Look:
    """Return the look of line `number`; colour and dashes differ, also for grey print."""
    return {
        "color": COLOURS[number % len(COLOURS)],
        "linestyle": LINES[(number + number // len(COLOURS)) % len(LINES)],
    }


def plain(text: str) -> str:
    """Return a text of a file for matplotlib, which would read $ as a formula."""
    return visible(text.replace("\t", " ")).replace("$", r"\$")


def axis_label(words: str, unit: str = "", width: int = LABEL_WIDTH) -> str:
    """Return the label of an axis: a quantity and its unit, such as "force, N", in short lines."""
    unit = labelled("", unit).replace(" ", NO_BREAK)  # stays with the last word
    return plain(fill(words + unit, width, break_long_words=False).replace(NO_BREAK, " "))


def quantity_label(name: str, unit: str, width: int = LABEL_WIDTH) -> str:
    """Return the label of an axis of a channel or quantity; `slip_percent` in % is slip."""
    return axis_label(name.removesuffix("_percent").replace("_", " "), unit, width)


class Picture(Figure):
    """A figure without pyplot, which a notebook shows as the value of a cell."""

    style = SCREEN

    def _repr_png_(self) -> bytes:
        return image_of(self, ".png", self.dpi)


def new_figure(width: float | None = None, dpi: float | None = None) -> Picture:
    """Return an empty figure; the view gives it a height."""
    return Picture((width or WIDTH, WIDTH), dpi=dpi or DOTS_PER_INCH, layout="constrained")


def drawn(
    draw: Callable[..., Any],
    figure: "Figure | SubFigure | None" = None,
    *,
    width: float | None = None,
    height: float | None = None,
    dpi: float | None = None,
    title: bool = True,
    style: str = SCREEN,
) -> Any:
    """Return a new figure, or a given empty one, into which `draw(figure=...)` has drawn.

    Width and height are in inches; the default height is that of the view.
    """
    if not isinstance(figure, FigureBase | None):
        words = f"expected a Figure or SubFigure of matplotlib, got {type(figure).__name__}"
        raise ArgumentError("figure", words)
    with styled(style):
        target: Any = new_figure(width, dpi) if figure is None else figure
        height = height or (figure.bbox.height / figure.dpi if figure else None)
        draw(figure=target)
        if not title:
            for text in target.findobj(lambda artist: artist.get_gid() == TITLE):
                text.set(visible=False, in_layout=False)
        if height and isinstance(target, Figure):
            target.set_figheight(height)
        if figure is None:
            target.style = style
        if style != SCREEN:  # what is made later has the sizes of another style
            target.draw_without_rendering()
    return target


def set_height(figure: "Figure | SubFigure", height: float) -> None:
    """Give a figure the height of a picture of the usual width, inches; not a subfigure."""
    if isinstance(figure, Figure):
        figure.set_figheight(height * min(1.0, max(MIN_PANEL, figure.get_figwidth() / WIDTH)))


def single_panel(figure: "Figure | SubFigure", height: float, title: str) -> Any:
    """Return the Axes of a picture of one panel, with its grid, height in inches and title."""
    set_height(figure, height)
    set_title(figure, title)
    ax = figure.subplots()
    ax.grid(visible=True)
    ax.margins(x=0.0)
    return ax


def letters_across(figure: "Figure | SubFigure", size: float = 1.0) -> int:
    """Return how many letters a line across a figure has; `size` is relative to the usual one."""
    width = float(figure.bbox.width / figure.dpi)
    return max(int(POINTS * width / (LETTER * size * rcParams["font.size"])), 10)


def set_title(figure: "Figure | SubFigure", text: str) -> None:
    """Give a figure a title."""
    lines = [fill(line, letters_across(figure)) for line in text.split("\n")]
    figure.suptitle(plain("\n".join(lines)), gid=TITLE)


def title_of(record: "Record", *notes: str) -> str:
    """Return the title of a picture of a result: with overrides, law, backend and status."""
    attributes = record.attributes
    laws = {
        str(table["law"])
        for table in scenario_of(record).get("effects", {}).values()
        if isinstance(table, dict) and "law" in table
    }
    parts = [f"law {law}" for law in sorted(laws - {SET_VALUED})]
    parts.append(f"backend {attributes['backend']}")
    parts = [*short_overrides(attributes, parts), *parts]
    if attributes["status"] != "done":
        parts.append(attributes["status"])
    elif attributes["reason"]:
        parts.append("self-audit failed")
    return f"{heading_of(attributes)} ({'; '.join([*parts, *notes])})"


MAX_OVERRIDES, MAX_OVERRIDE = 3, 24  # in a title, and letters of the value of one


def short_overrides(attributes: Mapping[str, str], stated: Sequence[str] = ()) -> list[str]:
    """Return the overrides of a result for its title, with as much of each key as tells them apart.

    `stated` are words that the title has anyway, such as "backend rkf45".
    """
    overrides = overrides_of(attributes, MAX_OVERRIDE)
    overrides.pop("title", None)  # it is the title
    names = short_names(list(overrides))
    pairs = zip(names, overrides.values(), strict=True)
    units = [unit_of(attributes["kind"], key) for key in overrides]
    texts = [
        f"{name} = {with_unit(value, unit)}"
        for (name, value), unit in zip(pairs, units, strict=True)
        if f"{name} {value}" not in stated
    ]
    more = len(texts) - MAX_OVERRIDES
    return [*texts[:MAX_OVERRIDES], f"{more} more set"] if more > 0 else texts


def add_legend(figure: "Figure | SubFigure", handles: Mapping[str, Any], columns: int = 4) -> None:
    """Add a legend below the panels, by its words; a figure is made higher for it."""
    if not handles:
        return
    size = 0.83  # "small"
    across = letters_across(figure, size)
    # Narrow pictures have two columns, too.
    words = [fill(text, min(max(across // 2 - 8, 8), LEGEND_WIDTH)) for text in handles]
    longest = max(len(line) for text in words for line in text.split("\n"))
    columns = max(1, min(columns, len(words), across // (longest + 8)))
    if isinstance(figure, Figure):
        rows = -(-len(words) // columns) + max(text.count("\n") for text in words)
        row = LEGEND_ROW * size * rcParams["font.size"] / POINTS
        figure.set_figheight(figure.get_figheight() + row * rows)
    for text, handle in handles.items():
        handle.set_label(text)
    figure.legend(
        list(handles.values()), list(map(plain, words)), loc="outside lower center", ncols=columns
    )


def require_channels(record: "Record", view: str, names: Sequence[str]) -> None:
    """Check that a result has the channels of a view."""
    if missing := [name for name in names if name not in record.channels]:
        raise InputError(
            f"cannot draw the view '{view}': this result has no channel {', '.join(missing)};"
            f" the view needs {', '.join(names)} (see output.channels)"
        )


def check_drawn(subject: str, *tables: Mapping[str, Any]) -> None:
    """Check that no number of some arrays is so large that a scale of it would overflow."""
    for name, values in (item for table in tables for item in table.items()):
        array = np.asarray(values)
        if array.dtype.kind == "f" and (np.abs(array[np.isfinite(array)]) > MAX_DRAWN).any():
            words = f"'{name}' has numbers above {MAX_DRAWN:g}"
            raise InputError(f"cannot draw this {subject}: {words}")


FORMATS = (".png", ".pdf", ".svg")
# Without dates and versions equal figures give equal files.
METADATA: dict[str, dict[str, None]] = {
    ".png": {"Software": None},
    ".pdf": {"CreationDate": None},
    ".svg": {"Date": None},
}


def check_format(path: Path) -> None:
    """Check that the suffix of a picture names a known format."""
    if path.suffix.lower() not in FORMATS:
        raise InputError(f"{path}: expected a picture name that ends in .png, .pdf or .svg")


def check_picture(path: Path) -> None:
    """Check that a picture can be written, and that no other file is replaced by one."""
    check_format(path)
    check_output(path, PICTURE)


def save(figure: Figure, path: Path, dpi: float = DOTS_PER_INCH) -> None:
    """Write a picture, whole or not at all, by the suffix of its path: .png, .pdf or .svg."""
    check_format(path)
    check_replaceable(path, PICTURE)
    suffix = path.suffix.lower()
    width, height = (float(size) * dpi for size in figure.get_size_inches())
    if suffix == ".png" and width * height > MAX_PIXELS:
        raise ArgumentError(
            "dpi",
            f"a picture of {width:.0f} x {height:.0f} dots is too large, {MAX_PIXELS:.0e} are the"
            " most; give a smaller number, or write a .pdf or .svg, which has no dots",
        )
    try:
        image = image_of(figure, suffix, dpi)
    except OSError as error:  # of fonts, and of what matplotlib keeps for itself
        raise OutputError(f"{path}: cannot write the picture: {error.strerror or error}") from None
    write_file(path, image, PICTURE)


def image_of(figure: Figure, suffix: str, dpi: float = DOTS_PER_INCH) -> bytes:
    """Return a picture as the bytes of a file."""
    buffer = BytesIO()
    with styled(getattr(figure, "style", SCREEN)), catch_warnings():
        simplefilter("ignore")  # of letters that a font lacks, which are drawn as boxes
        figure.savefig(buffer, format=suffix[1:], dpi=dpi, metadata=METADATA[suffix])
    return buffer.getvalue()
