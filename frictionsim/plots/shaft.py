"""The pictures of a body on a dry shaft."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from frictionsim.plots import time_history
from frictionsim.plots.friction_circle import friction_circle as friction_circle
from frictionsim.plots.static_limit import draw_static_limit
from frictionsim.plots.style import add_legend

if TYPE_CHECKING:
    from matplotlib.figure import Figure, SubFigure

    from frictionsim.results import Record


def response(result: "Record", figure: "Figure | SubFigure", channels: Sequence[str] = ()) -> None:
    """Draw channels over time, with the static limit of the friction torque."""
    axes, handles = time_history.draw_channels(result, figure, channels)
    add_legend(figure, [*handles, *draw_static_limit(axes, result)])
