"""The method of `RungeKuttaFehlberg45` for many runs at once: each has its own time and step.

The stages are those of `frictionsim.solvers.runge_kutta_fehlberg`: a state is a row of an array of
shape (states, runs). What follows on a condition there is chosen for each run here.
"""

from math import inf
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.solvers.common import rhs_with_friction
from frictionsim.solvers.runge_kutta_fehlberg import MIN_TRIAL_STEP, stages
from frictionsim.solvers.stepper import (
    MAX_FACTOR,
    MIN_ERROR_NORM,
    MIN_FACTOR,
    PI_ALPHA,
    PI_BETA,
    SAFETY,
    STEP_END_TOLERANCE,
    Rhs,
)

if TYPE_CHECKING:
    from frictionsim.scenario.settings import SolverSettings
    from frictionsim.solvers.mechanism import DryFriction, Mechanism


class Tolerances(NamedTuple):
    """Settings of the integrator of each run, (runs,); `end` is the duration, s."""

    rtol: Any
    atol: Any
    max_step: Any
    end: Any

    def select(self, runs: Any) -> "Tolerances":
        """Return those of some of the runs, by their indices."""
        return Tolerances(*(values[runs] for values in self))


def tolerances_of(settings: "list[SolverSettings]") -> Tolerances:
    """Return the settings of many runs."""
    return Tolerances(
        np.array([s.rtol for s in settings]),
        np.array([s.atol for s in settings]),
        np.array([s.max_step or inf for s in settings]),
        np.array([s.duration for s in settings]),
    )


class Start(NamedTuple):
    """The start of a segment: derivative, length of the first step, s, and which runs may start."""

    f: Any
    h: Any
    finite: Any


class LockstepStepper:
    """Integrator of many runs over smooth segments.

    Parameters
    ----------
    states, runs : int
    rhs : callable
        Of times (runs,) and states (states, runs).
    tolerances : Tolerances
    """

    def __init__(self, states: int, runs: int, rhs: Rhs, tolerances: Tolerances) -> None:
        self._rhs = rhs
        self._tolerances = tolerances
        # The stages take all states of all runs as one row.
        row = (1, states, runs)
        self._k = [np.empty(row) for _ in range(6)]
        self._stage, self._y_new, self._error = (np.empty(row) for _ in range(3))

    def start(self, t: Any, y: Any) -> Start:
        """Return how a segment starts at (t, y)."""
        f = np.empty_like(y)
        self._rhs(t, y, f)
        h, finite = self._select_initial_step(t, y, f)
        return Start(f, h, finite)

    def step(self, t: Any, h: Any, y: Any, f: Any) -> Any:
        """Take a step of length h from (t, y); return the state at its end, with its `error`.

        The next call overwrites both.
        """
        self._k[0] = f[None]
        stages(self._rhs_of_row, t, h, y[None], self._k, self._stage, self._y_new, self._error)  # type: ignore[arg-type]
        return self._y_new[0]

    def _rhs_of_row(self, t: Any, y: Any, dy: Any) -> None:
        self._rhs(t, y[0], dy[0])

    def error_norm(self, y_old: Any, y: Any) -> Any:
        """Return the largest error of each run, relative to its tolerance; nan if one is nan."""
        rtol, atol = self._tolerances.rtol, self._tolerances.atol
        size = np.maximum(abs(y_old), abs(y))
        ratio = abs(self._error[0]) / (atol + rtol * size)
        return ratio.max(axis=0)

    def next_step_size(
        self, h: Any, planned: Any, error: Any, error_before: Any, rejected_here: Any
    ) -> Any:
        """Return the length of the step after one of length h, of an error above the minimum."""
        growth = SAFETY * np.float_power(error, -PI_ALPHA) * np.float_power(error_before, PI_BETA)
        most = np.where(rejected_here, 1.0, MAX_FACTOR)
        length = h * np.minimum(np.maximum(growth, MIN_FACTOR), most)
        kept = np.where(~rejected_here & (h < planned), planned, 0.0)
        return np.minimum(np.maximum(length, kept), self._tolerances.max_step)

    def _select_initial_step(self, t: Any, y: Any, f: Any) -> tuple[Any, Any]:
        size, rate = self._norm(y, y), self._norm(f, y)
        max_step = self._tolerances.max_step
        with np.errstate(all="ignore"):  # where nothing moves
            h0 = np.where((size > 1e-5) & (rate > 1e-5), 0.01 * size / rate, 1e-6)
        h0 = np.minimum(np.maximum(h0, MIN_TRIAL_STEP), max_step)
        change = np.empty_like(y)
        self._rhs(t + h0, y + h0 * f, change)
        change = (change - f) / h0
        fastest = np.maximum(rate, self._norm(change, y))
        finite = np.isfinite(rate) & ~np.isnan(fastest)
        with np.errstate(all="ignore"):
            h1 = np.float_power(0.01 / fastest, 0.2)
        h1 = np.where(fastest > 1e-15, h1, np.maximum(1e-6, 1e-3 * h0))
        h = np.minimum(np.minimum(100.0 * h0, h1), max_step)
        return np.where(np.isfinite(fastest), h, h0), finite

    def _norm(self, values: Any, y: Any) -> Any:
        rtol, atol = self._tolerances.rtol, self._tolerances.atol
        return (abs(values) / (atol + rtol * abs(y))).max(axis=0)


def controlled_error(error: Any) -> Any:
    """Return the errors for the controller, not below their minimum."""
    return np.maximum(error, MIN_ERROR_NORM)


def reduced_steps(h: Any, error: Any) -> Any:
    """Return the lengths of the next trials after steps of length h with errors above 1."""
    return h * np.maximum(MIN_FACTOR, SAFETY * np.float_power(error, -0.2))


def clipped_steps(h: Any, left: Any) -> Any:
    """Return the lengths of the next steps, at most `left`, s."""
    halved = np.where(h > 0.5 * left, 0.5 * left, h)
    return np.where(h >= left * STEP_END_TOLERANCE, left, halved)


def slip_rhs(mechanism: "Mechanism", contact: "DryFriction", s: Any) -> Rhs:
    """Return the right-hand side while the contact slides in direction s."""
    kinetic_limit = contact.kinetic_limit

    def friction(u: float, q: float, v: float, applied_torque: float) -> float:
        return -s * kinetic_limit(u, q, v, s)

    return rhs_with_friction(mechanism, friction)
