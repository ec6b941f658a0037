"""SciPy's integrators in the place of that of `one_contact_step`."""

from array import array
from math import ulp
from typing import Any
from warnings import catch_warnings, simplefilter

import numpy as np
import scipy.integrate
from numpy.linalg import LinAlgError

from frictionsim.errors import BudgetExceeded
from frictionsim.solvers import one_contact_state as layout
from frictionsim.solvers.law_stepper import DIRECTION, LawStepper
from frictionsim.solvers.one_contact_step import derivatives
from frictionsim.solvers.problems import Problem
from frictionsim.solvers.stepper import non_finite_error, step_underflow


class ScipyStepper(LawStepper):
    """A method of scipy.integrate, whose error is a root mean square over the states.

    The method is restarted for every segment and after a truncated step, so that it never steps
    across a discontinuity. `rejected` is 0 for implicit methods, which do not report it.

    Parameters
    ----------
    integrator : str
        RK45, DOP853, Radau, BDF or LSODA.
    law, problem
        See `LawStepper`.
    """

    def __init__(self, integrator: str, law: Any, problem: Problem) -> None:
        super().__init__(law, problem)
        self._method = getattr(scipy.integrate, integrator)
        # Evaluations of an explicit method for each trial step.
        self._stages = getattr(self._method, "n_stages", 0) if integrator != "Radau" else 0
        run = problem.run
        self._options = {"rtol": run.rtol, "atol": run.atol, "max_step": run.max_step}
        self._what = problem.subject
        self._solver: Any = None
        self._dense: Any = None

    def start(self, t: float, y: list[float]) -> None:
        """Start a segment at (t, y)."""
        self._s[layout.Y : layout.Y + len(y)] = array("d", y)
        self._write(t, y)
        self._s[layout.T_OLD] = t
        layout.copy(self._s, layout.Y_OLD, layout.Y, len(y))
        self._solver = None

    def advance(self, limit: float) -> None:
        """Take one accepted step that ends at `limit`, s, at the latest."""
        s, most = self._s, self._problem.run.max_steps
        if self.steps + self.rejected >= most:
            raise BudgetExceeded(
                f"limit of {most} steps reached at t = {self.t:.9g} s of {self._what};"
                f" {self._problem.budget_advice}"
            )
        s[layout.T_OLD] = s[layout.T_NEW]
        layout.copy(s, layout.Y_OLD, layout.Y_NEW, self._states)
        self._dense = None
        with catch_warnings():  # failures are detected below
            simplefilter("ignore")
            try:
                self._step(limit)
            except (ValueError, LinAlgError):  # a non-finite or singular matrix
                raise non_finite_error(self.t_old, self._what) from None

    def resume(self) -> None:
        """Refuse: runs with SciPy's methods have no checkpoints."""
        raise NotImplementedError

    def truncate(self, t: float) -> None:
        """End the last step at a time within it."""
        self._write(t, self.interpolate(t))
        self._solver = None

    def repeat_shorter(self) -> bool:
        """Keep the last step: after a truncated one the method restarts with a short step."""
        return False

    def interpolate(self, t: float) -> list[float]:
        """Return the state at a time within the last step, by the dense output of the method."""
        if t >= self.t:
            return self.y
        if t <= self.t_old:
            return self.y_old
        if self._dense is None:
            self._dense = self._solver.dense_output()
        state: list[float] = self._dense(t).tolist()
        return state

    def _write(self, t: float, y: list[float]) -> None:
        self._s[layout.T_NEW] = t
        self._s[layout.Y_NEW : layout.Y_NEW + len(y)] = array("d", y)

    def _step(self, limit: float) -> None:
        if self._solver is None or self._solver.t_bound != limit:
            self._solver = self._method(self._fun, self.t, self.y, limit, **self._options)
        before = self.nfev
        self._solver.step()
        self._write(float(self._solver.t), self._solver.y.tolist())
        if not all(np.isfinite(self.y)):
            raise non_finite_error(self.t_old, self._what)
        if self._solver.status == "failed":
            if not all(np.isfinite(self._fun(self.t_old, np.array(self.y_old)))):
                raise non_finite_error(self.t_old, self._what)
            raise step_underflow(self.t_old, 10.0 * ulp(self.t_old), self._what)
        self._s[layout.STEPS] += 1.0
        if self._stages:
            self._s[layout.REJECTED] += (self.nfev - before) // self._stages - 1

    def _fun(self, t: float, y: Any) -> tuple[float, ...]:
        self._s[layout.EVALUATIONS] += 1.0
        q, v = y[:2].tolist()
        return derivatives(self._law, t, q, v, DIRECTION)[: self._states]
