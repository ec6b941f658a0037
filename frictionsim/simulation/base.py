"""The contract between a kind of mechanism and a run of it."""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Protocol

if TYPE_CHECKING:
    from frictionsim.results import Channel, SimulationResult


class Simulation(Protocol):
    """One scenario, to be solved once; a family of mechanisms has a class of its own for it.

    Attributes
    ----------
    effects : tuple of str
        The effects that are simulated.
    states : int
        What is integrated: the length of the state vector.
    channel_info : mapping of name to Channel
        For every channel that it may show.
    axes : mapping of name to tuple of str
        The names of the members of each axis, without blanks; "0", "1", ... where they have
        none. Empty for one coordinate.
    """

    @property
    def effects(self) -> tuple[str, ...]: ...

    @property
    def states(self) -> int: ...

    @property
    def channel_info(self) -> Mapping[str, "Channel"]: ...

    @property
    def axes(self) -> Mapping[str, tuple[str, ...]]: ...

    def prepare(self, on_step: Callable[[float], Any]) -> float:
        """Make ready to step, before `solve` and after any `restore`; no step is taken here.

        Return the seconds that it took to compile, 0 if nothing was. A method `compiling` of poll,
        if it has one, is a context manager that is given the seconds to expect and entered then.

        Raises
        ------
        SolverError, ArithmeticError
        """

    def solve(self, on_step: Callable[[float], Any]) -> None:
        """Step to the end, from the start or from what was restored.

        Call poll with the time along the way, between steps only: it may ask for the state, the
        counts and the samples, and it may raise BudgetExceeded or Interrupted.

        Raises
        ------
        SolverError, ArithmeticError
            What was sampled before can be observed. After BudgetExceeded and Interrupted the state
            is one to go on from.
        """

    def state(self) -> dict[str, Any] | None:
        """Return all that the rest of the run depends on, as numpy arrays of float64 or bytes.

        None where the run cannot go on from anything that could be saved.

        Samples, transitions and counts so far are in it, too. A run that is restored from it ends
        with the same bits as one that was never interrupted.
        """

    def restore(self, state: dict[str, Any]) -> None:
        """Take over the state of another simulation of the same scenario, before `solve`.

        Raises
        ------
        InputError
            If it is of another scenario.
        """

    def statistics(self) -> tuple[int, int, int]:
        """Return steps, rejected steps and evaluations of the right-hand side so far."""

    def observe(self) -> "SimulationResult":
        """Return what was sampled so far, also of a run that stopped short of its end."""
