"""The writing of picture files: equal figures give identical bytes, in any thread."""

from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from os.path import isdir
from pathlib import Path
from threading import RLock
from typing import TYPE_CHECKING, Any
from warnings import catch_warnings, simplefilter

import matplotlib as mpl

from frictionsim.errors import InputError, OutputError
from frictionsim.io.atomic_write import check_replaceable

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DOTS_PER_INCH = 100  # keeps pictures with many events below 200 KB
FORMATS = (".png", ".pdf", ".svg")
OPTIONS: dict[str, dict[str, Any]] = {
    ".png": {"metadata": {"Software": None}, "pil_kwargs": {"optimize": True}},
    ".pdf": {"metadata": {"CreationDate": None}},
    ".svg": {"metadata": {"Date": None}},
}

_lock = RLock()


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
    """Check that no other file than a picture is replaced by one.

    Raises
    ------
    OutputError
        If one would be.
    """
    check_replaceable(path, (b"\x89PNG", b"%PDF", b"<?xml", b"<svg"), "a picture")


def save(figure: "Figure", path: Path) -> None:
    """Write a picture; equal figures give identical bytes.

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
    check_picture(path)
    try:
        with rendering():
            figure.savefig(path, dpi=DOTS_PER_INCH, **OPTIONS[path.suffix.lower()])
    except OSError as error:
        missing = f"there is no folder '{path.parent}'" if not isdir(path.parent) else ""
        why = missing or error.strerror or error
        raise OutputError(f"{path}: cannot write the picture: {why}") from None


def png(figure: "Figure") -> bytes:
    """Return a picture as the bytes of a PNG file."""
    buffer = BytesIO()
    with rendering():
        figure.savefig(buffer, format="png", dpi=DOTS_PER_INCH, **OPTIONS[".png"])
    return buffer.getvalue()


@contextmanager
def rendering() -> Iterator[None]:
    """Allow one thread at a time to render, without warnings and with repeatable SVG.

    Filters of warnings and parameters of matplotlib belong to the whole process: two threads that
    change and restore them in turn would leave the values of the first. Only the one parameter is
    restored, so that a change by the user in another thread is not lost.
    """
    with _lock, catch_warnings():
        simplefilter("ignore")  # the font may lack letters of the title
        salt = mpl.rcParams["svg.hashsalt"]
        mpl.rcParams["svg.hashsalt"] = (
            "frictionsim"  # otherwise the names of SVG elements are random
        )
        try:
            yield
        finally:
            mpl.rcParams["svg.hashsalt"] = salt
