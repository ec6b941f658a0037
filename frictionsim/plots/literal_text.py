r"""Texts of pictures as they are: none is read as a formula or as commands of TeX.

Titles, names and units come from files, which others may have written. matplotlib typesets what is
between two $, and fails where it is no formula; TeX, which a user may have set, can even read files
by command. So views write texts as they are, and `literally` escapes all that they have drawn.
Numbers along axes remain as matplotlib writes them, with raised powers of ten; a view escapes names
along axes by `literal`.
"""

from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from logging import LogRecord, getLogger
from typing import Any

from matplotlib import rcParams
from matplotlib.axis import Axis
from matplotlib.text import Text

from frictionsim.io.terminal import visible

# What says on stderr, for each text and letter, that a font lacks it.
LOGGERS = ("matplotlib.mathtext", "matplotlib._mathtext")
TEX = str.maketrans(
    {letter: f"\\{letter}" for letter in "$%&#_{}"}
    | {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}"}
)


def shown(text: str) -> str:
    r"""Return a text without what no font draws: control characters are escapes as \x1b.

    So are marks that change the direction of writing, and halves of characters that are stored in
    two. A tab is a space.
    """
    whole = text.encode("utf-8", "backslashreplace").decode("utf-8")
    return visible(whole.replace("\t", " "))


def literal(text: str) -> str:
    """Escape a text for Matplotlib's mathtext.

    Parameters
    ----------
    text : str
        Of a tick of an axis, or one that changes; `literally` cares for all others.
    """
    if rcParams["text.usetex"]:
        return shown(text).translate(TEX)
    # A backslash before the $, and not `parse_math`, which matplotlib forgets where it wraps lines.
    return shown(text).replace("$", r"\$")


def literally(draw: Callable[[Any], None], figure: Any) -> None:
    """Draw into a figure, and have all texts of it drawn as they are.

    Parameters
    ----------
    draw : callable
        Takes the figure.
    figure : Figure or SubFigure
        Texts that it has before stay.
    """
    before = {text: text.get_text() for text in _texts(figure)}
    draw(figure)
    _escape(text for text in _texts(figure) if before.get(text) != text.get_text())


def make_literal(figure: Any) -> None:
    """Have all texts of a drawn figure drawn as they are; only once."""
    _escape(_texts(figure))


def _escape(texts: Iterable[Text]) -> None:
    for text in list(texts):
        text.set_text(literal(text.get_text()))


def _texts(artist: Any) -> Iterator[Text]:
    """Yield the texts in an artist, but those of ticks: to ask for them lays out the axis."""
    children = [artist.label] if isinstance(artist, Axis) else artist.get_children()
    for child in children:
        if isinstance(child, Text):
            yield child
        else:
            yield from _texts(child)


@contextmanager
def without_logs() -> Iterator[None]:
    """Keep matplotlib from logging which letters its fonts lack."""
    loggers = [getLogger(name) for name in LOGGERS]
    for logger in loggers:
        logger.addFilter(_refuse)
    try:
        yield
    finally:
        for logger in loggers:
            logger.removeFilter(_refuse)


def _refuse(_record: LogRecord) -> bool:
    return False
