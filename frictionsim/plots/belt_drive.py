"""The layout of a belt drive: tension, forces on the contact arcs, sticking and slipping.

Bodies in the plane are links: the belt is drawn from centre to centre. A guided string follows its
line: it is drawn along spans and arcs, and what touches a pulley ends where the arc ends.
"""

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

from frictionsim.display import (
    BLACK,
    BLUE,
    GREY,
    PULLEY_SHADE,
    TENSION_COLOURS,
    VERMILION,
    picture_text,
    study_text,
    with_minus,
    with_unit,
)
from frictionsim.errors import InputError
from frictionsim.mechanisms.belt_drive.slip import senses_of
from frictionsim.motion.belt_path import (
    DrawnPulley,
    arc_of,
    guiding_path,
    line_between,
    middles_on,
    patch_members,
    path_of,
    places_on,
)
from frictionsim.plots.belt_geometry import has_friction, pulleys_of
from frictionsim.plots.belt_time_history import body, recorded_speed_at_rest, speeds, tension
from frictionsim.plots.force_drawing import Area, Label, draw_labels
from frictionsim.plots.old_style import (
    Style,
    add_legend,
    axis_label,
    relative_width,
    require_channels,
    set_up,
    shrink,
    width_of,
)
from frictionsim.plots.texts import points_of, text_width
from frictionsim.plots.view import BODY, View, over_time
from frictionsim.scenario.toml_data import scenario_value

if TYPE_CHECKING:
    import numpy.typing as npt
    from matplotlib.figure import SubFigure

    from frictionsim.mechanisms.belt_drive.geometry import Path
    from frictionsim.results import Record

    Array = npt.NDArray[np.float64]


class ContactArc(NamedTuple):
    """The bodies on one pulley at the last sample.

    Attributes
    ----------
    place : (n, 2), m
        Positions.
    lines : list of (k, 2), m
        The line of each body on the pulley.
    normal : (n, 2)
        Unit normals, outwards from the centre of the pulley.
    normal_force, friction : (n,), N
        On the belt; friction is positive counter-clockwise about the pulley.
    sticks : (n,) of bool
        False without friction.
    """

    place: Any
    lines: list[Any]
    normal: Any
    normal_force: Any
    friction: Any
    sticks: Any


class DrawnBelt(NamedTuple):
    """The belt at the last sample.

    Attributes
    ----------
    bodies : (n, 2), m
        Positions.
    pieces : list of (k, 2), m
        The line from body k - 1 to body k, for each k.
    halves : list of (k, 2), m
        The line of each body, from joint to joint.
    pitch : float, m
        Between bodies.
    tension : (n,), N
        Of the pieces.
    colours : ScalarMappable
    path : Path or None
        The line of a guided string.
    """

    bodies: Any
    pieces: list[Any]
    halves: list[Any]
    pitch: float
    tension: Any
    colours: ScalarMappable
    path: "Path | None"


def belt_of(result: "Record") -> DrawnBelt:
    """Return the belt of a result at its last sample."""
    bodies = np.column_stack([result.channels["x"][-1], result.channels["y"][-1]])
    tension = result.channels["tension"][-1]
    scale = Normalize(float(np.min(tension)), float(np.max(tension)))
    before = np.roll(bodies, 1, axis=0)
    pitch = float(np.median(np.hypot(*(bodies - before).T)))
    path = guiding_path(result, -1)
    if path is None:
        joints = 0.5 * (bodies + before)
        pieces = list(np.stack([before, bodies], axis=1))
        halves = list(np.stack([joints, bodies, np.roll(joints, -1, axis=0)], axis=1))
    else:
        places = places_on(path, bodies)
        steps = (places - np.roll(places, 1)) % path.length
        ends = zip(places - steps, places, strict=True)
        pieces = [line_between(path, start, stop) for start, stop in ends]
        first, last = _extents(path, places)
        halves = [line_between(path, *of) for of in zip(first, last, strict=True)]
    return DrawnBelt(
        bodies, pieces, halves, pitch, tension, ScalarMappable(scale, TENSION_COLOURS), path
    )


def _extents(path: "Path", places: Any) -> tuple[Any, Any]:
    """Return start and end, m, of the part of the string that belongs to each point."""
    first = middles_on(path, places)
    return first, first + (np.roll(first, -1) - first) % path.length


def contact_arc(
    result: "Record", number: int, pulley: DrawnPulley, belt: DrawnBelt, has_friction: bool
) -> ContactArc:
    """Return the bodies on each pulley, by its number."""
    channels = result.channels
    on = np.flatnonzero(channels["pulley_index"][-1] == number)
    place, lines = belt.bodies[on], [belt.halves[k] for k in on]
    if belt.path is not None and on.size:
        place, lines = _arc_lines(belt.path, belt.bodies, on, arc_of(belt.path, number))
    away = place - (pulley.x, pulley.y)
    none = np.zeros(len(place))
    return ContactArc(
        place,
        lines,
        away / np.maximum(np.hypot(*away.T), np.finfo(float).tiny)[:, None],
        channels["normal_force"][-1][on],
        channels["friction_force"][-1][on] if has_friction else none,
        (channels["sticking"][-1][on] if has_friction else none) > 0,
    )


def _arc_lines(
    path: "Path", bodies: Any, on: Any, arc: tuple[float, float]
) -> tuple[Any, list[Any]]:
    """Return the middles of the parts of an arc around points of a string, and their lines."""
    first, last = (ends[on] for ends in _extents(path, places_on(path, bodies)))
    middle = 0.5 * (first + last)
    turns = np.round((0.5 * sum(arc) - middle) / path.length) * path.length
    start, stop = (np.clip(ends + turns, *arc) for ends in (first, last))
    lines = [line_between(path, *ends) for ends in zip(start, stop, strict=True)]
    return path.at(0.5 * (start + stop) % path.length).position, lines


class BeltPatch(NamedTuple):
    """The part of a belt with another friction: its line (n, 2), m, and its words in the key."""

    line: Any
    words: str


def patch_of(result: "Record", belt: DrawnBelt) -> BeltPatch | None:
    """Return the patch of the scenario, where its bodies are; None if it has none."""
    try:
        within = patch_members(result)
    except InputError:
        return None
    if within is None or not within.any():
        return None
    table = scenario_value(result, "effects", "patch")
    coefficients = [
        f"{name} = {study_text(table[name])}"
        for name in ("mu_s", "mu_k")
        if isinstance(table.get(name), int | float)
    ]
    return BeltPatch(
        np.concatenate([belt.halves[k] for k in np.flatnonzero(within)]),
        ": ".join(["patch", ", ".join(coefficients)]) if coefficients else "patch",
    )


MAX_BAR = 0.6  # radii
GAP = 0.11  # radii, between the belt and the bars
FULL_WIDTH_PITCH = 5.0  # points between bodies; bars are thinner where there is less
MARKED_PITCH = 3.0  # points between bodies; bars that are closer have no marks at their ends
MIN_MARKED = 0.02  # of the largest force

# Normal force and both directions of friction differ in their ends too, for grey print.
NORMAL: Style = {"color": BLUE, "linewidth": 1.8}
FORWARD: Style = {"color": VERMILION, "linewidth": 1.8, "marker": "o", "markersize": 4.5}
BACKWARD: Style = FORWARD | {"marker": "s", "markerfacecolor": "white", "linewidth": 1.0}
EDGED = [withStroke(linewidth=3.6, foreground=BLACK)]
STICK: Style = {"color": BLACK, "linewidth": 2.4, "path_effects": EDGED}
SLIP: Style = STICK | {"color": "white"}


def largest_force(touches: "Sequence[ContactArc]") -> float:
    """Return the largest normal force or friction of all pulleys, N; 0 without any."""
    forces = [np.abs([touch.normal_force, touch.friction]) for touch in touches]
    return max((float(force.max()) for force in forces if force.size), default=0.0)


def draw_forces(
    ax: Any, pulley: DrawnPulley, touch: "ContactArc", force: float, pitch_points: float
) -> None:
    """Draw forces and modes of the bodies on a pulley.

    Parameters
    ----------
    force : float, N
        The largest force, which has the longest bar.
    pitch_points : float
        From body to body, in points.
    """
    if force > 0.0:
        _draw_bars(ax, touch, pulley.radius, MAX_BAR * pulley.radius / force, pitch_points)
        _draw_scale_bar(ax, pulley, force)
    mark_modes(ax, touch, width=2.2)


def _draw_bars(
    ax: Any, touch: "ContactArc", radius: float, per_force: float, pitch_points: float
) -> None:
    """Draw the normal forces outwards from the belt and the friction forces inwards."""
    forward = touch.friction > 0.0
    least = MIN_MARKED * MAX_BAR * radius / per_force
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
        ends = tip[which & (np.abs(lengths) > least)]
        if "marker" in style and pitch_points >= MARKED_PITCH and ends.size:
            ax.plot(*ends.T, **(style | {"linestyle": ""}))


def _draw_scale_bar(ax: Any, pulley: DrawnPulley, force: float) -> None:
    """Draw a scale bar of a round force at the centre of the pulley."""
    value = round_below(force)
    half = 0.5 * MAX_BAR * pulley.radius * value / force
    ends = [pulley.x - half, pulley.x + half]
    ax.plot(ends, [pulley.y] * 2, color=BLACK, linewidth=1.5, marker="|", markersize=5)
    ax.annotate(
        f"{study_text(value)} N",
        (pulley.x, pulley.y),
        (0.0, 4.0),
        textcoords="offset points",
        ha="center",
        va="bottom",
        fontsize="x-small",
    )


def round_below(value: float) -> float:
    """Return the largest of ..., 1, 2, 5, 10, ... that does not exceed a value."""
    power = 10.0 ** floor(log10(value))
    return max(factor * power for factor in (1.0, 2.0, 5.0) if factor * power <= value)


def mark_modes(ax: Any, touch: "ContactArc", width: float) -> None:
    """Draw a strip on the bodies: black where they stick, white with a black edge elsewhere."""
    slips = [line for line, sticks in zip(touch.lines, touch.sticks, strict=True) if not sticks]
    edge = LineCollection(touch.lines, colors=BLACK, linewidths=width + 1.0, zorder=5)
    strip = LineCollection(slips, colors="white", linewidths=width, zorder=5)
    ax.add_collection(edge)
    ax.add_collection(strip)


def force_handles(has_friction: bool) -> list[Any]:
    """Return the legend of forces and modes."""
    handles = [Line2D([], [], **NORMAL, label="normal force")]
    if not has_friction:
        return [*handles, Line2D([], [], **SLIP, label="touching")]
    for style, words in ((FORWARD, "counter-clockwise"), (BACKWARD, "clockwise")):
        handles.append(Line2D([], [], **style, label=f"friction on the belt, {words}"))
    for style, words in ((STICK, "sticking"), (SLIP, "slipping")):
        handles.append(Line2D([], [], **style, label=words))
    return handles


ARROW_RADIUS = 0.3  # radii, from the centre of a pulley to the arrow of its motion
HALF = np.radians(60.0)  # half the angle of that arrow, which is below the centre
MIN_SHARE = 1e-6  # of the largest speed in the run: slower is at rest
TRIANGLE = 3  # of a triangle


def speeds_of(result: "Record", pulleys: list[DrawnPulley]) -> "Array":
    """Return the speed of each rim at the last sample, m/s; 0 at rest or if not recorded."""
    if "pulley_speed" not in result.channels:
        return np.zeros(len(pulleys))
    rims = result.channels["pulley_speed"] * np.array([p.radius for p in pulleys])
    at_rest = max(recorded_speed_at_rest(result), MIN_SHARE * float(np.max(np.abs(rims))))
    return np.where(np.abs(rims[-1]) > at_rest, rims[-1], 0.0)


def draw_belt_motion(ax: Any, result: "Record", belt: "DrawnBelt", rims: "Array") -> None:
    """Draw a triangle on each span that points where the belt moves; none if it is at rest.

    Parameters
    ----------
    rims : (pulleys,), m/s
        Of `speeds_of`.
    """
    try:
        path = path_of(result)
    except InputError:
        path = None
    if path is None:
        return
    along = float(np.mean(rims * senses_of(path)))
    if along == 0.0:
        return
    for span in path.spans:
        start, stop = np.array(span.start), np.array(span.end)
        middle = 0.5 * (start + stop)
        place = belt.bodies[np.argmin(np.hypot(*(belt.bodies - middle).T))]
        ahead = np.sign(along) * (stop - start)
        turned = float(np.degrees(np.arctan2(ahead[1], ahead[0]))) - 90.0  # it points upwards
        style = {"markersize": 11, "mfc": "white", "mec": BLACK, "mew": 1.2, "zorder": 7}
        ax.plot(*place, marker=(TRIANGLE, 0, turned), linestyle="", **style)


def draw_rotation(ax: Any, pulley: DrawnPulley, rim: float) -> None:
    """Draw a curved arrow inside a pulley the way it turns; none at rest.

    Parameters
    ----------
    rim : float, m/s
        Positive counter-clockwise.
    """
    if rim == 0.0:
        return
    sign, centre = np.sign(rim), np.array([pulley.x, pulley.y])
    tail, tip = (
        centre + ARROW_RADIUS * pulley.radius * np.array([np.sin(turn), -np.cos(turn)])
        for turn in (-sign * HALF, sign * HALF)
    )
    bend = {"arrowstyle": "-|>", "connectionstyle": f"arc3,rad={sign * np.tan(0.5 * HALF):.4f}"}
    arrow = bend | {"color": BLACK, "linewidth": 1.2, "shrinkA": 0.0, "shrinkB": 0.0}
    ax.annotate("", tuple(tip), tuple(tail), arrowprops=arrow)


NEEDED = ("x", "y", "tension", "normal_force", "pulley_index")
MAX_IN_A_ROW, MAX_DETAILS = 4, 8
NARROW = 0.6  # of the usual width: half as many in a row
MAX_SIDE = 3.0  # inches, of a detail
MIN_HEIGHT, HIGH, MAX_HEIGHT = 0.8, 2.0, 4.0  # inches, of the whole drive
MARGIN = 0.8  # inches, for the title and the colour bar
TITLE = 0.5  # inches, of a detail
WINDOW = 1.75  # radii, from the centre of a pulley to the edge of its detail
POINTS_PER_INCH = 72.0  # per inch
NAME_SIZE, INNER = "x-small", 0.75  # of a name; part of the sides of a drawing within its labels
NAME_ROOM = 24.0  # points for the height of a name and its distance from what is drawn
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
    rows = -(-len(shown) // (MAX_IN_A_ROW if relative > NARROW else MAX_IN_A_ROW // 2))
    columns = -(-len(shown) // rows)  # so that no row is nearly empty
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
        pitch_points = POINTS_PER_INCH * 0.5 * side / WINDOW * belt.pitch / pulley.radius
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


def _notes(pulleys: Sequence[DrawnPulley]) -> list[str]:
    """Return the notes for the title: whether pulleys are omitted in the details."""
    if len(pulleys) <= MAX_DETAILS:
        return []
    return [f"forces on the first {MAX_DETAILS} of {len(pulleys)} pulleys"]


def _time(result: "Record") -> str:
    """Return the time of the picture, which is in it with a title and without."""
    return f"at {study_text(result.channels['time'][-1])} s"


def _height_of_whole(belt: DrawnBelt, width: float) -> float:
    """Return the height of the whole drive where it has a width; both in inches."""
    wide, high = np.ptp(belt.bodies, axis=0)
    return float(np.clip(width * high / max(wide, 1e-9 * high), MIN_HEIGHT, MAX_HEIGHT))


def _draw_whole(
    ax: Any,
    pulleys: Sequence[DrawnPulley],
    belt: DrawnBelt,
    touches: Sequence[ContactArc],
) -> None:
    for pulley in pulleys:
        ax.add_patch(_disc(pulley))
    _draw_belt(ax, belt, WHOLE)
    for touch in touches:
        mark_modes(ax, touch, width=1.2)
    _write_names(ax, pulleys, belt)
    ax.set_aspect("equal")
    ax.margins(0.03, 0.12)
    ax.set_xlabel("x, m")
    ax.set_ylabel("y, m")


def _write_names(ax: Any, pulleys: Sequence[DrawnPulley], belt: DrawnBelt) -> None:
    """Write the name of each pulley into its circle, or beside it where it does not fit."""
    room = max(text_width(pulley.name, NAME_SIZE) for pulley in pulleys) + NAME_ROOM
    low, high = np.min(belt.bodies, axis=0), np.max(belt.bodies, axis=0)
    # Before there is a layout it can be estimated only how many points a metre has.
    sides = INNER * POINTS_PER_INCH * np.array([width_of(ax.figure), MAX_HEIGHT])
    sides = np.maximum(sides - 2.0 * np.array([room, NAME_ROOM]), room)
    scale = float(np.min(sides / np.maximum(high - low, np.finfo(float).tiny)))
    turns = np.linspace(0.0, 2.0 * np.pi, 48)
    rim = np.column_stack([np.cos(turns), np.sin(turns)])
    steps = (np.linspace(piece[:-1], piece[1:], 8).reshape(-1, 2) for piece in belt.pieces)
    drawn, beside = list(steps), list[Label]()
    middle = np.mean([(pulley.x, pulley.y) for pulley in pulleys], axis=0)
    for pulley in pulleys:
        centre = np.array([pulley.x, pulley.y])
        drawn.append(centre + pulley.radius * rim)
        half = 0.5 * np.array([text_width(pulley.name, NAME_SIZE), points_of(NAME_SIZE)])
        if np.hypot(*half) + WHOLE <= pulley.radius * scale:
            style = {"ha": "center", "va": "center", "fontsize": NAME_SIZE, "path_effects": HALO}
            ax.annotate(pulley.name, tuple(centre), zorder=6, **style)
            continue
        away = (centre - middle) / max(float(np.hypot(*(centre - middle))), 1e-12)
        edge = centre + (pulley.radius + WHOLE / scale) * away
        beside.append(Label(pulley.name, tuple(edge), tuple(away)))
    if beside:
        view = Area(tuple(low - room / scale), tuple(high + room / scale), scale)
        boxes = draw_labels(ax, beside, np.concatenate(drawn), view, NAME_SIZE)
        ax.update_datalim(boxes.reshape(-1, 2))


def _disc(pulley: DrawnPulley) -> Circle:
    return Circle((pulley.x, pulley.y), pulley.radius, fc=PULLEY_SHADE, ec=GREY, linewidth=0.6)


def _draw_belt(ax: Any, belt: DrawnBelt, width: float) -> None:
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


def _draw_detail(ax: Any, pulleys: Sequence[DrawnPulley], number: int, belt: DrawnBelt) -> None:
    """Draw the surroundings of one of the pulleys."""
    for pulley in pulleys:
        ax.add_patch(_disc(pulley))
    _draw_belt(ax, belt, DETAIL)
    x, y, reach = pulleys[number].x, pulleys[number].y, WINDOW * pulleys[number].radius
    ax.set_xlim(x - reach, x + reach)
    ax.set_ylim(y - reach, y + reach)
    ax.set_aspect("equal")


def _caption(result: "Record", number: int, pulley: DrawnPulley) -> str:
    """Return the name of a pulley, and below it its recorded speed and torque."""
    known = [
        with_unit(picture_text(result.channels[name][-1, number]), result.units[name])
        for name in ("pulley_speed", "pulley_torque")
        if name in result.channels
    ]
    numbers = ", ".join(map(with_minus, known))
    return "\n".join(text for text in (pulley.name, numbers) if text)


VIEWS = {
    "speeds": over_time(speeds, ("pulley_speed", "pulley_torque")),
    "drive": View(drive, instant=True),
    "tension": View(tension, instant=True),
    BODY: View(body, window=True, body=True),
}
