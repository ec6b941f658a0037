"""Friction laws in the right-hand side of one coordinate.

Of a mechanism of one coordinate with one contact, without end stops. A law gives the friction of a
state, so that no change of mode ends a step. Steps end where the drive, a table over the angle or
the load is not smooth.

set-valued     T = clip(-M) at rest up to the static limit, so that sticking is exact; the kinetic
               limit in the direction of sliding. Where the friction jumps, the error estimate
               shortens the steps to some roundings of the time.
regularised    T = -sign(v) F(|v|/v_t) with Threlfall's curve, `friction_curve`: at rest the body
               creeps at about v_t M/(1.5 L_s), the time constant there is v_t I/(1.5 L_s), and the
               error of the motion is of the order of v_t. What counts as stick is |v| < v_t.
published      Eq 30 of the paper as printed [1]_, I dw/dt = (-sign(w) r_k R + M) sign(|sign(|x| -
               x)| + |sign(w)|), x = r_s - |M|/R: beyond the limit at rest, sign(0) = 0 removes all
               friction; after the first motion no step hits w = 0 again, so that the static limit
               has no effect. It is here for comparison.

References
----------
.. [1] "Analysis of friction systems on shafts", Int. J. Applied Engineering Research 13(11),
   2018, 8871-8881, eq 30.
"""

from math import inf, ulp
from typing import Any

from frictionsim.errors import Chattering
from frictionsim.results import BACKWARD, FORWARD, STICK
from frictionsim.solvers.friction_curve import KINETIC_FROM, friction_curve
from frictionsim.solvers.loop import Loop, State, may_pass_zero, sign, smooth_step
from frictionsim.solvers.rkf45 import Tolerances
from frictionsim.solvers.roots import bracket_root
from frictionsim.solvers.system import OneCoordinate

# A step across a jump of the friction is accepted at so many units in the last place of the time:
# its error is of the order of the roundoff.
JUMP_ULPS = 16.0
# Of eq 30: so many changes of direction within this fraction of the duration are chattering, and so
# are so many steps, as stages on both sides of v = 0 cancel and v creeps without changing sign.
CHANGES, CHANGES_WITHIN = 100, 1e-4
STEPS, STEPS_WITHIN = 1000, 1e-6


class Law(Loop):
    """A friction law in the right-hand side, which replaces the dry friction of the system."""

    system: OneCoordinate

    def __init__(self, system: OneCoordinate, *others: Any) -> None:
        super().__init__(system, *others)
        self.contact: Any = system.friction
        system.use_friction(self.friction)
        self.state = self.state._replace(modes=[self.mode_at_start(system.start[1])])

    def friction(self, u: Any, q: float, v: float, s: int, applied: float) -> float:
        """Return T of a state, N m; s is the mode, or of a stage that of the step."""
        raise NotImplementedError

    def mode_at_start(self, v: float) -> int:
        """Return the mode before the run."""
        return sign(v)

    def mode_of(self, t: float, y: list[float], mode: int) -> int:
        """Return the mode of a state within a step that began in a mode."""
        return sign(y[1])

    def row(self, t: float, y: list[float], modes: list[int]) -> list[float]:
        return self.recording.row(t, y, [self.mode_of(t, y, modes[0])])

    def segment_until(self, t: float, y: list[float], mode: int) -> float:
        """Return until when the next steps are smooth, s."""
        return self.system.smooth_until(t, y, self.end)

    def begun(self, state: State) -> State:
        if state.t < state.segment or state.t >= self.end:
            return state
        if not state.step.y:
            state = self.started(state, state.y, self.first_mode(state))
        segment = self.segment_until(state.t, state.y, state.modes[0])
        return state._replace(segment=segment)

    def first_mode(self, state: State) -> int:
        """Return the mode that begins at the start of the run; record a breakaway there."""
        return state.modes[0]

    def started(self, state: State, y: list[float], mode: int) -> State:
        """Return a state whose integrator begins anew in a mode."""
        step = state.step.started(self.system, [mode], state.t, y, self.tolerances)
        return state._replace(y=y, modes=[mode], step=step)

    def record_change(
        self, t: float, modes: tuple[int, int], *sides: list[float], held: float = inf
    ) -> None:
        """Record a change of mode with the states on both sides of it.

        `held` is the last time in the mode before, s, one rounding earlier if the drive jumps.
        """
        y, after = sides
        before_it = [t, *self.recording.row(min(held, t), y, [modes[0]])[1:]]
        rows = [before_it, self.recording.row(t, after, [modes[1]])]
        self.recording.event(t, self.contact.name, modes, after[0], rows)


class SetValued(Law):
    """Exact sticking; the mode is the direction of sliding, or STICK."""

    def __init__(self, system: OneCoordinate, tolerances: Tolerances, *others: Any) -> None:
        super().__init__(system, tolerances._replace(jump_ulps=JUMP_ULPS), *others)

    def friction(self, u: Any, q: float, v: float, s: int, applied: float) -> float:
        s = self._mode(u, q, v, s, applied)
        return -applied if s == STICK else -s * self.contact.kinetic(u, q, v, s, applied)

    def _mode(self, u: Any, q: float, v: float, s: int, applied: float) -> int:
        """Return the mode of a state, after sliding in direction s or a rest.

        It slides if the velocity has that direction, or where a slip begins at rest; else it
        sticks up to the static limit.
        """
        direction = s or v
        if direction * v > 0.0 or (s and v == 0.0):
            return FORWARD if direction > 0.0 else BACKWARD
        if abs(applied) <= self.contact.static(u, q) + self.contact.roundoff(u, q):
            return STICK
        return FORWARD if applied > 0.0 else BACKWARD

    def mode_of(self, t: float, y: list[float], mode: int) -> int:
        u = self.system.acting(t, y[0], y[1])
        return self._mode(u, y[0], y[1], mode, self.system.torque(u, y[0], y[1]))

    def mode_from_rest(self, t: float, y: list[float]) -> int:
        """Return the mode that follows from rest in the position of y."""
        return self.mode_of(t, [y[0], 0.0], STICK)

    def segment_until(self, t: float, y: list[float], mode: int) -> float:
        # At rest no breakaway is missed within a step.
        of = self.system.rests_until if mode == STICK else self.system.smooth_until
        return of(t, y, self.end)

    def first_mode(self, state: State) -> int:
        if state.modes != [STICK]:
            return state.modes[0]
        mode = self.mode_from_rest(0.0, state.y)
        if mode != STICK:
            row = self.recording.row(0.0, state.y, [mode])
            self.recording.event(0.0, self.contact.name, (STICK, mode), state.y[0], [row, row])
        return mode

    def step(self, state: State) -> tuple[Any, Any]:
        step, crossed = super().step(state)
        slowest = _time_of_possible_rest(step, state.modes[0])
        if slowest < inf:
            # Take the step again, to there: a rest between its stages would go unnoticed.
            modes, system = state.modes, self.system
            before = state.step.started(system, modes, state.t, state.y, self.tolerances)
            step, crossed = smooth_step(system, before, modes, slowest, self.tolerances)
        return step, crossed

    def ended(self, state: State, step: Any) -> State:
        mode, v, system = state.modes[0], state.y[1], self.system
        if mode == STICK and v != 0.0:
            # The sign of v may be wrong: across a jump, some stages have the friction before it
            # and some the friction after it.
            after = self.mode_from_rest(state.t, state.y) or sign(v)
            held, t = self._breakaway(step, after)
            rest = [step.y_old[0], 0.0, *step.y_old[2:]]
            self.record_change(t, (mode, after), rest, rest, held=held)
            # Displacement against the new direction is below the tolerance; discard it.
            q = step.y_old[0] if after * (state.y[0] - step.y_old[0]) < 0.0 else state.y[0]
        elif mode != STICK and mode * v <= 0.0:
            t = self._rest(step, mode)
            y = step.at(system, [mode], t)
            # If it sticks at the stop, it may have broken away again within the step.
            after = self.mode_from_rest(t, y) or self.mode_from_rest(state.t, state.y)
            rest = [y[0] if after else state.y[0], 0.0, *(y if after else state.y)[2:]]
            if after != mode:
                self.record_change(t, (mode, after), rest, rest)
            q = state.y[0]
        else:
            return state
        v = 0.0 if after * v <= 0.0 else v  # below the tolerance
        state = self.started(state, [q, v, *state.y[2:]], after)
        # Where it breaks away at rest depends on the position.
        return state._replace(segment=state.t if after == STICK else state.segment)

    def _breakaway(self, step: Any, mode: int) -> tuple[float, float]:
        """Return the time of the breakaway in a step, s, and before it the last that holds."""
        side, y, a, b = 0 if mode == FORWARD else 1, step.y_old, step.t_old, step.t

        def excess(t: float) -> float:
            return -self.system.margins(t, y, [STICK])[0][side]

        if excess(a) > 0.0 or excess(b) <= 0.0:
            return a, a
        held, t = bracket_root(excess, a, b)
        return (a, a) if t < ulp(b) else (held, t)  # a time near zero has digits beyond a step's

    def _rest(self, step: Any, mode: int) -> float:
        """Return the time at which the velocity became zero in a step, s."""
        if mode * step.y_old[1] <= 0.0:
            return float(step.t_old)
        return bracket_root(
            lambda t: mode * step.at(self.system, [mode], t)[1], step.t_old, step.t
        )[1]


def _time_of_possible_rest(step: Any, s: int) -> float:
    """Return when a step in direction s was slowest, s, if it may have been at rest; else inf.

    The cubic through both ends has its minimum about where the velocity has.
    """
    if not (s * step.y[1] > 0.0 and may_pass_zero(step, 1, s)):
        return inf
    h = step.t - step.t_old
    v_old, v, a_old, a = s * step.y_old[1], s * step.y[1], s * step.k_old[1], s * step.k[1]
    # v_old + a_old x + c x^2 + d x^3 with x = t - t_old; its slope is zero once after a fall.
    c = (3.0 * (v - v_old) / h - 2.0 * a_old - a) / h
    d = (a_old + a - 2.0 * (v - v_old) / h) / (h * h)
    t: float = step.t_old - a_old / (c + (c * c - 3.0 * a_old * d) ** 0.5)
    return t if step.t_old < t < step.t else inf


class Regularised(Law):
    """Smoothed over the transition speed; slower motion counts as sticking."""

    def friction(self, u: Any, q: float, v: float, s: int, applied: float) -> float:
        s = FORWARD if v > 0.0 else BACKWARD
        x = s * v / self.contact.transition_speed
        static = self.contact.static(u, q) if x < KINETIC_FROM else 0.0
        kinetic = self.contact.kinetic(u, q, v, s, applied) if x > 1.0 else 0.0
        return -s * friction_curve(x, static, kinetic)

    def mode_at_start(self, v: float) -> int:
        return STICK if abs(v) < self.contact.transition_speed else sign(v)

    def mode_of(self, t: float, y: list[float], mode: int) -> int:
        return self.mode_at_start(y[1])

    def segment_until(self, t: float, y: list[float], mode: int) -> float:
        return min(self.end, self.system.drive.next_discontinuity(t))

    def ended(self, state: State, step: Any) -> State:
        before, after = state.modes[0], self.mode_at_start(state.y[1])
        if after == before:
            return state
        threshold = (after or before) * self.contact.transition_speed
        way, t = 1.0 if threshold > step.y_old[1] else -1.0, step.t
        if way * (step.y_old[1] - threshold) < 0.0:
            t = bracket_root(
                lambda at: way * (step.at(self.system, [before], at)[1] - threshold),
                step.t_old,
                step.t,
            )[1]
        y = step.at(self.system, [before], t)
        self.record_change(t, (before, after), y, y)
        return state._replace(modes=[after])


class Published(Law):
    """Eq 30; changes of direction are found at the ends of steps, and chattering ends a run."""

    def friction(self, u: Any, q: float, v: float, s: int, applied: float) -> float:
        s = sign(v) or s  # the side before a reversal is at rest in its mode
        x = self.contact.static(u, q) - abs(applied)
        if sign(abs(sign(abs(x) - x)) + abs(s)) == 0:
            return -applied
        return -s * self.contact.kinetic(u, q, v, s, applied) if s else 0.0

    def ended(self, state: State, step: Any) -> State:
        before, after, t = state.modes[0], sign(state.y[1]), state.t
        if after != before:
            # It is not located: the side before it is at rest, after a rest at the step's start.
            q, _, *energies = step.y_old if before == STICK else state.y
            self.record_change(t, (before, after), [q, 0.0, *energies], state.y)
            state = state._replace(modes=[after], changes=[*state.changes[-CHANGES:], t])
        if self.tolerances.fixed_step == 0.0:
            self._check(state, after != before)
            if step.taken % STEPS == 0:
                state = state._replace(held=t)  # when the last thousand ended
        return state

    def _check(self, state: State, changed: bool) -> None:
        changes, within = state.changes, CHANGES_WITHIN * self.end
        if changed and len(changes) > CHANGES and state.t - changes[0] < within:
            raise self._chattering(state.t, "changed its mode", CHANGES, state.t - changes[0])
        since, within = state.t - state.held, STEPS_WITHIN * self.end
        if state.step.taken % STEPS == 0 and since < within:
            raise self._chattering(state.t, "made the solver creep", STEPS, since)

    def _chattering(self, t: float, what: str, times: int, within: float) -> Chattering:
        return Chattering(
            f"chattering at t = {t:.9g} s: the contact '{self.contact.name}' {what} {times} times"
            f" within {within:.2g} s; eq 30 chatters instead of sticking; use law 'set-valued', or"
            " a fixed solver.step to show the chattering"
        )
