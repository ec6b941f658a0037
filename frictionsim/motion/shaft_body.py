"""The look of a body on a shaft, from what its scenario says: arms, drums, eccentric mass, stops.

A scenario has no outline: it has points at which forces act and radii at which cords leave. An arm
goes to each point that turns with the body; cords and points that are fixed in space have a disc of
their radius, and so has a body on which only couples act.
"""

from math import acos, atan2, ceil, hypot, inf, pi, radians
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.motion.parts import Disc, Line
from frictionsim.motion.shapes import arc, wheel

if TYPE_CHECKING:
    from frictionsim.mechanisms.shaft.schema import ShaftScenario
    from frictionsim.motion.parts import Array

# Relative to the reach of the body.
HUB, TIP, PIN, MASS, SHAFT_SEEN = 0.11, 0.05, 0.02, 0.09, 0.06
STOP_FROM, STOP_TO, STOP_WIDTH = 0.55, 0.75, 0.08  # along an arm, and beside it
SPRING = 0.30  # outer radius of a torsion spring
COIL, MAX_COILS = 1.5, 6.0  # turns of a torsion spring: at least; with more it is left out
HUB_OF_SHAFT = 1.7  # radius of a hub relative to its shaft
OF_COUPLES = 5.0  # radius of a body on which only couples act, relative to its shaft
MAX_ARMS = 12  # more are an outline around them


class Look(NamedTuple):
    """Sizes of the drawing of a body.

    Attributes
    ----------
    reach : float, m
        Distance of the outermost point from the axis.
    shaft : float, m
        Drawn radius of the shaft.
    hub : float, m
    arms : tuple of (float, float), m
        Points at the angle 0 to which arms go.
    rim : float, m
        Radius of the disc; 0 for none.
    """

    reach: float
    shaft: float
    hub: float
    arms: tuple[tuple[float, float], ...]
    rim: float


def look_of(scenario: "ShaftScenario") -> Look:
    """Return the sizes of the drawing of a body."""
    journal, eccentric = scenario.effects.shaft_friction, scenario.effects.eccentric_mass
    arms: dict[tuple[float, float], None] = {}
    rim = 0.0
    for force in scenario.forces:
        if force.point is None:
            rim = max(rim, abs(force.cord_radius or 0.0))
        elif force.point_turns:
            arms[force.point] = None
        else:
            rim = max(rim, hypot(*force.point))
    lengths = [hypot(*point) for point in arms]
    reach = max([rim, *lengths, eccentric.radius if eccentric else 0.0])
    shaft = journal.shaft_radius if journal is not None else SHAFT_SEEN * (reach or 1.0)
    if not reach > HUB_OF_SHAFT * shaft:
        reach = rim = max(reach, OF_COUPLES * shaft if reach == 0.0 else HUB_OF_SHAFT * shaft)
    hub = min(max(HUB_OF_SHAFT * shaft, HUB * reach), reach)
    seen = tuple(point for point in arms if hypot(*point) > hub)
    if not rim and not seen:
        rim = reach
    return Look(reach, shaft, hub, seen, rim)


def shapes_of(scenario: "ShaftScenario") -> tuple[Disc | Line, ...]:
    """Return the shapes of the body at the angle 0, from back to front."""
    look = look_of(scenario)
    shapes: list[Disc | Line] = []
    if look.rim:
        shapes += wheel(look.rim, hub=min(look.hub / look.rim, 0.7))
        cords = {abs(force.cord_radius) for force in scenario.forces if force.cord_radius}
        shapes += [
            Disc(0.0, 0.0, radius, "fixed", open=True)
            for radius in sorted(cords, reverse=True)
            if look.hub < radius < look.rim
        ]
    tip = TIP * look.reach
    if len(look.arms) > MAX_ARMS:
        shapes.append(Line(_outline(look.arms), "moving", closed=True))
    else:
        shapes += [Line(arm(point, look.hub, tip), "moving", closed=True) for point in look.arms]
    if look.arms or look.hub < look.rim:
        shapes.append(Disc(0.0, 0.0, look.hub, "moving"))
    shapes += [Disc(*point, PIN * look.reach, "fixed") for point in look.arms]
    if not look.rim:  # what the eye follows
        shapes.append(Disc(*_on_hub(look), 0.5 * PIN * look.reach, "marked"))
    eccentric = scenario.effects.eccentric_mass
    if eccentric is not None and eccentric.mass > 0.0:
        azimuth = radians(eccentric.azimuth_deg)
        place = eccentric.radius * np.cos(azimuth), eccentric.radius * np.sin(azimuth)
        shapes.append(Disc(float(place[0]), float(place[1]), MASS * look.reach, "load"))
    if _stops(scenario) is not None and not look.arms:
        shapes.append(_lug(look))
    return tuple(shapes)


def _on_hub(look: Look) -> tuple[float, float]:
    """Return a place on the hub, on the side of the first arm."""
    x, y = look.arms[0]
    length, place = hypot(x, y), 0.5 * (look.shaft + look.hub)
    return place * x / length, place * y / length


def arm(point: tuple[float, float], hub: float, tip: float) -> "Array":
    """Return the outline (n, 2) of an arm from a hub to a round end about a point, m."""
    length, azimuth = hypot(*point), atan2(point[1], point[0])
    side = acos((hub - tip) / length) if length > abs(hub - tip) else 0.5 * pi
    end = arc(tip, -side, side, 9) + np.array([length, 0.0])
    x, y = np.concatenate([end, arc(hub, side, 2.0 * pi - side, 13)]).T
    cosine, sine = np.cos(azimuth), np.sin(azimuth)
    return np.column_stack([cosine * x - sine * y, sine * x + cosine * y])


def _outline(points: tuple[tuple[float, float], ...]) -> "Array":
    """Return a polygon through the outermost points, in the order of their azimuths."""
    found = np.array(points)
    return found[np.argsort(np.arctan2(found[:, 1], found[:, 0]))]


def _stops(scenario: "ShaftScenario") -> Any:
    return getattr(scenario.effects, "end_stops", None)


def stops_of(scenario: "ShaftScenario") -> tuple[Line, ...]:
    """Return the end stops, beside the longest arm where it is against them.

    None are drawn where the body may turn by more than a turn between them.
    """
    stops, look = _stops(scenario), look_of(scenario)
    if stops is None:
        return ()
    low, high = stops.lowest_angle_deg, stops.highest_angle_deg
    if low is not None and high is not None and high - low > 360.0:
        return ()
    if look.arms:
        point = max(look.arms, key=lambda point: hypot(*point))
        azimuth, length = atan2(point[1], point[0]), hypot(*point)
        begin, end = (max(part * length, 1.05 * look.hub) for part in (STOP_FROM, STOP_TO))
        half = look.hub + (TIP * look.reach - look.hub) * begin / length
    else:
        azimuth, begin, end, half = 0.0, 1.02 * look.rim, 1.2 * look.rim, LUG * look.rim
    wide = STOP_WIDTH * look.reach
    found = []
    for degrees, side in ((low, -1.0), (high, 1.0)):
        if degrees is not None:
            near, far = side * half, side * (half + wide)
            corners = np.array([(begin, near), (end, near), (end, far), (begin, far)])
            found.append(Line(_turned(corners, azimuth + radians(degrees)), "fixed", closed=True))
    return tuple(found)


LUG = 0.06  # half the width of what comes against a stop, relative to the rim


def _lug(look: Look) -> Line:
    rim, half = look.rim, LUG * look.rim
    corners = [(0.97 * rim, -half), (1.15 * rim, -half), (1.15 * rim, half), (0.97 * rim, half)]
    return Line(np.array(corners), "marked", closed=True)


def _turned(points: "Array", angle: float) -> "Array":
    cosine, sine = np.cos(angle), np.sin(angle)
    return points @ np.array([[cosine, sine], [-sine, cosine]])


def spring_line(scenario: "ShaftScenario", angle: "Array") -> "tuple[Array, Array] | None":
    """Return the torsion spring at angles of the body, two arrays (frames, n) in m.

    A spiral from the hub to a fixed place; None if it would have too many turns.
    """
    spring, look = scenario.effects.torsion_spring, look_of(scenario)
    if spring is None or spring.stiffness == 0.0:
        return None
    free = radians(spring.free_angle_deg)
    # Its turns when it is free, of which enough are left at all angles.
    turns = COIL + ceil(2.0 * max(float(np.max(angle - free, initial=0.0)), 0.0) / (2.0 * pi)) / 2.0
    most = turns + float(np.max(free - angle, initial=0.0)) / (2.0 * pi)
    outer = max(SPRING * look.reach, 1.4 * look.hub)
    if most > MAX_COILS:
        return None
    part = np.linspace(0.0, 1.0, 1 + 30 * ceil(most))
    end = free + 2.0 * pi * turns
    winding = angle[:, None] + part * (end - angle[:, None])
    radius = look.hub + part * (outer - look.hub)
    return radius * np.cos(winding), radius * np.sin(winding)


def circle_window(scenario: "ShaftScenario") -> float:
    """Return half the side of the enlarged view of the friction circles, m.

    0 without dry friction, which has no shaft; that of the shaft where the circles are points.
    """
    journal = scenario.effects.shaft_friction
    if journal is None:
        return 0.0
    return min(3.0 * journal.static_radius or inf, 1.3 * journal.shaft_radius)
