"""How large a picture is and how it looks: size, resolution, title, and style of type and lines.

The size is that of the picture; text keeps its size in points, and the layout adapts. A style is a
set of matplotlib's parameters: `paper` and `talk` change its defaults, `user` takes the parameters
of the user, of matplotlibrc or set in Python.
"""

from math import isfinite
from typing import Any, NamedTuple

from frictionsim.errors import ArgumentError, unknown
from frictionsim.plots.parameters import defaults, of_user
from frictionsim.plots.picture_file import DOTS_PER_INCH

UNITS = {"mm": 25.4, "cm": 2.54, "in": 1.0, "pt": 72.0}  # per inch
MIN_LENGTH, MAX_LENGTH = 20.0 / 25.4, 2000.0 / 25.4  # inches
MIN_DPI, MAX_DPI = 10.0, 10_000.0
TEXT, LINE = 10.0, 1.5  # points, of text and lines where no style changes them

USER = "user"
# The widths of lines are no widths that a view gives: such are scaled, see `arrangement`.
STYLES: dict[str, dict[str, Any]] = {
    "paper": {
        "font.size": 8.0,
        "lines.linewidth": 0.95,
        "lines.markersize": 4.0,
        "axes.linewidth": 0.5,
        "axes.titlesize": "medium",
        "axes.labelpad": 2.0,
        "patch.linewidth": 0.6,
        "xtick.major.width": 0.5,
        "ytick.major.width": 0.5,
        "xtick.major.size": 2.5,
        "ytick.major.size": 2.5,
        "xtick.major.pad": 2.0,
        "ytick.major.pad": 2.0,
    },
    "talk": {
        "font.size": 16.0,
        "lines.linewidth": 2.95,
        "lines.markersize": 10.0,
        "axes.linewidth": 1.4,
        "patch.linewidth": 1.6,
        "xtick.major.width": 1.4,
        "ytick.major.width": 1.4,
        "xtick.major.size": 6.0,
        "ytick.major.size": 6.0,
    },
}


class Appearance(NamedTuple):
    """Size and style of a new picture.

    Attributes
    ----------
    width, height : float or None, inches
        None is that of the view.
    dpi : float or None
        Dots per inch of a PNG; None is the usual number.
    title : bool
    style : str
        paper, talk or user; empty is the usual one.
    fitted : bool
        Labels are broken where they are too long, also in the usual size.
    """

    width: float | None = None
    height: float | None = None
    dpi: float | None = None
    title: bool = True
    style: str = ""
    fitted: bool = False

    @property
    def dots_per_inch(self) -> float:
        """Dots per inch of a PNG."""
        return DOTS_PER_INCH if self.dpi is None else self.dpi

    @property
    def of_new_figure(self) -> str:
        """The name of an argument that only a new figure can have; empty if none is given."""
        given = {"width": self.width, "height": self.height, "dpi": self.dpi, "style": self.style}
        return next((name for name, value in given.items() if value), "")

    def parameters(self) -> dict[str, Any]:
        """Return matplotlib's parameters for this style."""
        if self.style == USER:
            # The picture has the size that is asked for, and its text is not cut; powers of ten
            # along axes, and an escaped $, are read as such.
            return of_user() | {
                "savefig.bbox": None,
                "figure.autolayout": False,
                "text.parse_math": True,
            }
        return defaults() | STYLES.get(self.style, {})


USUAL = Appearance()


def appearance(
    width: Any = None, height: Any = None, dpi: Any = None, title: Any = True, style: Any = None
) -> Appearance:
    """Return an appearance from what a user gives.

    Parameters
    ----------
    width, height : str or None
        Number and unit: mm, cm, in or pt.
    dpi : float or None
    title : bool
    style : str or None
    """
    if not isinstance(title, bool):
        raise ArgumentError("title", f"expected True or False, got {title!r:.60}")
    if style is not None and style not in (*STYLES, USER):
        raise ArgumentError("style", unknown("style", style, [*STYLES, USER]))
    return Appearance(
        None if width is None else _inches("width", width),
        None if height is None else _inches("height", height),
        None if dpi is None else _dots(dpi),
        title,
        style or "",
    )


def _inches(argument: str, text: Any) -> float:
    """Return a length of a picture in inches."""
    wanted = "expected a length with its unit (mm, cm, in or pt), as 84mm"
    if not isinstance(text, str):
        raise ArgumentError(argument, f"{wanted}, got {text!r:.60}")
    unit = next((unit for unit in UNITS if text.strip().endswith(unit)), "")
    try:
        number = float(text.strip().removesuffix(unit))
    except ValueError:
        raise ArgumentError(argument, f"{wanted}, got '{text:.60}'") from None
    if not unit:
        raise ArgumentError(argument, f"{wanted}, got '{text:.60}' without a unit")
    inches = number / UNITS[unit]
    if not MIN_LENGTH <= inches <= MAX_LENGTH:  # also nan
        limits = f"{MIN_LENGTH * UNITS[unit]:.4g} to {MAX_LENGTH * UNITS[unit]:.4g} {unit}"
        raise ArgumentError(argument, f"expected {limits}, got {text.strip():.60}")
    return inches


def _dots(number: Any) -> float:
    if isinstance(number, bool) or not isinstance(number, int | float):
        raise ArgumentError("dpi", f"expected a number of dots per inch, got {number!r:.60}")
    if not (isfinite(number) and MIN_DPI <= number <= MAX_DPI):
        raise ArgumentError(
            "dpi", f"expected {MIN_DPI:g} to {MAX_DPI:g} dots per inch, got {number:g}"
        )
    return float(number)
