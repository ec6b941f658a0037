"""Event-driven integration: any number of coordinates, contacts with dry friction, and ropes.

Between two events all contacts keep their modes and the equations are smooth. A mode ends where a
force reaches its limit, a sliding contact comes to rest, or a gap closes; an end stop is hit where
the coordinate passes it. Each is located to the roundoff of the time. The modes that follow are
those of `modes.consistent`.

While all coordinates are held, nothing is integrated: the state is constant, and the next event is
looked for in what acts on the mechanism. Else the integrator takes a step, `rkf45.Step`.
"""

from math import inf, ulp
from typing import Any, NamedTuple

from frictionsim.errors import Chattering
from frictionsim.results import BACKWARD, FORWARD, SLACK, STICK, TAUT
from frictionsim.solvers.loop import Loop, State, may_pass_zero, sign, smooth_step
from frictionsim.solvers.modes import KEEPS, REFINDS, Modes, consistent, holds
from frictionsim.solvers.rkf45 import Step
from frictionsim.solvers.roots import bracket_root
from frictionsim.solvers.system import STOP

# Parts of a step at which margins are looked at; near its ends for the sign of their slopes.
PLACES = (0.0, 1e-3, 1 / 6, 1 / 3, 1 / 2, 2 / 3, 5 / 6, 1.0 - 1e-3, 1.0)
# The minimum of a margin is searched for below this part of its rise on a side, or where a parabola
# has its minimum below this part of the margin in the middle.
LOW_MARGIN = 0.5
MINIMUM_RESOLUTION = 1e-9  # of the time of the minimum, relative to the interval
GOLDEN = 0.381966011250105
RESOLUTION = 1e-12  # of the end of a motion, relative to the step
SAME_TIME_ULPS = 2.0  # a root search stops at so many units in the last place of the time
# So many changes of mode within this time, s, or this part of a shorter run, are chattering.
CHATTERING_EVENTS, CHATTERING_WINDOW = 100, 1e-6
# A flight shorter than this number of units in the last place of time or position, over 1 - e, is
# ignored: rounding would give the body as much speed as an impact takes.
HIDDEN_ULPS = 16.0
MAX_IMPACTS = 100  # of ropes that become taut at one time: each leaves less of what is to close
LEAVES_STOP = 2  # in the place of the direction in which a stop is hit: a body leaves it


class Change(NamedTuple):
    """The first change of the mode of a contact: its time, s, and the mode that begins.

    `held` is the last time before it, of a contact that is released.
    """

    time: float
    mode: int
    held: float = inf


NEVER = Change(inf, KEEPS)


class Events(Loop):
    """The event-driven solver."""

    def __init__(self, system: Any, *others: Any) -> None:
        super().__init__(system, *others)
        self._same_time = SAME_TIME_ULPS * ulp(self.end)
        y = self.state.y
        modes = [TAUT if c.is_rope else sign(_rate(system, c, y)) for c in system.contacts]
        at_stop = 0 if system.stops is None else system.stops.struck(y[0], y[1])
        now = [REFINDS for _ in modes]
        self.state = self.state._replace(modes=modes, now=now, held=inf, at_stop=at_stop)

    def begun(self, state: State) -> State:
        while not state.step.y or state.at_stop or state.now.count(KEEPS) < len(state.now):
            state = self._settled(state)
        return state

    def turned(self, state: State) -> State:
        """Return the state after a step or a rest, which ends at the first change within it."""
        system, modes, step, segment = self.system, state.modes, state.step, state.segment
        at_rest, at_stop = self._is_at_rest(state), 0
        crossed: Any = None
        if not at_rest:
            if step.t >= segment:
                segment = system.smooth_until(step.t, step.y, self.end)
            step, crossed = smooth_step(system, step, modes, segment, self.tolerances)
            if system.stops is not None and not modes:
                turn = self._time_of_turn(step)
                if turn < step.t:
                    step, crossed = step.cut(system, modes, turn), None
        elif modes:
            step = step.resting(state.t, system.rests_until(state.t, state.y, self.end))
        else:
            until, leaves = system.departure(state.t, state.y, self.end)
            step, at_stop = step.resting(state.t, until), LEAVES_STOP if leaves else 0
        first = self._first_changes(step, modes, at_rest)
        end, held, now = step.t, inf, [KEEPS] * len(modes)
        if first:
            end = min([end, *[change.time for change in first.values()]])
        if system.stops is not None and not at_rest:
            impact, side = self._first_impact(step, modes, end)
            if side:
                end, at_stop, first = impact, side, {}
        for i, change in first.items():
            if change.time - end <= self._same_time:
                now[i], held = change.mode, min(held, change.held)
        samples = self.sampled(state, step, end)
        if at_stop:
            now = [REFINDS] * len(modes)
        elif crossed and end == step.t:
            self.record_crossing(crossed, step, modes)
        y = step.at(system, modes, end)
        return State(end, y, modes, now, held, at_stop, step, segment, samples, state.changes)

    def _is_at_rest(self, state: State) -> bool:
        """Return whether nothing moves: contacts hold all coordinates, or a stop the only one."""
        if len(state.modes) < self.system.coordinates:
            return not state.modes and self.system.rests_on_stop(state.t, state.y)
        return all(map(holds, state.modes))

    def _first_changes(self, step: Step, modes: Modes, at_rest: bool) -> dict[int, Change]:
        """Return the first change of each contact whose mode ends within a step."""
        n, some_hold = self.system.coordinates, False
        first: dict[int, Change] = {}
        for i, mode in enumerate(modes):
            if holds(mode):
                some_hold = True
                continue
            c = self.system.contacts[i].coordinate
            slack = mode == SLACK
            time = self._time_of_zero(step, modes, *((c, FORWARD) if slack else (n + c, mode)))
            if time < inf:
                first[i] = Change(time, TAUT if slack else STICK)
        return first | self._first_releases(step, modes, at_rest) if some_hold else first

    def _time_of_zero(self, step: Step, modes: Modes, c: int, s: int) -> float:
        """Return when number c of the state, of sign s, becomes zero in a step, s; else inf.

        The zero at the start of a motion does not count.
        """
        # What moves from rest may be slowed down at first by the roundoff of the limit at which it
        # was released.
        if s * step.y[c] > 0.0 and not may_pass_zero(step, c, s):
            return inf
        return self._located_zero(step, modes, c, s)

    def _located_zero(self, step: Step, modes: Modes, c: int, s: int) -> float:
        """Return the time of the zero if the number has one, s; else inf."""
        system, t_old, t, v_old = self.system, step.t_old, step.t, s * step.y_old[c]
        resolution = RESOLUTION * (t - t_old)

        def value(at: float) -> float:
            return s * step.at(system, modes, at)[c]

        if s * step.y[c] > 0.0:

            def slope(at: float) -> float:
                rates: list[float] = system.rates(at, step.at(system, modes, at), modes)
                return s * rates[c]

            t = bracket_root(slope, t_old, t, resolution)[1]
            if value(t) > 0.0:
                return inf
        if v_old <= 0.0:
            width = t - t_old
            while value(t_old + width) <= 0.0:
                width *= 0.1
                if width <= resolution:
                    return t_old
            t_old += width
            if t_old >= t:
                return t
        return bracket_root(value, t_old, t, resolution)[1]

    def _time_of_turn(self, step: Step) -> float:
        """Return when a body without contacts turns in a step, s; inf if it moves one way.

        The direction at the start may be that of a first acceleration which is roundoff.
        """
        direction = sign(step.y_old[1] or step.k_old[1] or step.y[1])
        for s in (direction, -direction) if direction else ():
            turn = self._time_of_zero(step, [], 1, s)
            if turn > step.t_old:
                return turn
        return inf

    def _first_releases(self, step: Step, modes: Modes, at_rest: bool) -> dict[int, Change]:
        """Return the first changes of contacts whose force passes its limit.

        Whether it does is decided with the roundoff of force and limit, when it does without. At
        rest a margin is monotone up to where it may first be used up; in a step it may be used up
        and restored.
        """
        first: dict[int, Change] = {}
        places = (0.0, 1.0) if at_rest else PLACES
        times = [*[step.t_old + x * (step.t - step.t_old) for x in places[:-1]], step.t]
        states = [step.y_old, *[step.near(x) for x in places[1:-1]], step.y]
        margins = [self.system.margins(t, y, modes) for t, y in zip(times, states, strict=True)]
        for i, mode in enumerate(modes):
            for side in (0, 1) if mode == STICK else (0,) if mode == TAUT else ():
                which, values = (i, side), [at[i][side] for at in margins]
                for k in range(1, len(times)):
                    change, span = NEVER, slice(k - 1, k + 2)
                    if values[k] + margins[k][i][2] < 0.0:
                        change = self._release(step, modes, which, times[k - 1], times[k])
                    elif times[k] < step.t and _may_be_used_up(times[span], values[span]):
                        lowest = self._lowest(step, modes, which, times[k - 1], times[k + 1])
                        if lowest < inf:
                            change = self._release(step, modes, which, times[k - 1], lowest)
                    if change is not NEVER:
                        first[i] = min(first.get(i, NEVER), change)
                        break
        return first

    def _lowest(
        self, step: Step, modes: Modes, which: tuple[int, int], a: float, b: float
    ) -> float:
        """Return a time near the minimum of a margin at which it is used up; inf if it never is."""

        def value(t: float) -> float:
            margins = self.system.margins(t, step.at(self.system, modes, t), modes)[which[0]]
            margin: float = margins[which[1]] + margins[2]
            return margin

        width = MINIMUM_RESOLUTION * (b - a)
        x, y = a + GOLDEN * (b - a), b - GOLDEN * (b - a)
        at_x, at_y = value(x), value(y)
        while min(at_x, at_y) >= 0.0 and b - a > width:
            if at_x < at_y:
                b, y, at_y = y, x, at_x
                x = a + GOLDEN * (b - a)
                at_x = value(x)
            else:
                a, x, at_x = x, y, at_y
                y = b - GOLDEN * (b - a)
                at_y = value(y)
        return x if at_x < 0.0 else y if at_y < 0.0 else inf

    def _release(
        self, step: Step, modes: Modes, which: tuple[int, int], a: float, b: float
    ) -> Change:
        """Return when a margin of a contact is used up between two times, s."""
        system, (i, side) = self.system, which

        def used_up(t: float, share: float) -> float:
            margins = system.margins(t, step.at(system, modes, t), modes)[i]
            return -(margins[side] + share * margins[2])

        if not used_up(b, 1.0) > 0.0:
            return NEVER
        share = 1.0 if used_up(a, 0.0) > 0.0 else 0.0  # an excess that is roundoff is ignored
        held, time = bracket_root(lambda t: used_up(t, share), a, b)
        if time - a <= self._same_time and used_up(a, -1.0) >= 0.0:
            held = time = a  # the force equals the limit there
        mode = SLACK if modes[i] == TAUT else (FORWARD, BACKWARD)[side]
        return Change(time, mode, held)

    def _first_impact(self, step: Step, modes: Modes, end: float) -> tuple[float, int]:
        """Return when the coordinate passes an end stop up to a time, s, and which; else 0."""
        system, stops = self.system, self.system.stops
        q = step.at(system, modes, end)[0]
        side = FORWARD if q > stops.highest else BACKWARD if q < stops.lowest else 0
        if not side:
            return inf, 0
        level = stops.highest if side == FORWARD else stops.lowest
        return bracket_root(
            lambda t: side * (step.at(system, modes, t)[0] - level), step.t_old, end
        )[1], side

    def _settled(self, state: State) -> State:
        """Return the state in the modes that follow from what is released, stops or closes."""
        system, t, modes, now = self.system, state.t, state.modes, state.now
        n, changes = system.coordinates, [*state.changes[-CHATTERING_EVENTS:], t]
        self._check_chattering(changes)
        y_before = list(state.y)
        for contact, mode in zip(system.contacts, now, strict=True):
            if mode == STICK:
                y_before[n + contact.coordinate] = 0.0
            elif mode == TAUT:
                y_before[contact.coordinate] = 0.0
        y = self._closed(y_before, modes, [i for i, mode in enumerate(now) if mode == TAUT])
        if state.at_stop and state.at_stop != LEAVES_STOP:
            y_before[0] = min(max(y[0], system.stops.lowest), system.stops.highest)
            y = self._rebounded(t, y_before, modes)
        after = consistent(system, t, y, modes, now) if modes else modes
        self._record_changes(state, y_before, y, after)
        # Without dry friction it may leave the stop that it has just come to rest on.
        stays = after or not state.at_stop or y[n] != 0.0 or system.rests_on_stop(t, y)
        at_stop = 0 if stays or state.at_stop == LEAVES_STOP else LEAVES_STOP
        started = State(
            t, y, after, [KEEPS for _ in after], inf, at_stop, state.step, t, 0, changes
        )
        if self._is_at_rest(started):
            step = state.step._replace(t=t, t_old=t, y=y, y_old=y)
        else:
            step = state.step.started(system, after, t, y, self.tolerances)
        return started._replace(step=step, samples=state.samples)

    def _closed(self, y: list[float], modes: Modes, ropes: list[int]) -> list[float]:
        """Return the state after the impacts of ropes that become taut at one time.

        One may take up the slack of another once more.
        """
        system, modes, collides = self.system, list(modes), list(ropes)
        for _ in range(MAX_IMPACTS):
            for i in collides:
                y = system.impact(i, y, modes)
                modes[i] = SLACK if _rate(system, system.contacts[i], y) > 0.0 else TAUT
            collides = [i for i in ropes if _rate(system, system.contacts[i], y) < 0.0]
            if not collides:
                break
        return y

    def _check_chattering(self, changes: list[float]) -> None:
        """Raise an error if contacts change their modes without end; bounces on a stop do end."""
        within = changes[-1] - changes[0]
        if not self.system.contacts:
            return
        if len(changes) > CHATTERING_EVENTS and within < CHATTERING_WINDOW * min(1.0, self.end):
            contacts = [contact.name for contact in self.system.contacts]
            what = f"the contact '{contacts[0]}' changed its mode"
            if contacts[1:]:
                what = "the contacts changed their modes"
            advice = "check whether the drive changes too fast"
            if self.system.stops is not None:
                advice += ", or give a larger effects.end_stops.capture_speed"
            raise Chattering(
                f"chattering at t = {changes[-1]:.9g} s: {what} {CHATTERING_EVENTS} times within"
                f" {within:.2g} s; {advice}"
            )

    def _record_changes(
        self, state: State, y_before: list[float], y: list[float], after: Modes
    ) -> None:
        """Record the changes of modes at a time, each with the samples on both sides of it."""
        recording, t, before, is_start = self.recording, state.t, state.modes, not state.step.y
        changed = [i for i, mode in enumerate(after) if mode != before[i] or state.now[i] == TAUT]
        if not (changed or state.at_stop):
            return
        after_it = recording.row(t, y, after)
        before_it = after_it
        if state.at_stop or not is_start:
            # The last time in the mode before is one rounding earlier if the drive jumps at t.
            before_it = [t, *recording.row(min(state.held, t), y_before, before)[1:]]
        if state.at_stop:
            modes = (before[0], after[0]) if before else (sign(y_before[1]), sign(y[1]))
            if state.at_stop == LEAVES_STOP:
                modes = (STICK, -self.system.stops.side(y[0]))
            recording.event(t, STOP, modes, y[0], [before_it, after_it])
            return
        for i in changed:
            name, modes = self.system.contacts[i].name, (before[i], after[i])
            recording.event(t, name, modes, y[0], [before_it, after_it])

    def _rebounded(self, t: float, y: list[float], modes: Modes) -> list[float]:
        """Return the state after an impact on an end stop, v+ = -e v-, with its heat.

        A flight that rounding of time or position would hide is none.
        """
        system, stops, (q, v) = self.system, self.system.stops, y[:2]
        side, after = stops.side(q), 0.0
        if abs(v) >= stops.capture_speed:
            after = -stops.restitution * v
            flight = [q, after, *y[2:]]
            moving = [-mode for mode in modes]
            towards = side * system.rates(t, flight, moving)[1]
            if towards > 0.0:
                duration, height = 2.0 * abs(after) / towards, 0.5 * after * after / towards
                ulps = HIDDEN_ULPS / (1.0 - stops.restitution)
                if duration < ulps * ulp(t) or height < ulps * ulp(q):
                    after = 0.0
        rebound = [q, after, *y[2:]]
        lost = system.kinetic_and_supplied(y)[0] - system.kinetic_and_supplied(rebound)[0]
        rebound[system.impact_heat] += lost
        return rebound


def _may_be_used_up(times: list[float], margins: list[float]) -> bool:
    """Return whether a margin, positive at three times, may be used up about the middle one.

    The times are unevenly spaced: a minimum may be far below the value in the middle where one of
    the spaces is much longer than the other.
    """
    before, middle, after = margins
    rise = max(before, after) - middle
    if before < middle or after < middle or rise == 0.0:
        return False
    left, right = times[1] - times[0], times[2] - times[1]
    fall, climb = (middle - before) / left, (after - middle) / right
    curvature = (climb - fall) / (left + right)
    slope = fall + curvature * left  # of the parabola at the middle time
    return (
        middle < LOW_MARGIN * rise or slope * slope > 4.0 * (1.0 - LOW_MARGIN) * curvature * middle
    )


def _rate(system: Any, contact: Any, y: list[float]) -> float:
    return y[system.coordinates + contact.coordinate]
