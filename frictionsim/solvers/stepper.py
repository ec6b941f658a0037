"""The interface of the integrators for mechanisms of one coordinate."""

from typing import Protocol

from frictionsim.solvers.runge_kutta_fehlberg import Rhs, State


class Stepper(Protocol):
    """An integrator over smooth segments; `RungeKuttaFehlberg45` documents its members."""

    CHECKPOINT_FIELDS: tuple[str, ...]
    t_old: float
    t: float
    y_old: State
    y: State
    steps: int
    rejected: int
    nfev: int

    def start(self, rhs: Rhs, t: float, y: State) -> None: ...

    def resume(self, rhs: Rhs) -> None: ...

    def advance(self, limit: float, floor: float = 0.0) -> None: ...

    def truncate(self, t: float) -> None: ...

    def interpolate(self, t: float) -> State: ...
