"""The writing of picture files: equal figures give identical bytes, in any thread."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any
from warnings import catch_warnings, simplefilter

from frictionsim.errors import ArgumentError, InputError, OutputError
from frictionsim.io.atomic_write import write_atomically
from frictionsim.io.replaceable import PICTURE, check_replaceable, check_target
from frictionsim.plots.literal_text import without_logs
from frictionsim.plots.parameters import defaults, parameters

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DOTS_PER_INCH = 100  # keeps pictures with many events below 200 KB
MAX_SVG = 500_000  # bytes of a picture in a page
MAX_PIXELS = 100_000_000  # 400 MB while it is drawn; a page at 1200 dpi has as many
# Text that editors of publishers can search and change: fonts as TrueType, text of SVG as text.
FONTS: dict[str, Any] = {
    "pdf.fonttype": 42,
    "pdf.use14corefonts": False,
    "svg.fonttype": "none",
}
FORMATS = (".png", ".pdf", ".svg")
OPTIONS: dict[str, dict[str, Any]] = {
    ".png": {"metadata": {"Software": None}, "pil_kwargs": {"optimize": True}},
    ".pdf": {"metadata": {"CreationDate": None}},
    ".svg": {"metadata": {"Date": None}},
}


def check_format(path: Path) -> None:
    """Check that the suffix of a picture names a known format."""
    if path.suffix.lower() not in FORMATS:
        raise InputError(f"{path}: expected a picture name that ends in .png, .pdf or .svg")


def check_picture(path: Path) -> None:
    """Check that a picture can be written, and that no other file is replaced by one."""
    check_format(path)
    check_target(path, PICTURE)


def save(figure: "Figure", path: Path, dpi: float = DOTS_PER_INCH) -> None:
    """Write a picture, whole or not at all; equal figures give identical bytes.

    Only the first picture of a figure is meant: drawing moves its texts, and the layout of the
    next starts from there.

    Parameters
    ----------
    figure : Figure
    path : Path
        Ends in .png, .pdf or .svg.
    dpi : float
        Dots per inch of a PNG.
    """
    check_format(path)
    check_replaceable(path, PICTURE)
    suffix = path.suffix.lower()
    if suffix == ".png":
        _check_pixels(figure, dpi)
    try:
        image = _image(figure, suffix, dpi)
    except OSError as error:  # of fonts, and of what matplotlib keeps for itself
        raise OutputError(f"{path}: cannot write the picture: {error.strerror or error}") from None
    write_atomically(image, path, PICTURE.word)


def _check_pixels(figure: "Figure", dpi: float) -> None:
    width, height = (float(size) * dpi for size in figure.get_size_inches())
    if width * height > MAX_PIXELS:
        raise ArgumentError(
            "dpi",
            f"a picture of {width:.0f} x {height:.0f} dots is too large, {MAX_PIXELS:.0e} are the"
            " most; give a smaller number, or write a .pdf or .svg, which has no dots",
        )


def png(figure: "Figure") -> bytes:
    """Return a picture as the bytes of a PNG file."""
    return _image(figure, ".png")


def image_for_page(figure: "Figure") -> bytes:
    """Return a picture as SVG, or as PNG where it has so many parts that SVG would be large."""
    image = _image(figure, ".svg")
    return image if len(image) <= MAX_SVG else _image(figure, ".png")


def _image(figure: "Figure", suffix: str, dpi: float = DOTS_PER_INCH) -> bytes:
    buffer = BytesIO()
    with rendering(getattr(figure, "parameters", None)):
        figure.savefig(buffer, format=suffix[1:], dpi=dpi, **OPTIONS[suffix])
    return buffer.getvalue()


@contextmanager
def rendering(values: Mapping[str, Any] | None = None) -> Iterator[None]:
    """Allow one thread at a time to render, without warnings and with repeatable SVG.

    Filters of warnings belong to the whole process, as parameters do.

    Parameters
    ----------
    values : mapping, optional
        The parameters of matplotlib that the figure was drawn with; by default its defaults.
    """
    # Without a salt the names of SVG elements are random.
    wanted = {**(defaults() if values is None else values), "svg.hashsalt": "frictionsim", **FONTS}
    with parameters(wanted), catch_warnings(), without_logs():
        simplefilter("ignore")  # of letters that a font lacks, which are drawn as boxes
        try:
            yield
        except RuntimeError as error:
            if not wanted["text.usetex"]:
                raise
            raise InputError(
                "cannot draw with the user's settings of matplotlib: text.usetex needs LaTeX"
                f" ({str(error).splitlines()[0]})"
            ) from None
