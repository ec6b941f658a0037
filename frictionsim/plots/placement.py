"""Where a view is drawn: a new figure, or the place of given Axes; and how its parts fit there.

Matplotlib's constrained layout makes room for titles, labels and legends. What is left to do here,
in a picture whose size is given, is what it does not: it breaks no labels into lines where they are
longer than their panels (the picture becomes higher for them), and it takes away no ticks at given
values and no labels of events that would overlap in narrow panels.
"""

from collections.abc import Callable
from itertools import pairwise
from typing import TYPE_CHECKING, Any
from warnings import catch_warnings, simplefilter

import numpy as np
from matplotlib import rcParams
from matplotlib.axes import Axes
from matplotlib.backend_bases import FigureCanvasBase
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure, SubFigure
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.ticker import NullLocator

from frictionsim.errors import ArgumentError, InputError
from frictionsim.plots.picture_file import FONTS, parameters, png, rendering
from frictionsim.plots.style import LINE, POINTS, USUAL, WIDTH, Appearance, text_scale, title_height
from frictionsim.plots.texts import LINE_SPACING, make_literal, wrapped

if TYPE_CHECKING:
    from matplotlib.gridspec import SubplotSpec

TITLE_ROOM = 0.9  # of the width of a panel: there may be another one beside it
MIN_SIDE = 0.25  # inches, of a panel that shows anything
COLLAPSED = "collapsed to zero"  # what matplotlib says if there is no room
COLOUR_BAR = "<colorbar>"  # the label that matplotlib gives to its axes
INCHES_TO_MM = 25.4


def arrange(figure: "Figure", appearance: Appearance) -> None:
    """Make a drawn figure fit its size and style."""
    _scale_lines(figure)
    if not appearance.title:
        _remove_title(figure)
    if appearance.height is not None:
        figure.set_figheight(appearance.height)
    # The first layout says how much room there is for the labels; the second has them in lines.
    _lay_out(figure, appearance)
    further = _break_labels(figure)
    if further and appearance.height is None:
        figure.set_figheight(figure.get_figheight() + further / POINTS)
    _lay_out(figure, appearance)
    if _thin_ticks(figure):
        _lay_out(figure, appearance)
    _hide_overlapping(figure)


def _thin_ticks(figure: "Figure") -> bool:
    """Take away every second tick where their labels overlap; return whether there are such."""
    thinned = False
    for axis in (axis for ax in figure.axes for axis in (ax.xaxis, ax.yaxis)):
        while True:
            low, high = sorted(axis.get_view_interval())
            ticks = [tick for tick in axis.get_majorticklocs() if low <= tick <= high]
            shown = [label for label in axis.get_ticklabels() if label.get_text()]
            boxes = [label.get_window_extent() for label in shown if label.get_visible()]
            if len(ticks) < 2 or not any(a.overlaps(b) for a, b in pairwise(boxes)):
                break
            axis.set_ticks(ticks[::2])
            axis.set_minor_locator(NullLocator())
            thinned = True
    return thinned


def _hide_overlapping(figure: "Figure") -> None:
    """Hide labels above panels that overlap others: a view cannot know how wide its panels are."""
    for ax in figure.axes:
        top, kept = ax.get_window_extent().y1, list[Any]()
        above = [text for text in ax.texts if text.get_window_extent().y0 >= top]
        for text in sorted(above, key=lambda text: float(text.get_window_extent().x0)):
            box = text.get_window_extent()
            if any(box.overlaps(other) for other in kept):
                text.set_visible(False)
            else:
                kept.append(box)


def _scale_lines(figure: "Figure") -> None:
    """Give lines and markers the width and size of the style, where a view has set its own."""
    width, size = float(rcParams["lines.linewidth"]), float(rcParams["lines.markersize"])
    factor, larger = width / LINE, text_scale()
    if factor == 1.0 and larger == 1.0:
        return
    drawn: list[Any] = [*figure.legends]
    for ax in figure.axes:
        drawn += [*ax.lines, *ax.collections, *ax.patches]
    for artist in [artist for one in drawn for artist in one.findobj()]:
        if artist.get_path_effects():  # their widths are those of what is drawn over them
            continue
        if isinstance(artist, Line2D):
            if artist.get_linewidth() != width:
                artist.set_linewidth(factor * artist.get_linewidth())
            if artist.get_markersize() != size:
                artist.set_markersize(larger * artist.get_markersize())
        elif isinstance(artist, LineCollection):
            widths: Any = np.atleast_1d(artist.get_linewidth())
            artist.set_linewidth(factor * widths)
        elif isinstance(artist, Patch) and artist.get_linewidth() != rcParams["patch.linewidth"]:
            artist.set_linewidth(factor * artist.get_linewidth())


def _remove_title(figure: "Figure") -> None:
    """Remove the title; the height follows."""
    title = figure.get_suptitle()
    # An empty title would have a margin.
    figure.suptitle("").set_in_layout(False)
    if title:
        height = figure.get_figheight() - title_height(title)
        figure.set_figheight(height)


def _break_labels(figure: "Figure | SubFigure") -> float:
    """Break labels that are longer than their panels; return the height of new lines in points."""
    further = 0.0
    for ax in figure.axes:
        box = ax.get_window_extent()
        width, height = (
            POINTS * float(side) / _root(figure).dpi for side in (box.width, box.height)
        )
        for text, available in (
            (ax.xaxis.label, width),
            (ax.title, TITLE_ROOM * width),
            (ax.yaxis.label, height),
        ):
            size = float(text.get_fontsize())
            broken = wrapped(text.get_text(), available, size)
            lines = broken.count("\n") - text.get_text().count("\n")
            if lines:
                text.set_text(broken)
            if text is not ax.yaxis.label:
                further = max(further, LINE_SPACING * size * lines)
    return further


def _lay_out(figure: "Figure", appearance: Appearance) -> None:
    with catch_warnings(record=True) as said:
        simplefilter("always")
        figure.draw_without_rendering()
    # One with equal scales is as low as what it shows.
    panels = [
        ax
        for ax in figure.axes
        if ax.get_label() != COLOUR_BAR and (ax.get_aspect() == "auto" or not ax.axison)
    ]
    sides = [float(side) for ax in panels for side in ax.get_window_extent().size]
    collapsed = any(COLLAPSED in str(warning.message) for warning in said)
    if not collapsed and all(side >= MIN_SIDE * figure.dpi for side in sides):
        return
    width, height = (INCHES_TO_MM * float(side) for side in figure.get_size_inches())
    which = "wider" if appearance.height is None else "higher or wider"
    raise InputError(
        f"cannot draw this view in {width:.0f} mm x {height:.0f} mm: there is no room for its"
        f" panels beside their labels; make the picture {which}, choose a style with smaller text"
        " (paper), or leave out the title"
    )


DrawFunction = Callable[[Figure | SubFigure], None]
"""Draws into an empty figure or subfigure."""


class NotebookFigure(Figure):
    """A figure that a notebook shows without pyplot.

    Attributes
    ----------
    parameters : dict or None
        The parameters of matplotlib that it was drawn with, if they are not the defaults.
    """

    parameters: dict[str, Any] | None = None

    def _repr_png_(self) -> bytes:
        return png(self)

    def savefig(self, *args: Any, **options: Any) -> None:
        """Save the figure as matplotlib does, with text that can be searched and changed."""
        with parameters({**(self.parameters or {}), **FONTS}):
            super().savefig(*args, **options)


def drawn_in(
    view: DrawFunction, ax: Any = None, width: float = WIDTH, appearance: Appearance = USUAL
) -> Figure:
    """Draw a view where the caller wants it; return the whole figure.

    Parameters
    ----------
    ax : Axes, optional
        Empty Axes of a grid, in whose place the view is drawn, with the parameters of matplotlib
        that there are. A new figure has the defaults.
    width : float, inches
        Of a new figure.
    appearance : Appearance
        Only a title can be left out where there is no new figure.
    """
    if ax is None:
        return _new(view, width, appearance)
    if appearance.new_figure_option:
        raise ArgumentError(
            appearance.new_figure_option,
            "is of a new picture; leave it out where the view is drawn in place of axes",
        )
    return _replace(view, ax, appearance.title)


def _new(view: DrawFunction, width: float, appearance: Appearance) -> Figure:
    values = appearance.parameters()
    side = width if appearance.width is None else appearance.width
    with parameters(values):
        figure = NotebookFigure(figsize=(side, side), layout="constrained")
        if appearance.style:
            figure.parameters = values
        view(figure)
        make_literal(figure)
        if not appearance.is_usual:
            with rendering(values):  # which says what the user's settings lack
                FigureCanvasAgg(figure)  # the plain canvas makes a renderer for each measurement
                arrange(figure, appearance)
                FigureCanvasBase(figure)  # lets go of the renderer
            if appearance.dpi is not None:
                figure.set_dpi(appearance.dpi)
    return figure


def _replace(view: DrawFunction, ax: Any, title: bool) -> Figure:
    """Draw a view in the place of Axes; they are removed when this has succeeded."""
    spec = _place_of(ax)
    part, root = ax.figure.add_subfigure(spec), _root(ax.figure)
    layout = root.get_layout_engine()
    try:
        if not isinstance(layout, ConstrainedLayoutEngine):
            # The only layout that makes room for the titles and legends of parts of a figure.
            root.set_layout_engine("constrained")
        view(part)
        make_literal(part)
        if not title:
            part.suptitle("").set_in_layout(False)
        root.draw_without_rendering()
        _break_labels(part)
    except BaseException:
        for artist in (*part.axes, *part.legends):
            artist.remove()
        part.remove()
        root.set_layout_engine(layout or "none")
        raise
    ax.remove()
    return root


def _root(figure: Figure | SubFigure) -> Figure:
    """Return the figure of a subfigure at any depth."""
    return figure.canvas.figure


def _type(value: Any) -> str:
    return type(value).__name__


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
            " subplots"
        )
    return spec
