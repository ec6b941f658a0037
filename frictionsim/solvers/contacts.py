"""Mechanisms of several coordinates, and their contacts as data of the equation.

Each contact has a coordinate of its own, chosen by the mechanism: the slip of dry friction, or the
gap of a rope that can only pull. While the contact holds, that is, sticks or is taut, its
coordinate stands still, so that sticking is exact: the others follow from it and from the gaps and
slips, which are differences that are integrated themselves and lose no digits.

    STICK            friction: v_c = 0, and the force is within its limits
    FORWARD, BACKWARD    friction: the force is at its kinetic limit, against v_c
    TAUT             unilateral: gap and its rate are zero, the force is not negative
    SLACK            unilateral: the force is zero, the gap is not negative

The forces of a contact and its limits are linear in the drive u and in the unknown forces that the
balance of the mechanism finds.

`frictionsim.solvers.mechanism` is the interface for one coordinate, which is faster.
"""

from array import array
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from frictionsim.results import FORWARD, STICK, TAUT
from frictionsim.solvers.mechanism import Trajectory

if TYPE_CHECKING:
    from frictionsim.results import Channel, Check, Quantities
    from frictionsim.scenario.signals import Signal

Value = Any  # a float, or an array over time
Vector = Any  # a value of each coordinate, or of each force

HOLDING = (STICK, TAUT)

Form = tuple[float, ...]
"""Coefficients of (1, u, forces): a number that is linear in the drive and the forces."""


def value_of(form: Form, u: Value, forces: Vector) -> Value:
    """Return the value of a form, of numbers or arrays."""
    constant, drive_coefficient, *force_coefficients = form
    value = constant + drive_coefficient * u
    for coefficient, force in zip(force_coefficients, forces, strict=True):
        value = value + coefficient * force
    return value


class Friction(NamedTuple):
    """The law of dry friction along a slip.

    Sticking holds while -limit(+1) <= force <= limit(-1), where limit is the static limit for an
    impending motion in a direction; sliding in direction s, the force is -s times the kinetic one.

    Attributes
    ----------
    static, kinetic : (Form, Form)
        The limits in the directions +1 and -1, not negative.
    heat : str
        Name of the energy that it dissipates.
    """

    static: tuple[Form, Form]
    kinetic: tuple[Form, Form]
    heat: str = "energy_friction"


class Unilateral(NamedTuple):
    """The law of a rope that pulls and does not push, and takes up its slack by an impact.

    Attributes
    ----------
    restitution : float
        e, from 0 to below 1: the part e^2 of the work that closes the gap is given back.
    capture_speed : float
        An impact with a slower rate has no restitution.
    """

    restitution: float = 0.0
    capture_speed: float = 0.0


class Contact(NamedTuple):
    """A contact: a slip or a gap, and its law.

    Attributes
    ----------
    name : str
        In events and messages, without blanks.
    coordinate : int
        Of the slip; or of the gap, zero while taut, positive while slack.
    law : Friction or Unilateral
    force : Form
        The friction along the coordinate, or the tension.
    roundoff : Form
        Coefficients of (1, |u|, |forces|): smaller differences of force and limit count as equal,
        and the contact holds.
    """

    name: str
    coordinate: int
    law: Friction | Unilateral
    force: Form
    roundoff: Form

    def force_of(self, forces: Vector, u: Value = 0.0) -> Value:
        """Return the force."""
        return value_of(self.force, u, forces)

    def limit_of(self, limit: str, s: int, forces: Vector, u: Value = 0.0) -> Value:
        """Return the limit of friction, `static` or `kinetic`, in direction s = +1 or -1."""
        return value_of(getattr(self.law, limit)[0 if s == FORWARD else 1], u, forces)

    def roundoff_of(self, forces: Vector, u: Value) -> Value:
        """Return the roundoff of force and limit."""
        return value_of(self.roundoff, abs(u), [abs(force) for force in forces])


class PackedContacts(NamedTuple):
    """The contacts of a system as numbers, those with friction first.

    Attributes
    ----------
    numbers : array
        Contact after contact: its coordinate, restitution and capture speed, then forms: its force,
        what must not be negative while it holds (of friction, in either direction), its roundoff.
    size, frictions : int
        Number of contacts, and of those with friction.
    terms, width : int
        Length of a form and of a contact.
    """

    numbers: "array[float]"
    size: int
    frictions: int
    terms: int
    width: int


COORDINATE, RESTITUTION, CAPTURE_SPEED, FORMS = range(4)  # places in a contact
FORCE, MARGIN, ROUNDOFF, END_OF_FORMS = 0, 1, 3, 4  # numbers of the forms


def table_of(contacts: Sequence[Contact]) -> PackedContacts:
    """Return contacts as numbers; those with friction are first."""
    frictions = sum(isinstance(contact.law, Friction) for contact in contacts)
    if not all(isinstance(contact.law, Friction) for contact in contacts[:frictions]):
        raise ValueError("contacts with friction come before those with gaps")
    terms = len(contacts[0].force)
    numbers = array("d", [number for contact in contacts for number in _row(contact)])
    width = FORMS + END_OF_FORMS * terms
    return PackedContacts(numbers, len(contacts), frictions, terms, width)


def heats_of(contacts: Sequence[Contact]) -> tuple[str, ...]:
    """Return the names of the energies that contacts dissipate: of each friction, and of gaps."""
    heats = [contact.law.heat for contact in contacts if isinstance(contact.law, Friction)]
    return (*heats, *(["energy_impact"] if len(heats) < len(contacts) else []))


def _row(contact: Contact) -> Iterator[float]:
    force, law = contact.force, contact.law
    if isinstance(law, Unilateral):
        yield from (contact.coordinate, law.restitution, law.capture_speed)
        margins = force, tuple(0.0 for _ in force)
    else:
        yield from (contact.coordinate, 0.0, 0.0)
        forward, backward = law.static
        margins = (
            tuple(limit + x for limit, x in zip(forward, force, strict=True)),
            tuple(limit - x for limit, x in zip(backward, force, strict=True)),
        )
    for form in (force, *margins, contact.roundoff):
        yield from form


class MultiContactMechanism(NamedTuple):
    """A mechanism of n coordinates q, v = dq/dt, and m contacts.

    Attributes
    ----------
    drive : Signal
        The input u over time.
    system : named tuple
        Its equations, see `frictionsim.solvers.multi_contact`.
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
    channels: Callable[[Trajectory], dict[str, Any]]
    channel_info: Mapping[str, "Channel"]
    quantities: Callable[[Trajectory], "Quantities"]
    effects: tuple[str, ...]
    energy_scale: float
    run_warnings: Callable[[Trajectory], list[str]] = lambda trajectory: []
    checks: Callable[[Trajectory], dict[str, "Check"]] = lambda trajectory: {}

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
    def initial_energy(self) -> Value:
        """The energy stored at the start, J."""
        return sum(self.system.stored_energies(self.position, self.velocity))
