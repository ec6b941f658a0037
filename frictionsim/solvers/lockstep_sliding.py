"""Sliding runs, a step of each at a time, and the stops within their steps."""

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.solvers.base import MAX_ENERGY_RATIO, EnergyMonitor
from frictionsim.solvers.lockstep_roots import bracket_roots
from frictionsim.solvers.lockstep_signals import SignalOfRuns
from frictionsim.solvers.lockstep_stepper import (
    LockstepStepper,
    Tolerances,
    clipped_steps,
    controlled_error,
    reduced_steps,
    slip_rhs,
)
from frictionsim.solvers.one_contact import RESOLUTION

if TYPE_CHECKING:
    from frictionsim.solvers.mechanism import Mechanism

SLIDING, AT_END, MAY_REST, GIVEN_BACK = 0, 1, 2, 3


class Segment(NamedTuple):
    """Where sliding runs are: arrays (runs,) or (states, runs), in the order of its fields.

    Attributes
    ----------
    t : s
    direction : +1 or -1
    h : s
        Planned length of the next step.
    error_before : relative to the tolerance
    smooth_end : s
        End of the smooth part of the drive.
    steps : steps and rejected steps so far
    rejected_here : of bool
        A trial of the next step was rejected.
    y, f : states and their derivatives
    """

    t: Any
    direction: Any
    h: Any
    error_before: Any
    smooth_end: Any
    steps: Any
    rejected_here: Any
    y: Any
    f: Any

    def select(self, runs: Any) -> "Segment":
        """Return those of some of the runs, by their indices."""
        return Segment(*(values[..., runs] for values in self))

    def put(self, runs: Any, other: "Segment") -> None:
        """Overwrite those of some of the runs."""
        for values, new in zip(self, other, strict=True):
            values[..., runs] = new


def monotone_segment_ends(drive: SignalOfRuns, breaks: tuple[Any, ...], t: Any, end: Any) -> Any:
    """Return times after t up to which drive and friction limits are smooth and monotone, s.

    `monotone_segment_end` of one run: the next extremum of the drive, the next of `breaks`, or
    `end`. A run whose search fails has nan.
    """
    b = np.minimum(end, drive.next_extremum(t))
    for critical in breaks:
        passes = (drive(t) - critical) * (drive(b) - critical) < 0.0
        if passes.any():
            found = bracket_roots(lambda x, c=critical: drive(x) - c, t, b, passes)  # type: ignore[misc]
            b = np.where(found.hidden, np.nan, found.high)
    return b


class SlidingRuns:
    """A step of each sliding run at a time, until it is at its end or may come to rest.

    Parameters
    ----------
    mechanism : Mechanism
        Of these runs.
    tolerances : Tolerances
    segment : Segment
        Changed in place.
    max_steps : int
        A run that takes so many is given back.

    Attributes
    ----------
    state : (runs,) of int
        SLIDING; AT_END; MAY_REST, in the step from `segment` to `t_new`, `y_new`, `f_new`; or
        GIVEN_BACK to the reference, which finds out what is the matter.
    """

    def __init__(
        self, mechanism: "Mechanism", tolerances: Tolerances, segment: Segment, max_steps: int
    ) -> None:
        assert mechanism.contact is not None  # of `joined_mechanism`
        states, runs = segment.y.shape
        self.segment, self.mechanism, self._max_steps = segment, mechanism, max_steps
        self._drive: Any = mechanism.drive
        self._breaks, self._end = mechanism.contact.monotonicity_breaks, tolerances.end
        self._rhs = slip_rhs(mechanism, mechanism.contact, segment.direction)
        self._stepper = LockstepStepper(states, runs, self._rhs, tolerances)
        self._monitor = EnergyMonitor(mechanism, tolerances)
        self.state = np.zeros(runs, dtype=np.int8)
        self.t_new, self.y_new, self.f_new = (
            np.zeros_like(x) for x in (segment.t, segment.y, segment.f)
        )
        self._f_trial = np.empty_like(segment.f)

    def advance(self) -> None:
        """Try a step in each sliding run, and take it where its error is small enough."""
        self._enter_smooth_parts()
        now, stepper = self.segment, self._stepper
        left = now.smooth_end - now.t
        h = clipped_steps(now.h, left)
        y = stepper.step(now.t, h, now.y, now.f)
        error = stepper.error_norm(now.y, y)
        t = np.where(h == left, now.smooth_end, now.t + h)
        f = self._f_trial
        self._rhs(t, y, f)
        sliding = self.state == SLIDING
        accepted = sliding & (error <= 1.0)
        np.add(now.steps, 1, out=now.steps, where=sliding)
        if not accepted.all():
            self._reject(np.flatnonzero(sliding & ~accepted), h, error)
        self._plan(accepted, h, error)
        self._commit(accepted, t, y, f)

    def _enter_smooth_parts(self) -> None:
        now = self.segment
        runs = np.flatnonzero((now.t >= now.smooth_end) & (self.state == SLIDING))
        if not runs.size:
            return
        breaks = tuple(np.asarray(critical)[runs] for critical in self._breaks)
        ends = monotone_segment_ends(self._drive.select(runs), breaks, now.t[runs], self._end[runs])
        failed = np.isnan(ends)
        self.state[runs[failed]] = GIVEN_BACK
        now.smooth_end[runs] = np.where(failed, now.t[runs], ends)

    def _reject(self, runs: Any, h: Any, error: Any) -> None:
        """Shorten the steps of runs whose errors are too large."""
        now = self.segment
        shorter = reduced_steps(h[runs], error[runs])
        now.h[runs] = shorter
        now.rejected_here[runs] = True
        failed = ~(shorter >= 4.0 * np.spacing(now.smooth_end[runs]))
        failed |= ~np.isfinite(error[runs]) | (now.steps[runs] >= self._max_steps)
        self.state[runs[failed]] = GIVEN_BACK

    def _plan(self, accepted: Any, h: Any, error: Any) -> None:
        """Plan the next step of each run that has taken one."""
        now = self.segment
        error = controlled_error(error)
        planned = self._stepper.next_step_size(h, now.h, error, now.error_before, now.rejected_here)
        np.copyto(now.h, planned, where=accepted)
        np.copyto(now.error_before, error, where=accepted)
        now.rejected_here[accepted] = False

    def _commit(self, accepted: Any, t: Any, y: Any, f: Any) -> None:
        """Go to the end of the steps, where they bring no stop."""
        now, state = self.segment, self.state
        kinetic, put_in = self._monitor.energies(y)
        state[accepted & (kinetic > MAX_ENERGY_RATIO * put_in)] = GIVEN_BACK
        state[accepted & (now.steps >= self._max_steps)] = GIVEN_BACK
        held_back = accepted & self._may_rest(t, y, f)
        if held_back.any():
            runs = np.flatnonzero(held_back & (state == SLIDING))
            state[runs] = MAY_REST
            self.t_new[runs], self.y_new[:, runs], self.f_new[:, runs] = (
                t[runs],
                y[:, runs],
                f[:, runs],
            )
            accepted = accepted & ~held_back
        np.copyto(now.t, t, where=accepted)
        np.copyto(now.y, y, where=accepted)
        np.copyto(now.f, f, where=accepted)
        state[accepted & (t >= self._end) & (state == SLIDING)] = AT_END

    def _may_rest(self, t: Any, y: Any, f: Any) -> Any:
        """Return whether the velocity may be zero within a step.

        It is at the end; or the velocity, which is above its tangents at both ends, may be as low
        as their intersection.
        """
        now, s = self.segment, self.segment.direction
        v1 = s * y[1]
        stopped = v1 <= 0.0
        turning = (s * now.f[1] < 0.0) & (s * f[1] > 0.0)
        if not turning.any():
            return stopped
        h, v0, a0, a1 = t - now.t, s * now.y[1], s * now.f[1], s * f[1]
        with np.errstate(all="ignore"):  # where it does not turn
            low = v0 + a0 * (v1 - v0 - a1 * h) / (a0 - a1) <= 0.0
        return stopped | (turning & low)


class StepInside:
    """The states within the last steps of runs, each a shorter step from its start.

    Parameters
    ----------
    mechanism : Mechanism
    tolerances : Tolerances
    segment : Segment
        The starts of the steps.
    t_new, y_new : (runs,) and (states, runs)
        Their ends.
    """

    def __init__(
        self,
        mechanism: "Mechanism",
        tolerances: Tolerances,
        segment: Segment,
        t_new: Any,
        y_new: Any,
    ) -> None:
        assert mechanism.contact is not None  # of `joined_mechanism`
        self._start, self._t_new, self._y_new = segment, t_new, y_new
        self._rhs = slip_rhs(mechanism, mechanism.contact, segment.direction)
        self._stepper = LockstepStepper(len(segment.y), t_new.size, self._rhs, tolerances)
        self._dy = np.empty_like(segment.y)

    def state(self, t: Any) -> Any:
        """Return the states at times within the steps."""
        start = self._start
        inside = self._stepper.step(start.t, t - start.t, start.y, start.f)
        return np.where(t >= self._t_new, self._y_new, inside)

    def velocity(self, t: Any) -> Any:
        """Return the velocities in the direction of sliding."""
        return self._start.direction * self.state(t)[1]

    def acceleration(self, t: Any) -> Any:
        """Return the accelerations in the direction of sliding."""
        self._rhs(t, self.state(t), self._dy)
        return self._start.direction * self._dy[1]

    def rests(self) -> tuple[Any, Any]:
        """Return the time of the first stop in each step, inf if none, and which searches failed.

        `EventDrivenSolver.rest_within_step` and `time_of_min_velocity` of one run.
        """
        start, t_old = self._start, self._start.t
        moving = start.direction * self._y_new[1] > 0.0
        t1, passes, hidden = self._t_new, np.zeros_like(moving), np.zeros_like(moving)
        if moving.any():
            resolution = RESOLUTION * (t1 - t_old)
            slowest = bracket_roots(self.acceleration, t_old, t1, moving, resolution)
            t1, hidden = np.where(moving, slowest.high, t1), slowest.hidden
            passes = moving & ~(self.velocity(t1) <= 0.0)
        resolution = RESOLUTION * (t1 - t_old)
        searched = ~passes & ~hidden
        low, at_once = self._after_breakaway(t1, resolution, searched)
        searched &= ~at_once & ~(low >= t1)
        rest = np.where(at_once, t_old, t1)
        if searched.any():
            found = bracket_roots(self.velocity, low, t1, searched, resolution)
            rest, hidden = np.where(searched, found.high, rest), hidden | found.hidden
        return np.where(passes, np.inf, rest), hidden

    def _after_breakaway(self, t1: Any, resolution: Any, searched: Any) -> tuple[Any, Any]:
        """Return where to search from, and where the contact stops at once.

        The zero velocity at the start of a phase after a breakaway does not count.
        """
        start = self._start
        from_rest = searched & (start.direction * start.y[1] <= 0.0)
        width, at_once = t1 - start.t, np.zeros_like(from_rest)
        left = from_rest.copy()
        while left.any():
            left &= self.velocity(start.t + width) <= 0.0
            width = np.where(left, width * 0.1, width)
            at_once |= left & (width <= resolution)
            left &= ~at_once
        return np.where(from_rest, start.t + width, start.t), at_once
