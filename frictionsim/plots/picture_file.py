"""The writing of picture files: equal figures give identical bytes, in any thread.

matplotlib's parameters are at their defaults meanwhile, so that a picture does not depend on who
draws it.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from io import BytesIO
from logging import ERROR, LogRecord, getLogger
from pathlib import Path
from threading import RLock
from typing import TYPE_CHECKING, Any
from warnings import catch_warnings, simplefilter

from frictionsim.errors import ArgumentError, InputError, OutputError
from frictionsim.io.output_file import PICTURE, check_output, check_replaceable, write_file

if TYPE_CHECKING:
    from matplotlib.figure import Figure


# Without a home matplotlib says so on stderr; it works, in a folder for temporary files.
_logger, _level = getLogger("matplotlib"), getLogger("matplotlib").level
_logger.setLevel(ERROR)
try:
    import matplotlib as mpl
    import matplotlib.font_manager  # which keeps a list of fonts in a folder
except UnicodeDecodeError as error:
    raise InputError(
        f"cannot draw: the file matplotlibrc, of this folder or the user, is not text: {error}"
    ) from None
except OSError as error:
    raise OutputError(
        f"cannot draw: matplotlib found no folder for its settings and fonts ({error}); set"
        " MPLCONFIGDIR to one that can be written to"
    ) from None
finally:
    _logger.setLevel(_level)

# Of matplotlib.style: what is about windows and files and not about how a picture looks.
NO_STYLE = {
    "backend",
    "backend_fallback",
    "date.epoch",
    "docstring.hardcopy",
    "figure.max_open_warning",
    "figure.raise_window",
    "interactive",
    "savefig.directory",
    "timezone",
    "tk.window_focus",
    "toolbar",
    "webagg.address",
    "webagg.open_in_browser",
    "webagg.port",
    "webagg.port_retries",
}

_lock = RLock()


def defaults() -> dict[str, Any]:
    """Return the defaults of all parameters that are about how a picture looks.

    One differs: matplotlib would move a part of nearly equal tick labels, +1.23e2, into a corner.
    """
    return _style_parameters(mpl.rcParamsDefault) | {"axes.formatter.useoffset": False}


def user_parameters() -> dict[str, Any]:
    """Return the parameters that the user has set, in matplotlibrc or in Python."""
    return _style_parameters(mpl.rcParams)


def _style_parameters(values: Any) -> dict[str, Any]:  # whose names are typed one by one
    return {name: value for name, value in values.items() if name not in NO_STYLE}


@contextmanager
def parameters(wanted: Mapping[str, Any]) -> Iterator[None]:
    """Have some of matplotlib's parameters at given values, in one thread at a time.

    Parameters belong to the whole process: two threads that change and restore them in turn would
    leave the values of the first. Only those that differ are changed, and only those that nobody
    has changed since are restored, so that a change by the user in another thread is not lost.

    Parameters
    ----------
    wanted : mapping
        By name; the others stay.
    """
    current: Any = mpl.rcParams
    with _lock:
        before = {name: current[name] for name, value in wanted.items() if current[name] != value}
        _set(current, {name: wanted[name] for name in before})
        try:
            yield
        finally:
            _set(current, {k: v for k, v in before.items() if current[k] == wanted[k]})


def _set(parameters: Any, values: dict[str, Any]) -> None:
    with catch_warnings():
        simplefilter("ignore")  # of parameters that are deprecated
        parameters.update(values)


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
    check_output(path, PICTURE)


def save(figure: "Figure", path: Path, dpi: float = DOTS_PER_INCH) -> None:
    """Write a picture, whole or not at all; equal figures give identical bytes.

    Only the first picture of a figure is meant: drawing moves its texts, and the layout of the
    next starts from there.

    Parameters
    ----------
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
    write_file(path, image, PICTURE)


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


# What says on stderr, for each text and letter, that a font lacks it.
LOGGERS = ("matplotlib.mathtext", "matplotlib._mathtext")


@contextmanager
def suppressed_logs() -> Iterator[None]:
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
    with parameters(wanted), catch_warnings(), suppressed_logs():
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
