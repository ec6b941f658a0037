"""Equations of motion: what a solver knows of a mechanism, and mechanisms of one coordinate.

`System` is the contract between mechanisms and solvers, for any number of coordinates and contacts.
`OneCoordinate` fulfils it for a mechanism of one coordinate q, rad, of velocity v, rad/s, as a sum
of terms, each with its torque and where its energy goes. An effect that a scenario lacks is none.

    inertia dv/dt = sum of the torques + T,    u = acting(t, q, v)

u is what acts on the mechanism at an instant, evaluated once for all terms: a force, or the sums of
several. T is the dry friction of the contact: while it sticks, v = 0, it balances the torques up to
its static limit; while it slides in direction s, T = -s times its kinetic limit.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple, Protocol

from frictionsim.errors import InputError
from frictionsim.results import BACKWARD, FORWARD, STICK
from frictionsim.scenario.schema import TRANSITION_SPEED
from frictionsim.solvers.roots import bracket_root

Acting = Any  # what acts on a mechanism at an instant
DryFriction = Callable[[Any, float, float, int, float], float]
Margins = tuple[float, float, float]
INPUT, IMPACT, FRICTION = "energy_input", "energy_impact", "energy_friction"
EQUATION = "the equation of motion of this kind of mechanism, which its author has to mend"
STOP = "stop"  # name of the event at an end stop
MARGINS = ("margin_forward", "margin_backward", "margin_roundoff")


class Term(NamedTuple):
    """A torque of the equation of one coordinate, and where its energy goes.

    Attributes
    ----------
    torque : callable, or float
        Of (u, q, v), N m, along the coordinate, smooth between surfaces; a number if it is
        constant.
    energy : str
        The energy that its work goes into: `energy_input` of a drive, whose work is counted as it
        is done on the mechanism; a heat, such as `energy_damping`, of what takes it out.
    potential : callable or None
        Of q, J, of a torque that is its negative slope; `energy` is empty then, and only then.
    """

    torque: Callable[[Any, float, float], float] | float
    energy: str = ""
    potential: Callable[[float], float] | None = None


class Friction(NamedTuple):
    """Dry friction along the coordinate.

    The limits are not negative. The kinetic one must not exceed the static one at v = 0, or
    a contact that breaks away would not move, and the run ends with a SolverError. For each
    direction s it is smooth in v between surfaces. It may depend on the torques, since the load of
    a contact may depend on the acceleration dv/dt = (applied - s kinetic)/inertia. v is 0 where a
    slip begins and ends, and may have the wrong sign by rounding.

    Attributes
    ----------
    name : str
        In events and messages.
    static : callable
        Static limit of (u, q), N m, with u at rest.
    kinetic : callable
        Kinetic limit of (u, q, v, s, applied), N m: s is the direction of the slip, +1 or -1, and
        `applied` the sum of the torques of all terms, N m.
    roundoff : callable
        Of (u, q), N m: up to it a torque beyond the static limit is held. Some 10 units in the last
        place of the numbers that torque and limit are sums of.
    law : str
        A name in `frictionsim.scenario.methods`.
    transition_speed : float, rad/s
        Of the regularised law.
    surfaces : tuple
        Where the kinetic limit has corners; as of `System`.
    """

    name: str
    static: Callable[[Any, float], float]
    kinetic: DryFriction
    roundoff: Callable[[Any, float], float]
    law: str = "set-valued"
    transition_speed: float = TRANSITION_SPEED
    surfaces: tuple[Any, ...] = ()


class EndStops(NamedTuple):
    """The end stops of a mechanism; one may be missing.

    An impact on a stop gives v+ = -e v-; after one slower than the capture speed the body stays on
    the stop, which then carries the whole torque towards it. The method `events` alone has impacts.
    """

    lowest: float  # rad; -inf for none
    highest: float  # rad; inf for none
    restitution: float  # e, at least 0 and below 1
    capture_speed: float  # rad/s

    def side(self, q: float) -> int:
        """Return FORWARD or BACKWARD at the highest or lowest position, STICK between them."""
        if q >= self.highest:
            return FORWARD
        return BACKWARD if q <= self.lowest else STICK

    def takes(self, q: float, v: float, torque: float) -> bool:
        """Return whether a stop takes a torque, N m: it presses a body at rest to it."""
        return v == 0.0 and self.side(q) * torque > 0.0

    def struck(self, q: float, v: float) -> int:
        """Return the direction of the stop that a body is beyond, or at and moving into; else 0."""
        side = self.side(q)
        is_struck = side * v > 0.0 or q > self.highest or q < self.lowest
        return side if is_struck else STICK


class Contact(NamedTuple):
    """A contact of a system; its coordinate is its slip, of a rope its gap, zero while taut."""

    name: str
    coordinate: int = 0
    is_rope: bool = False


class System(Protocol):
    """What the event-driven solver integrates, in floats and SI units.

    The state y has n positions, their velocities, and the energies that are integrated, on which
    rates do not depend. Modes are those of the contacts: FORWARD, STICK and BACKWARD of dry
    friction, TAUT and SLACK of a rope, from `frictionsim.results`.

    Where the equations are not smooth, steps end: at surfaces, each with `event`, the name of an
    event or empty, and `beyond(step, t, y)`, positive after the first crossing within a step.
    """

    coordinates: int  # n
    contacts: tuple[Contact, ...]
    start: list[float]  # the state
    surfaces: tuple[Any, ...]
    stops: EndStops | None  # of one coordinate
    impact_heat: int  # place of the heat of impacts on stops in the state

    def rates(self, t: float, y: list[float], modes: list[int]) -> list[float]:
        """Return dy/dt in the modes of the contacts; exactly zero for a velocity that is held."""

    def margins(self, t: float, y: list[float], modes: list[int]) -> list[Margins]:
        """Return of each contact the margins of its force and their roundoff, while it holds.

        Of friction the margins forward and backward, limit +- force; of a rope its tension, and a
        number that is not used.
        """

    def recorded(self, t: float, y: list[float], modes: list[int]) -> list[float]:
        """Return what is recorded with a sample beside the state and the modes."""

    def smooth_until(self, t: float, y: list[float], end: float) -> float:
        """Return a time after t, at most the end, up to which the equations are smooth in t."""

    def rests_until(self, t: float, y: list[float], end: float) -> float:
        """Return a time after t, at most the end, up to which margins at rest are monotone.

        Or, while all contacts hold, one such that each breaks away at most once up to it, and that
        does not hold at it if it does.
        """

    def kinetic_and_supplied(self, y: list[float]) -> tuple[float, float]:
        """Return the kinetic energy, and what the mechanism had at the start and was given, J."""

    def impact(self, i: int, y: list[float], modes: list[int]) -> list[float]:
        """Return the state after the impact in which rope i becomes taut."""

    def rests_on_stop(self, t: float, y: list[float]) -> bool:
        """Return whether a body without contacts is pressed to an end stop at rest."""

    def departure(self, t: float, y: list[float], end: float) -> tuple[float, bool]:
        """Return until when such a body rests, at most the end, and whether it leaves then."""


class OneCoordinate:
    """A mechanism of one coordinate with one dry contact or none; a `System`.

    Parameters
    ----------
    drive : Signal
        Or another object with `next_extremum(t)` and `next_discontinuity(t)`, s, of what acts; it
        is called with the time if there is no `acting`.
    acting : callable or None
        Of (t, q, v); None if the drive acts as it is, u = drive(t).
    inertia : float, kg m^2
    terms : sequence of Term
        One of them has the energy `INPUT`, of the drive; no two heats have one name.
    friction : Friction or None
    start : (float, float), rad and rad/s
    breaks : sequence of float
        Values of a drive that acts as it is, u = drive(t), between which torque and limit at rest
        are smooth, and torque -+ limit are monotone.
    first_excess : callable or None
        For others: first_excess(q, a, b) returns a time after a, at most b, such that at rest in q
        the contact breaks away at most once up to it, and does not hold at it if it does; so does a
        body without dry friction on a stop, which leaves it where the torque points away. Without
        it torque -+ limit at rest have to be monotone between the extrema of the drive.
    surfaces, stops
        As of `System`.
    channels : tuple of str
        Names of the further numbers of a sample.
    recorded : callable
        Returns them, of (u, q, v, a) with the acceleration a, rad/s^2.

    Attributes
    ----------
    columns : tuple of str
        The names of the numbers of a sample: of the state, of what is recorded, of the mode.
    energies : tuple of str
        The names of the energies that are integrated.
    torques : list of callable
        Of the terms, in their order.

    Raises
    ------
    InputError
        If terms are not as above.
    """

    coordinates = 1

    def __init__(
        self,
        drive: Any,
        acting: Callable[[float, float, float], Acting] | None,
        inertia: float,
        terms: Sequence[Term],
        friction: Friction | None,
        *,
        start: tuple[float, float] = (0.0, 0.0),
        breaks: Sequence[float] = (),
        first_excess: Callable[[float, float, float], float] | None = None,
        surfaces: tuple[Any, ...] = (),
        stops: EndStops | None = None,
        channels: tuple[str, ...] = (),
        recorded: Callable[[Acting, float, float, float], list[float]] = lambda u, q, v, a: [],
    ) -> None:
        self.drive, self.inertia, self.friction = drive, inertia, friction
        self._acting, self._recorded, self.stops = acting, recorded, stops
        self._breaks, self._first_excess = breaks, first_excess
        self.surfaces = (*surfaces, *friction.surfaces) if friction else surfaces
        self.contacts = () if friction is None else (Contact(friction.name),)
        self.energies = _energies_of(terms, stops is not None, friction is not None)
        self.start = [*start, *[0.0 for _ in self.energies]]
        if stops is not None:
            self.impact_heat = 2 + self.energies.index(IMPACT)
        self._heat_of_friction = [2 + i for i, name in enumerate(self.energies) if name == FRICTION]
        self._potentials = [term.potential for term in terms if term.potential]
        self._potential_at_start = self.potential(start[0])
        self.torques = [_function(term.torque) for term in terms]
        of_terms = list(zip(terms, self.torques, strict=True))
        (self._driving,) = [torque for term, torque in of_terms if term.energy == INPUT]
        self._losing = [torque for term, torque in of_terms if term.energy not in ("", INPUT)]
        storing = [term.torque for term in terms if term.potential]
        self._varying = [torque for torque in storing if callable(torque)]
        self._constant = sum([torque for torque in storing if not callable(torque)])
        self._further = [*self._varying, *self._losing]
        self.use_friction(None)
        self.columns = (
            *("angle", "angular_velocity", *self.energies, "angular_acceleration"),
            *("energy_kinetic", *(["energy_potential"] if self._potentials else [])),
            *(["torque_at_rest"] if friction is None else ["friction_torque", *MARGINS]),
            *channels,
            *([] if friction is None else ["mode"]),
        )

    def acting(self, t: float, q: float, v: float) -> Acting:
        """Return what acts at a time, s, in an angle, rad, at a speed, rad/s."""
        return self.drive(t) if self._acting is None else self._acting(t, q, v)

    def torque(self, u: Acting, q: float, v: float) -> float:
        """Return the sum of all torques except dry friction, N m.

        A stop takes the whole torque that presses a body at rest to it.
        """
        applied = self.torque_between_stops(u, q, v)
        stops = self.stops
        return 0.0 if stops is not None and stops.takes(q, v, applied) else applied

    def torque_between_stops(self, u: Acting, q: float, v: float) -> float:
        """Return the sum of all torques except dry friction and those of stops, N m."""
        applied: float = self._driving(u, q, v) + self._constant
        for torque in self._further:
            applied += torque(u, q, v)
        return applied

    def powers(self, u: Acting, q: float, v: float) -> list[float]:
        """Return the powers of the energies but for stops and dry friction, W."""
        return [self._driving(u, q, v) * v, *[-torque(u, q, v) * v for torque in self._losing]]

    def use_friction(self, law: DryFriction | None) -> None:
        """Replace T: of (u, q, v, s, applied) with the mode s, N m; None for that of the modes."""
        self._law = law
        drive, acting, stops, inertia = self.drive, self._acting, self.stops, self.inertia
        driving, constant = self._driving, self._constant
        varying, losing, has_contact = self._varying, self._losing, self.friction is not None
        kinetic: Any = self.friction and self.friction.kinetic

        def rates(t: float, y: list[float], modes: list[int]) -> list[float]:
            # All in one function: it takes most of the time of a run.
            q, v = y[0], y[1]
            u = drive(t) if acting is None else acting(t, q, v)
            given = driving(u, q, v)
            applied = given + constant
            for torque in varying:
                applied += torque(u, q, v)
            rates = [v, 0.0, given * v]
            for torque in losing:
                loss = torque(u, q, v)
                applied += loss
                rates.append(-loss * v)
            if stops is not None:
                applied = 0.0 if stops.takes(q, v, applied) else applied
                rates.append(0.0)
            if has_contact:
                s = modes[0]
                if law is not None:
                    T = law(u, q, v, s, applied)
                else:
                    T = -s * kinetic(u, q, v, s, applied) if s else -applied
                rates.append(-T * v)
                applied += T
            rates[1] = applied / inertia
            return rates

        self.rates = rates  # type: ignore[method-assign]

    def rates(self, t: float, y: list[float], modes: list[int]) -> list[float]:
        raise NotImplementedError  # `use_friction` sets it

    def margins(self, t: float, y: list[float], modes: list[int]) -> list[Margins]:
        return [self._margins_at_rest(self.acting(t, y[0], 0.0), y[0])]

    def dry_friction(self, u: Acting, q: float, v: float, s: int, applied: float) -> float:
        """Return T in the mode s, N m."""
        if self._law is not None:
            return self._law(u, q, v, s, applied)
        friction: Any = self.friction
        return -applied if s == STICK else -s * friction.kinetic(u, q, v, s, applied)

    def _margins_at_rest(self, u: Acting, q: float) -> Margins:
        friction: Any = self.friction
        torque, limit = self.torque(u, q, 0.0), friction.static(u, q)
        return limit - torque, limit + torque, friction.roundoff(u, q)

    def recorded(self, t: float, y: list[float], modes: list[int]) -> list[float]:
        q, v = y[0], y[1]
        u = self.acting(t, q, v)
        applied = self.torque(u, q, v)
        friction = self.dry_friction(u, q, v, modes[0], applied) if modes else 0.0
        return self.numbers(t, u, (q, v, (applied + friction) / self.inertia), friction)

    def numbers(
        self,
        t: float,
        u: Acting,
        motion: tuple[float, float, float],
        friction: float,
        margins: Margins | None = None,
    ) -> list[float]:
        """Return what is recorded of an instant, with angle, velocity and acceleration.

        Without margins they are those at rest.
        """
        q, v, a = motion
        numbers = [a, self.kinetic(v)]
        if self._potentials:
            numbers.append(self.potential(q))
        at_rest = u if v == 0.0 or self._acting is None else self._acting(t, q, 0.0)
        if self.friction is None:
            numbers.append(self.torque(at_rest, q, 0.0))
        else:
            numbers.append(friction)
            numbers.extend(margins or self._margins_at_rest(at_rest, q))
        numbers.extend(self._recorded(u, q, v, a))
        return numbers

    def smooth_until(self, t: float, y: list[float], end: float) -> float:
        drive = self.drive
        if self.friction is None:
            return min(end, drive.next_discontinuity(t))
        b = min(end, drive.next_extremum(t))
        for critical in self._breaks:
            if (drive(t) - critical) * (drive(b) - critical) < 0.0:
                b = bracket_root(lambda at, to=critical: drive(at) - to, t, b)[1]  # type: ignore[misc]
        return b

    def rests_until(self, t: float, y: list[float], end: float) -> float:
        b = self.smooth_until(t, y, end)
        return b if self._first_excess is None else self._first_excess(y[0], t, b)

    def impact(self, i: int, y: list[float], modes: list[int]) -> list[float]:
        raise NotImplementedError  # there are no ropes

    def kinetic(self, v: float) -> float:
        """Return the kinetic energy, J."""
        return 0.5 * self.inertia * v * v

    def potential(self, q: float) -> float:
        """Return the potential energy, J."""
        energy = 0.0
        for potential in self._potentials:
            energy += potential(q)
        return energy

    def kinetic_and_supplied(self, y: list[float]) -> tuple[float, float]:
        released = abs(self.potential(y[0]) - self._potential_at_start)
        supplied = self.kinetic(self.start[1]) + abs(y[2]) + released
        for i in self._heat_of_friction:  # published laws may give some back
            supplied += max(0.0, -y[i])
        return self.kinetic(y[1]), supplied

    def rests_on_stop(self, t: float, y: list[float]) -> bool:
        stops, q = self.stops, y[0]
        if stops is None or y[1] != 0.0 or stops.side(q) == 0:
            return False
        return not self._away(t, q) > 0.0

    def _away(self, t: float, q: float) -> float:
        """Return the torque away from the stop at which a body rests, N m."""
        torque = self.torque_between_stops(self.acting(t, q, 0.0), q, 0.0)
        return -self.stops.side(q) * torque  # type: ignore[union-attr]

    def departure(self, t: float, y: list[float], end: float) -> tuple[float, bool]:
        q, until = y[0], self.smooth_until(t, y, end)
        if self._first_excess is None:
            until = min(until, self.drive.next_extremum(t))
        else:
            until = self._first_excess(q, t, until)
        if not self._away(until, q) > 0.0:
            return until, False
        return bracket_root(lambda at: self._away(at, q), t, until)[1], True


def _energies_of(terms: Sequence[Term], has_stops: bool, has_friction: bool) -> tuple[str, ...]:
    """Return the names of the energies that are integrated, that of the drive first."""
    for term in terms:
        if (term.potential is None) == (not term.energy):
            raise InputError(
                f"{EQUATION}: each term says where its energy goes; give it an energy, such as"
                " 'energy_damping' of what takes it out, or a potential"
            )
    drives = [term for term in terms if term.energy == INPUT]
    if len(drives) != 1:
        raise InputError(
            f"{EQUATION}: one term has the energy '{INPUT}', of a drive; found {len(drives)}"
        )
    names = (
        INPUT,
        *[term.energy for term in terms if term.energy not in ("", INPUT)],
        *([IMPACT] if has_stops else []),
        *([FRICTION] if has_friction else []),
    )
    if len(set(names)) < len(names):
        raise InputError(
            f"{EQUATION}: each heat has a name of its own; found {', '.join(names)}: make one term"
            " of those with one name, or give them others"
        )
    return names


def _function(torque: Callable[[Any, float, float], float] | float) -> Any:
    """Return a torque as a function."""
    return torque if callable(torque) else lambda u, q, v: torque
