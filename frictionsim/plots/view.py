"""A view of a kind of mechanism: how it is drawn, and which part of a result it can show."""

from collections.abc import Callable
from typing import NamedTuple

from frictionsim.plots.window import Extent


class View(NamedTuple):
    """A picture of a kind.

    Attributes
    ----------
    draw : callable
        `draw(result, figure, **options)` draws a result into an empty figure or subfigure.
    instant, window, channels : bool
        Whether it shows a single instant, a window of time, or other channels than its own.
    overlaid : tuple of str or None
        The channels in which several results are drawn over each other, () for those of a view
        over time; None for a view in which they are not.
    effect : str
        What the results have that it is of; empty if all have it.
    """

    draw: Callable[..., None]
    instant: bool = False
    window: bool = False
    channels: bool = False
    overlaid: tuple[str, ...] | None = None
    effect: str = ""

    def applicable(self, shown: Extent) -> Extent:
        """Return the part of an extent that it can show."""
        return Extent(
            shown.time if self.instant else None,
            shown.start if self.window else None,
            shown.stop if self.window else None,
            shown.channels if self.channels else (),
        )


def over_time(draw: Callable[..., None], overlaid: tuple[str, ...] = ()) -> View:
    """Return a view over time of channels that may be chosen."""
    return View(draw, window=True, channels=True, overlaid=overlaid)
