"""SciPy's integrators, step by step, behind the interface of our own."""

from math import ulp
from typing import Any
from warnings import catch_warnings, simplefilter

import numpy as np
import scipy.integrate
from numpy.linalg import LinAlgError

from frictionsim.errors import BudgetExceeded
from frictionsim.solvers.runge_kutta_fehlberg import Rhs, State, not_finite, step_too_short


class ScipyStepper:
    """One of the methods of scipy.integrate, as a `Stepper`.

    Every piece is started anew, also where a step was cut: none of them steps across a kink.

    Parameters
    ----------
    integrator : str
        RK45, DOP853, Radau, BDF or LSODA.
    rtol, atol : float
        As the method takes them: a root mean square over the states.
    max_step : float, s
    max_steps : int
    what : str
        What is integrated, as messages have it.

    Attributes
    ----------
    t0, t : float, s
        Start and end of the last step.
    y0, y : (n,)
        The states there.
    steps, rejected, evaluations : int
        `rejected` stays 0 for the implicit methods, which do not tell.
    """

    CHECKPOINT_FIELDS: tuple[str, ...] = ()  # what a method remembers of its steps is its own

    def __init__(
        self,
        integrator: str,
        rtol: float,
        atol: float,
        max_step: float,
        max_steps: int,
        what: str = "the motion",
    ) -> None:
        self._method = getattr(scipy.integrate, integrator)
        # Explicit methods of SciPy take this many evaluations for a trial step.
        self._stages = getattr(self._method, "n_stages", 0) if integrator != "Radau" else 0
        self._options: dict[str, Any] = {"rtol": rtol, "atol": atol, "max_step": max_step}
        self._max_steps, self._what = max_steps, what
        self.steps = self.rejected = self.nfev = 0
        self.t_old = self.t = 0.0
        self.y_old: State = []
        self.y: State = []
        self._solver: Any = None
        self._dense: Any = None

    def start(self, rhs: Rhs, t: float, y: State) -> None:
        """Start a piece with these rates at (t, y)."""
        self._rhs = rhs
        self._dy: State = [0.0] * len(y)
        self.t_old = self.t = t
        self.y_old, self.y = list(y), list(y)
        self._solver = None

    def advance(self, limit: float, floor: float = 0.0) -> None:
        """Take one accepted step that ends at `limit` at the latest.

        Raises
        ------
        SolverError
            If the state ceases to be finite, the step falls below the resolution of the time,
            or the budget of steps is spent.
        """
        if self.steps + self.rejected >= self._max_steps:
            raise BudgetExceeded(
                f"{self._max_steps} steps are spent at t = {self.t:.9g} s of {self._what}; give a"
                " larger solver.max_steps, a larger solver.transition_speed, or looser tolerances"
            )
        self.t_old, self.y_old = self.t, self.y
        self._dense = None
        with catch_warnings():  # what they warn of is seen below
            simplefilter("ignore")
            try:
                self._step(limit)
            except (ValueError, LinAlgError):  # a matrix that is not finite, or singular
                raise not_finite(self.t_old, self._what) from None

    def resume(self, rhs: Rhs) -> None:
        """Begin anew where it is: these runs are not resumed."""
        self.start(rhs, self.t, self.y)

    def truncate(self, t: float) -> None:
        """End the last step at a time inside it."""
        self.y = self.interpolate(t)
        self.t = t
        self._solver = None

    def interpolate(self, t: float) -> State:
        """Return the state at a time inside the last step, by the method's own interpolation."""
        if t >= self.t:
            return self.y
        if t <= self.t_old:
            return self.y_old
        if self._dense is None:
            self._dense = self._solver.dense_output()
        state: State = self._dense(t).tolist()
        return state

    def _step(self, limit: float) -> None:
        if self._solver is None or self._solver.t_bound != limit:
            self._solver = self._method(self._rates_of, self.t, self.y, limit, **self._options)
        before = self.nfev
        self._solver.step()
        self.t, self.y = float(self._solver.t), self._solver.y.tolist()
        if not all(np.isfinite(self.y)):
            raise not_finite(self.t_old, self._what)
        if self._solver.status == "failed":
            if not all(np.isfinite(self._rates_of(self.t_old, np.array(self.y_old)))):
                raise not_finite(self.t_old, self._what)
            raise step_too_short(self.t_old, 10.0 * ulp(self.t_old), self._what)
        self.steps += 1
        if self._stages:
            self.rejected += (self.nfev - before) // self._stages - 1

    def _rates_of(self, t: float, y: Any) -> State:
        self.nfev += 1
        self._rhs(t, y.tolist(), self._dy)
        return self._dy
