"""The strip above the errors of a cost diagram, in which the runs that failed are marked."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.plots.style import GREY, STICK_COLOUR

if TYPE_CHECKING:
    import numpy.typing as npt

    Array = npt.NDArray[np.float64]

STRIP = 0.09  # of the height of a panel


def add_strip(ax: Any) -> float:
    """Extend the scale of errors of a panel by a strip for failed runs; return its middle.

    Parameters
    ----------
    ax : Axes
        With its limits, and a logarithmic scale of y.
    """
    low, high = ax.get_ylim()
    top = high * (high / low) ** (STRIP / (1.0 - STRIP))
    ax.axhspan(high, top, facecolor=STICK_COLOUR, linewidth=0, zorder=0.5)
    ax.axhline(high, color=GREY, linewidth=0.8)
    ax.set_yticks([tick for tick in ax.get_yticks() if low <= tick <= high])  # none in the strip
    ax.set_yticks([], minor=True)
    ax.set_ylim(low, top)
    if ax.get_subplotspec() is None or ax.get_subplotspec().is_first_col():
        ax.annotate(
            "failed",
            (0.0, 1.0 - 0.5 * STRIP),
            (-5.0, 0.0),
            xycoords="axes fraction",
            textcoords="offset points",
            ha="right",
            va="center",
            fontsize="small",
        )
    return float(np.sqrt(high * top))


def places_of(work: Sequence[float], others: Sequence[float]) -> "Array":
    """Return where failed runs are marked along an axis of work, which is logarithmic.

    One that was refused has done none: it is marked at the least work of all.
    """
    done = [value for value in (*work, *others) if value > 0.0]
    return np.maximum(np.asarray(work, dtype=np.float64), min(done, default=1.0))
