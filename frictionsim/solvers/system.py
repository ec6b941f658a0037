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
stored_energies(q, v)
    J, the kinetic energy first.
breaks
    An array: the values of u between which s applied_torque(u, q, 0) - static_limit(u, q) is
    monotone in u.
first_excess(q, a, b)
    A time after a, at most b, up to which a contact at rest in q breaks away at most once, s.
surfaces, stops, reversing_load
    Tuples, empty without: `Surface`, `EndStops`, and what has a method load(u, q, v), the load of
    the contact if it may reverse.

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


class FunctionSurface(NamedTuple):
    """A switching surface that is given by functions."""

    surface: "SwitchingSurface"
    is_event: bool
    is_of_table: bool

    def beyond(self, q0: float, v0: float, q1: float, q: float, v: float) -> float:
        """Return a number that is positive beyond the surface, in a step from (q0, v0) to q1."""
        return self.surface.crossing(q0, v0, q1, v)(q, v)


class FunctionSystem(NamedTuple):
    """The system of a mechanism whose equation is given by functions; it is not compiled."""

    mechanism: "Mechanism"
    contact: "DryFriction"
    drive: FunctionDrive
    inertia: float
    breaks: "array[float]"
    surfaces: tuple[FunctionSurface, ...]
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

    def first_excess(self, q: float, a: float, b: float) -> float:
        """As of the contact."""
        return b if self.contact.first_excess is None else self.contact.first_excess(q, a, b)


def system_of(mechanism: "Mechanism") -> Any:
    """Return the system of a mechanism with dry friction."""
    if mechanism.system is not None:
        return mechanism.system
    contact = mechanism.contact
    assert contact is not None  # checked by the solver
    return FunctionSystem(
        mechanism,
        contact,
        FunctionDrive(mechanism.drive),
        mechanism.inertia,
        breaks=array("d", contact.monotonicity_breaks),
        surfaces=tuple(
            FunctionSurface(surface, bool(surface.event), surface.is_of_table)
            for surface in mechanism.switching_surfaces
        ),
        stops=() if mechanism.stops is None else (mechanism.stops,),
        reversing_load=() if contact.load is None else (contact,),
    )
