"""A pulley with masses on both sides of its cord, which may fall slack or slip.

theta > 0 lifts the car, x1 and x2 are the heights of car and counterweight, w = theta':

    m1 x1'' = T1 - m1 g,    m2 x2'' = T2 - m2 g - P
    I w' = (T2 - T1) r + tau - b w + T
    |T| <= r_s (T1 + T2) sticking,    T = -s r_k (T1 + T2) sliding

Half of the rope hangs on each side and belongs to m1 and m2; its weight is compensated. Neglected
are the weight of the pulley, the centrifugal tension and the elasticity of the rope.

Taut, x1 = r theta and x2 = -r theta. The tensions depend on the acceleration, the friction on the
tensions: eliminating both, the friction shifts the arms of the forces by its radius,

    (I + m1 r (r + s r_k) + m2 r (r - s r_k)) w'
        = (P + m2 g)(r - s r_k) - m1 g (r + s r_k) + tau - b w

and a slack side has no terms in it. Its body falls freely, the gap d1 = x1 - r theta, or
d2 = x2 + r theta, grows, and closes with an impact, `rope_impact`.

With cord friction, x is the displacement of the cord, x1 = x and x2 = -x. It sticks while
exp(-mu_s phi) <= T2/T1 <= exp(mu_s phi); slipping in direction sigma = sign(x' - r w) [1]_,

    T2/T1 = R = exp(sigma mu_k phi),    T1 = (m1 g m2 + (P + m2 g) m1)/(m2 + R m1)

Where w is given, tau follows, with no friction T at rest, where it is indeterminate. The impulse of
a rope that closes at v is J = m (1 + e) v, and the drive does its work and that of the friction.

References
----------
.. [1] J. A. Eytelwein, Handbuch der Statik fester Koerper, 1808: the capstan equation.
"""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

from frictionsim.mechanisms.effects import CONTACT_NAME, ROUNDING
from frictionsim.mechanisms.journal import journal_channels
from frictionsim.mechanisms.pulley.rope_impact import shock
from frictionsim.mechanisms.pulley.schema import LiftParameters, PulleyScenario
from frictionsim.mechanisms.pulley.statics import impending_motion
from frictionsim.mechanisms.single_dof import start_of
from frictionsim.results import FORWARD, SLACK, STICK, Check, Quantity, Transition
from frictionsim.scenario.kinetic_friction import Corners, in_motion
from frictionsim.scenario.signal_tables import extremes, signal_and_curve
from frictionsim.simulation.mechanism import ContactColumns, Mechanism, Samples
from frictionsim.solvers.prescribed import DRIVE, Segment
from frictionsim.solvers.system import INPUT, MARGINS, Contact, Margins

if TYPE_CHECKING:
    from frictionsim.results import Quantities

CORD, CAR_ROPE, COUNTERWEIGHT_ROPE = "cord", "car_rope", "counterweight_rope"
ROPES = {CAR_ROPE: "car", COUNTERWEIGHT_ROPE: "counterweight"}
TENSIONS = ("rope_tension_car", "rope_tension_counterweight")
# A tension at the located start of slack is below zero by the roundoff of the location.
TENSION_ROUNDOFF = 1e-12
# P + m2 g, N; tau - b w, N m; what `Lift.shift` returns, m; w' where there is no shift, rad/s^2.
Acting = tuple[float, float, float | None, float]
# w', the accelerations of the other coordinates, T1 and T2.
Tensions = tuple[float, list[float], float, float]


class Balance(NamedTuple):
    """The drive u, the accelerations of the coordinates, T, N m, and the tensions, N."""

    u: float
    a: list[float]
    T: float
    t1: float
    t2: float


class Lift:
    """Masses on a cord, a `System`: `RopeLift` or `CordLift`.

    The coordinates are the angle, rad, and gaps or the slip, m. The shaft, if it has friction, is
    the first contact.

    Attributes
    ----------
    energies, columns : tuple of str
        Names of the integrated energies, and of the numbers of a sample.
    contact_columns : tuple of ContactColumns
    """

    stops = None
    coordinates: int
    # Of the coordinates, their rates, the numbers of a sample that `own_numbers` returns.
    positions: tuple[str, ...]
    rates_of_positions: tuple[str, ...]
    own_columns: tuple[str, ...]
    own_contacts: tuple[ContactColumns, ...]
    own_heat: str
    tension_roundoff = 0.0  # of a tension at which a rope falls slack, N

    def __init__(self, scenario: PulleyScenario) -> None:
        effects, n = scenario.effects, scenario.lift_parameters
        journal, cord, count = effects.shaft_friction, effects.cord_friction, self.coordinates
        self.n, self.first = n, 1 if journal else 0
        self._given = n.by_torque, n.weight_2, n.damping
        self.drive, self.curve = signal_and_curve(scenario.drive.given or 0.0)
        self.radius = journal.radius_over_speed if journal else None
        self.ratio: Any = cord.ratio_over_speed if cord else None
        self.surfaces: tuple[Any, ...] = (
            *(self.radius.surfaces(count) if self.radius else ()),
            *(self.ratio.surfaces(count + 1) if self.ratio else ()),
            *([Corners(count, self.curve.corners())] if self.curve else []),
        )
        powers: dict[str, Callable[[Balance, list[float]], float]] = {
            INPUT: (lambda f, v: f.u * v[0]) if n.by_torque else self._power_of_force
        }
        if effects.viscous_damping is not None:
            powers["energy_damping"] = lambda f, v: n.damping * v[0] * v[0]
        if journal:
            powers["energy_friction"] = lambda f, v: -f.T * v[0]
        powers[self.own_heat] = self.own_loss
        self.energies, self._powers = tuple(powers), tuple(powers.values())
        (angle, velocity), rest = start_of(scenario), [0.0 for _ in range(count - 1)]
        self.start = [angle, *rest, velocity, *rest, *[0.0 for _ in powers]]
        self.impact_heat = len(self.start) - 1
        self._at_start = self.stored(self.start)
        motion = ("angle", "angular_velocity", "friction_torque", "mode")
        shaft = (ContactColumns(CONTACT_NAME, *motion, *MARGINS),) if journal else ()
        self.contact_columns = (*shaft, *self.own_contacts)
        names = ("angle", *self.positions, "angular_velocity", *self.rates_of_positions)
        self.contacts = tuple(
            Contact(c.name, names.index(c.position), not c.backward) for c in self.contact_columns
        )
        self._dry = [i for i, contact in enumerate(self.contacts) if not contact.is_rope]
        self.columns = (
            *names,
            *self.energies,
            *("angular_acceleration", "drive_torque" if n.by_torque else "drive_force"),
            *("shaft_reaction", *TENSIONS, "car_position", "car_velocity", "car_acceleration"),
            *("counterweight_position", "counterweight_velocity"),
            *("energy_kinetic", "energy_potential"),
            *(["friction_torque", *MARGINS] if journal else []),
            *self.own_columns,
            *(c.mode for c in self.contact_columns),
        )

    def tensions(self, v: list[float], modes: list[int], acting: Acting) -> Tensions:
        """Return accelerations and tensions, of the rates of the coordinates."""
        raise NotImplementedError

    def heights(self, q: list[float]) -> tuple[float, float]:
        """Return x1 and x2 of the coordinates, m; or their rates of those of the coordinates."""
        raise NotImplementedError

    def own_loss(self, f: Balance, v: list[float]) -> float:
        """Return the power that goes into the own heat, W."""
        raise NotImplementedError

    def own_margins(self, f: Balance) -> list[Margins]:
        """Return the margins of the contacts other than the shaft."""
        raise NotImplementedError

    def own_numbers(self, f: Balance, modes: list[int], margins: list[Margins]) -> list[float]:
        """Return what is recorded of the contacts other than the shaft."""
        raise NotImplementedError

    def loads(self, t: float, w: float) -> tuple[float, float, float]:
        """Return the drive u, P + m2 g, N, and tau - b w, N m."""
        (by_torque, weight, b), u = self._given, self.drive(t)
        if self.curve is not None:
            u += self.curve(w)
        return (u, weight, u - b * w) if by_torque else (u, weight + u, -b * w)

    def shift(self, modes: list[int], w: float) -> float | None:
        """Return s r_k, m, by which friction shifts the arms; None at rest."""
        if self.radius is None:
            return 0.0
        return None if modes[0] == STICK else modes[0] * self.radius.at(w)

    def balance(self, t: float, v: list[float], modes: list[int]) -> Balance:
        """Return the forces, of the rates of the coordinates."""
        u, pull, torque = self.loads(t, v[0])
        shift = self.shift(modes, v[0])
        a, others, t1, t2 = self.tensions(v, modes, (pull, torque, shift, 0.0))
        T = -((t2 - t1) * self.n.r + torque) if shift is None else -shift * (t1 + t2)
        return Balance(u, [a, *others], T, t1, t2)

    def rates(self, t: float, y: list[float], modes: list[int]) -> list[float]:
        v = y[self.coordinates : 2 * self.coordinates]
        f = self.balance(t, v, modes)
        return [*v, *f.a, *[power(f, v) for power in self._powers]]

    def margins(self, t: float, y: list[float], modes: list[int]) -> list[Margins]:
        f, n = self.balance(t, y[self.coordinates :], modes), self.n
        own = self.own_margins(f)
        if not self.first:
            return own
        limit, driving = n.r_s * (f.t1 + f.t2), abs(f.u) * (1.0 if n.by_torque else n.r)
        tie = ROUNDING * (driving + abs(f.T) + n.r * (abs(f.t1) + abs(f.t2)))
        tie += 2.0 * n.r_s * self.tension_roundoff
        return [(limit + f.T, limit - f.T, tie), *own]

    def margins_if_held(self, t: float, y: list[float], modes: list[int]) -> list[Margins]:
        """Return the margins of the dry contacts, each if it stuck and the others kept their modes.

        They are those of the modes for a contact that sticks.
        """
        held = self.margins(t, y, modes) if STICK in modes else []
        return [
            held[i]
            if modes[i] == STICK
            else self.margins(t, y, [*modes[:i], STICK, *modes[i + 1 :]])[i]
            for i in self._dry
        ]

    def recorded(self, t: float, y: list[float], modes: list[int]) -> list[float]:
        n = self.coordinates
        q, v = y[:n], y[n : 2 * n]
        f = self.balance(t, v, modes)
        x1, x2 = self.heights([q[0] - self.start[0], *q[1:]])
        v1, v2 = self.heights(v)
        margins = self.margins_if_held(t, y, modes)
        return [
            *(f.a[0], f.u, f.t1 + f.t2, f.t1, f.t2, x1, v1, self.heights(f.a)[0], x2, v2),
            *self.stored(y),
            *self.shaft_numbers(f, margins),
            *self.own_numbers(f, modes, margins),
        ]

    def shaft_numbers(self, f: Balance, margins: list[Margins]) -> list[float]:
        """Return what is recorded of the shaft."""
        return [f.T, *margins[0]] if self.first else []

    def stored(self, y: list[float]) -> tuple[float, float]:
        """Return the kinetic energy, and the potential one of the masses, J."""
        n, count = self.n, self.coordinates
        w, (x1, x2), (v1, v2) = y[count], self.heights(y), self.heights(y[count:])
        kinetic = 0.5 * (n.inertia * w * w + n.m1 * v1 * v1 + n.m2 * v2 * v2)
        return kinetic, n.g * (n.m1 * x1 + n.m2 * x2)

    def kinetic_and_supplied(self, y: list[float]) -> tuple[float, float]:
        (kinetic, potential), at_start = self.stored(y), self._at_start
        given = abs(y[2 * self.coordinates])
        return kinetic, at_start[0] + given + abs(potential - at_start[1])

    def smooth_until(self, t: float, y: list[float], end: float) -> float:
        return min(end, self.drive.next_extremum(t))

    # At rest all forces are linear in the drive.
    rests_until = smooth_until

    def impact(self, i: int, y: list[float], modes: list[int]) -> list[float]:
        raise NotImplementedError  # there are no ropes

    def _power_of_force(self, f: Balance, v: list[float]) -> float:
        return -f.u * self.heights(v)[1]


def _rigid(
    n: LiftParameters, acting: Acting, taut_1: bool = True, taut_2: bool = True
) -> tuple[float, float, float]:
    """Return w', T1 and T2 of a cord that does not slip."""
    (pull, torque, shift, a), (r, inertia, m1, m2, g) = acting, n[:5]
    weight = m1 * g
    if shift is not None:
        arm_1, arm_2 = r + shift, r - shift
        if taut_1:
            inertia += m1 * r * arm_1
            torque -= weight * arm_1
        if taut_2:
            inertia += m2 * r * arm_2
            torque += pull * arm_2
        a = torque / inertia
    rim = r * a
    return a, weight + m1 * rim if taut_1 else 0.0, pull - m2 * rim if taut_2 else 0.0


class RopeLift(Lift):
    """Masses whose ropes may fall slack; the coordinates are the angle and the gaps.

    A massless end has no gap, since its tension is P.
    """

    own_heat = "energy_impact"
    own_columns = ("slack",)

    def __init__(self, scenario: PulleyScenario) -> None:
        masses: Any = scenario.effects.hanging_masses
        ropes = list(ROPES)[: 1 if masses.other_side == 0.0 else 2]
        self.coordinates = 1 + len(ropes)
        self.positions = tuple(f"{name}_gap" for name in ropes)
        self.rates_of_positions = tuple(f"{name}_gap_rate" for name in ropes)
        self.own_contacts = tuple(
            ContactColumns(
                name, f"{name}_gap", f"{name}_gap_rate", tension, f"{name}_mode", tension, "", ""
            )
            for name, tension in zip(ropes, TENSIONS, strict=False)
        )
        self.restitution, self.capture_speed = masses.restitution, masses.capture_speed
        force, torque = largest_loads(scenario)
        self.tension_roundoff = ROUNDING * (force + torque / scenario.mechanism.cord_radius)
        super().__init__(scenario)

    def tensions(self, v: list[float], modes: list[int], acting: Acting) -> Tensions:
        n, first = self.n, self.first
        taut_1 = modes[first] != SLACK
        taut_2 = self.coordinates == 2 or modes[first + 1] != SLACK
        a, t1, t2 = _rigid(n, acting, taut_1, taut_2)
        gaps = [0.0 if taut_1 else -n.g - n.r * a]
        if self.coordinates == 3:
            gaps.append(0.0 if taut_2 else n.r * a - acting[0] / n.m2)
        return a, gaps, t1, t2

    def heights(self, q: list[float]) -> tuple[float, float]:
        rim = self.n.r * q[0]
        return rim + q[1], (q[2] if self.coordinates == 3 else 0.0) - rim

    def own_loss(self, f: Balance, v: list[float]) -> float:
        return 0.0

    def own_margins(self, f: Balance) -> list[Margins]:
        tie = self.tension_roundoff
        return [(f.t1, 0.0, tie), (f.t2, 0.0, tie)][: self.coordinates - 1]

    def own_numbers(self, f: Balance, modes: list[int], margins: list[Margins]) -> list[float]:
        sides = modes[self.first :]
        return [sum([1 << side for side, mode in enumerate(sides) if mode == SLACK])]

    def restitution_at(self, rate: float) -> float:
        """Return e of an impact at a rate of the gap, m/s: zero where it is slow."""
        return self.restitution if -rate >= self.capture_speed else 0.0

    def impact(self, i: int, y: list[float], modes: list[int]) -> list[float]:
        n, count, side = self.n, self.coordinates, i - self.first
        sign, (own, other) = (1.0, (n.m1, n.m2)) if side == 0 else (-1.0, (n.m2, n.m1))
        gap, far = count + 1 + side, count + 2 - side
        if count == 3 and modes[self.first + 1 - side] == SLACK:
            other = 0.0
        w, rate = y[count], y[gap]
        e = self.restitution_at(rate)
        if self.radius is not None:
            n = n._replace(r_k=self.radius.at(w))  # that at the speed before the impact
        end = shock(n, own, other, sign * w, rate, e)
        after = list(y)
        after[count], after[gap] = sign * end.w, end.rate
        if count == 3 and end.other == 0.0:
            # The body of a slack rope flies on, the rim changes its speed.
            after[far] += n.r * (end.w - sign * w)
        after[self.impact_heat] += (1.0 - e * e) * end.absorbed
        if self.first:
            after[self.impact_heat - 1] += end.heat
        return after


class CordLift(Lift):
    """Masses on a cord that may slip and is always taut; the coordinates are angle and slip.

    The friction T1 - T2 acts on the cord, along its slip. Its limit is (R - 1) times the tension
    behind, R = exp(mu_s phi): T1 where it slips forward, else T2.
    """

    coordinates = 2
    own_heat = "energy_cord_friction"
    positions, rates_of_positions = ("cord_slip",), ("cord_slip_rate",)
    own_columns = ("cord_force", *(f"cord_{name}" for name in MARGINS))
    own_contacts = (
        ContactColumns(CORD, *positions, *rates_of_positions, own_columns[0], "cord_mode",
                       *own_columns[1:]),
    )  # fmt: skip

    def tensions(self, v: list[float], modes: list[int], acting: Acting) -> Tensions:
        (pull, torque, shift, a), n, sigma = acting, self.n, modes[-1]
        if sigma == STICK:
            a, t1, t2 = _rigid(n, acting)
            return a, [0.0], t1, t2
        ratio = self.ratio.at(v[1])
        ratio = ratio if sigma == FORWARD else 1.0 / ratio
        weight = n.m1 * n.g
        t1 = (weight * n.m2 + pull * n.m1) / (n.m2 + ratio * n.m1)
        t2 = ratio * t1
        if shift is not None:
            a = ((t2 - t1) * n.r + torque - shift * (t1 + t2)) / n.inertia
        return a, [(t1 - weight) / n.m1 - n.r * a], t1, t2

    def heights(self, q: list[float]) -> tuple[float, float]:
        x = self.n.r * q[0] + q[1]
        return x, -x

    def own_loss(self, f: Balance, v: list[float]) -> float:
        return (f.t2 - f.t1) * v[1]

    def own_margins(self, f: Balance) -> list[Margins]:
        ratio, t1, t2 = self.n.static_ratio, f.t1, f.t2
        tie = ROUNDING * ratio * (abs(t1) + abs(t2))
        return [((ratio - 1.0) * t1 + (t1 - t2), (ratio - 1.0) * t2 - (t1 - t2), tie)]

    def own_numbers(self, f: Balance, modes: list[int], margins: list[Margins]) -> list[float]:
        return [f.t1 - f.t2, *margins[-1]]


class LiftAtSpeed(Lift):
    """Masses on a pulley of given velocity, rad/s; `solvers.prescribed` has the attributes."""

    segment = Segment()

    def __init__(self, scenario: PulleyScenario) -> None:
        super().__init__(scenario)
        self.velocity: Any = scenario.given_speed
        self._has_shaft, self.first = self.first, 0
        self.surfaces = in_motion(self.surfaces, self.coordinates)
        self.turns = CONTACT_NAME if self._has_shaft else DRIVE
        self.contacts = self.contacts[self._has_shaft :]
        self._dry = [i - self._has_shaft for i in self._dry[self._has_shaft :]]

    def balance(self, t: float, v: list[float], modes: list[int]) -> Balance:
        n, a = self.n, self.segment.acceleration(self.velocity, t)
        _, pull, torque = self.loads(t, v[0])
        _, others, t1, t2 = self.tensions(v, modes, (pull, torque, None, a))
        shift = self.shift([self.segment.direction], v[0])
        T = 0.0 if shift is None else -shift * (t1 + t2)
        return Balance(n.inertia * a - (t2 - t1) * n.r - torque - T, [a, *others], T, t1, t2)

    def recorded(self, t: float, y: list[float], modes: list[int]) -> list[float]:
        direction = [self.segment.direction] if self._has_shaft else []
        return [*super().recorded(t, y, modes), *direction]

    def shaft_numbers(self, f: Balance, margins: list[Margins]) -> list[float]:
        limit = self.n.r_s * (f.t1 + f.t2)
        return [f.T, limit, limit, 0.0] if self._has_shaft else []


class CordAtSpeed(LiftAtSpeed, CordLift):
    """A cord that may slip."""


class RopesAtSpeed(LiftAtSpeed, RopeLift):
    """Ropes that may fall slack."""

    def impact(self, i: int, y: list[float], modes: list[int]) -> list[float]:
        n, gap, after = self.n, self.coordinates + 1 + i, list(y)
        pull, m = (n.r, n.m1) if i == 0 else (-n.r, n.m2)
        rate, w = y[gap], y[self.coordinates]
        e = self.restitution_at(rate)
        impulse = -m * (1.0 + e) * rate
        heat = (self.radius.at(w) if self.radius else 0.0) * impulse * abs(w)
        after[gap] = -e * rate
        after[2 * self.coordinates] += impulse * pull * w + heat
        after[self.impact_heat] += 0.5 * (1.0 - e * e) * m * rate * rate
        if self._has_shaft:
            after[self.impact_heat - 1] += heat
        return after


def mechanism_with_masses(scenario: PulleyScenario) -> Mechanism:
    """Return the mechanism, composed of the effects in the scenario."""
    n, (_, velocity) = scenario.lift_parameters, start_of(scenario)
    weights, torque = largest_loads(scenario)
    kinetic = 0.5 * (n.inertia + (n.m1 + n.m2) * n.r**2) * velocity**2
    is_given = scenario.given_speed is not None
    if scenario.effects.cord_friction is not None:
        system: Lift = CordAtSpeed(scenario) if is_given else CordLift(scenario)
    else:
        system = RopesAtSpeed(scenario) if is_given else RopeLift(scenario)

    def checks(samples: Samples) -> dict[str, Check]:
        tensions = [samples.columns[name] for name in TENSIONS]
        lowest = min(float(x.min(initial=0.0)) for x in tensions)
        largest = max(weights, *(float(abs(x).max(initial=0.0)) for x in tensions))
        return {"rope_tension": Check(-lowest / largest if lowest else 0.0, TENSION_ROUNDOFF)}

    return Mechanism(
        system=system,
        columns=system.columns,
        contacts=system.contact_columns,
        energies=system.energies,
        channel_info=scenario.CHANNELS,
        effects=scenario.effect_names,
        quantities=lambda samples: impending_motion(scenario) | _sample_quantities(samples),
        energy_scale=lambda samples: n.r * weights + torque + kinetic,
        run_warnings=lambda samples: _slack_warnings(samples.transitions),
        checks=checks,
        prescribed=is_given,
        derived=journal_channels(scenario.effects.shaft_friction, n.inertia),
    )


def largest_loads(scenario: PulleyScenario) -> tuple[float, float]:
    """Return the weights with the largest force during a run, N, and the largest torque, N m."""
    force, torque = (
        0.0 if signal is None else max(map(abs, extremes(signal, scenario.solver.duration)))
        for signal in (scenario.drive.force, scenario.drive.torque)
    )
    n = scenario.lift_parameters
    return n.weight_1 + n.weight_2 + force, torque


def _sample_quantities(samples: Samples) -> "Quantities":
    """Return the quantities of samples and events; none without a sample."""
    if not samples.time.size:
        return {}
    quantities = {}
    for name in TENSIONS:
        quantities[f"{name}_max"] = Quantity(float(samples.columns[name].max()), "N")
        quantities[f"{name}_min"] = Quantity(float(samples.columns[name].min()), "N")
    largest = float(abs(samples.columns["car_acceleration"]).max())
    quantities["car_acceleration_max"] = Quantity(largest, "m/s^2")
    quantities["car_travel"] = Quantity(float(samples.columns["car_position"][-1]), "m")
    if "cord_slip" in samples.columns:
        slip = float(abs(samples.columns["cord_slip"]).max())
        quantities["cord_slip_max"] = Quantity(slip, "m")
        slips = _first(samples, lambda e: e.contact == CORD and e.mode_from == STICK)
        quantities["cord_slip_time"] = Quantity(slips, "s")
    else:
        quantities["slack_time"] = Quantity(_first(samples, lambda e: e.mode_to == SLACK), "s")
    return quantities


def _first(samples: Samples, applies: Callable[[Transition], bool]) -> float | None:
    """Return the time of the first event of a sort up to the last sample, s; None if none."""
    end = float(samples.time[-1])
    return next((e.time for e in samples.transitions if applies(e) and e.time <= end), None)


def _slack_warnings(transitions: Sequence[Transition]) -> list[str]:
    """Return a warning for each rope that fell slack: the model has no elasticity."""
    warnings = []
    for contact, body in ROPES.items():
        slack = [
            e for e in transitions if e.contact == contact and e.mode_to == SLACK != e.mode_from
        ]
        if not slack:
            continue
        first = f"{slack[0].time:.6g} s"
        when = f"once, at {first}" if len(slack) == 1 else f"{len(slack)} times, first at {first}"
        warnings.append(
            f"the {body} rope goes slack {when}; retightening is modelled as the impact of a rigid"
            " rope: its force is undefined, and the energy lost depends on restitution"
        )
    return warnings
