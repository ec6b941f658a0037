"""SciPy's integrators with the interface of `rkf45.Step`."""

from math import ulp
from typing import Any, Self
from warnings import catch_warnings, simplefilter

import numpy as np
import scipy.integrate
from numpy.linalg import LinAlgError

from frictionsim.solvers.rkf45 import Tolerances, check_budget
from frictionsim.solvers.stepper import non_finite_error, step_underflow


class ScipyStep:
    """A step of a method of scipy.integrate, whose error is a root mean square over the states.

    The method is restarted for every segment and after a step that is cut, so that it never steps
    across a discontinuity. `rejected` is 0 for implicit methods, which do not report it.

    Parameters
    ----------
    integrator : str
        RK45, DOP853, Radau, BDF or LSODA.

    Attributes
    ----------
    t_old, y_old, k_old, t, y, k, taken, rejected, evaluations
        As of `rkf45.Step`.
    """

    def __init__(self, integrator: str) -> None:
        self._integrator = integrator
        self.t_old = self.t = 0.0
        self.y_old: list[float] = []
        self.y: list[float] = []
        self.k_old: list[float] = []
        self.k: list[float] = []
        self.taken = self.rejected = self.evaluations = 0
        self._solver: Any = None
        self._dense: Any = None

    def _with(self, **changed: Any) -> Self:
        """Return a step with other attributes; the method is restarted after it."""
        step = type(self)(self._integrator)
        step.__dict__.update(self.__dict__ | {"_solver": None, "_dense": None} | changed)
        return step

    def started(
        self, system: Any, modes: list[int], t: float, y: list[float], tol: Tolerances
    ) -> Self:
        """Return a step of no length at a state."""
        k = system.rates(t, y, modes)
        return self._with(t_old=t, t=t, y_old=y, y=y, k_old=k, k=k)

    def resting(self, t: float, end: float) -> Self:
        """Return a step from a time to another in which nothing moves."""
        return self._with(t_old=t, t=end, y_old=self.y)

    def advanced(self, system: Any, modes: list[int], limit: float, tol: Tolerances) -> Self:
        """Return the next step, which ends at a time, s, at the latest."""
        check_budget(self, tol)
        with catch_warnings():  # failures are detected below
            simplefilter("ignore")
            try:
                return self._advanced(system, modes, limit, tol)
            except (ValueError, LinAlgError):  # a non-finite or singular matrix
                raise non_finite_error(self.t, tol.subject) from None

    def _advanced(self, system: Any, modes: list[int], limit: float, tol: Tolerances) -> Self:
        def rates(t: float, y: Any) -> list[float]:
            values: list[float] = system.rates(t, y.tolist(), modes)
            return values

        solver = self._solver
        if solver is None or solver.t_bound != limit:
            options = {"rtol": tol.rtol, "atol": tol.atol, "max_step": tol.max_step}
            method = getattr(scipy.integrate, self._integrator)
            solver = method(rates, self.t, self.y, limit, **options)
        before = solver.nfev
        solver.step()
        y, evaluations = solver.y.tolist(), solver.nfev - before
        if not all(np.isfinite(y)):
            raise non_finite_error(self.t, tol.subject)
        if solver.status == "failed":
            if not all(np.isfinite(rates(self.t, np.array(self.y)))):
                raise non_finite_error(self.t, tol.subject)
            raise step_underflow(self.t, 10.0 * ulp(self.t), tol.subject)
        # Evaluations of an explicit method for each trial step.
        stages = getattr(solver, "n_stages", 0) if self._integrator != "Radau" else 0
        t = float(solver.t)
        return self._with(
            t_old=self.t,
            y_old=self.y,
            k_old=self.k,
            t=t,
            y=y,
            k=system.rates(t, y, modes),
            taken=self.taken + 1,
            rejected=self.rejected + (evaluations // stages - 1 if stages else 0),
            evaluations=self.evaluations + evaluations,
            _solver=solver,
        )

    def at(self, system: Any, modes: list[int], t: float) -> list[float]:
        """Return the state at a time within the step, by the dense output of the method."""
        if t >= self.t or self.y is self.y_old:
            return self.y
        if t <= self.t_old:
            return self.y_old
        if self._dense is None:
            self._dense = self._solver.dense_output()
        state: list[float] = self._dense(t).tolist()
        return state

    def cut(self, system: Any, modes: list[int], t: float) -> Self:
        """Return the step ended at a time within it."""
        if t >= self.t:
            return self
        y = self.at(system, modes, t)
        return self._with(t=t, y=y, k=system.rates(t, y, modes), _dense=self._dense)

    def repeated(self, *_: Any) -> None:
        """Return none: after a step that is cut, the method restarts with a short step."""
