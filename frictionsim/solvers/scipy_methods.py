"""SciPy's integrators with the interface of `rkf45.Step`."""

from dataclasses import dataclass, field, replace
from math import ulp
from typing import Any, Self
from warnings import catch_warnings, simplefilter

import numpy as np
import scipy.integrate
from numpy.linalg import LinAlgError

from frictionsim.solvers.rkf45 import Tolerances, check_budget, non_finite_error, step_underflow


@dataclass
class ScipyStep:
    """A step of a method of scipy.integrate.

    Its error is a root mean square over the states, of LSODA the largest one. The method is
    restarted for every segment and after a step that is cut, so that it never steps across a
    discontinuity. `rejected` is 0 for implicit methods, which do not report it.

    Attributes
    ----------
    integrator : str
        RK45, DOP853, Radau, BDF or LSODA.
    t_old, y_old, k_old, t, y, k, taken, rejected, evaluations
        As of `rkf45.Step`.
    """

    integrator: str
    t_old: float = 0.0
    t: float = 0.0
    y_old: list[float] = field(default_factory=list)
    y: list[float] = field(default_factory=list)
    k_old: list[float] = field(default_factory=list)
    k: list[float] = field(default_factory=list)
    taken: int = 0
    rejected: int = 0
    evaluations: int = 0
    solver: Any = None
    dense: Any = None

    def _with(self, solver: Any = None, dense: Any = None, **changed: Any) -> Self:
        """Return a step with other attributes; the method is restarted after it."""
        return replace(self, solver=solver, dense=dense, **changed)

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

        def rates(t: float, y: Any) -> list[float]:
            values: list[float] = system.rates(t, y.tolist(), modes)
            return values

        with catch_warnings():  # failures are detected below
            simplefilter("ignore")
            try:
                solver = self.solver
                if solver is None or solver.t_bound != limit:
                    options = {"rtol": tol.rtol, "atol": tol.atol, "max_step": tol.max_step}
                    method = getattr(scipy.integrate, self.integrator)
                    solver = method(rates, self.t, self.y, limit, **options)
                before = solver.nfev
                solver.step()
                is_finite = np.all(np.isfinite(solver.y))
                if is_finite and solver.status == "failed":
                    is_finite = np.all(np.isfinite(rates(self.t, np.array(self.y))))
            except (ValueError, LinAlgError):  # a non-finite or singular matrix
                is_finite = np.False_
        if not is_finite:
            raise non_finite_error(self.t, tol.subject)
        if solver.status == "failed":
            raise step_underflow(self.t, 10.0 * ulp(self.t), tol.subject)
        t, y, evaluations = float(solver.t), solver.y.tolist(), solver.nfev - before
        # Evaluations of an explicit method for each trial step.
        stages = getattr(solver, "n_stages", 0)
        return self._with(
            solver,
            t_old=self.t,
            y_old=self.y,
            k_old=self.k,
            t=t,
            y=y,
            k=system.rates(t, y, modes),
            taken=self.taken + 1,
            rejected=self.rejected + (evaluations // stages - 1 if stages else 0),
            evaluations=self.evaluations + evaluations,
        )

    def at(self, system: Any, modes: list[int], t: float) -> list[float]:
        """Return the state at a time within the step, by the dense output of the method."""
        if t >= self.t or self.y is self.y_old:
            return self.y
        if t <= self.t_old:
            return self.y_old
        if self.dense is None:
            self.dense = self.solver.dense_output()
        state: list[float] = self.dense(t).tolist()
        return state

    def cut(self, system: Any, modes: list[int], t: float) -> Self:
        """Return the step ended at a time within it."""
        if t >= self.t:
            return self
        y = self.at(system, modes, t)
        return self._with(dense=self.dense, t=t, y=y, k=system.rates(t, y, modes))

    def repeated(self, *_: Any) -> None:
        """Return none: after a step that is cut, the method restarts with a short step."""
