"""The writing of picture files: equal figures give identical bytes, in any thread."""

from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any
from warnings import catch_warnings, simplefilter

from frictionsim.errors import InputError, OutputError
from frictionsim.io.atomic_write import write_atomically
from frictionsim.io.replaceable import PICTURE, check_replaceable, check_target
from frictionsim.plots.parameters import default_parameters

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DOTS_PER_INCH = 100  # keeps pictures with many events below 200 KB
FORMATS = (".png", ".pdf", ".svg")
OPTIONS: dict[str, dict[str, Any]] = {
    ".png": {"metadata": {"Software": None}, "pil_kwargs": {"optimize": True}},
    ".pdf": {"metadata": {"CreationDate": None}},
    ".svg": {"metadata": {"Date": None}},
}


def check_format(path: Path) -> None:
    """Check that the suffix of a picture names a known format.

    Raises
    ------
    InputError
        If it does not.
    """
    if path.suffix.lower() not in FORMATS:
        raise InputError(f"{path}: expected a picture name that ends in .png, .pdf or .svg")


def check_picture(path: Path) -> None:
    """Check that a picture can be written, and that no other file is replaced by one.

    Raises
    ------
    InputError
        If its suffix names no known format.
    OutputError
    """
    check_format(path)
    check_target(path, PICTURE)


def save(figure: "Figure", path: Path) -> None:
    """Write a picture, whole or not at all; equal figures give identical bytes.

    Only the first picture of a figure is meant: drawing moves its texts, and the layout of the
    next starts from there.

    Parameters
    ----------
    figure : Figure
    path : Path
        Ends in .png, .pdf or .svg.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    check_format(path)
    check_replaceable(path, PICTURE)
    try:
        image = _image(figure, path.suffix.lower())
    except OSError as error:  # of fonts, and of what matplotlib keeps for itself
        raise OutputError(f"{path}: cannot write the picture: {error.strerror or error}") from None
    write_atomically(image, path, PICTURE.word)


def png(figure: "Figure") -> bytes:
    """Return a picture as the bytes of a PNG file."""
    return _image(figure, ".png")


def _image(figure: "Figure", suffix: str) -> bytes:
    buffer = BytesIO()
    with rendering():
        figure.savefig(buffer, format=suffix[1:], dpi=DOTS_PER_INCH, **OPTIONS[suffix])
    return buffer.getvalue()


@contextmanager
def rendering() -> Iterator[None]:
    """Allow one thread at a time to render, without warnings and with repeatable SVG.

    Filters of warnings belong to the whole process, as parameters do.
    """
    # Without a salt the names of SVG elements are random.
    with default_parameters(svg_hashsalt="frictionsim"), catch_warnings():
        simplefilter("ignore")  # the font may lack letters of the title
        yield
