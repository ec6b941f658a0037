"""The layout of a belt drive: tension, forces on the contact arcs, sticking and slipping."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle
from matplotlib.patheffects import withStroke

from frictionsim.plots.belt_forces import draw_forces, force_handles, largest_force, mark_modes
from frictionsim.plots.belt_geometry import Pulley, has_friction, pulleys_of
from frictionsim.plots.belt_motion import draw_belt_motion, draw_rotation, speeds_of
from frictionsim.plots.belt_shape import (
    TENSION_COLOURS,
    Belt,
    ContactArc,
    belt_of,
    contact_arc,
    patch_of,
)
from frictionsim.plots.style import (
    BLACK,
    GREY,
    Style,
    add_legend,
    axis_label,
    relative_width,
    require_channels,
    set_up,
    shrink,
    width_of,
    with_unit,
)

if TYPE_CHECKING:
    from matplotlib.figure import SubFigure

    from frictionsim.results import Record

NEEDED = ("x", "y", "tension", "normal_force", "pulley_index")
PULLEY_COLOUR = "#EEEEEE"
MAX_IN_A_ROW, MAX_DETAILS = 4, 8
NARROW = 0.6  # of the usual width: half as many in a row
MAX_SIDE = 3.0  # inches, of a detail
MIN_HEIGHT, HIGH, MAX_HEIGHT = 0.8, 2.0, 4.0  # inches, of the whole drive
MARGIN = 0.8  # inches, for the title and the colour bar
TITLE = 0.5  # inches, of a detail
WINDOW = 1.75  # radii, from the centre of a pulley to the edge of its detail
POINTS = 72.0  # per inch
WHOLE, DETAIL = 4.5, 6.0  # points, width of the belt in the whole and in a detail
HALO = [withStroke(linewidth=2.0, foreground="white")]
# Teeth on both sides of the belt, which are seen in grey too.
PATCH: Style = {"color": BLACK, "linestyle": (0, (0.12, 0.3)), "zorder": 1.5}
TEETH = 6.0  # points, by how much these are wider than the belt


def drive(result: "Record", figure: "Figure | SubFigure") -> None:
    """Draw the belt and its pulleys at the last sample, and details of the pulleys with forces.

    The belt is coloured by its tension. Outward bars are the normal forces on its bodies, inward
    bars the friction forces. A strip on the belt is black where it sticks, white where it slips.
    """
    shows_friction = has_friction(result)
    require_channels(
        result, "drive", (*NEEDED, *(("friction_force", "sticking") if shows_friction else ()))
    )
    pulleys, belt = pulleys_of(result), belt_of(result)
    touches = [
        contact_arc(result, i, pulley, belt, shows_friction) for i, pulley in enumerate(pulleys)
    ]
    shown = pulleys[:MAX_DETAILS]
    relative = relative_width(figure)
    columns = min(len(shown), MAX_IN_A_ROW if relative > NARROW else MAX_IN_A_ROW // 2)
    rows = -(-len(shown) // columns)
    side = min(width_of(figure) / columns, MAX_SIDE)
    height = _height_of_whole(belt, width_of(figure))
    heights = [MARGIN + height, *[side + TITLE] * rows]
    set_up(figure, result, sum(heights), *_notes(pulleys), scaled=False)
    parts = figure.add_gridspec(1 + rows, columns, height_ratios=heights)
    whole = figure.add_subplot(parts[0, :])
    patch, rims = patch_of(result, belt), speeds_of(result, pulleys)
    _draw_whole(whole, pulleys, belt, touches)
    whole.set_title(_time(result), fontsize="small", loc="left")
    draw_belt_motion(whole, result, belt, rims)
    length = 0.5 if height > HIGH else 1.0
    colours = figure.colorbar(
        belt.colours, ax=whole, location="bottom", shrink=length, aspect=60 * length
    )
    colours.set_label(axis_label("tension", "N"))
    force = largest_force(touches)
    details = []
    for i, pulley in enumerate(shown):
        ax = figure.add_subplot(parts[1 + i // columns, i % columns])
        ax.set_axis_off()
        details.append(ax)
        pitch_points = POINTS * 0.5 * side / WINDOW * belt.pitch / pulley.radius
        caption = ax.set_title(_caption(result, i, pulley), fontsize="small")
        if not isinstance(figure, Figure):
            shrink(caption, relative * MAX_IN_A_ROW / columns)
        _draw_detail(ax, pulleys, i, belt)
        draw_rotation(ax, pulley, float(rims[i]))
        draw_forces(ax, pulley, touches[i], force, pitch_points)
    handles = force_handles(shows_friction)
    if patch is not None:
        for ax, width in ((whole, WHOLE), *((ax, DETAIL) for ax in details)):
            ax.plot(*patch.line.T, **PATCH, linewidth=width + TEETH, scalex=False, scaley=False)
        handles.append(Line2D([], [], **PATCH, linewidth=0.7 * TEETH, label=patch.words))
    add_legend(figure, handles, columns=3)


def _notes(pulleys: Sequence[Pulley]) -> list[str]:
    """Return the notes for the title: whether pulleys are omitted in the details."""
    if len(pulleys) <= MAX_DETAILS:
        return []
    return [f"forces on the first {MAX_DETAILS} of {len(pulleys)} pulleys"]


def _time(result: "Record") -> str:
    """Return the time of the picture, which is in it with a title and without."""
    return f"at {result.channels['time'][-1]:.6g} s"


def _height_of_whole(belt: Belt, width: float) -> float:
    """Return the height of the whole drive where it has a width; both in inches."""
    wide, high = np.ptp(belt.bodies, axis=0)
    return float(np.clip(width * high / max(wide, 1e-9 * high), MIN_HEIGHT, MAX_HEIGHT))


def _draw_whole(
    ax: Any,
    pulleys: Sequence[Pulley],
    belt: Belt,
    touches: Sequence[ContactArc],
) -> None:
    for pulley in pulleys:
        ax.add_patch(_disc(pulley))
        ax.annotate(
            pulley.name,
            (pulley.x, pulley.y),
            ha="center",
            va="center",
            fontsize="x-small",
            zorder=6,
            path_effects=HALO,
        )
    _draw_belt(ax, belt, WHOLE)
    for touch in touches:
        mark_modes(ax, touch, width=1.2)
    ax.set_aspect("equal")
    ax.margins(0.03, 0.12)
    ax.set_xlabel("x, m")
    ax.set_ylabel("y, m")


def _disc(pulley: Pulley) -> Circle:
    return Circle((pulley.x, pulley.y), pulley.radius, fc=PULLEY_COLOUR, ec=GREY, linewidth=0.6)


def _draw_belt(ax: Any, belt: Belt, width: float) -> None:
    """Draw the belt with a dark edge, so that its light parts stand out from the background."""
    ax.add_collection(
        LineCollection(belt.pieces, colors=BLACK, linewidths=width + 1.2, capstyle="round")
    )
    lines = LineCollection(
        belt.pieces,
        cmap=TENSION_COLOURS,
        norm=belt.colours.norm,
        linewidths=width,
        capstyle="round",
    )
    lines.set_array(belt.tension)
    ax.add_collection(lines)


def _draw_detail(ax: Any, pulleys: Sequence[Pulley], number: int, belt: Belt) -> None:
    """Draw the surroundings of one of the pulleys."""
    for pulley in pulleys:
        ax.add_patch(_disc(pulley))
    _draw_belt(ax, belt, DETAIL)
    x, y, reach = pulleys[number].x, pulleys[number].y, WINDOW * pulleys[number].radius
    ax.set_xlim(x - reach, x + reach)
    ax.set_ylim(y - reach, y + reach)
    ax.set_aspect("equal")


def _caption(result: "Record", number: int, pulley: Pulley) -> str:
    """Return the name of a pulley, and below it its recorded speed and torque."""
    known = [
        with_unit(f"{result.channels[name][-1, number]:.4g}", result.units[name])
        for name in ("pulley_speed", "pulley_torque")
        if name in result.channels
    ]
    numbers = ", ".join(known).replace("-", "\N{MINUS SIGN}")
    return "\n".join(text for text in (pulley.name, numbers) if text)
