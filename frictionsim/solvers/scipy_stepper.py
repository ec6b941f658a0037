"""SciPy's integrators behind the `Stepper` interface."""

from collections.abc import Mapping
from math import ulp
from typing import Any, ClassVar
from warnings import catch_warnings, simplefilter

import numpy as np
import scipy.integrate
from numpy.linalg import LinAlgError

from frictionsim.errors import BudgetExceeded
from frictionsim.solvers.state_values import Values
from frictionsim.solvers.stepper import Rhs, State, non_finite_error, step_underflow


class ScipyStepper:
    """A method of scipy.integrate as a `Stepper`.

    The method is restarted for every segment and after a truncated step, so that it never steps
    across a discontinuity.

    Parameters
    ----------
    integrator : str
        RK45, DOP853, Radau, BDF or LSODA.
    rtol, atol : float
        As in SciPy: the error is a root mean square over the states.
    max_step : float, s
    max_steps : int
        Limit of accepted plus rejected steps.
    what : str
        Subject of messages.

    Attributes
    ----------
    t_old, t : float, s
        Start and end of the last step.
    y_old, y : (n,)
        The states there.
    steps, rejected, nfev : int
        `rejected` is 0 for implicit methods, which do not report it.
    """

    # The state of SciPy's methods is private.
    CHECKPOINT_FIELDS: ClassVar[Mapping[str, Values]] = {}

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
        # Evaluations of an explicit method for each trial step.
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
        """Start a segment at (t, y)."""
        self._rhs = rhs
        self._dy: State = [0.0] * len(y)
        self.t_old = self.t = t
        self.y_old, self.y = list(y), list(y)
        self._solver = None

    def advance(self, limit: float, floor: float = 0.0) -> None:
        """Take one accepted step that ends at `limit` at the latest.

        Parameters
        ----------
        limit : float, s
        floor : float, s
            Not used; see `RungeKuttaFehlberg45.advance`.
        """
        if self.steps + self.rejected >= self._max_steps:
            raise BudgetExceeded(
                f"limit of {self._max_steps} steps reached at t = {self.t:.9g} s of {self._what};"
                " raise the limit, loosen the tolerances or increase the transition_speed of a"
                " regularised law"
            )
        self.t_old, self.y_old = self.t, self.y
        self._dense = None
        with catch_warnings():  # failures are detected below
            simplefilter("ignore")
            try:
                self._step(limit)
            except (ValueError, LinAlgError):  # a non-finite or singular matrix
                raise non_finite_error(self.t_old, self._what) from None

    def resume(self, rhs: Rhs) -> None:
        """Restart; runs with SciPy's methods have no checkpoints."""
        self.start(rhs, self.t, self.y)

    def truncate(self, t: float) -> None:
        """End the last step at a time within it."""
        self.y = self.interpolate(t)
        self.t = t
        self._solver = None

    def repeat_shorter(self, floor: float) -> bool:
        """Keep the last step: after a truncated one the method restarts with a short step."""
        return False

    def interpolate(self, t: float) -> State:
        """Return the state at a time within the last step, by the dense output of the method."""
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
            self._solver = self._method(self._fun, self.t, self.y, limit, **self._options)
        before = self.nfev
        self._solver.step()
        self.t, self.y = float(self._solver.t), self._solver.y.tolist()
        if not all(np.isfinite(self.y)):
            raise non_finite_error(self.t_old, self._what)
        if self._solver.status == "failed":
            if not all(np.isfinite(self._fun(self.t_old, np.array(self.y_old)))):
                raise non_finite_error(self.t_old, self._what)
            raise step_underflow(self.t_old, 10.0 * ulp(self.t_old), self._what)
        self.steps += 1
        if self._stages:
            self.rejected += (self.nfev - before) // self._stages - 1

    def _fun(self, t: float, y: Any) -> State:
        self.nfev += 1
        self._rhs(t, y.tolist(), self._dy)
        return self._dy
