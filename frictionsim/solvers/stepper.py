"""What steps a mechanism of one coordinate: our own method, or one of SciPy's."""

from typing import Protocol

from frictionsim.solvers.runge_kutta_fehlberg import Rhs, State


class Stepper(Protocol):
    """What steps along smooth pieces: our own method, or one of SciPy's.

    See `RungeKuttaFehlberg45` for what its methods and attributes are.
    """

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
