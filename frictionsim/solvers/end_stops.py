"""End stops: the coordinate stays between two values, and the impacts on them are located.

    v+ = -e v-,     v+ = 0 where |v-| is below the capture speed, or rounding hides the flight

An impact takes no time. A stop is a torque on the body and no force on a contact, so that dry
friction has no part in an impact. At rest on a stop, v = 0, the stop takes all of the torque that
presses the body into it, and dry friction has none: how both share it is indeterminate. Torque that
points away from the stop meets dry friction as anywhere else.
"""

from math import inf, ulp
from typing import TYPE_CHECKING

from frictionsim.results import BACKWARD, FORWARD, STICK
from frictionsim.solvers.root_finding import bracket_root

if TYPE_CHECKING:
    from frictionsim.solvers.mechanism import Mechanism
    from frictionsim.solvers.stepper import Rhs, State, Stepper

# A flight shorter than this number of units in the last place of time or position, over 1 - e, is
# ignored: rounding would give the body as much speed as an impact takes.
HIDDEN_ULPS = 16.0
EVENT = "stop"
ENERGY = "energy_impact"


class StopContact:
    """The end stops of a mechanism while it is solved."""

    def __init__(self, mechanism: "Mechanism") -> None:
        assert mechanism.stops is not None  # checked by the solver
        self._mechanism, self._stops = mechanism, mechanism.stops
        self._kinetic = mechanism.stored_energies["energy_kinetic"]
        self._heat = 2 + mechanism.energy_integrals.index(ENERGY)

    def is_hit(self, y: "State") -> bool:
        """Return whether a state is beyond a stop, or at it and moving into it."""
        q, v = y[0], y[1]
        if self._stops.lowest < q < self._stops.highest:
            return False
        side = self._stops.side(q)
        return side * v > 0.0 or q > self._stops.highest or q < self._stops.lowest

    def before_impact(self, y: "State") -> "State":
        """Return the state of an impact, whose time is exact to rounding, exactly at the stop."""
        q = min(max(y[0], self._stops.lowest), self._stops.highest)
        return [q, *y[1:]]

    def after_impact(self, t: float, y: "State") -> "State":
        """Return the state that follows from one before an impact at t, s."""
        side, kinetic = self._stops.side(y[0]), self._kinetic
        after = self.before_impact(y)
        speed = side * y[1]
        rebound = self._stops.restitution * speed
        if speed < self._stops.capture_speed or self._is_hidden(t, after[0], rebound):
            rebound = 0.0
        after[1] = -side * rebound if rebound > 0.0 else 0.0
        after[self._heat] += kinetic(y[0], y[1]) - kinetic(y[0], after[1])
        return after

    def _is_hidden(self, t: float, q: float, rebound: float) -> bool:
        """Return whether rounding of time or position hides the flight after a rebound."""
        mechanism, side = self._mechanism, self._stops.side(q)
        torque = mechanism.applied_torque(mechanism.drive(t), q, -side * rebound)
        a = side * torque / mechanism.inertia  # towards the stop
        if a <= 0.0:
            return False
        duration, height = 2.0 * rebound / a, 0.5 * rebound * rebound / a
        ulps = HIDDEN_ULPS / (1.0 - self._stops.restitution)
        return bool(duration < ulps * ulp(t) or height < ulps * ulp(q))

    def impact_in_slip(self, stepper: "Stepper", s: int, until: float) -> float:
        """Return the time, s, of the impact in the last step; inf without one.

        The body moves in direction s up to the time `until`.
        """
        stop = self._stops.highest if s == FORWARD else self._stops.lowest
        if s * (stepper.interpolate(until)[0] - stop) <= 0.0:
            return inf
        return _first_beyond(stepper, s, stop, stepper.t_old, until)

    def first_impact(self, stepper: "Stepper", rhs: "Rhs") -> float:
        """Return the time of the first impact in the last step, s; inf if there is none.

        The velocity may change its direction within the step. Where the body may reach a stop, the
        step is divided where the velocity is extreme, so that it turns at most once in each part.
        """
        t_old, t, y_old, y = stepper.t_old, stepper.t, stepper.y_old, stepper.y
        h = t - t_old
        dy_old, dy = [0.0] * len(y), [0.0] * len(y)
        rhs(t_old, y_old, dy_old)
        rhs(t, y, dy)
        v_old, v, a_old, a = y_old[1], y[1], h * dy_old[1], h * dy[1]
        # More than the cubic through velocities and accelerations reaches.
        reach = h * (max(abs(v_old), abs(v)) + abs(a_old) + abs(a))
        stops = self._stops
        if stops.highest - y_old[0] > reach and y_old[0] - stops.lowest > reach:
            return inf
        parts = {0.5, 1.0, *_extrema(v_old, v, a_old, a)}
        times = [t_old + x * h if x < 1.0 else t for x in sorted(parts)]
        impact = inf
        for s, stop in ((FORWARD, stops.highest), (BACKWARD, stops.lowest)):
            if stop * s < inf:
                impact = min(impact, _impact_on(stepper, s, stop, times))
        return impact

    def is_at_rest(self, y: "State") -> bool:
        """Return whether a state is at rest on a stop."""
        return y[1] == 0.0 and self._stops.side(y[0]) != STICK

    def departure(self, q: float, t: float, end: float) -> tuple[float, int]:
        """Return the time, s, up to which a body rests on a stop without dry friction.

        With it the direction away from the stop if the torque turns away then, else STICK. The
        signals are smooth between t and end.
        """
        side, mechanism = self._stops.side(q), self._mechanism

        def away(time: float) -> float:
            torque: float = mechanism.applied_torque(mechanism.drive(time), q, 0.0)
            return -side * torque

        if away(t) > 0.0:
            return t, -side
        until = mechanism.system.first_departure(q, t, end)
        if away(until) <= 0.0:
            return until, STICK
        return bracket_root(away, t, until)[0], -side


def _impact_on(stepper: "Stepper", s: int, stop: float, times: list[float]) -> float:
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


def _first_beyond(stepper: "Stepper", s: int, stop: float, begin: float, end: float) -> float:
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
