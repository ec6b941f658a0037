"""Which characters of a picture the fonts lack."""

import unicodedata
from collections.abc import Iterable, Iterator
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from matplotlib import ft2font, rcParams
from matplotlib.font_manager import FontProperties, findfont, get_font
from matplotlib.ticker import FixedFormatter

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MAX_NAMED = 8
ALWAYS_THERE = "DejaVu Sans"  # which comes with matplotlib
RIGHT_TO_LEFT = ("R", "AL")
ORDERS_LETTERS = hasattr(ft2font, "__libraqm_version__")  # as matplotlib does from 3.11 on
WAY_OUT = (
    "name a font that has them as font.family in matplotlibrc and give the style 'user'"
    " (--style user)"
)


class GlyphWarning(UserWarning):
    """Characters of a picture are not drawn as they should be."""


def faults_of(figure: "Figure") -> list[str]:
    """Return a sentence on characters that no font has, and one on such in a wrong order.

    Parameters
    ----------
    figure : Figure
        Drawn with the parameters of matplotlib that there are.
    """
    if rcParams["text.usetex"]:
        return []
    title = figure.get_suptitle()
    lacking: dict[str, None] = {}
    reversed_order: dict[str, None] = {}
    for text, families in _texts(figure):
        unusual = [letter for letter in text if ord(letter) > 0x7E]
        lacking |= dict.fromkeys(x for x in unusual if not _has(families, x))
        if not ORDERS_LETTERS:
            of_right = (x for x in unusual if unicodedata.bidirectional(x) in RIGHT_TO_LEFT)
            reversed_order |= dict.fromkeys(of_right)
    found = []
    if lacking:
        way_out = f"{WAY_OUT}{_or_no_title(title, lacking)}"
        found.append(f"no font has {_named(lacking)}, drawn as boxes; {way_out}")
    if reversed_order:
        found.append(
            f"text from right to left ({_named(reversed_order)}) is drawn from left to right by"
            f" this version of matplotlib; 3.11 or later orders it"
            f"{_or_no_title(title, reversed_order)}"
        )
    return found


def _texts(figure: "Figure") -> Iterator[tuple[str, tuple[str, ...]]]:
    """Yield each text that is not a number of an axis, and the families of its font."""
    found = list(figure.texts)
    for legend in figure.legends:
        found += legend.get_texts()
    for ax in figure.axes:
        found += [ax.title, ax.xaxis.label, ax.yaxis.label, *ax.texts]
        for axis in (ax.xaxis, ax.yaxis):
            # Not the ticks themselves: to ask for them lays out the axis.
            formatter = axis.get_major_formatter()
            if isinstance(formatter, FixedFormatter):
                yield "".join(map(str, formatter.seq)), tuple(axis.label.get_fontfamily())
    for text in found:
        if text.get_visible():
            yield text.get_text(), tuple(text.get_fontfamily())


def _or_no_title(title: str, letters: Iterable[str]) -> str:
    return ", or leave out the title (--no-title)" if set(letters) & set(title) else ""


def _named(letters: Iterable[str]) -> str:
    """Return characters for a message, with their numbers: a terminal may lack them too."""
    names = [
        f"{letter if letter.isprintable() else ''} (U+{ord(letter):04X})" for letter in letters
    ]
    more = f" and {len(names) - MAX_NAMED} more" if len(names) > MAX_NAMED else ""
    return ", ".join(name.strip() for name in names[:MAX_NAMED]) + more


def _has(families: tuple[str, ...], letter: str) -> bool:
    """Return whether one of the fonts of some families has a character."""
    settings: Any = rcParams  # whose names are typed one by one
    names: list[str] = []
    for family in families:
        names += settings.get(f"font.{family}", [family])
    there = [path for path in map(_path_of, names) if path] or [_path_of(ALWAYS_THERE)]
    return any(_font_has(path, letter) for path in there)


@lru_cache(maxsize=256)
def _path_of(name: str) -> str:
    """Return the file of a font; empty if there is none."""
    try:
        return str(findfont(FontProperties(family=[name]), fallback_to_default=False))
    except ValueError:
        return ""


@lru_cache(maxsize=4096)
def _font_has(path: str, letter: str) -> bool:
    return bool(get_font(path).get_char_index(ord(letter)))
