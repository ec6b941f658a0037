"""The pictures of a body on a dry shaft: its friction circle with all forces, its response."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle
from matplotlib.ticker import MaxNLocator

from frictionsim.display import (
    BLACK,
    BROWN,
    CONTACT_WORDS,
    FORCE_COLOURS,
    GREY,
    ORANGE,
    ROLES,
    VERMILION,
    WINE,
    picture_text,
    study_text,
    with_minus,
)
from frictionsim.mechanisms.shaft.free_body import (
    ECCENTRIC_WEIGHT,
    VANISHES,
    AppliedCouple,
    FreeBody,
    channels_needed,
    free_body,
)
from frictionsim.motion.parts import Body, Disc
from frictionsim.motion.shaft import ARROW, bodies_of, cords_of, scenario_in, sizes_of, tail_of
from frictionsim.motion.shapes import arc, reaction_foot
from frictionsim.plots import time_history
from frictionsim.plots.force_drawing import Area, ForceDrawing, Resultant, arrow_sample
from frictionsim.plots.moving_parts import moving
from frictionsim.plots.old_style import (
    Style,
    add_legend,
    relative_width,
    require_channels,
    set_up,
    width_of,
)
from frictionsim.plots.texts import text_width, wrapped
from frictionsim.plots.time_history import draw_static_limit
from frictionsim.plots.view import View, over_time

if TYPE_CHECKING:
    import numpy.typing as npt
    from matplotlib.figure import Figure, SubFigure

    from frictionsim.mechanisms.shaft.schema import ShaftScenario
    from frictionsim.motion.parts import Outline
    from frictionsim.results import Record

    Point = tuple[float, float]
    Array = npt.NDArray[np.floating[Any]]


STOP = "end stop"
MILLIMETRES = 0.1  # m: shorter lengths are written in mm


def scale_of(body: FreeBody, reach: float) -> float:
    """Return the length of a force in a drawing, m/N: the largest has its share of the reach."""
    sizes = [float(np.max(np.abs(force.size), initial=0.0)) for force in body.forces]
    reaction = np.hypot(body.reaction_across, body.reaction_up)
    largest = max([float(np.max(reaction, initial=0.0)), *sizes])
    return ARROW * reach / largest if largest > 0.0 else 0.0


class Instant(NamedTuple):
    """A body on a shaft at one instant.

    Attributes
    ----------
    scenario : ShaftScenario
    time : float, s
    angle : (1,), rad
    free_body : FreeBody
    couples : tuple of AppliedCouple
        With that of an end stop.
    reaction, resultant : Resultant
        The force of the shaft on the body; all applied forces and couples together.
    state : str
        What the contact does; empty if it is not known.
    """

    scenario: "ShaftScenario"
    time: float
    angle: Any
    free_body: FreeBody
    couples: tuple[AppliedCouple, ...]
    reaction: Resultant
    resultant: Resultant
    state: str


def instant_of(result: "Record", view: str) -> Instant:
    """Return the forces on the body at the last sample."""
    scenario = scenario_in(result)
    needed = channels_needed(scenario)
    require_channels(result, view, needed)

    def last(name: str) -> Any:
        known = name in result.channels
        return np.array([float(result.channels[name][-1]) if known else 0.0])

    rates = [last(name) for name in ("angular_velocity", "angular_acceleration")]
    time, angle = last("time"), last("angle")
    body = free_body(scenario, (time, angle, rates[0], rates[1]))
    stop = last("stop_torque")
    couples = body.couples
    if stop[0]:
        couples = (*couples, AppliedCouple(STOP, stop))
    moments = [np.abs(force.size) * np.hypot(force.x, force.y) for force in body.forces]
    small = VANISHES * sum([*moments, *(np.abs(couple.size) for couple in couples)])

    def without_rounding(torque: Any) -> Any:
        return np.where(np.abs(torque) <= small, 0.0, torque)

    couples = tuple(c._replace(size=without_rounding(c.size)) for c in couples)
    reaction, resultant = (
        _line_of_action(body, *force, without_rounding(torque))
        for force, torque in (
            ((body.reaction_across, body.reaction_up), last("friction_torque")),
            ((body.across, body.up), body.moment + stop),
        )
    )
    mode = int(result.channels["mode"][-1]) if "mode" in result.channels else None
    state = "" if mode is None else CONTACT_WORDS.get(mode, "")
    return Instant(scenario, float(time[0]), angle, body, couples, reaction, resultant, state)


def _line_of_action(body: FreeBody, across: Any, up: Any, torque: Any) -> Resultant:
    vanishes = body.vanishes(np.hypot(across, up))
    x, y = reaction_foot(across, up, torque, vanishes)
    foot = float(x[0]), float(y[0])
    return Resultant(float(across[0]), float(up[0]), foot, float(torque[0]), bool(vanishes[0]))


def number(value: float, unit: str) -> str:
    """Return a number with its unit, such as "12.5 N"."""
    return f"{with_minus(picture_text(value))} {unit}"


def length(value: float) -> str:
    """Return a length in mm or m."""
    return number(1e3 * value, "mm") if value < MILLIMETRES else number(value, "m")


def words_of_resultant(now: Instant, reach: float) -> str:
    """Return the name of the resultant with its size and place, for the key."""
    resultant = now.resultant
    if resultant.vanishes:
        if not resultant.torque:
            return "resultant: none"
        return f"resultant: none, but a couple of {number(resultant.torque, 'N m')}"
    size = number(resultant.size, "N")
    if resultant.arm > reach:
        return f"resultant, {size}, with a couple of {number(resultant.torque, 'N m')}"
    return f"resultant, {size} at {length(resultant.arm)}"


def words_of_reaction(now: Instant) -> str:
    """Return the name of the reaction with its size and lever arm, for the key."""
    reaction = now.reaction
    if reaction.vanishes:
        return "reaction of the shaft: none"
    return f"reaction of the shaft, {number(reaction.size, 'N')} at c = {length(reaction.arm)}"


def notes_of(now: Instant) -> list[str]:
    """Return sentences on special cases."""
    state = f"at {study_text(now.time)} s" + (f": {now.state}" if now.state else "")
    notes = [state]
    if now.scenario.effects.shaft_friction is None:
        notes.append("no dry friction: the reaction goes through the axis")
    elif now.reaction.vanishes:
        notes.append("no reaction: the shaft has no friction at this instant")
    return notes


NARROW = 0.75  # of the usual width: the two drawings stand below each other
SHARE = 0.56  # of the width for the whole body beside the enlarged shaft
MIN_HEIGHT, MAX_HEIGHT, HEADING = 2.4, 4.4, 1.4  # inches
TITLE_GAP = 0.09  # inches, around drawings with their captions
MAX_OF_TWO = 2.7  # inches, of each drawing if they stand below each other
POINTS, BESIDE, CAUTION = 72.0, 0.5, 0.85  # per inch; inches of labels; see Area.scale
TICK, MAX_TICKS = 1.3, 6  # widths of a number from tick to tick; ticks along an axis
MARGIN = 0.14  # of the size of what is drawn
MAX_NAMED, MAX_COUPLES = 10, 4  # forces and couples with a colour of their own
REACTION, RESULTANT, INERTIA = VERMILION, GREY, WINE
WEIGHTS = (ORANGE, BROWN)  # the second is that of an eccentric mass, which is orange itself
UNSEEN = " (not drawn)"  # too short
COUPLE_RADIUS, MAX_SWEEP, SWEEP = 0.42, 2.0, 0.75  # arcs: of the reach; rad; of their share
FIRST_ARC = 135.0  # deg, the middle of the first
CIRCLE_SEEN = 0.12  # of the shaft's radius: of smaller friction circles the shaft is left out
SHAFT_VIEW, CIRCLE_VIEW = 1.6, 4.0  # half side of the enlarged view, of the radius of either
LONG, LONG_ALONE = 0.32, 0.6  # length of the larger force in it, of its half side
BODY_SEEN = 1.5  # radius of the body around the shaft there, of the shaft
STATIC_CIRCLE: Style = {"fc": "none", "ec": BLACK, "linestyle": (0, (4, 2)), "linewidth": 1.2}
KINETIC_CIRCLE: Style = {"fc": "none", "ec": VERMILION, "linewidth": 1.2}
ARM: Style = {"color": BLACK, "linewidth": 2.6, "solid_capstyle": "butt"}


def friction_circle(result: "Record", figure: "Figure | SubFigure") -> None:
    """Draw all forces at the last sample, and the shaft with its friction circles enlarged.

    Forces are arrows from where they act, couples are curved. The resultant of all of them and
    the reaction of the shaft are on their lines of action; c is the lever arm of the reaction,
    whose product with the reaction is the friction torque.
    """
    now = instant_of(result, "friction_circle")
    space = _space_of(figure, now)
    set_up(figure, result, space.height, scaled=False)
    engine: Any = figure.get_layout_engine()
    if isinstance(figure, Figure) and engine is not None:
        engine.set(h_pad=TITLE_GAP)
    if space.side == 0.0:
        axes = [figure.subplots()]
    elif space.stacked:
        axes = figure.subplots(2, 1, height_ratios=(space.body_height + 0.5, space.side))
    else:
        axes = figure.subplots(1, 2, width_ratios=(SHARE, 1.0 - SHARE))
    handles = _draw_body(axes[0], now, space.view)
    _caption(axes[0], "\n".join(notes_of(now)), space.width)
    if space.side:
        handles += _draw_shaft(axes[1], now, CAUTION * POINTS * space.side)
        _caption(axes[1], "shaft and friction circles, enlarged", space.width)
    add_legend(figure, handles, columns=2)


class _Space(NamedTuple):
    """The space of the two drawings.

    Attributes
    ----------
    height : float, inches
        Of the figure without its key.
    width, body_height : float, inches
        Of the drawing of the whole body.
    side : float, inches
        Of the enlarged shaft; 0 without dry friction, which has none.
    stacked : bool
        Whether that is below the body, not beside it.
    view : Area
        Of the body.
    """

    height: float
    width: float
    body_height: float
    side: float
    stacked: bool
    view: Area


def _space_of(figure: "Figure | SubFigure", now: Instant) -> _Space:
    enlarged = now.scenario.effects.shaft_friction is not None
    stacked = enlarged and relative_width(figure) < NARROW
    whole, (low, high) = width_of(figure), _bounds(now)
    width = whole * (SHARE if enlarged and not stacked else 1.0) - BESIDE
    wide, tall = high[0] - low[0], high[1] - low[1]
    tallest = MAX_OF_TWO if stacked else MAX_HEIGHT
    height = float(np.clip(width * tall / wide, MIN_HEIGHT, tallest))
    side = 0.0
    if enlarged:
        side = min(whole - 0.3, MAX_OF_TWO)
        side = side if stacked else min((1.0 - SHARE) * whole - 0.2, height)
    total = height + HEADING + (side if stacked else 0.0)
    scale = CAUTION * POINTS * min(width / wide, height / tall)
    return _Space(total, width, height, side, stacked, Area(low, high, scale))


def _caption(ax: Any, text: str, width: float) -> None:
    ax.set_title(wrapped(text, POINTS * width, "small"), fontsize="small")


def _parts(now: Instant) -> list[Any]:
    """Return body, shaft, spring, stops and cords."""
    bodies = [
        part._replace(shapes=_unmarked(part.shapes)) if isinstance(part, Body) else part
        for part in bodies_of(now.scenario, now.angle)
    ]
    return [*bodies, *cords_of(now.scenario, now.free_body, now.angle)]


def _unmarked(shapes: "tuple[Disc | Outline, ...]") -> "tuple[Disc | Outline, ...]":
    """Return shapes without the marks that show a turn: nothing moves, and marks look like forces.

    A spoke that is marked is one of the others; what comes against a stop is a part of the body.
    """
    unmarked: list[Disc | Outline] = []
    for shape in shapes:
        if shape.role != "marked":
            unmarked.append(shape)
        elif not isinstance(shape, Disc):
            unmarked.append(shape._replace(role="moving" if shape.closed else "fixed"))
    return tuple(unmarked)


def _segments(now: Instant) -> list[tuple[str, str, "Point", "Point"]]:
    """Return name, kind, tail and vector of the arrow of each force, m."""
    reach = sizes_of(now.scenario).reach
    scale = scale_of(now.free_body, reach)
    segments = []
    for force in now.free_body.forces:
        x, y = tail_of(force, reach)
        vector = float(scale * force.across[0]), float(scale * force.up[0])
        segments.append((force.name, str(force.kind), (float(x[0]), float(y[0])), vector))
    return segments


def _bounds(now: Instant) -> tuple["Point", "Point"]:
    """Return the corners of the drawing of the body, with a margin, m."""
    sizes = sizes_of(now.scenario)
    arcs = COUPLE_RADIUS * sizes.reach if _drawn_couples(now) else 0.0
    round_axis = max(sizes.rim, 1.3 * sizes.hub, arcs)
    points = [np.array([[-round_axis, -round_axis], [round_axis, round_axis]])]
    for part in _parts(now):
        if not isinstance(part, Body):
            points.append(part.points.reshape(-1, 2))
    for _, _, tail, vector in _segments(now):
        points.append(np.array([tail, np.add(tail, vector)]))
    scale = scale_of(now.free_body, sizes.reach)
    for force in (now.reaction, now.resultant):
        if force.arm <= sizes.reach:
            tip = np.add(force.foot, (scale * force.across, scale * force.up))
            points.append(np.array([force.foot, tip]))
    cosine, sine = float(np.cos(now.angle[0])), float(np.sin(now.angle[0]))
    eccentric = now.scenario.effects.eccentric_mass
    places = list(sizes.arms)
    if eccentric is not None:
        azimuth = np.radians(eccentric.azimuth_deg)
        out = eccentric.radius + 0.1 * sizes.reach
        places.append((float(out * np.cos(azimuth)), float(out * np.sin(azimuth))))
    points += [np.array([[cosine * x - sine * y, sine * x + cosine * y]]) for x, y in places]
    corners = np.concatenate(points)
    low, high = corners.min(axis=0), corners.max(axis=0)
    margin = MARGIN * float(max(high - low))
    return (
        (float(low[0]) - margin, float(low[1]) - margin),
        (float(high[0]) + margin, float(high[1]) + margin),
    )


def _drawn_couples(now: Instant) -> list[str]:
    """Return the names of the couples that are drawn."""
    return [couple.name for couple in now.couples if couple.size[0]][:MAX_COUPLES]


def _draw_body(ax: Any, now: Instant, view: Area) -> list[Any]:
    """Draw the body with all that acts on it; return legend handles."""
    sizes = sizes_of(now.scenario)
    reach = sizes.reach
    for part in _parts(now):
        moving(ax, part, 1.0, 1.0 / view.scale).move(0)
    drawing = ForceDrawing(ax, view)
    drawing.keep_free(arc(sizes.rim, 0.0, 2.0 * np.pi, 45))
    handles = [*_draw_forces(drawing, now), *_draw_couples(drawing, now)]
    scale = scale_of(now.free_body, reach)
    for force, name, colour, words in (
        (now.resultant, "resultant", RESULTANT, words_of_resultant(now, reach)),
        (now.reaction, "reaction", REACTION, words_of_reaction(now)),
    ):
        shown = force if force.arm <= reach else force._replace(foot=(0.0, 0.0))
        broad = force is now.resultant
        if not force.vanishes:
            drawing.force(name, shown, scale * force.size, colour, broad)
        handles.append(arrow_sample(colour, words, broad))
    drawing.write_names()
    number_width = TICK * text_width("\N{MINUS SIGN}0.15", "medium")
    ticks = view.scale * (view.high[0] - view.low[0]) / number_width
    ax.xaxis.set_major_locator(MaxNLocator(int(np.clip(ticks, 1, MAX_TICKS))))
    ax.set_xlabel("x, m")
    ax.set_ylabel("y, m")
    return handles


def _draw_forces(drawing: ForceDrawing, now: Instant) -> list[Any]:
    """Draw the forces; the largest have a colour, a name and a place in the key of their own."""
    sizes = {force.name: float(force.size[0]) for force in now.free_body.forces}
    named = sorted(sizes, key=lambda name: -abs(sizes[name]))[:MAX_NAMED]
    handles, number_of = [], 0
    for name, kind, tail, vector in _segments(now):
        if kind == "inertia":
            colour = INERTIA
        elif kind == "weight":
            colour = WEIGHTS[name == ECCENTRIC_WEIGHT]
        elif name in named:
            colour = FORCE_COLOURS[number_of % len(FORCE_COLOURS)]
            number_of += 1
        else:
            colour = BLACK
        long = drawing.arrow(name, tail, vector, colour)
        if name in named:
            if long:
                words = "inertia force" if kind == "inertia" else name  # there is one
                drawing.name(words, (tail[0] + vector[0], tail[1] + vector[1]), vector)
            unseen = UNSEEN if sizes[name] and not drawing.shows(vector) else ""
            handles.append(arrow_sample(colour, f"{name}, {number(sizes[name], 'N')}{unseen}"))
    further = len(sizes) - len(named)
    if further > 0:
        handles.append(arrow_sample(BLACK, f"{further} smaller forces"))
    return handles


def _draw_couples(drawing: ForceDrawing, now: Instant) -> list[Any]:
    """Draw couples as curved arrows about the axis; those that vanish are in the key only."""
    handles = []
    drawn = _drawn_couples(now)
    share = 2.0 * np.pi / max(len(drawn), 1)
    radius, half = COUPLE_RADIUS * sizes_of(now.scenario).reach, 0.5 * min(MAX_SWEEP, SWEEP * share)
    for i, couple in enumerate(now.couples[:MAX_NAMED]):
        size = float(couple.size[0])
        colour = FORCE_COLOURS[(len(now.scenario.forces) + i) % len(FORCE_COLOURS)]
        words = f"{couple.name}, {number(size, 'N m')}"
        handles.append(arrow_sample(colour, words, curved=True))
        if couple.name in drawn:
            middle = np.radians(FIRST_ARC) + share * drawn.index(couple.name)
            points = arc(radius, middle - half, middle + half)
            drawing.curved_arrow(couple.name, points if size > 0.0 else points[::-1], colour)
    further = len(now.couples) - MAX_NAMED
    if further > 0:
        total = sum(float(couple.size[0]) for couple in now.couples[MAX_NAMED:])
        words = f"{further} further couples, {number(total, 'N m')}"
        handles.append(arrow_sample(BLACK, words, curved=True))
    return handles


def _draw_shaft(ax: Any, now: Instant, side: float) -> list[Any]:
    """Draw shaft, friction circles and lever arm enlarged; return legend handles.

    Parameters
    ----------
    side : float, points
        Side of the drawing.
    """
    journal = now.scenario.effects.shaft_friction
    assert journal is not None  # checked by the caller
    shaft, r_s = journal.shaft_radius, journal.static_radius
    small = 0.0 < r_s < CIRCLE_SEEN * shaft
    half = CIRCLE_VIEW * r_s if small else SHAFT_VIEW * shaft
    drawing = ForceDrawing(ax, Area((-half, -half), (half, half), side / (2.0 * half)))
    ax.add_patch(Circle((0.0, 0.0), BODY_SEEN * shaft, fc=ROLES["moving"], ec=GREY, lw=0.8))
    ax.add_patch(Circle((0.0, 0.0), shaft, fc=ROLES["still"], ec=GREY, lw=0.8))
    handles = []
    for name, radius, style in (
        ("static", r_s, STATIC_CIRCLE),
        ("kinetic", journal.kinetic_radius, KINETIC_CIRCLE),
    ):
        words = f"circle of {name} friction, radius {length(radius)}"
        if radius > 0.0:
            ax.add_patch(Circle((0.0, 0.0), radius, **style, zorder=3, label=words))
        face: Style = {"color": "none", "mfc": "none", "mec": style["ec"], "mew": 1.3}
        handles.append(Line2D([], [], marker="o", markersize=8, label=words, **face))
    names = {"still": f"shaft, radius {length(shaft)}", "moving": "body around the shaft"}
    for role, words in names.items():
        face = {"color": "none", "mfc": ROLES[role], "mec": GREY, "mew": 0.8}
        handles.append(Line2D([], [], marker="o", markersize=8, label=words, **face))
    drawing.keep_free(arc(r_s, 0.0, 2.0 * np.pi, 45))
    larger = max(now.reaction.size, now.resultant.size)
    scale = (LONG_ALONE if small else LONG) * half / larger if larger > 0.0 else 0.0
    resultant, reaction = now.resultant, now.reaction
    if resultant.arm < half and not resultant.vanishes:
        drawing.force("resultant", resultant, scale * resultant.size, RESULTANT, broad=True)
    handles += _draw_lever_arm(drawing, reaction)
    if not reaction.vanishes:
        from_contact = _draw_contact(drawing, reaction, 0.0 if small else shaft)
        drawing.force("reaction", from_contact, scale * reaction.size, REACTION)
    ax.plot(0.0, 0.0, marker="+", markersize=7, color=BLACK, zorder=7)
    drawing.write_names()
    ax.set_axis_off()
    return handles


def _draw_contact(drawing: ForceDrawing, reaction: Resultant, shaft: float) -> Resultant:
    """Draw where the shaft of a radius is loaded, m, and its normal; return the force from there.

    The line of action of the reaction leaves the shaft there. With the radius 0 it is not in the
    drawing.
    """
    (x, y), (ux, uy) = reaction.foot, reaction.direction
    out = float(np.sqrt(max(shaft**2 - reaction.arm**2, 0.0)))
    contact = x + out * ux, y + out * uy
    if out:
        drawing.ax.plot([0.0, contact[0]], [0.0, contact[1]], color=GREY, lw=0.8, zorder=3)
        drawing.ax.plot(*contact, marker="o", markersize=4.5, color=BLACK, zorder=7)
        drawing.keep_free(np.array([(0.0, 0.0), contact]))
        drawing.name("contact", contact, (uy, -ux))
    return reaction._replace(foot=contact)


def _draw_lever_arm(drawing: ForceDrawing, reaction: Resultant) -> list[Any]:
    """Draw the lever arm of the reaction, from the axis to its line of action."""
    if reaction.arm == 0.0:
        return []
    x, y = reaction.foot
    drawing.ax.plot([0.0, x], [0.0, y], **ARM, zorder=6.5, label="lever arm")
    drawing.keep_free(np.array([(0.0, 0.0), (x, y)]))
    drawing.name(f"c = {length(reaction.arm)}", (0.5 * x, 0.5 * y), (-y, x), first=True)
    torque = f"lever arm c, friction torque {number(reaction.torque, 'N m')}"
    return [Line2D([], [], **ARM, label=torque)]


def response(result: "Record", figure: "Figure | SubFigure", channels: Sequence[str] = ()) -> None:
    """Draw channels over time, with the static limit of the friction torque."""
    axes, handles = time_history.draw_channels(result, figure, channels)
    add_legend(figure, [*handles, *draw_static_limit(axes, result)])


VIEWS = {
    "response": over_time(response),
    "friction_circle": View(friction_circle, instant=True),
}
