r"""Texts of pictures as they are: none is read as a formula or as commands of TeX.

Titles, names and units come from files, which others may have written. matplotlib typesets what is
between two $, and fails where it is no formula; TeX, which a user may have set, can even read files
by command. So views write texts as they are, and `make_literal` has matplotlib not parse them.
Numbers along axes remain as matplotlib writes them, with raised powers of ten; names along axes are
set with LITERAL.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from logging import LogRecord, getLogger
from typing import Any

from matplotlib import rcParams
from matplotlib.axis import Axis
from matplotlib.text import Text

from frictionsim.io.terminal import visible

# What says on stderr, for each text and letter, that a font lacks it.
LOGGERS = ("matplotlib.mathtext", "matplotlib._mathtext")
LITERAL: dict[str, Any] = {"parse_math": False}  # of the labels of ticks, as `literal` has them
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
