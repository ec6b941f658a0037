"""The layout of a belt drive: tension, forces on the contact arcs, sticking and slipping."""

from collections.abc import Sequence
from math import floor, log10
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle
from matplotlib.patheffects import withStroke

from frictionsim.plots.belt_geometry import Pulley, has_friction, pulleys_of
from frictionsim.plots.style import (
    BLACK,
    BLUE,
    GREY,
    VERMILION,
    Style,
    add_legend,
    escape_mathtext,
    relative_width,
    require_channels,
    set_up,
    shrink,
    width_of,
)

if TYPE_CHECKING:
    from matplotlib.figure import SubFigure

    from frictionsim.results import Record

NEEDED = ("x", "y", "tension", "normal_force", "pulley_index")
PULLEY_COLOUR = "#EEEEEE"
TENSION_COLOURS = "cividis"  # colour-blind safe, and monotonic in grey print
MAX_IN_A_ROW, MAX_DETAILS = 4, 8
NARROW = 0.6  # of the usual width: half as many in a row
MAX_SIDE = 3.0  # inches, of a detail
MIN_HEIGHT, HIGH, MAX_HEIGHT = 0.8, 2.0, 4.0  # inches, of the whole drive
MARGIN = 0.8  # inches, for the title and the colour bar
TITLE = 0.5  # inches, of a detail
WINDOW = 1.75  # radii, from the centre of a pulley to the edge of its detail
MAX_BAR = 0.6  # radii
GAP = 0.11  # radii, between the belt and the bars
POINTS = 72.0  # per inch
FULL_WIDTH_PITCH = 5.0  # points between bodies; bars are thinner where there is less

NORMAL: Style = {"color": BLUE, "linewidth": 1.8}
FORWARD: Style = {"color": VERMILION, "linewidth": 2.2}
BACKWARD: Style = {"color": GREY, "linewidth": 0.9}
EDGED = [withStroke(linewidth=3.6, foreground=BLACK)]
STICK: Style = {"color": BLACK, "linewidth": 2.4, "path_effects": EDGED}
SLIP: Style = STICK | {"color": "white"}
HALO = [withStroke(linewidth=2.0, foreground="white")]


class _ContactArc(NamedTuple):
    """The bodies on one pulley at the last sample.

    Attributes
    ----------
    place : (n, 2), m
        Positions.
    halves : (n, 3, 2), m
        The line of each body: joint, body, joint.
    normal : (n, 2)
        Unit normals, outwards from the centre of the pulley.
    normal_force, friction : (n,), N
        On the belt; friction is positive counter-clockwise about the pulley.
    sticks : (n,) of bool
        False without friction.
    """

    place: Any
    halves: Any
    normal: Any
    normal_force: Any
    friction: Any
    sticks: Any


class _Belt(NamedTuple):
    """The belt at the last sample: lines between bodies, their tension, and its colours."""

    pieces: Any
    pitch: float  # m, between bodies
    tension: Any
    colours: ScalarMappable


def drive(result: "Record", figure: "Figure | SubFigure") -> None:
    """Draw the belt and its pulleys at the last sample, and details of the pulleys with forces.

    The belt is coloured by its tension. Outward bars are the normal forces on its bodies, inward
    bars the friction forces. A strip on the belt is black where it sticks, white where it slips.
    """
    shows_friction = has_friction(result)
    require_channels(
        result, "drive", (*NEEDED, *(("friction_force", "sticking") if shows_friction else ()))
    )
    pulleys, belt = pulleys_of(result), _belt(result)
    touches = [_touch(result, i, pulley, belt, shows_friction) for i, pulley in enumerate(pulleys)]
    shown = pulleys[:MAX_DETAILS]
    relative = relative_width(figure)
    columns = min(len(shown), MAX_IN_A_ROW if relative > NARROW else MAX_IN_A_ROW // 2)
    rows = -(-len(shown) // columns)
    side = min(width_of(figure) / columns, MAX_SIDE)
    height = _height_of_whole(belt, width_of(figure))
    heights = [MARGIN + height, *[side + TITLE] * rows]
    set_up(figure, result, sum(heights), *_notes(result, pulleys), scaled=False)
    parts = figure.add_gridspec(1 + rows, columns, height_ratios=heights)
    whole = figure.add_subplot(parts[0, :])
    _draw_whole(whole, pulleys, belt, touches)
    length = 0.5 if height > HIGH else 1.0
    colours = figure.colorbar(
        belt.colours, ax=whole, location="bottom", shrink=length, aspect=60 * length
    )
    colours.set_label("tension, N")
    force = _largest_force(touches)
    for i, pulley in enumerate(shown):
        ax = figure.add_subplot(parts[1 + i // columns, i % columns])
        ax.set_axis_off()
        pitch_points = POINTS * 0.5 * side / WINDOW * belt.pitch / pulley.radius
        caption = ax.set_title(_caption(result, i, pulley), fontsize="small")
        if not isinstance(figure, Figure):
            shrink(caption, relative * MAX_IN_A_ROW / columns)
        _draw_detail(ax, pulleys, i, belt)
        _draw_forces(ax, pulley, touches[i], force, pitch_points)
    add_legend(figure, _handles(shows_friction), columns=3)


def _notes(result: "Record", pulleys: Sequence[Pulley]) -> list[str]:
    """Return the notes for the title: the time, and whether pulleys are omitted in the details."""
    notes = [f"at {result.channels['time'][-1]:.6g} s"]
    if len(pulleys) > MAX_DETAILS:
        notes.append(f"forces on the first {MAX_DETAILS} of {len(pulleys)} pulleys")
    return notes


def _belt(result: "Record") -> _Belt:
    bodies = np.column_stack([result.channels["x"][-1], result.channels["y"][-1]])
    tension = result.channels["tension"][-1]
    scale = Normalize(float(np.min(tension)), float(np.max(tension)))
    pieces = np.stack([np.roll(bodies, 1, axis=0), bodies], axis=1)
    pitch = float(np.median(np.hypot(*(pieces[:, 1] - pieces[:, 0]).T)))
    return _Belt(pieces, pitch, tension, ScalarMappable(scale, TENSION_COLOURS))


def _touch(
    result: "Record", number: int, pulley: Pulley, belt: _Belt, has_friction: bool
) -> _ContactArc:
    channels = result.channels
    on = channels["pulley_index"][-1] == number
    joints, bodies = belt.pieces.mean(axis=1), belt.pieces[:, 1]
    halves = np.stack([joints, bodies, np.roll(joints, -1, axis=0)], axis=1)
    place = bodies[on]
    away = place - (pulley.x, pulley.y)
    none = np.zeros(len(place))
    return _ContactArc(
        place,
        halves[on],
        away / np.maximum(np.hypot(*away.T), np.finfo(float).tiny)[:, None],
        channels["normal_force"][-1][on],
        channels["friction_force"][-1][on] if has_friction else none,
        (channels["sticking"][-1][on] if has_friction else none) > 0,
    )


def _height_of_whole(belt: _Belt, width: float) -> float:
    """Return the height of the whole drive where it has a width; both in inches."""
    wide, high = np.ptp(belt.pieces.reshape(-1, 2), axis=0)
    return float(np.clip(width * high / max(wide, 1e-9 * high), MIN_HEIGHT, MAX_HEIGHT))


def _largest_force(touches: Sequence[_ContactArc]) -> float:
    forces = [np.abs([touch.normal_force, touch.friction]) for touch in touches]
    return max((float(force.max()) for force in forces if force.size), default=0.0)


def _draw_whole(
    ax: Any,
    pulleys: Sequence[Pulley],
    belt: _Belt,
    touches: Sequence[_ContactArc],
) -> None:
    for pulley in pulleys:
        ax.add_patch(_disc(pulley))
        ax.annotate(
            escape_mathtext(pulley.name),
            (pulley.x, pulley.y),
            ha="center",
            va="center",
            fontsize="x-small",
            zorder=6,
            path_effects=HALO,
        )
    _draw_belt(ax, belt, width=4.5)
    for touch in touches:
        _mark_modes(ax, touch, width=1.2)
    ax.set_aspect("equal")
    ax.margins(0.03, 0.12)
    ax.set_xlabel("x, m")
    ax.set_ylabel("y, m")


def _disc(pulley: Pulley) -> Circle:
    return Circle((pulley.x, pulley.y), pulley.radius, fc=PULLEY_COLOUR, ec=GREY, linewidth=0.6)


def _draw_belt(ax: Any, belt: _Belt, width: float) -> None:
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


def _mark_modes(ax: Any, touch: _ContactArc, width: float) -> None:
    """Draw a strip on the bodies: black where they stick, white with a black edge elsewhere."""
    edge = LineCollection(touch.halves, colors=BLACK, linewidths=width + 1.0, zorder=5)
    strip = LineCollection(touch.halves[~touch.sticks], colors="white", linewidths=width, zorder=5)
    ax.add_collection(edge)
    ax.add_collection(strip)


def _draw_detail(ax: Any, pulleys: Sequence[Pulley], number: int, belt: _Belt) -> None:
    """Draw the surroundings of one of the pulleys."""
    for pulley in pulleys:
        ax.add_patch(_disc(pulley))
    _draw_belt(ax, belt, width=6.0)
    x, y, reach = pulleys[number].x, pulleys[number].y, WINDOW * pulleys[number].radius
    ax.set_xlim(x - reach, x + reach)
    ax.set_ylim(y - reach, y + reach)
    ax.set_aspect("equal")


def _draw_forces(
    ax: Any, pulley: Pulley, touch: _ContactArc, force: float, pitch_points: float
) -> None:
    """Draw forces and modes of the bodies on a pulley; `pitch_points` apart, in points."""
    if force > 0.0:
        _draw_bars(ax, touch, pulley.radius, MAX_BAR * pulley.radius / force, pitch_points)
        _draw_scale_bar(ax, pulley, force)
    _mark_modes(ax, touch, width=2.2)


def _draw_bars(
    ax: Any, touch: _ContactArc, radius: float, per_force: float, pitch_points: float
) -> None:
    """Draw the normal forces outwards from the belt and the friction forces inwards."""
    forward = touch.friction > 0.0
    for style, which, lengths in (
        (NORMAL, touch.normal_force > 0.0, touch.normal_force),
        (FORWARD, forward, -touch.friction),
        (BACKWARD, ~forward, touch.friction),
    ):
        foot = touch.place + GAP * radius * np.sign(lengths)[:, None] * touch.normal
        tip = foot + (per_force * lengths)[:, None] * touch.normal
        width = style["linewidth"] * min(1.0, pitch_points / FULL_WIDTH_PITCH)
        bars = np.stack([foot, tip], axis=1)[which]
        ax.add_collection(LineCollection(bars, colors=style["color"], linewidths=width))


def _draw_scale_bar(ax: Any, pulley: Pulley, force: float) -> None:
    """Draw a scale bar of a round force at the centre of the pulley."""
    value = _round_below(force)
    half = 0.5 * MAX_BAR * pulley.radius * value / force
    ends = [pulley.x - half, pulley.x + half]
    ax.plot(ends, [pulley.y] * 2, color=BLACK, linewidth=1.5, marker="|", markersize=5)
    ax.annotate(
        f"{value:g} N",
        (pulley.x, pulley.y),
        (0.0, 4.0),
        textcoords="offset points",
        ha="center",
        va="bottom",
        fontsize="x-small",
    )


def _round_below(value: float) -> float:
    """Return the largest of ..., 1, 2, 5, 10, ... that does not exceed a value."""
    power = 10.0 ** floor(log10(value))
    return max(factor * power for factor in (1.0, 2.0, 5.0) if factor * power <= value)


def _caption(result: "Record", number: int, pulley: Pulley) -> str:
    """Return the name of a pulley, and below it its recorded speed and torque."""
    known = [
        f"{result.channels[name][-1, number]:.4g} {result.units[name]}"
        for name in ("pulley_speed", "pulley_torque")
        if name in result.channels
    ]
    numbers = ", ".join(known).replace("-", "\N{MINUS SIGN}")
    return "\n".join(text for text in (escape_mathtext(pulley.name), numbers) if text)


def _handles(has_friction: bool) -> list[Any]:
    handles = [Line2D([], [], **NORMAL, label="normal force")]
    if not has_friction:
        return [*handles, Line2D([], [], **SLIP, label="touching")]
    for style, words in ((FORWARD, "counter-clockwise"), (BACKWARD, "clockwise")):
        handles.append(Line2D([], [], **style, label=f"friction on the belt, {words}"))
    for style, words in ((STICK, "sticking"), (SLIP, "slipping")):
        handles.append(Line2D([], [], **style, label=words))
    return handles
