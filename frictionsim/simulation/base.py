"""The interface between a kind of mechanism and `simulate.run`."""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from frictionsim.results import Channel, SimulationResult
    from frictionsim.simulation.monitor import RunMonitor


class Simulation(Protocol):
    """The simulation of one scenario, which is solved once.

    Implemented for mechanisms of one coordinate, of several contacts, and for belt drives.

    Attributes
    ----------
    effects : tuple of str
        The effects that are simulated.
    states : int
        Length of the state vector.
    channel_info : mapping of name to Channel
        For every channel that `observe` may return.
    axes : mapping of name to tuple of str
        The names of the members of each axis, without blanks; "0", "1", ... if they have no
        names. Empty for one coordinate.
    """

    @property
    def effects(self) -> tuple[str, ...]: ...

    @property
    def states(self) -> int: ...

    @property
    def channel_info(self) -> Mapping[str, "Channel"]: ...

    @property
    def axes(self) -> Mapping[str, tuple[str, ...]]: ...

    def sample_at(self, times: Sequence[float]) -> None:
        """Take samples at these times, s, strictly increasing, instead of the regular ones.

        Called before `prepare`, if at all: by fits to measured data.
        """

    def prepare(self, monitor: "RunMonitor") -> float:
        """Prepare the first step; called before `solve` and after `restore`.

        Parameters
        ----------
        monitor : RunMonitor
            Kernels are compiled within its `compiling`.

        Returns
        -------
        float, s
            Time of compilation; 0 if nothing was compiled.

        Raises
        ------
        SolverError, ArithmeticError
            If the equations have no solution at the start, or not within the numbers.
        """

    def compile(self, monitor: "RunMonitor") -> float | None:
        """Compile the kernels of the run, for `fs.warm_up`; return the duration, s.

        None if it has none. `monitor` is as for `prepare`.
        """

    def solve(self, on_step: Callable[[float], Any]) -> None:
        """Integrate to the end, from the start or from a restored state.

        Parameters
        ----------
        on_step : callable
            Called with the time between steps. It may call `state`, `statistics` and `observe`,
            and raise BudgetExceeded or Interrupted.

        Raises
        ------
        SolverError, ArithmeticError
            Earlier samples remain available. After BudgetExceeded and Interrupted the run can be
            resumed from `state`.
        """

    def state(self) -> dict[str, Any] | None:
        """Return the complete state of the run, as numpy arrays of float64 or bytes.

        It includes samples, transitions and statistics. A run restored from it gives the same bits
        as an uninterrupted one. None if the backend does not support resuming.
        """

    def restore(self, state: dict[str, Any]) -> None:
        """Load the state of another simulation of the same scenario, before `solve`.

        Raises
        ------
        InputError
            If the state does not fit the scenario.
        """

    def statistics(self) -> tuple[int, int, int]:
        """Return steps, rejected steps and evaluations of the right-hand side so far."""

    def observe(self) -> "SimulationResult":
        """Return the results so far; also of a run that stopped before its end."""
