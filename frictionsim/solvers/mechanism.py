"""The interface between mechanisms of one coordinate and solvers.

A mechanism provides its equation of motion; a solver integrates it without knowledge of the
mechanism. Dry friction is not part of the equation, but a set-valued force with two limits, so
that each solver can treat it in its own way: solve for it, locate its switches, or regularise it.

All functions below use arithmetic operators only, so that they accept numbers in a step and
arrays in post-processing; `u` is the value of the drive.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from frictionsim.results import BACKWARD, FORWARD, STICK
from frictionsim.scenario.schema import TRANSITION_SPEED
from frictionsim.solvers.compilation import compiled_as

if TYPE_CHECKING:
    from frictionsim.results import Array, Channel, Quantities, Transition
    from frictionsim.scenario.signals import Signal

Value = Any  # float in a step, array in post-processing
OF_EQUATIONS = ("inertia", "applied_torque", "powers", "stored_energies", "surfaces")
OF_SYSTEMS = (*OF_EQUATIONS, "drive", "torques_and_powers", "breaks", "stops", "reversing_load")
OF_FRICTION = ("static_limit", "kinetic_limit", "roundoff", "first_excess")


class DryFriction(NamedTuple):
    """Dry friction along the coordinate of a mechanism.

    While sticking, v = 0, friction balances the applied torque, |T| <= static_limit(u, q).
    Sliding in direction s = +1 or -1, T = -s kinetic_limit(u, q, v, s). The direction is an
    argument because the load of a contact may depend on the acceleration, which depends on s.

    Both limits are non-negative, and kinetic_limit <= static_limit at v = 0.

    Attributes
    ----------
    name : str
        Name of the contact in events and messages.
    static_limit, kinetic_limit : callable, N m
    roundoff : callable, N m
        roundoff(u, q): smaller differences of torque and limit count as equal; the contact sticks.
    monotonicity_breaks : tuple of float
        Values of u between which s applied_torque(u, q, 0) - static_limit(u, q) is monotone in u,
        for both directions s.
    first_excess : callable or None
        For drives without such values: first_excess(q, a, b) returns a time after a, at most b,
        such that at rest in q the contact breaks away at most once up to it, and does not hold at
        it if it does. None if `monotonicity_breaks` say it.
    load : callable or None
        load(u, q, v), for numbers: the two components of the load to whose size the kinetic limit
        is proportional. Steps end where it reverses, because its size has a corner at zero. None
        if it cannot reverse, or if the limits tell where it does.
    law : str
        Friction law, a name in `frictionsim.scenario.methods`.
    transition_speed : float, rad/s
        Of the regularised law.
    """

    name: str
    static_limit: Callable[[Value, Value], Value]
    kinetic_limit: Callable[[Value, Value, Value, Value], Value]
    roundoff: Callable[[Value, Value], Value]
    monotonicity_breaks: tuple[float, ...] = ()
    first_excess: Callable[[float, float, float], float] | None = None
    load: Callable[[float, float, float], tuple[float, float]] | None = None
    law: str = "set-valued"
    transition_speed: float = TRANSITION_SPEED


class SwitchingSurface(NamedTuple):
    """States at which the equations of a mechanism are not smooth; steps end there.

    Attributes
    ----------
    function : callable
        function(q, v) changes its sign on the surface, at most once within a step.
    event : str
        Name of the event to record; empty for none.
    is_of_table : bool
        The next surface may be closer than a step is long: a step that is cut here is rechecked.
    """

    function: Callable[[Value, Value], Value]
    event: str = ""
    is_of_table: bool = False

    @property
    def is_event(self) -> bool:
        """Whether it is to be recorded."""
        return bool(self.event)

    def beyond(self, q0: float, v0: float, q1: float, q: float, v: float) -> float:
        """Return a number that is positive after the first crossing of a step.

        Parameters
        ----------
        q0, v0 : float, rad and rad/s
            At the start of the step.
        q1 : float, rad
            At its end.
        q, v : float, rad and rad/s
        """
        beyond: float = -self.function(q0, v0) * self.function(q, v)
        return beyond


class EndStops(NamedTuple):
    """The end stops of a mechanism; one may be missing.

    Attributes
    ----------
    lowest, highest : float, rad
        Positions of the stops; -inf and inf for none.
    restitution : float
        e, at least 0 and below 1.
    capture_speed : float, rad/s
    """

    lowest: float
    highest: float
    restitution: float
    capture_speed: float

    def side(self, q: float) -> int:
        """Return FORWARD or BACKWARD at the highest or lowest position, STICK between them."""
        if q >= self.highest:
            return FORWARD
        return BACKWARD if q <= self.lowest else STICK

    def excess(self, q: Any) -> Any:
        """Return how far a position is beyond the stops, rad; negative between them."""
        import numpy as np

        return np.maximum(q - self.highest, self.lowest - q)


def _stop_torque(stops: EndStops, applied: float, q: float, v: float) -> float:
    into = (q >= stops.highest and applied > 0.0) or (q <= stops.lowest and applied < 0.0)
    return -applied if v == 0.0 and into else 0.0


@compiled_as(_stop_torque)
def stop_torque(stops: EndStops, applied: Value, q: Value, v: Value) -> Value:
    """Return the torque of end stops on a body that rests on one, N m, of numbers or arrays.

    Parameters
    ----------
    stops : EndStops
    applied : N m
        All other torques except dry friction.
    q, v : rad, rad/s
    """
    if isinstance(q, float) and isinstance(v, float):
        return _stop_torque(stops, applied, q, v)
    import numpy as np  # imported here because `check` does not need it

    into = ((q >= stops.highest) & (applied > 0.0)) | ((q <= stops.lowest) & (applied < 0.0))
    return np.where((v == 0.0) & into, -applied, 0.0)


class Trajectory(NamedTuple):
    """The samples of a run as arrays over time, and its transitions.

    Of several coordinates and contacts the arrays of coordinates, forces and modes have two axes:
    the first is that of the members.

    Attributes
    ----------
    time : (n,), s
    drive : (n,)
        Value of the drive, in its unit.
    position, velocity, acceleration : (n,), rad, rad/s, rad/s^2
    forces : (n,), N m
        The friction; of several contacts all forces of their balance.
    modes : (n,)
        0 sticking, +1 or -1 sliding; of ropes TAUT or SLACK.
    energy_integrals : dict of (n,), J
        Integrated power flows: energy input and dissipated energies.
    stored_energies : dict of (n,), J
        Energies of the state.
    transitions : list of Transition
    velocity_before, velocity_after : (m,) or None, rad/s
        Velocity immediately before and after each transition, where it is known.
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
    velocity_before: "Array | None" = None
    velocity_after: "Array | None" = None

    @property
    def friction(self) -> "Array":
        """The friction torque of the contact, (n,), N m."""
        return self.forces

    @property
    def mode(self) -> "Array":
        """The mode of the contact, (n,)."""
        return self.modes


class Mechanism(NamedTuple):
    """A mechanism with one rotational coordinate q, v = dq/dt, and at most one dry contact.

        inertia dv/dt = applied_torque(u, q, v) + T,    u = drive(t)

    with the friction torque T of `contact`. A scenario without dry friction has no contact, and
    an effect that is not in the scenario has no term in any function.

    Attributes
    ----------
    drive : Signal
        The input u over time.
    inertia : float, kg m^2, positive
    applied_torque : callable, N m
        The sum of all torques except dry friction.
    contact : DryFriction or None
    power_flows : mapping of name to callable, W
        power(u, q, v) of each power flow to integrate: `energy_input` into the mechanism,
        `energy_damping` out of it. A contact adds `energy_friction`.
    stored_energies : mapping of name to callable, J
        energy(q, v): `energy_kinetic`, `energy_potential`.
    position, velocity : float, rad and rad/s
        The initial state.
    switching_surfaces : tuple of SwitchingSurface, or named tuples with these members
        Discontinuities that depend on the state; the drive reports those in time.
    stops : EndStops or None
        End stops; applied_torque has their torque at rest on them, and `energy_impact` is among
        the power flows, with no power: it grows at impacts.
    prescribed : bool
        The drive prescribes the velocity, and u is the torque that this takes, a summand of
        applied_torque.
    channels : callable
        channels(trajectory) returns the channels by name, without those of time, motion, dry
        friction and energies.
    channel_info : mapping of name to Channel
        For each of those names, and for the energies.
    quantities : callable
        quantities(trajectory) returns the quantities that are specific to the mechanism.
    run_warnings : callable
        run_warnings(trajectory) returns warnings about a complete run.
    is_turned : callable
        is_turned(trajectory) of a body at rest: whether any torque is applied to it, also where
        all of them cancel. Without it: whether the drive is not zero.
    effects : tuple of str
        The effects that are simulated.
    tolerance_share : float
        Of the absolute tolerance: 1, less of a motion that is far below a radian.
    system : named tuple or None
        The same equation as data with methods (`frictionsim.solvers.system`), which can be
        compiled; None if there are only the functions above.
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
    is_turned: Callable[[Trajectory], bool] = lambda trajectory: any(trajectory.drive)
    position: float = 0.0
    velocity: float = 0.0
    switching_surfaces: tuple[Any, ...] = ()
    stops: EndStops | None = None
    prescribed: bool = False
    tolerance_share: float = 1.0
    system: Any = None

    @property
    def energy_integrals(self) -> tuple[str, ...]:
        """The names of the energy integrals, in the order of the state vector."""
        friction = () if self.contact is None else ("energy_friction",)
        return (*self.power_flows, *friction)

    @property
    def initial_state(self) -> list[float]:
        """The initial state vector: position, velocity, and the energy integrals."""
        return [self.position, self.velocity, *(0.0 for _ in self.energy_integrals)]

    @property
    def initial_energy(self) -> Value:
        """The energy stored at the start, J."""
        return sum(energy(self.position, self.velocity) for energy in self.stored_energies.values())


def equation_of(
    system: Any, flows: Sequence[str], stored: Sequence[str], is_compiled: bool = True
) -> dict[str, Any]:
    """Return the arguments of `Mechanism` taken from a system.

    Parameters
    ----------
    system : named tuple
        See `frictionsim.solvers.system`.
    flows, stored : sequence of str
        The names of its powers and of its stored energies.
    is_compiled : bool
        False of a system that lacks what compiled loops call.

    Raises
    ------
    TypeError
        If the system lacks a member, or no flow is the energy input.
    """
    _check_members(system, OF_SYSTEMS if is_compiled else OF_EQUATIONS)
    if "energy_input" not in flows:
        raise TypeError(f"the flows of {type(system).__name__} lack 'energy_input'")
    return {
        "system": system if is_compiled else None,
        "switching_surfaces": system.surfaces,
        "inertia": system.inertia,
        "applied_torque": system.applied_torque,
        "power_flows": {name: _member(system.powers, i) for i, name in enumerate(flows)},
        "stored_energies": {
            name: _member(system.stored_energies, i) for i, name in enumerate(stored)
        },
    }


def _check_members(system: Any, names: Sequence[str]) -> None:
    lacking = [name for name in names if not hasattr(system, name)]
    if lacking:
        raise TypeError(
            f"{type(system).__name__} lacks {', '.join(lacking)}: see frictionsim.solvers.system"
        )


def _member(function: Callable[..., Any], number: int) -> Callable[..., Value]:
    return lambda *arguments: function(*arguments)[number]


def friction_of(system: Any, name: str, law: dict[str, Any]) -> DryFriction:
    """Return the dry contact of a system.

    Parameters
    ----------
    system : named tuple
    name : str
    law : dict
        Law and transition speed, `FrictionLaw.law_of_contact`.

    Raises
    ------
    TypeError
        If the system lacks a member.
    """
    _check_members(system, OF_FRICTION)
    return DryFriction(
        name,
        system.static_limit,
        system.kinetic_limit,
        system.roundoff,
        monotonicity_breaks=tuple(system.breaks),
        first_excess=system.first_excess,
        **law,
    )
