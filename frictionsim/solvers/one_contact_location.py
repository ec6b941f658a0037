"""Location of events within a step or a rest: brackets of a root, of functions by their number.

The iterates are those of `root_finding.bracket_root`.
"""

from typing import Any, NamedTuple

from frictionsim.solvers.compilation import compilable
from frictionsim.solvers.one_contact_state import (
    HIDDEN_EVENT,
    INSIDE,
    MODE,
    T_OLD,
    Y_NEW,
    Y_OLD,
    Run,
    Y,
    fail,
)
from frictionsim.solvers.one_contact_step import derivatives, write_inside
from frictionsim.solvers.root_finding import Bracket, is_narrow, narrowed, next_point

# Functions of the time, whose roots are located. With the parameter x they are
# the torque beyond the static limit at rest, and less its roundoff; the drive less x; the velocity
# in the direction; its derivative; how far the position is beyond x in the direction; how far the
# state is beyond the switching surface number x; the negative product of the load and that at the
# start of the step.
EXCESS, EXCESS_BEYOND_ROUNDOFF, DRIVE, VELOCITY, ACCELERATION, POSITION, SURFACE, LOAD = range(8)


@compilable
def excess(system: Any, s: Any, t: float, direction: float) -> float:
    """Return the applied torque in a direction minus the static limit, at rest, N m."""
    u, q = system.drive.at(t), s[Y]
    return direction * system.applied_torque(u, q, 0.0) - system.static_limit(u, q)


@compilable
def excess_beyond_roundoff(system: Any, s: Any, t: float, direction: float) -> float:
    """Return the excess minus the roundoff, N m; the contact holds unless it is positive."""
    return excess(system, s, t, direction) - system.roundoff(system.drive.at(t), s[Y])


@compilable
def beyond_surface(surfaces: Any, s: Any, x: float, q: float, v: float) -> float:
    """Return a number that is positive beyond a surface that the last step crosses."""
    if len(surfaces) == 0:
        return 0.0
    return surfaces[int(x)].beyond(s[Y_OLD], s[Y_OLD + 1], s[Y_NEW], q, v)


@compilable
def against_load(loads: Any, system: Any, s: Any, t: float, q: float, v: float) -> float:
    """Return the negative product of the load of the contact and that at the start of the step.

    It is positive where the load has turned by a right angle; zero if `loads` is empty. A load that
    passes zero turns by two at once, where its size, and friction with it, has a corner.
    """
    if len(loads) == 0:
        return 0.0
    x_old, y_old = system.contact_load(system.drive.at(s[T_OLD]), s[Y_OLD], s[Y_OLD + 1])
    x, y = system.contact_load(system.drive.at(t), q, v)
    return -(x * x_old + y * y_old)


@compilable
class EventFunction(NamedTuple):
    """A function of time within the last step, whose root is located.

    Attributes
    ----------
    which : int
        `VELOCITY`, `POSITION`, ... as above.
    direction : float
        Of sliding, +1 or -1, which makes it grow through its root; 0 if it has none.
    parameter : float
        Value of the drive, position, rad, or number of the surface; 0 if it has none.
    """

    which: int
    direction: float
    parameter: float

    def value_at(self, system: Any, run: Run, s: Any, t: float) -> float:
        """Return the value at a time, s."""
        which, direction, x = self
        if which == EXCESS:
            return excess(system, s, t, direction)
        if which == EXCESS_BEYOND_ROUNDOFF:
            return excess_beyond_roundoff(system, s, t, direction)
        if which == DRIVE:
            return system.drive.at(t) - x
        sliding = s[MODE]
        write_inside(system, run, s, sliding, t)
        q, v = s[INSIDE], s[INSIDE + 1]
        if which == VELOCITY:
            return direction * v
        if which == POSITION:
            return direction * (q - x)
        if which == ACCELERATION:
            return direction * derivatives(system, t, q, v, sliding)[1]
        if which == SURFACE:
            return beyond_surface(system.surfaces, s, x, q, v)
        return against_load(system.reversing_load, system, s, t, q, v)


@compilable
def bracket(
    function: Any, system: Any, run: Run, s: Any, a: float, b: float, resolution: float
) -> tuple[float, float]:
    """Return a bracket (lo, hi) of a root in [a, b]; see `root_finding.bracket_root`.

    The function is an `EventFunction`, or another named tuple with its method.
    """
    f_a = function.value_at(system, run, s, a)
    f_b = function.value_at(system, run, s, b)
    if (f_a > 0.0) == (f_b > 0.0):
        fail(HIDDEN_EVENT, a, b, f_a, f_b)
    root = Bracket(a, f_a, b, f_b, 0.5)
    while not is_narrow(root, resolution):
        x = next_point(root, resolution)
        root = narrowed(root, x, function.value_at(system, run, s, x))
    return min(root.x, root.y), max(root.x, root.y)
