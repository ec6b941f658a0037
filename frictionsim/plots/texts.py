"""Texts of pictures: drawn as they are, measured, and broken into lines that fit a width.

Titles, names and units come from files of others, so no text is parsed as a formula or as TeX:
matplotlib typesets what stands between two $ and fails if it is no formula, and TeX, if the user
has chosen it, has commands that read files. Views write plain texts, and `make_literal` turns
parsing off. Numbers along axes remain as matplotlib
writes them, with raised powers of ten; names along axes are set with LITERAL.
"""

import re
from collections.abc import Iterator
from functools import lru_cache
from typing import Any

from matplotlib import rcParams
from matplotlib.axis import Axis
from matplotlib.font_manager import FontProperties
from matplotlib.text import Text
from matplotlib.textpath import text_to_path

from frictionsim.io.terminal import visible

LITERAL: dict[str, Any] = {"parse_math": False}  # of the labels of ticks, as `literal` has them
TEX = str.maketrans(
    {letter: f"\\{letter}" for letter in "$%&#_{}"}
    | {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}"}
)


def shown(text: str) -> str:
    r"""Return a text without characters that no font draws: control characters are escapes as \x1b.

    So are marks that change the direction of writing, and halves of characters that are stored in
    two. A tab is a space.
    """
    whole = text.encode("utf-8", "backslashreplace").decode("utf-8")
    return visible(whole.replace("\t", " "))


def literal(text: str) -> str:
    """Return a text for matplotlib, which does not parse it; escaped where TeX typesets it."""
    return shown(text).translate(TEX) if rcParams["text.usetex"] else shown(text)


def make_literal(figure: Any) -> None:
    """Have all texts of a drawn figure or subfigure drawn as they are; only once."""
    for text in list(_texts(figure)):
        text.set_parse_math(False)
        text.set_text(literal(text.get_text()))


def _texts(artist: Any) -> Iterator[Text]:
    """Yield the texts in an artist, but those of ticks: to ask for them lays out the axis."""
    children = [artist.label] if isinstance(artist, Axis) else artist.get_children()
    for child in children:
        if isinstance(child, Text):
            yield child
        else:
            yield from _texts(child)


LINE_SPACING = 1.2
WITH_UNIT = re.compile(r"(?<=\d) (?=[A-Za-z])|(?<=\bN) (?=m)|(?<=\bkg) (?=m)")


def points_of(size: str | float) -> float:
    """Return a size of text in points; words as "small" are relative to `font.size`."""
    return float(FontProperties(size=size).get_size_in_points())


def text_width(text: str, size: str | float) -> float:
    """Return the width of a text, of its widest line, in points; in the font of the parameters."""
    settings: Any = rcParams  # whose names are typed one by one
    family = tuple(settings["font.family"])
    fonts = tuple(tuple(settings.get(f"font.{name}", ())) for name in family)
    points = points_of(size)
    lines = shown(text).split("\n")
    return max(_line_width(line, points, family, fonts) for line in lines)


@lru_cache(maxsize=4096)
def _line_width(line: str, points: float, family: tuple[str, ...], _fonts: Any) -> float:
    if not line:
        return 0.0
    font = FontProperties(family=list(family), size=points)
    return float(text_to_path.get_text_width_height_descent(line, font, ismath=False)[0])


def wrapped(text: str, width: float, size: str | float) -> str:
    """Return a text with further line breaks, so that it is at most so wide.

    Parameters
    ----------
    width : float, points
    size : str or float
        Of the text, as matplotlib takes it.

    Returns
    -------
    str
        Words that are wider are broken; a number stays with its unit.
    """
    lines: list[str] = []
    for line in WITH_UNIT.sub("\u00a0", text).split("\n"):
        if text_width(line, size) <= width:
            lines.append(line)
            continue
        current = ""
        for word in line.split(" "):
            longer = f"{current} {word}" if current else word
            if text_width(longer, size) <= width:
                current = longer
                continue
            if current:
                lines.append(current)
            *full, current = _broken(word, width, size)
            lines += full
        lines.append(current)
    return "\n".join(lines).replace("\u00a0", " ")


def _broken(word: str, width: float, size: str | float) -> list[str]:
    """Return the parts of a word of which each is at most so wide, or a single letter."""
    parts = [""]
    for letter in word:
        if parts[-1] and text_width(parts[-1] + letter, size) > width:
            parts.append("")
        parts[-1] += letter
    return parts
