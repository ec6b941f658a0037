"""End stops: the coordinate stays between two values, and the impacts on them are located.

    v+ = -e v-,     v+ = 0 where |v-| is below the capture speed, or rounding hides the flight

An impact takes no time. A stop is a torque on the body and no force on a contact, so that dry
friction has no part in an impact. At rest on a stop, v = 0, the stop takes all of the torque that
presses the body into it, and dry friction has none: how both share it is indeterminate. Torque that
points away from the stop meets dry friction as anywhere else.
"""

from collections.abc import Callable
from math import inf
from typing import TYPE_CHECKING, Any

from frictionsim.results import BACKWARD, FORWARD, STICK
from frictionsim.solvers.root_finding import bracket_root

if TYPE_CHECKING:
    from frictionsim.solvers.mechanism import EndStops

# A flight shorter than this number of units in the last place of time or position, over 1 - e, is
# ignored: rounding would give the body as much speed as an impact takes.
HIDDEN_ULPS = 16.0
EVENT = "stop"
ENERGY = "energy_impact"


def first_impact(
    stepper: Any,
    stops: "EndStops",
    acceleration: Callable[[float, list[float]], float],
) -> float:
    """Return the time of the first impact in the last step of a `LawStepper`, s; inf without one.

    The velocity may change its direction within the step. Where the body may reach a stop, the
    step is divided where the velocity is extreme, so that it turns at most once in each part.
    """
    t_old, t, y_old, y = stepper.t_old, stepper.t, stepper.y_old, stepper.y
    h = t - t_old
    v_old, v = y_old[1], y[1]
    a_old, a = h * acceleration(t_old, y_old), h * acceleration(t, y)
    # More than the cubic through velocities and accelerations reaches.
    reach = h * (max(abs(v_old), abs(v)) + abs(a_old) + abs(a))
    if stops.highest - y_old[0] > reach and y_old[0] - stops.lowest > reach:
        return inf
    parts = {0.5, 1.0, *_extrema(v_old, v, a_old, a)}
    times = [t_old + x * h if x < 1.0 else t for x in sorted(parts)]
    impact = inf
    for s, stop in ((FORWARD, stops.highest), (BACKWARD, stops.lowest)):
        if stop * s < inf:
            impact = min(impact, _impact_on(stepper, s, stop, times))
    return impact


def first_departure(
    system: Any, side: int, q: float, interval: tuple[float, float]
) -> tuple[float, int]:
    """Return the time, s, up to which a body rests on a stop without dry friction.

    With it the direction away from the stop if the torque turns away then, else STICK. The signals
    are smooth in the interval, and the stop is on a side of the body, FORWARD or BACKWARD.
    """
    t, end = interval

    def away(time: float) -> float:
        torque: float = system.applied_torque(system.drive.at(time), q, 0.0)
        return -side * torque

    if away(t) > 0.0:
        return t, -side
    until = system.first_departure(q, t, end)
    if away(until) <= 0.0:
        return until, STICK
    return bracket_root(away, t, until)[0], -side


def _impact_on(stepper: Any, s: int, stop: float, times: list[float]) -> float:
    """Return the first time at which a step is beyond the stop in direction s; inf if it is not."""
    begin, v_begin = stepper.t_old, s * stepper.y_old[1]
    for end in times:
        q, v = stepper.interpolate(end)[:2]
        beyond, v = s * (q - stop) > 0.0, s * v
        if not beyond and v_begin > 0.0 > v:  # it turns in between
            turn = bracket_root(lambda t: s * stepper.interpolate(t)[1], begin, end)[0]
            if s * (stepper.interpolate(turn)[0] - stop) > 0.0:
                end, beyond = turn, True
        if beyond:
            return _first_beyond(stepper, s, stop, begin, end)
        begin, v_begin = end, v
    return inf


def _first_beyond(stepper: Any, s: int, stop: float, begin: float, end: float) -> float:
    """Return the time at which a step passes a stop between two times, s."""
    return bracket_root(lambda t: s * (stepper.interpolate(t)[0] - stop), begin, end)[1]


def _extrema(v_old: float, v: float, a_old: float, a: float) -> list[float]:
    """Return where the cubic through velocities and slopes at 0 and 1 is extreme, within (0, 1)."""
    c = 3.0 * (v - v_old) - 2.0 * a_old - a
    d = 3.0 * (a_old + a - 2.0 * (v - v_old))
    root = c * c - d * a_old  # a_old + 2 c x + d x^2 = 0
    if not root > 0.0:
        return []
    larger = -(c + (root**0.5 if c > 0.0 else -(root**0.5)))
    roots = [larger / d] if d != 0.0 else []
    roots += [a_old / larger] if larger != 0.0 else []
    return [x for x in roots if 0.0 < x < 1.0]
