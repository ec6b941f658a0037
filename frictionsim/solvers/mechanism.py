"""The contract between physics and integration, for mechanisms of one coordinate.

A mechanism states its equation of motion and never integrates it; a backend integrates it and
never knows what it moves. Dry friction stands outside of the equation, as a set-valued force
between two limits, so that each backend can treat it in its own way: solve for it, locate its
switches, or switch it as published.

Every function below uses arithmetic operators only, so that it takes numbers while a backend
steps and arrays when the whole run is looked at; `u` is the value of the drive.
"""

from collections.abc import Callable, Mapping
from math import ceil, floor
from typing import TYPE_CHECKING, Any, NamedTuple

from frictionsim.scenario.friction_law import TRANSITION_SPEED

if TYPE_CHECKING:
    from frictionsim.results import Array, Channel, Quantities, Transition
    from frictionsim.scenario.signals import Signal

Value = Any  # float while stepping, array of floats afterwards


class DryFriction(NamedTuple):
    """Dry friction along the coordinate of a mechanism.

    Sticking, v = 0, the friction is what holds the mechanism, |T| <= static_limit(u, q).
    Sliding in direction s = +1 or -1, it is T = -s kinetic_limit(u, q, v, s). The direction is an
    argument because the load of a contact may depend on the acceleration that s leads to.

    Both limits are not negative and kinetic_limit <= static_limit at v = 0.

    Attributes
    ----------
    name : str
        What slides, for events and messages.
    static_limit, kinetic_limit : callable, N m
    rounding : callable
        rounding(u, q), N m: below this, moment and limit cannot be told from equal. A tie sticks.
    critical_inputs : tuple of float
        Between two neighbours of these values of u, s moment(u, q, 0) - static_limit(u, q) is
        monotone in u for both directions s.
    law : str
        A name of `frictionsim.scenario.methods`.
    transition_speed : float, rad/s
        Of the regularised law.
    """

    name: str
    static_limit: Callable[[Value, Value], Value]
    kinetic_limit: Callable[[Value, Value, Value, Value], Value]
    roundoff: Callable[[Value, Value], Value]
    monotonicity_breaks: tuple[float, ...] = ()
    law: str = "set-valued"
    transition_speed: float = TRANSITION_SPEED


class SwitchingSurface(NamedTuple):
    """States at which the equations of a mechanism have a kink; a step ends on them.

    Attributes
    ----------
    function : callable or None
        function(q, v) changes its sign there, and not twice within a step.
    every : float, rad
        Without a function: the multiples of this angle, however many a step would pass.
    event : str
        What happens there, if it is to be noted as an event.
    """

    function: Callable[[Value, Value], Value] | None = None
    every: float = 0.0
    event: str = ""

    def crossing(self, q0: float, v0: float, q: float, v: float) -> Callable[[float, float], float]:
        """Return a function of q and v that is positive once the first kink is passed.

        On the way from (q0, v0) to (q, v); not positive at the end if none is.
        """
        if self.function is not None:
            function, before = self.function, self.function(q0, v0)
            return lambda q, v: -before * function(q, v)
        if q > q0:
            upper = (floor(q0 / self.every) + 1) * self.every
            return lambda q, v: q - upper
        lower = (ceil(q0 / self.every) - 1) * self.every
        return lambda q, v: lower - q


class Trajectory(NamedTuple):
    """The samples of a run as arrays over time, and its transitions.

    Attributes
    ----------
    time : (n,), s
    drive : (n,)
        Value of the drive, in its own unit.
    position, velocity, acceleration : (n,), rad, rad/s, rad/s^2
    friction : (n,), N m
    mode : (n,)
        0 sticking, +1 or -1 sliding.
    ledger : dict of (n,), J
        The energies that were integrated along: into the mechanism, and out of it as heat.
    stores : dict of (n,), J
        The energies that the state has.
    transitions : list of Transition
    """

    time: "Array"
    drive: "Array"
    position: "Array"
    velocity: "Array"
    acceleration: "Array"
    friction: "Array"
    mode: "Array"
    energy_integrals: dict[str, "Array"]
    stored_energies: dict[str, "Array"]
    transitions: list["Transition"]


class Mechanism(NamedTuple):
    """One rotating coordinate q with v = dq/dt and at most one dry contact.

        inertia dv/dt = moment(u, q, v) + T,    u = drive(t)

    with the friction torque T of `contact`. A scenario without dry friction has no contact, and
    an effect that the scenario does not name has no term in any function here.

    Attributes
    ----------
    drive : Signal
        The input u over time.
    inertia : float, kg m^2, positive
    moment : callable, N m
        All that drives or resists, dry friction excepted.
    contact : Contact or None
    powers : mapping of name to callable, W
        power(u, q, v) of each flow of energy that is integrated along: `energy_input` into the
        mechanism, `energy_damping` out of it. A contact adds `energy_friction` by itself.
    stores : mapping of name to callable, J
        energy(q, v) of each store: `energy_kinetic`, `energy_potential`.
    position, velocity : float, rad and rad/s
        The state at the start.
    kinks : tuple of Kink
        Those that depend on the state; the drive knows its own.
    prescribed : bool
        The drive gives the velocity, and u is the torque that it takes: a summand of the moment.
    channels : callable
        channels(trajectory) returns the channels to record beside time, motion, dry friction and
        energies, by name.
    channel_info : mapping of name to Channel
        For each of those names, and for the energies.
    quantities : callable
        quantities(series) returns the mechanism's own quantities of a run.
    run_warnings : callable
        run_warnings(series) returns what is odd about a whole run, as warnings.
    effects : tuple of str
        The effects that are simulated.
    """

    drive: "Signal"
    inertia: float
    applied_torque: Callable[[Value, Value, Value], Value]
    contact: DryFriction | None
    power_flows: Mapping[str, Callable[[Value, Value, Value], Value]]
    stored_energies: Mapping[str, Callable[[Value, Value], Value]]
    channels: Callable[[Trajectory], dict[str, Any]]
    channel_info: Mapping[str, "Channel"]
    quantities: Callable[[Trajectory], "Quantities"]
    effects: tuple[str, ...]
    run_warnings: Callable[[Trajectory], list[str]] = lambda trajectory: []
    position: float = 0.0
    velocity: float = 0.0
    switching_surfaces: tuple[SwitchingSurface, ...] = ()
    prescribed: bool = False

    @property
    def energy_integrals(self) -> tuple[str, ...]:
        """The energies that are integrated along, in the order of the state vector."""
        friction = () if self.contact is None else ("energy_friction",)
        return (*self.power_flows, *friction)

    @property
    def initial_state(self) -> list[float]:
        """The state vector at the start: position, velocity, and the energies of the ledger."""
        return [self.position, self.velocity, *(0.0 for _ in self.energy_integrals)]
