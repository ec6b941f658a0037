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
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from frictionsim.solvers.mechanism import Mechanism, SwitchingSurface


class FunctionDrive(NamedTuple):
    """A signal as the drive of a system."""

    at: Callable[[float], float]
    next_extremum: Callable[[float], float]


class FunctionSystem(NamedTuple):
    """The system of a mechanism whose equation is given by functions; it is not compiled."""

    drive: FunctionDrive
    inertia: float
    applied_torque: Callable[[float, float, float], float]
    static_limit: Any
    kinetic_limit: Any
    roundoff: Any
    power_flows: tuple[Callable[[float, float, float], float], ...]
    energies: tuple[Callable[[float, float], float], ...]
    first_excess: Callable[[float, float, float], float]
    contact_load: Any
    breaks: "array[float]"
    surfaces: "tuple[SwitchingSurface, ...]"
    stops: Any
    reversing_load: Any

    def powers(self, u: float, q: float, v: float) -> tuple[float, ...]:
        """Return the power flows of the mechanism."""
        return tuple([power(u, q, v) for power in self.power_flows])

    def stored_energies(self, q: float, v: float) -> tuple[float, ...]:
        """Return the stored energies of the mechanism."""
        return tuple([energy(q, v) for energy in self.energies])

    def torques_and_powers(
        self, u: float, q: float, v: float, s: float
    ) -> tuple[float, float, tuple[float, ...]]:
        """Return the applied torque, its kinetic limit and the powers."""
        return self.applied_torque(u, q, v), self.kinetic_limit(u, q, v, s), self.powers(u, q, v)

    def first_departure(self, q: float, a: float, b: float) -> float:
        """Return b: the torque is monotone between the extrema of the drive."""
        return b


def system_of(mechanism: "Mechanism") -> Any:
    """Return the system of a mechanism; without dry friction its limits are not called."""
    if mechanism.system is not None:
        return mechanism.system
    contact: Any = mechanism.contact
    static, kinetic, roundoff, load, first_excess = (
        getattr(contact, name, None)
        for name in ("static_limit", "kinetic_limit", "roundoff", "load", "first_excess")
    )
    return FunctionSystem(
        FunctionDrive(mechanism.drive, mechanism.drive.next_extremum),
        mechanism.inertia,
        mechanism.applied_torque,
        static,
        kinetic,
        roundoff,
        power_flows=tuple(mechanism.power_flows.values()),
        energies=tuple(mechanism.stored_energies.values()),
        first_excess=first_excess or (lambda q, a, b: b),
        contact_load=load,
        breaks=array("d", contact.monotonicity_breaks if contact else ()),
        surfaces=mechanism.switching_surfaces,
        stops=() if mechanism.stops is None else (mechanism.stops,),
        reversing_load=(True,) if load else (),
    )
