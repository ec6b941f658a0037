"""The interface of the integrators for mechanisms of one coordinate."""

from collections.abc import Mapping
from typing import ClassVar, Protocol

from frictionsim.solvers.runge_kutta_fehlberg import Rhs, State
from frictionsim.solvers.state_values import Values


class Stepper(Protocol):
    """An integrator over smooth segments; `RungeKuttaFehlberg45` documents its members."""

    CHECKPOINT_FIELDS: ClassVar[Mapping[str, Values]]
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

    def repeat_shorter(self, floor: float) -> bool: ...

    def interpolate(self, t: float) -> State: ...
