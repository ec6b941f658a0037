"""What a kind of mechanism of one or several coordinates gives the simulation.

Without numpy, which `check` does not need.
"""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, NamedTuple

from frictionsim.scenario.methods import SET_VALUED

if TYPE_CHECKING:
    from frictionsim.results import Array, Channel, Check, Quantities, Transition


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
