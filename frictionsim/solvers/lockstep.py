"""Event-driven integration of many runs of one scenario with other numbers, all at once.

The algorithm, its equations and its iterates are those of `EventDrivenSolver`, the reference:
times and states are the same to the last bit. Each run has its own time and step; in one pass all
sliding runs try a step together, as arrays with one number for each run. A run that would fail
there, for whatever reason, is given back to be done by the reference, which says why.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.results import BACKWARD, FORWARD, STICK
from frictionsim.solvers.common import SAME_TIME_ULPS
from frictionsim.solvers.lockstep_functions import selected
from frictionsim.solvers.lockstep_roots import bracket_roots
from frictionsim.solvers.lockstep_sliding import (
    AT_END,
    GIVEN_BACK,
    MAY_REST,
    SLIDING,
    Segment,
    SlidingRuns,
    StepInside,
    monotone_segment_ends,
)
from frictionsim.solvers.lockstep_stepper import LockstepStepper, Tolerances, slip_rhs
from frictionsim.solvers.one_contact_state import CHATTERING_EVENTS, CHATTERING_WINDOW, NEVER

if TYPE_CHECKING:
    from frictionsim.solvers.mechanism import Mechanism


# A pass of so few runs takes longer than their steps one by one in the reference.
FEW = 16
# Passes that few runs may take, however soon the others were done.
PASSES_OF_FEW = 500


class Events(NamedTuple):
    """Changes of mode, in the order in which they were found; arrays (events,).

    Attributes
    ----------
    run : index of the run
    time, held : s
        See `Solver.change_mode`.
    mode_from, mode_to : modes
    y : (states, events)
    """

    run: Any
    time: Any
    held: Any
    mode_from: Any
    mode_to: Any
    y: Any


class LockstepSolver:
    """Solver of many runs of one coordinate with dry friction.

    Parameters
    ----------
    mechanism : Mechanism
        Of all runs, as of `joined_mechanism`.
    tolerances : Tolerances
    max_steps : int
    on_pass : callable, optional
        Called between passes; it may raise what stops all runs.

    Attributes
    ----------
    given_back : (runs,) of bool
        To be done by the reference.
    mode, y : (runs,), (states, runs)
        At the end.
    start_mode : (runs,)
        Mode of the sample at the start.
    events : list of Events
    """

    def __init__(
        self,
        mechanism: "Mechanism",
        tolerances: Tolerances,
        max_steps: int,
        on_pass: Callable[[], object] = lambda: None,
    ) -> None:
        runs = mechanism.velocity.size  # type: ignore[attr-defined]
        self._mechanism, self._tolerances, self._max_steps = mechanism, tolerances, max_steps
        y = np.zeros((len(mechanism.initial_state), runs))
        y[0], y[1] = mechanism.position, mechanism.velocity
        t, mode, h, error_before, smooth_end = np.zeros((5, runs))
        steps, rejected_here = np.zeros(runs, dtype=np.int64), np.zeros(runs, dtype=bool)
        counts = steps, rejected_here
        self._segment = Segment(t, mode, h, error_before, smooth_end, *counts, y, np.zeros_like(y))
        self.mode, self.y = mode, y  # the mode is the direction of sliding
        self.mode[:] = np.sign(mechanism.velocity)
        self.start_mode = self.mode.copy()
        self.given_back = np.zeros(runs, dtype=bool)
        self.events: list[Events] = []
        self._on_pass, self._passes, self._passes_of_few = on_pass, 0, 0
        self._state = np.zeros(runs, dtype=np.int8)
        self._held = np.full(runs, NEVER)
        self._switches = np.zeros(runs, dtype=np.int64)
        self._switch_times = np.zeros((CHATTERING_EVENTS, runs))
        self._t_new, self._y_new, self._f_new = (np.zeros_like(x) for x in (self.mode, y, y))

    def run(self) -> None:
        """Integrate all runs to their ends."""
        sliding = np.flatnonzero(self.mode != STICK)
        resting = np.flatnonzero(self.mode == STICK)
        self._begin_slip(sliding)
        self._switch(resting, self._mode_from_rest(resting))
        while True:
            on_the_way = self._state == SLIDING
            resting = np.flatnonzero(on_the_way & (self.mode == STICK))
            sliding = np.flatnonzero(on_the_way & (self.mode != STICK))
            may_rest = np.flatnonzero(self._state == MAY_REST)
            if self._takes_too_long(resting.size + sliding.size + may_rest.size):
                self._state[self._state != AT_END] = GIVEN_BACK
                break
            if resting.size:
                self._stick(resting)
            elif sliding.size:
                self._slip(sliding)
            elif may_rest.size:
                self._stop(may_rest)
            else:
                break
        self.given_back = self._state == GIVEN_BACK

    def _takes_too_long(self, runs: int) -> bool:
        """Count a pass, and return whether the runs that are left are better done alone."""
        self._on_pass()
        self._passes += 1
        if runs > FEW:
            return False
        self._passes_of_few += 1
        return self._passes_of_few > max(PASSES_OF_FEW, self._passes // 2)

    def _slip(self, runs: Any) -> None:
        """Slide until half of the runs are at their end or may come to rest."""
        group = SlidingRuns(
            selected(self._mechanism, runs),
            self._tolerances.select(runs),
            self._segment.select(runs),
            self._max_steps,
        )
        while 2 * np.count_nonzero(group.state == SLIDING) > runs.size:
            group.advance()
            if self._takes_too_long(runs.size):
                break
        self._segment.put(runs, group.segment)
        self._state[runs] = group.state
        self._t_new[runs], self._y_new[:, runs] = group.t_new, group.y_new
        self._f_new[:, runs] = group.f_new

    def _stop(self, runs: Any) -> None:
        """Look for stops in the last steps, and go on from there, or from the end of the step."""
        segment, t_new, y_new = self._segment.select(runs), self._t_new[runs], self._y_new[:, runs]
        inside = StepInside(
            selected(self._mechanism, runs), self._tolerances.select(runs), segment, t_new, y_new
        )
        rest, hidden = inside.rests()
        at_rest = inside.state(np.minimum(rest, t_new))
        self._state[runs] = np.where(hidden, GIVEN_BACK, SLIDING)
        goes_on = np.isinf(rest)
        now = self._segment
        now.t[runs] = np.where(goes_on, t_new, rest)
        now.y[:, runs] = np.where(goes_on, y_new, at_rest)
        now.f[:, runs] = self._f_new[:, runs]  # where it goes on
        stopped = runs[~goes_on & ~hidden]
        now.y[1, stopped] = 0.0
        self._switch(stopped, self._mode_from_rest(stopped))
        self._end(runs)

    def _stick(self, runs: Any) -> None:
        """Stick for a monotone segment of the drive, or up to the breakaway in it."""
        mechanism = selected(self._mechanism, runs)
        assert mechanism.contact is not None  # of `joined_mechanism`
        now, end = self._segment, self._tolerances.end[runs]
        a, drive = now.t[runs], mechanism.drive
        b = monotone_segment_ends(drive, mechanism.contact.monotonicity_breaks, a, end)  # type: ignore[arg-type]
        failed = np.isnan(b)
        b = np.where(failed, a, b)
        balance = _BalanceAtRest(mechanism, now.y[0, runs])
        mode = balance.mode_from_rest(b)
        breaks_away = (mode != STICK) & ~failed
        held, until = b, b
        if breaks_away.any():
            found, hidden = balance.breakaways(a, b, mode, breaks_away, end)
            (held, until), failed = found, failed | hidden
        self._held[runs] = np.where(breaks_away, held, self._held[runs])
        now.t[runs] = until
        self._state[runs[failed]] = GIVEN_BACK
        leaves = breaks_away & ~failed
        self._switch(runs[leaves], mode[leaves])
        self._end(runs)

    def _end(self, runs: Any) -> None:
        at_end = self._segment.t[runs] >= self._tolerances.end[runs]
        self._state[runs[at_end & (self._state[runs] == SLIDING)]] = AT_END

    def _mode_from_rest(self, runs: Any) -> Any:
        """Return the modes that follow from rest at the present times."""
        balance = _BalanceAtRest(selected(self._mechanism, runs), self._segment.y[0, runs])
        return balance.mode_from_rest(self._segment.t[runs])

    def _switch(self, runs: Any, mode: Any) -> None:
        """Switch to the next modes, and record the transitions where a mode changes."""
        self._count_switches(runs)
        now, before = self._segment, self.mode[runs]
        changes = before != mode
        who = runs[changes]
        t = now.t[who]
        held = np.where(before[changes] == STICK, self._held[who], t)
        self.events.append(Events(who, t, held, before[changes], mode[changes], now.y[:, who]))
        self.mode[runs] = mode
        at_start = runs[now.t[runs] == 0.0]
        self.start_mode[at_start] = self.mode[at_start]
        self._begin_slip(runs[mode != STICK])

    def _count_switches(self, runs: Any) -> None:
        """Give back the runs that chatter."""
        t, last = self._segment.t[runs], self._switches[runs] % CHATTERING_EVENTS
        first = self._switch_times[last, runs]  # as long ago as are counted
        window = CHATTERING_WINDOW * np.minimum(1.0, self._tolerances.end[runs])
        chatters = (self._switches[runs] >= CHATTERING_EVENTS) & (t - first < window)
        self._switch_times[last, runs] = t
        self._switches[runs] += 1
        self._state[runs[chatters]] = GIVEN_BACK

    def _begin_slip(self, runs: Any) -> None:
        now, mechanism = self._segment, selected(self._mechanism, runs)
        assert mechanism.contact is not None  # of `joined_mechanism`
        rhs = slip_rhs(mechanism, mechanism.contact, self.mode[runs])
        stepper = LockstepStepper(len(self.y), runs.size, rhs, self._tolerances.select(runs))
        t = now.t[runs]
        start = stepper.start(t, now.y[:, runs])
        now.f[:, runs], now.h[runs], now.error_before[runs] = start.f, start.h, 1.0
        now.smooth_end[runs] = t
        self._state[runs[~start.finite]] = GIVEN_BACK


class _BalanceAtRest:
    """Applied torque against the static limit of runs at rest, at positions q."""

    def __init__(self, mechanism: "Mechanism", q: Any) -> None:
        assert mechanism.contact is not None  # of `joined_mechanism`
        self._drive: Any = mechanism.drive
        self._applied_torque, self._contact = mechanism.applied_torque, mechanism.contact
        self._q = q

    def excess(self, t: Any, s: Any) -> Any:
        """Return the applied torque in direction s minus the static limit, N m."""
        u, q = self._drive(t), self._q
        return s * self._applied_torque(u, q, 0.0) - self._contact.static_limit(u, q)

    def roundoff(self, t: Any) -> Any:
        """Return the roundoff of the excess, N m."""
        return self._contact.roundoff(self._drive(t), self._q)

    def mode_from_rest(self, t: Any) -> Any:
        """Return the modes that follow at times t."""
        roundoff = self.roundoff(t)
        forward = self.excess(t, FORWARD) - roundoff > 0.0
        backward = self.excess(t, BACKWARD) - roundoff > 0.0
        return np.where(forward, float(FORWARD), np.where(backward, float(BACKWARD), float(STICK)))

    def breakaways(self, a: Any, b: Any, s: Any, wanted: Any, end: Any) -> tuple[Any, Any]:
        """Return the times of the breakaways within monotone segments, and which searches failed.

        Two adjacent times, s: the contact still holds at the first.
        """
        at_a = self.excess(a, s)
        # If the torque equals the limit at a, ignore an excess that is roundoff.
        plain, tie = at_a <= 0.0, self.roundoff(a)

        def excess(t: Any) -> Any:
            return self.excess(t, s) - np.where(plain, 0.0, self.roundoff(t))

        found = bracket_roots(excess, a, b, wanted)
        at_once = (found.high - a <= SAME_TIME_ULPS * np.spacing(end)) & (excess(a) >= -tie)
        return (np.where(at_once, a, found.low), np.where(at_once, a, found.high)), found.hidden
