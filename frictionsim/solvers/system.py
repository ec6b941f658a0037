"""Systems: the equation of motion of one coordinate with one dry contact, as data with methods.

    inertia dv/dt = applied_torque(u, q, v) + T,    u = drive.at(t)

A system is a named tuple of numbers with at most three arrays. Its fields and methods:

drive
    The input u over time, a `Curve` with `at(t)` and `next_extremum(t)`.
inertia
    kg m^2, positive.
applied_torque(u, q, v)
    The sum of all torques except dry friction, N m.
static_limit(u, q), kinetic_limit(u, q, v, s)
    The limits of `frictionsim.solvers.mechanism.DryFriction`, N m.
roundoff(u, q)
    Smaller differences of torque and limit count as equal, N m.
powers(u, q, v)
    The power of each energy integral, W, but for the heat of the contact.
torques_and_powers(u, q, v, s)
    Applied torque, kinetic limit and powers at once, of a body that slides.
stored_energies(q, v)
    J, the kinetic energy first.
breaks
    An array: the values of u between which s applied_torque(u, q, 0) - static_limit(u, q) is
    monotone in u.
first_excess(q, a, b)
    A time after a, at most b, up to which a contact at rest in q breaks away at most once, s.
surfaces, stops
    Tuples, empty without: switching surfaces with a method `beyond`, and `EndStops`.
first_departure(q, a, b)
    With stops: a time after a, at most b, such that the torque on the body at rest on a stop in q
    turns away from it at most once up to it, and points away at it if it does, s. The signals are
    smooth from a to b.
reversing_load
    (True,) if the load of the contact may reverse, `contact_load(u, q, v)`; empty if not.

An effect that a scenario omits is an empty tuple in the data. Functions that take such a tuple
begin with `if len(effect) == 0`, which is decided when they are compiled.
"""

from array import array
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from frictionsim.scenario.signals import Signal
    from frictionsim.solvers.mechanism import DryFriction, Mechanism, SwitchingSurface


class FunctionDrive(NamedTuple):
    """A signal as the drive of a system."""

    signal: "Signal"

    def at(self, t: float) -> float:
        """Return the value at time t, s."""
        return self.signal(t)

    def next_extremum(self, t: float) -> float:
        """Return a time after t, s, up to which the signal is monotone and smooth."""
        return self.signal.next_extremum(t)


class FunctionSystem(NamedTuple):
    """The system of a mechanism whose equation is given by functions; it is not compiled."""

    mechanism: "Mechanism"
    contact: "DryFriction"
    drive: FunctionDrive
    inertia: float
    breaks: "array[float]"
    surfaces: "tuple[SwitchingSurface, ...]"
    stops: Any
    reversing_load: Any

    def applied_torque(self, u: float, q: float, v: float) -> float:
        """As of the mechanism."""
        torque: float = self.mechanism.applied_torque(u, q, v)
        return torque

    def static_limit(self, u: float, q: float) -> float:
        """As of the contact."""
        limit: float = self.contact.static_limit(u, q)
        return limit

    def kinetic_limit(self, u: float, q: float, v: float, s: float) -> float:
        """As of the contact."""
        limit: float = self.contact.kinetic_limit(u, q, v, s)
        return limit

    def roundoff(self, u: float, q: float) -> float:
        """As of the contact."""
        roundoff: float = self.contact.roundoff(u, q)
        return roundoff

    def powers(self, u: float, q: float, v: float) -> tuple[float, ...]:
        """Return the power flows of the mechanism."""
        return tuple([power(u, q, v) for power in self.mechanism.power_flows.values()])

    def stored_energies(self, q: float, v: float) -> tuple[float, ...]:
        """Return the stored energies of the mechanism."""
        return tuple([energy(q, v) for energy in self.mechanism.stored_energies.values()])

    def torques_and_powers(
        self, u: float, q: float, v: float, s: float
    ) -> tuple[float, float, tuple[float, ...]]:
        """Return the applied torque, its kinetic limit and the powers."""
        return self.applied_torque(u, q, v), self.kinetic_limit(u, q, v, s), self.powers(u, q, v)

    def contact_load(self, u: float, q: float, v: float) -> tuple[float, float]:
        """As `DryFriction.load`."""
        assert self.contact.load is not None  # as reversing_load says
        return self.contact.load(u, q, v)

    def first_departure(self, q: float, a: float, b: float) -> float:
        """Return b: the torque is monotone between the extrema of the drive."""
        return b

    def first_excess(self, q: float, a: float, b: float) -> float:
        """As of the contact."""
        return b if self.contact.first_excess is None else self.contact.first_excess(q, a, b)


def system_of(mechanism: "Mechanism") -> Any:
    """Return the system of a mechanism; without dry friction its limits are not called."""
    if mechanism.system is not None:
        return mechanism.system
    contact: Any = mechanism.contact
    return FunctionSystem(
        mechanism,
        contact,
        FunctionDrive(mechanism.drive),
        mechanism.inertia,
        breaks=array("d", contact.monotonicity_breaks if contact else ()),
        surfaces=mechanism.switching_surfaces,
        stops=() if mechanism.stops is None else (mechanism.stops,),
        reversing_load=(True,) if contact and contact.load else (),
    )
