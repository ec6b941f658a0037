"""What a kind of mechanism gives: its `Simulation`, or the `Mechanism` that has one made.

Without numpy, which `check` does not need.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from frictionsim.scenario.methods import SET_VALUED

if TYPE_CHECKING:
    from frictionsim.results import (
        Array,
        Channel,
        Check,
        Quantities,
        SimulationResult,
        Transition,
    )
    from frictionsim.simulation.monitor import RunMonitor


class Simulation(Protocol):
    """The simulation of one scenario, which is solved once: what `simulate.run` asks of a kind."""

    effects: tuple[str, ...]  # that are simulated
    states: int  # length of the state vector
    channel_info: "Mapping[str, Channel]"  # of every channel that `observe` may return
    # The names of the members of each axis, without blanks; "0", "1", ... if they have no names.
    axes: Mapping[str, tuple[str, ...]]

    def sample_at(self, times: Sequence[float]) -> None:
        """Take samples at these times, s, strictly increasing, instead of the regular ones.

        Called before `prepare`, if at all: by fits to measured data.
        """

    def prepare(self, monitor: "RunMonitor") -> float:
        """Prepare the first step; called before `solve` and after `restore`.

        Kernels are compiled within the monitor's `compiling`; returned is how long that took, s.

        Raises
        ------
        SolverError, ArithmeticError
            If the equations have no solution at the start, or not within the numbers.
        """
        return 0.0

    def compile(self, monitor: "RunMonitor") -> float | None:
        """Compile the kernels of the run, for `fs.warm_up`, as `prepare` does; None without any."""
        return None

    def solve(self, on_step: Callable[[float], Any]) -> None:
        """Integrate to the end, from the start or from a restored state.

        `on_step` is called with the time between steps. It may call `state`, `statistics` and
        `observe`, and raise BudgetExceeded or Interrupted, after which the run can be resumed.

        Raises
        ------
        SolverError, ArithmeticError
            Earlier samples remain available.
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
        """Return the results so far, of finite samples; also of a run that stopped early."""


@dataclass(frozen=True)
class Samples:
    """The samples of a run by the names of their columns, and its events."""

    time: "Array"  # (n,), s
    columns: "Mapping[str, Array]"  # (n,): channels, and what only the audit reads
    transitions: "list[Transition]"
    before: "Mapping[str, Array]"  # (m,): the columns immediately before each transition
    after: "Mapping[str, Array]"

    def __getitem__(self, name: Any) -> Any:
        """Return a column by its name."""
        return self.columns[name]

    def largest(self, name: str) -> float:
        """Return the largest magnitude of a column, at samples and events."""
        sides = self.columns, self.before, self.after
        return max(float(abs(side[name]).max(initial=0.0)) for side in sides)


Derived = Callable[["Array", "Mapping[str, Array]", Samples], "Array"]
"""How a channel follows from recorded columns: of the times of some rows, (n,), s, the columns of
these rows, and the samples of the whole run; (n,)."""


class ContactColumns(NamedTuple):
    """The names of the columns of a contact."""

    name: str  # of the contact itself, as in events
    position: str  # of its slip, rad, or gap, m
    velocity: str
    force: str  # its friction, N m or N, or the tension of a rope, N
    mode: str  # as in `frictionsim.results`
    # What `System.margins` returns, in the unit of the force: limit +- force, and their roundoff.
    forward: str
    backward: str  # empty of a rope
    roundoff: str


class Mechanism(NamedTuple):
    """A mechanism of one or several coordinates.

    Attributes
    ----------
    system : System
        The equations of motion, `frictionsim.solvers.system`.
    columns : tuple of str
        The names of the numbers of a sample after its time: state, `system.recorded`, modes. Those
        that are in `channel_info` are channels. `energy_kinetic` is among them, `energy_potential`
        where there is a potential.
    contacts : tuple of ContactColumns
    energies : tuple of str
        The names of the energies that are integrated.
    channel_info : mapping of name to Channel
    effects : tuple of str
        The effects that are simulated.
    quantities, run_warnings, checks : callable
        Of the samples: the quantities and checks that are specific to the mechanism, and warnings
        about a complete run.
    energy_scale : callable
        Of the samples: a scale of the energies that does not depend on how exactly the motion was
        found, J.
    law : str
        The friction law, a name in `frictionsim.scenario.methods`; empty without dry friction.
    tolerance_share : float
        Of the absolute tolerance: 1; less for a motion that is far below a radian.
    prescribed : bool
        The drive gives the velocity of the first coordinate, whatever the method.
    torques : callable
        Of the time, s: the torques on a body of one coordinate that rests from the start, N m.
    derived : mapping of name to Derived
        Channels that are not recorded, but follow from what is.
    """

    system: Any
    columns: tuple[str, ...]
    contacts: tuple[ContactColumns, ...]
    energies: tuple[str, ...]
    channel_info: "Mapping[str, Channel]"
    effects: tuple[str, ...]
    quantities: "Callable[[Samples], Quantities]"
    energy_scale: "Callable[[Samples], float]"
    run_warnings: "Callable[[Samples], list[str]]" = lambda samples: []
    checks: "Callable[[Samples], dict[str, Check]]" = lambda samples: {}
    law: str = SET_VALUED
    tolerance_share: float = 1.0
    prescribed: bool = False
    torques: "Callable[[float], Iterable[float]]" = lambda t: []
    derived: "Mapping[str, Derived]" = MappingProxyType({})
