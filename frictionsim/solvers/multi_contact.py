"""The interface between mechanisms of several coordinates and contacts and their solver.

Each contact has a coordinate of its own, chosen by the mechanism: the slip of dry friction, or the
gap of a rope that can only pull. While the contact holds, that is, sticks or is taut, its
coordinate stands still, so that sticking is exact: the others follow from it and from the gaps and
slips, which are differences that are integrated themselves and lose no digits.

    STICK            friction: v_c = 0, and the force is within its limits
    FORWARD, BACKWARD    friction: the force is at its kinetic limit, against v_c
    TAUT             rope: gap and its rate are zero, the tension is not negative
    SLACK            rope: the tension is zero, the gap is not negative

Given a mode of each contact, the mechanism solves its equations of motion, which may be implicit:
loads of contacts depend on accelerations, and accelerations on friction. All functions are smooth
for one combination of modes; u is the value of the drive.

`frictionsim.solvers.mechanism` is the interface for one coordinate, which is faster.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from frictionsim.results import STICK, TAUT

if TYPE_CHECKING:
    from frictionsim.results import Array, Channel, Check, Quantities, Transition
    from frictionsim.scenario.signals import Signal

Value = Any  # float in a step, array in post-processing
Vector = Any  # sequence of float in a step, array (k, n) in post-processing
Modes = tuple[int, ...]
"""A mode of each contact, in their order."""

HOLDING = (STICK, TAUT)


class Balance(NamedTuple):
    """The solution of the equations of motion for given modes.

    Attributes
    ----------
    acceleration : tuple of float, (n,)
        Exactly zero of the coordinate of a contact that holds.
    forces : tuple of float
        What the mechanism records of forces and torques; contacts find theirs in it.
    """

    acceleration: tuple[float, ...]
    forces: tuple[float, ...]


class Impact(NamedTuple):
    """The state after an impact.

    Attributes
    ----------
    velocity : list of float, (n,)
    losses : mapping of name to float, J
        Increments of the energy integrals by name, not negative.
    """

    velocity: list[float]
    losses: Mapping[str, float]


class FrictionContact(NamedTuple):
    """Dry friction along a coordinate.

    Sticking holds while -limit(forces, +1) <= force <= limit(forces, -1), where limit is the
    static limit for an impending motion in a direction; sliding in direction s, the force is
    -s kinetic_limit(forces, s).

    Attributes
    ----------
    name : str
        In events and messages, without blanks.
    coordinate : int
        Of the slip.
    force : callable
        force(forces): the friction along the coordinate.
    static_limit, kinetic_limit : callable
        Of (forces, s), not negative; arithmetic only, so that both may be arrays.
    roundoff : callable
        roundoff(u, forces): smaller differences of force and limit count as equal; it sticks.
    heat : str
        Name of the energy that it dissipates.
    """

    name: str
    coordinate: int
    force: Callable[[Vector], Value]
    static_limit: Callable[[Vector, Value], Value]
    kinetic_limit: Callable[[Vector, Value], Value]
    roundoff: Callable[[Value, Vector], Value]
    heat: str = "energy_friction"


class UnilateralContact(NamedTuple):
    """A rope that pulls and does not push, and takes up its slack by an impact.

    Attributes
    ----------
    name : str
        In events and messages, without blanks.
    coordinate : int
        Of the gap: zero while taut, positive while slack.
    force : callable
        force(forces): the tension.
    roundoff : callable
        roundoff(u, forces): a tension that is below zero by less counts as zero; it is taut.
    restitution : float
        e, from 0 to below 1: the part e^2 of the work that takes the rope up is given back.
    capture_speed : float
        An impact with a slower rate has no restitution.
    """

    name: str
    coordinate: int
    force: Callable[[Vector], Value]
    roundoff: Callable[[Value, Vector], Value]
    restitution: float = 0.0
    capture_speed: float = 0.0


Contact = FrictionContact | UnilateralContact


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
    contacts : tuple of Contact, (m,)
    balance : callable
        balance(u, q, v, modes) returns a `Balance`. It depends on u and v linearly, so that a
        monotone drive lets a contact at rest go at most once.
    impact : callable
        impact(contact, v, modes, restitution) returns the `Impact` in which a rope, the contact
        with that index, becomes taut. It may stop or reverse sliding, and slacken other ropes.
    forces : int
        Length of `Balance.forces`.
    power_flows : mapping of name to callable, W
        power(u, q, v): `energy_input` into the mechanism, `energy_damping` out of it. Contacts add
        their heat and `energy_impact`.
    stored_energies : mapping of name to callable, J
        energy(q, v): `energy_kinetic`, `energy_potential`.
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
    contacts: tuple[Contact, ...]
    balance: Callable[[float, Sequence[float], Sequence[float], Modes], Balance]
    impact: Callable[[int, Sequence[float], Modes, float], Impact]
    forces: int
    power_flows: Mapping[str, Callable[[Value, Vector, Vector], Value]]
    stored_energies: Mapping[str, Callable[[Vector, Vector], Value]]
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
    def frictions(self) -> tuple[tuple[int, FrictionContact], ...]:
        """The contacts with dry friction, with their indices."""
        return tuple((i, c) for i, c in enumerate(self.contacts) if isinstance(c, FrictionContact))

    @property
    def energy_integrals(self) -> tuple[str, ...]:
        """The names of the energy integrals, in the order of the state vector."""
        heats = [contact.heat for _, contact in self.frictions]
        ropes = len(self.contacts) > len(heats)
        return (*self.power_flows, *heats, *(("energy_impact",) if ropes else ()))

    @property
    def initial_state(self) -> list[float]:
        """The initial state vector: positions, velocities, and the energy integrals."""
        return [*self.position, *self.velocity, *(0.0 for _ in self.energy_integrals)]

    @property
    def subject(self) -> str:
        """The subject of messages about the motion."""
        names = " and ".join(f"'{contact.name}'" for contact in self.contacts)
        return f"the motion on the contacts {names}" if names else "the motion"
