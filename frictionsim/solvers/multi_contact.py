"""Mechanisms of several coordinates and contacts.

`frictionsim.solvers.mechanism` is the interface for one coordinate, which is faster.
"""

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from frictionsim.solvers.contacts import Contact, Friction, heats_of

if TYPE_CHECKING:
    from frictionsim.results import Array, Channel, Check, Quantities, Transition
    from frictionsim.scenario.signals import Signal


class MultiContactTrajectory(NamedTuple):
    """The samples of a run as arrays over time, and its transitions.

    Attributes
    ----------
    time : (n,), s
    drive : (n,)
    position, velocity, acceleration : (coordinates, n)
    forces : (forces, n)
    modes : (contacts, n)
    energy_integrals, stored_energies : dict of (n,), J
    transitions : list of Transition
    """

    time: "Array"
    drive: "Array"
    position: "Array"
    velocity: "Array"
    acceleration: "Array"
    forces: "Array"
    modes: "Array"
    energy_integrals: dict[str, "Array"]
    stored_energies: dict[str, "Array"]
    transitions: list["Transition"]


class MultiContactMechanism(NamedTuple):
    """A mechanism of n coordinates q, v = dq/dt, and m contacts.

    Attributes
    ----------
    drive : Signal
        The input u over time.
    system : named tuple
        Its equations, see `frictionsim.solvers.several_contacts`.
    contacts : tuple of Contact, (m,)
    power_flows : tuple of str
        Names of the powers of the system: `energy_input` into the mechanism, `energy_damping` out
        of it. Contacts add their heat.
    stored_energies : tuple of str
        Names of the stored energies of the system.
    position, velocity : tuple of float, (n,)
        The initial state.
    channels : callable
        channels(trajectory) returns all channels but those of time and energies, by name.
    channel_info : mapping of name to Channel
    quantities, run_warnings, checks : callable
        Of a trajectory: the quantities, warnings and checks specific to the mechanism.
    energy_scale : float, J
        Of the scenario, for the audit.
    effects : tuple of str
    """

    drive: "Signal"
    system: Any
    contacts: tuple[Contact, ...]
    power_flows: tuple[str, ...]
    stored_energies: tuple[str, ...]
    position: tuple[float, ...]
    velocity: tuple[float, ...]
    channels: Callable[[MultiContactTrajectory], dict[str, Any]]
    channel_info: Mapping[str, "Channel"]
    quantities: Callable[[MultiContactTrajectory], "Quantities"]
    effects: tuple[str, ...]
    energy_scale: float
    run_warnings: Callable[[MultiContactTrajectory], list[str]] = lambda trajectory: []
    checks: Callable[[MultiContactTrajectory], dict[str, "Check"]] = lambda trajectory: {}

    @property
    def frictions(self) -> tuple[tuple[int, Contact], ...]:
        """The contacts with dry friction, with their indices."""
        return tuple((i, c) for i, c in enumerate(self.contacts) if isinstance(c.law, Friction))

    @property
    def energy_integrals(self) -> tuple[str, ...]:
        """The names of the energy integrals, in the order of the state vector."""
        return (*self.power_flows, *heats_of(self.contacts))

    @property
    def initial_state(self) -> list[float]:
        """The initial state vector: positions, velocities, and the energy integrals."""
        return [*self.position, *self.velocity, *(0.0 for _ in self.energy_integrals)]

    @property
    def subject(self) -> str:
        """The subject of messages about the motion."""
        names = " and ".join(f"'{contact.name}'" for contact in self.contacts)
        return f"the motion on the contacts {names}" if names else "the motion"
