"""Where a view is drawn: a new figure, a given figure or subfigure, or the place of given Axes."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure, SubFigure
from matplotlib.layout_engine import ConstrainedLayoutEngine

from frictionsim.errors import ArgumentError, InputError
from frictionsim.plots.appearance import USUAL, Appearance
from frictionsim.plots.arrangement import arrange
from frictionsim.plots.glyphs import faults_of
from frictionsim.plots.literal_text import literally
from frictionsim.plots.parameters import parameters
from frictionsim.plots.picture_file import FONTS, png, rendering
from frictionsim.plots.style import WIDTH

if TYPE_CHECKING:
    from matplotlib.gridspec import SubplotSpec

View = Callable[[Figure | SubFigure], None]
"""Draws into an empty figure or subfigure."""


class Picture(Figure):
    """A figure that a notebook shows without pyplot.

    Attributes
    ----------
    parameters : dict or None
        The parameters of matplotlib that it was drawn with, if they are not the defaults.
    faults : tuple of str
        Sentences on characters that are not drawn as they should be.
    """

    parameters: dict[str, Any] | None = None
    faults: tuple[str, ...] = ()

    def _repr_png_(self) -> bytes:
        return png(self)

    def savefig(self, *args: Any, **options: Any) -> None:
        """Save the figure as matplotlib does, with text that can be searched and changed."""
        with parameters({**(self.parameters or {}), **FONTS}):
            super().savefig(*args, **options)


def drawn_in(
    view: View,
    figure: Figure | SubFigure | None = None,
    ax: Any = None,
    width: float = WIDTH,
    look: Appearance = USUAL,
) -> Figure:
    """Draw a view where the caller wants it; return the whole figure.

    Parameters
    ----------
    view : View
    figure : Figure or SubFigure, optional
        An empty one; it is drawn into with the parameters of matplotlib that there are. A new one
        has the defaults.
    ax : Axes, optional
        Empty Axes of a grid, in whose place the view is drawn.
    width : float, inches
        Of a new figure.
    look : Appearance
        Only a title can be left out where there is no new figure.

    Raises
    ------
    InputError
        If both are given, the figure is not empty, or the axes cannot be replaced. Then, and
        where the view raises, figure and axes are as before. If a new figure has no room for the
        view.
    """
    if figure is not None and ax is not None:
        raise InputError("expected a figure or axes to draw into, got both; leave one out")
    if figure is None and ax is None:
        return _new(view, width, look)
    if look.of_new_figure:
        raise ArgumentError(
            look.of_new_figure,
            "is of a new picture; leave it out where the view is drawn into a figure or axes",
        )
    drawn = view if look.title else _untitled(view)
    if ax is not None:
        return _replace(drawn, ax)
    assert figure is not None
    _check_empty(figure)
    return _fill(drawn, figure)


def _new(view: View, width: float, look: Appearance) -> Figure:
    values = look.parameters()
    side = width if look.width is None else look.width
    with parameters(values):
        figure = Picture(figsize=(side, side), layout="constrained")
        if look.style:
            figure.parameters = values
        if look == USUAL:
            literally(view, figure)
        else:
            with rendering(values):  # which says what the user's settings lack
                literally(view, figure)
                arrange(figure, look)
            if look.dpi is not None:
                figure.set_dpi(look.dpi)
        figure.faults = tuple(faults_of(figure))
    return figure


def _untitled(view: View) -> View:
    def draw(figure: Figure | SubFigure) -> None:
        view(figure)
        figure.suptitle("").set_in_layout(False)

    return draw


def _check_empty(figure: Any) -> None:
    if not isinstance(figure, Figure | SubFigure):
        raise InputError(f"figure: expected a matplotlib Figure or SubFigure, got {_type(figure)}")
    if figure.axes or figure.subfigs:
        raise InputError(
            "figure: expected an empty figure, got one with axes or subfigures; give one of its"
            " axes as ax, to draw in their place, or an empty subfigure"
        )


def _type(value: Any) -> str:
    return type(value).__name__


def _replace(view: View, ax: Any) -> Figure:
    """Draw a view in the place of Axes; they are removed when this has succeeded."""
    spec = _place_of(ax)
    part = ax.figure.add_subfigure(spec)
    try:
        root = _fill(view, part)
    except BaseException:
        part.remove()
        raise
    ax.remove()
    return root


def _place_of(ax: Any) -> "SubplotSpec":
    if not isinstance(ax, Axes):
        raise InputError(
            f"ax: expected matplotlib Axes, got {_type(ax)}; of several, choose one, as axes[0, 1]"
        )
    if ax.figure is None:
        raise InputError("ax: these axes were removed from their figure; a view takes their place")
    if ax.has_data():
        raise InputError("ax: expected empty axes, got some with data; a view takes their place")
    spec = ax.get_subplotspec()
    if spec is None:
        raise InputError(
            "ax: expected axes of a grid, as plt.subplots() makes, got axes placed by hand; use"
            " subplots, or give an empty figure or subfigure as figure"
        )
    return spec


def _fill(view: View, figure: Figure | SubFigure) -> Figure:
    """Draw a view into an empty figure or subfigure; take back what it drew if it raises."""
    root = figure.canvas.figure  # also of a subfigure, at any depth
    width, height = root.get_size_inches()
    title = figure.get_suptitle()
    try:
        literally(view, figure)
        if not isinstance(root.get_layout_engine(), ConstrainedLayoutEngine):
            _arrange(view, figure, root)
    except BaseException:
        for artist in (*figure.axes, *figure.legends):
            artist.remove()
        figure.suptitle(title)
        root.set_size_inches(width, height)
        raise
    return root


def _arrange(view: View, figure: Figure | SubFigure, root: Figure) -> None:
    """Place the parts of a drawn view so that its texts do not overlap, in any layout.

    The places are those in a trial figure of the same size with constrained layout, the only
    layout that makes room for titles and legends of figures. The caller's layout stays.
    """
    box = figure.bbox
    size = float(box.width / root.dpi), float(box.height / root.dpi)
    trial = Figure(figsize=size, dpi=root.dpi, layout="constrained")
    model: Any = trial if figure is root else trial.subfigures()
    literally(view, model)
    with rendering():
        trial.draw_without_rendering()
    for ax, placed in zip(figure.axes, model.axes, strict=True):
        ax.set_position(placed.get_position(original=True))
    for text, placed in zip(figure.texts, model.texts, strict=False):
        text.set_position(placed.get_position())
