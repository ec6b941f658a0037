"""The sizes of texts, and texts in lines that fit a width."""

import re
from functools import lru_cache
from typing import Any

from matplotlib import rcParams
from matplotlib.font_manager import FontProperties
from matplotlib.textpath import text_to_path

from frictionsim.plots.literal_text import shown

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
    text : str
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
