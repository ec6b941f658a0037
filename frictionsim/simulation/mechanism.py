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
    """The simulation of one scenario, which is solved once: what `simulate.run` asks of a kind.

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

    effects: tuple[str, ...]
    states: int
    channel_info: "Mapping[str, Channel]"
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
    """The samples of a run by the names of their columns, and its events.

    Attributes
    ----------
    time : (n,), s
    columns : mapping of name to (n,)
        Channels, and what only the audit reads.
    transitions : list of Transition
    before, after : mapping of name to (m,)
        The columns immediately before and after each transition.
    """

    time: "Array"
    columns: "Mapping[str, Array]"
    transitions: "list[Transition]"
    before: "Mapping[str, Array]"
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
    """The names of the columns of a contact.

    Attributes
    ----------
    name : str
        Of the contact itself, as in events.
    position, velocity : str
        Of its slip, rad, or gap, m.
    force : str
        Its friction, N m or N, or the tension of a rope, N.
    mode : str
        As in `frictionsim.results`.
    forward, backward, roundoff : str
        The margins that `System.margins` returns, in the unit of the force: limit -+ force, and
        their roundoff; `backward` is empty of a rope.
    """

    name: str
    position: str
    velocity: str
    force: str
    mode: str
    forward: str
    backward: str
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
    quantities : callable
        quantities(samples) returns the quantities that are specific to the mechanism.
    run_warnings : callable
        run_warnings(samples) returns warnings about a complete run.
    checks : callable
        checks(samples) returns the checks that are specific to the mechanism.
    energy_scale : callable
        energy_scale(samples) returns a scale of the energies that does not depend on how exactly
        the motion was found, J.
    law : str
        The friction law, a name in `frictionsim.scenario.methods`; empty without dry friction.
    tolerance_share : float
        Of the absolute tolerance: 1; less for a motion that is far below a radian.
    prescribed : bool
        The drive gives the velocity of the only coordinate, whatever the method.
    torques : callable
        torques(t) returns the torques on a body of one coordinate that rests from the start, N m.
    derived : mapping of name to Derived
        Channels that are not recorded. They are computed where a result has them.
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
