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
d2 = x2 + r theta, grows, and closes with an impact, of which the friction of the shaft is a
part (`frictionsim.mechanisms.pulley.masses`).

With cord friction, x is the displacement of the cord, x1 = x and x2 = -x. It sticks while
exp(-mu_s phi) <= T2/T1 <= exp(mu_s phi); slipping in direction sigma = sign(x' - r w),
T2 = T1 exp(sigma mu_k phi) [1]_.

References
----------
.. [1] J. A. Eytelwein, Handbuch der Statik fester Koerper, 1808: the capstan equation.

The impact of a slack rope that becomes taut, over a pulley on a dry shaft.

Tensions are impulsive in it, so is the reaction of the shaft, the sum of both tensions, and with
it the friction of the shaft. The other forces are finite and have no part. Let J be the impulse of
the rope that becomes taut, w the speed of the pulley, positive against the pull of that rope, and
d' the rate of the gap; m is the body on the rope and m' that on the other side. With the impulse
J' of the other rope, while the shaft slides in direction s,

    m dv = dJ,    m' r dw = -dJ',    I dw = (dJ' - dJ) r - s r_k (dJ + dJ')
    dw/dJ = -k,   k = (r + s r_k)/(I + m' r (r - s r_k)),   dJ' = m' r k dJ,   m' = 0 if slack
    d(d')/dJ = 1/m + r k

At w = 0 the shaft locks if r_s >= r, as then r dJ <= r_s dJ; if not, s becomes -1. Where k < 0,
which takes r_k > r and s = -1, J' would be negative: the other rope falls slack, and m' = 0.

All speeds are linear in J, in two pieces at most. The rope takes the work -d' dJ up while the gap
closes, and gives the part e^2 of it back, the energetic restitution [1]_. In an impact of one
piece, d' after is -e d' before (Newton), which is no law for others: together with friction, it may
give more energy than there was.

References
----------
.. [1] W. J. Stronge, Rigid body collisions with friction, Proc. R. Soc. Lond. A 431, 1990.

Channels, quantities, warnings and checks of a pulley with masses on its cord.
"""

from collections.abc import Callable, Sequence
from math import inf, radians, sqrt
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.mechanisms.effects import CONTACT_NAME, ROUNDING
from frictionsim.mechanisms.pulley.schema import LiftParameters, PulleyScenario
from frictionsim.mechanisms.pulley.statics import impending_motion_of_lift
from frictionsim.results import FORWARD, SLACK, STICK, TAUT, Check, Quantities, Quantity, Transition
from frictionsim.scenario.signal_tables import extremes
from frictionsim.solvers.multi_contact import (
    Balance,
    Contact,
    FrictionContact,
    Impact,
    Modes,
    MultiContactMechanism,
    UnilateralContact,
    Value,
    Vector,
)

if TYPE_CHECKING:
    from frictionsim.solvers.multi_contact import Contact, MultiContactTrajectory


TORQUE, CAR, OTHER = 0, 1, 2  # in `Balance.forces`: friction torque of the shaft, T1, T2
SLIP = 1  # coordinate of a cord that may slip, x - r theta
CORD, CAR_ROPE, COUNTERWEIGHT_ROPE = "cord", "car_rope", "counterweight_rope"
ROPES = {CAR_ROPE: "car", COUNTERWEIGHT_ROPE: "counterweight"}
# A tension at the located start of slack is below zero by the roundoff of the location.
TENSION_ROUNDOFF = 1e-12
Heights = Callable[[Any], tuple[Any, Any]]


def outputs(
    scenario: PulleyScenario, contacts: "tuple[Contact, ...]", heights: Heights
) -> dict[str, Any]:
    """Return the arguments of the mechanism that say what is recorded.

    Parameters
    ----------
    scenario : PulleyScenario
    contacts : tuple of Contact
    heights : callable
        The heights of car and counterweight, of the coordinates.
    """
    names = [contact.name for contact in contacts]
    n = scenario.lift_parameters
    weights = n.weight_1 + n.weight_2 + _largest_magnitude(scenario.drive.force, scenario)

    def channels(trajectory: "MultiContactTrajectory") -> dict[str, Any]:
        q, v, a = trajectory.position, trajectory.velocity, trajectory.acceleration
        forces, modes = trajectory.forces, dict(zip(names, trajectory.modes, strict=True))
        x1, x2 = heights(_from_start(q, scenario))
        v1, v2 = heights(v)
        values = {
            "angle": q[0],
            "angular_velocity": v[0],
            "angular_acceleration": a[0],
            "drive_torque" if n.by_torque else "drive_force": trajectory.drive,
            "shaft_reaction": forces[CAR] + forces[OTHER],
            "rope_tension_car": forces[CAR],
            "rope_tension_counterweight": forces[OTHER],
            "car_position": x1,
            "car_velocity": v1,
            "car_acceleration": heights(a)[0],
            "counterweight_position": x2,
            "counterweight_velocity": v2,
        }
        if CONTACT_NAME in modes:
            values |= {"friction_torque": forces[TORQUE], "mode": modes[CONTACT_NAME]}
        if CORD in modes:
            values |= {"cord_slip": q[SLIP], "cord_mode": modes[CORD]}
        else:
            ropes = [mode == SLACK for name, mode in modes.items() if name != CONTACT_NAME]
            values["slack"] = sum(side << i for i, side in enumerate(np.asarray(ropes, dtype=int)))
        return values

    def quantities(trajectory: "MultiContactTrajectory") -> Quantities:
        return impending_motion_of_lift(scenario) | _sample_quantities(
            trajectory, channels(trajectory), names
        )

    def checks(trajectory: "MultiContactTrajectory") -> dict[str, Check]:
        tensions = trajectory.forces[CAR:]
        lowest = float(np.min(tensions, initial=0.0))
        largest = max(weights, float(np.max(np.abs(tensions), initial=0.0)))
        return {"rope_tension": Check(-lowest / largest if lowest else 0.0, TENSION_ROUNDOFF)}

    def run_warnings(trajectory: "MultiContactTrajectory") -> list[str]:
        return _run_warnings(trajectory.transitions)

    torque = _largest_magnitude(scenario.drive.torque, scenario) if n.by_torque else 0.0
    speed = scenario.mechanism.initial_angular_velocity
    inertia = n.inertia + (n.m1 + n.m2) * n.r**2
    return {
        "channels": channels,
        "quantities": quantities,
        "checks": checks,
        "run_warnings": run_warnings,
        "energy_scale": n.r * weights + torque + 0.5 * inertia * speed**2,
    }


def _largest_magnitude(signal: Any, scenario: PulleyScenario) -> float:
    """Return the largest magnitude of a signal during the run; 0 without a signal."""
    if signal is None:
        return 0.0
    return max(map(abs, extremes(signal, scenario.solver.duration)))


def _from_start(q: Any, scenario: PulleyScenario) -> Any:
    """Return the coordinates, the angle from its start."""
    moved = np.array(q)
    moved[0] -= np.radians(scenario.mechanism.initial_angle_deg)
    return moved


def _sample_quantities(
    trajectory: "MultiContactTrajectory", channels: dict[str, Any], names: Sequence[str]
) -> Quantities:
    """Return the quantities of samples and events; none without a sample."""
    if not trajectory.time.size:
        return {}
    quantities = {}
    for name in ("rope_tension_car", "rope_tension_counterweight"):
        quantities[f"{name}_max"] = Quantity(float(np.max(channels[name])), "N")
        quantities[f"{name}_min"] = Quantity(float(np.min(channels[name])), "N")
    largest = float(np.max(np.abs(channels["car_acceleration"])))
    quantities["car_acceleration_max"] = Quantity(largest, "m/s^2")
    quantities["car_travel"] = Quantity(float(channels["car_position"][-1]), "m")
    if CORD in names:
        slip = float(np.max(np.abs(channels["cord_slip"])))
        quantities["cord_slip_max"] = Quantity(slip, "m")
        quantities["cord_slip_time"] = Quantity(
            _first(trajectory, lambda e: e.contact == CORD and e.mode_from == STICK), "s"
        )
    else:
        quantities["slack_time"] = Quantity(_first(trajectory, lambda e: e.mode_to == SLACK), "s")
    return quantities


def _first(
    trajectory: "MultiContactTrajectory", applies: Callable[[Transition], bool]
) -> float | None:
    """Return the time of the first event of a sort up to the last sample, s; None if none."""
    end = float(trajectory.time[-1])
    return next((e.time for e in trajectory.transitions if applies(e) and e.time <= end), None)


def _run_warnings(transitions: Sequence[Transition]) -> list[str]:
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


class Shock(NamedTuple):
    """The state after an impact, and the energy lost.

    Attributes
    ----------
    w : float, rad/s
    rate : float, m/s
        Of the gap; exactly zero without restitution.
    other_slackens : bool
        The rope of the other side, taut before, does not pull in the impact: its body flies on.
    rope_loss, heat : float, J
        What is lost in the rope and by the friction of the shaft.
    """

    w: float
    rate: float
    other_slackens: bool
    rope_loss: float
    heat: float


def shock(
    n: LiftParameters, masses: tuple[float, float], w: float, rate: float, restitution: float
) -> Shock:
    """Return the velocities after an impact.

    Parameters
    ----------
    n : LiftParameters
    masses : (float, float), kg
        On the rope that becomes taut, and on the other, zero if that is slack.
    w : float, rad/s
        Speed of the pulley, positive against the pull of the rope that becomes taut.
    rate : float, m/s
        Of the gap, negative.
    restitution : float
    """
    impact = _Impact(n, masses, w, rate)
    while impact.rate < 0.0 and not impact.pull(-impact.rate / impact.softness):
        pass
    impact.rate = 0.0
    given_back = restitution * restitution * impact.work
    while given_back > 0.0:
        softness, rate = impact.softness, impact.rate
        until = sqrt(rate * rate + 2.0 * softness * given_back)
        before = impact.work
        if impact.pull((until - rate) / softness):
            break
        given_back -= before - impact.work
    rope_loss = (1.0 - restitution * restitution) * impact.taken_up
    return Shock(impact.w, impact.rate, impact.other_slackens, rope_loss, impact.heat)


class _Impact:
    """An impact under way: speeds and works, advanced piece by piece."""

    def __init__(
        self, n: LiftParameters, masses: tuple[float, float], w: float, rate: float
    ) -> None:
        self._n = n
        self._own, self._other = masses
        self.w, self.rate = w, rate
        self.work = self.taken_up = self.heat = 0.0  # work that the rope holds, and has taken up
        self.other_slackens = False
        self._begin_piece()

    def _begin_piece(self) -> None:
        """Set how the speeds depend on the impulse, from here to the next stop of the shaft."""
        n = self._n
        self._slowing = self._friction = 0.0
        if self.w != 0.0 or n.r_s < n.r:
            shift = n.r_k if self.w > 0.0 else -n.r_k
            self._slowing = (n.r + shift) / (n.inertia + self._other * n.r * (n.r - shift))
            if self._slowing < 0.0:
                self.other_slackens = self._other > 0.0
                self._other = 0.0
                self._slowing = (n.r + shift) / n.inertia
            self._friction = n.r_k * (1.0 + self._other * n.r * self._slowing)
        self.softness = 1.0 / self._own + n.r * self._slowing

    def pull(self, impulse: float) -> bool:
        """Advance by an impulse, N s, or until the shaft stops; return whether by all of it."""
        stop = self.w / self._slowing if self.w * self._slowing > 0.0 else inf
        whole = impulse < stop
        step = impulse if whole else stop
        w = self.w - self._slowing * step if whole else 0.0
        rate = self.rate + self.softness * step
        work = -0.5 * (self.rate + rate) * step
        self.work += work
        self.taken_up += max(work, 0.0)
        self.heat += self._friction * 0.5 * abs(self.w + w) * step
        self.w, self.rate = w, rate
        if not whole:
            self._begin_piece()
        return whole


TURN, GAP_1, GAP_2 = 0, 1, 2  # coordinates


def with_masses(scenario: PulleyScenario) -> MultiContactMechanism:
    """Return the mechanism, composed of the effects in the scenario."""
    n, start = scenario.lift_parameters, scenario.mechanism
    shaft = _shaft(n) if scenario.effects.shaft_friction else ()
    equations = (
        SlippingCord(n, bool(shaft)) if scenario.effects.cord_friction else Ropes(n, bool(shaft))
    )
    contacts: tuple[Contact, ...] = (*shaft, *equations.contacts(scenario))
    rest = (0.0,) * (equations.coordinates - 1)
    flows: dict[str, Any] = {"energy_input": equations.power}
    if scenario.effects.viscous_damping is not None:
        flows["energy_damping"] = lambda u, q, v: n.damping * v[TURN] * v[TURN]
    angle = radians(start.initial_angle_deg)
    return MultiContactMechanism(
        drive=scenario.drive_signal,
        contacts=contacts,
        balance=equations.balance,
        impact=equations.impact,
        forces=3,
        power_flows=flows,
        stored_energies={
            "energy_kinetic": equations.kinetic,
            "energy_potential": equations.potential,
        },
        position=(angle, *rest),
        velocity=(start.initial_angular_velocity, *rest),
        effects=scenario.effect_names,
        channel_info=scenario.CHANNELS,
        **outputs(scenario, contacts, equations.heights),
    )


def _shaft(n: LiftParameters) -> tuple[FrictionContact]:
    def roundoff(u: Value, forces: Vector) -> Value:
        torque, t1, t2 = forces
        driving = abs(u) * (1.0 if n.by_torque else n.r)
        return ROUNDING * (n.r * (abs(t1) + abs(t2)) + abs(torque) + driving)

    return (
        FrictionContact(
            CONTACT_NAME,
            TURN,
            force=lambda forces: forces[TORQUE],
            static_limit=lambda forces, s: n.r_s * (forces[CAR] + forces[OTHER]),
            kinetic_limit=lambda forces, s: n.r_k * (forces[CAR] + forces[OTHER]),
            roundoff=roundoff,
        ),
    )


class Ropes:
    """The equations of masses on a cord that does not slip, and may fall slack.

    The coordinates are the angle and the gaps; a massless end has none, since its tension is P.

    Parameters
    ----------
    n : LiftParameters
    has_shaft_friction : bool
        Then the first of the modes is that of the shaft.
    """

    def __init__(self, n: LiftParameters, has_shaft_friction: bool) -> None:
        self._n = n
        self._first = int(has_shaft_friction)
        self.coordinates = 3 if n.m2 > 0.0 else 2

    def contacts(self, scenario: PulleyScenario) -> tuple[Contact, ...]:
        """Return the contacts beside the shaft."""
        n, masses = self._n, scenario.effects.hanging_masses
        assert masses is not None
        bounce = masses.restitution, masses.capture_speed

        def roundoff(u: Value, forces: Vector) -> Value:
            driving = abs(u) / n.r if n.by_torque else abs(u)
            return ROUNDING * (n.weight_1 + n.weight_2 + driving)

        car = UnilateralContact(CAR_ROPE, GAP_1, lambda forces: forces[CAR], roundoff, *bounce)
        if self.coordinates == 2:
            return (car,)
        name = COUNTERWEIGHT_ROPE
        return car, UnilateralContact(name, GAP_2, lambda f: f[OTHER], roundoff, *bounce)

    def _taut(self, modes: Modes) -> tuple[bool, bool]:
        """Return whether each side is taut; an end without mass is."""
        first = self._first
        return modes[first] == TAUT, self.coordinates == 2 or modes[first + 1] == TAUT

    def balance(self, u: float, q: Sequence[float], v: Sequence[float], modes: Modes) -> Balance:
        """Return accelerations and tensions for the modes of shaft and ropes."""
        n = self._n
        force, torque = (0.0, u) if n.by_torque else (u, 0.0)
        weight_1, weight_2 = n.weight_1, n.weight_2 + force
        taut_1, taut_2 = self._taut(modes)
        torque -= n.damping * v[TURN]
        sticks = bool(self._first) and modes[0] == STICK
        shift = modes[0] * n.r_k if self._first else 0.0
        acceleration = 0.0
        if not sticks:
            arm_1, arm_2 = n.r + shift, n.r - shift
            inertia, driving = n.inertia, torque
            if taut_1:
                inertia += n.m1 * n.r * arm_1
                driving -= weight_1 * arm_1
            if taut_2:
                inertia += n.m2 * n.r * arm_2
                driving += weight_2 * arm_2
            acceleration = driving / inertia
        rim = n.r * acceleration
        t1 = weight_1 + n.m1 * rim if taut_1 else 0.0
        t2 = weight_2 - n.m2 * rim if taut_2 else 0.0
        friction = -((t2 - t1) * n.r + torque) if sticks else -shift * (t1 + t2)
        gap_1 = 0.0 if taut_1 else -weight_1 / n.m1 - rim
        if self.coordinates == 2:
            return Balance((acceleration, gap_1), (friction, t1, t2))
        gap_2 = 0.0 if taut_2 else rim - weight_2 / n.m2
        return Balance((acceleration, gap_1, gap_2), (friction, t1, t2))

    def impact(self, contact: int, v: Sequence[float], modes: Modes, restitution: float) -> Impact:
        """Return the state after the impact in which the rope of a side becomes taut."""
        n, velocity = self._n, list(v)
        of_car = contact == self._first
        gap, far = (GAP_1, GAP_2) if of_car else (GAP_2, GAP_1)
        own, other = (n.m1, n.m2) if of_car else (n.m2, n.m1)
        side = 1.0 if of_car else -1.0
        is_taut = self._taut(modes)[1 if of_car else 0]
        found = shock(n, (own, other if is_taut else 0.0), side * v[TURN], v[gap], restitution)
        velocity[TURN], velocity[gap] = side * found.w, found.rate
        if not is_taut or found.other_slackens:  # its body flies on, the rim changes its speed
            velocity[far] += n.r * (found.w - side * v[TURN])
        losses = {"energy_impact": found.rope_loss}
        if self._first:
            losses["energy_friction"] = found.heat
        return Impact(velocity, losses)

    def heights(self, q: Vector) -> tuple[Value, Value]:
        """Return x1 and x2 of the coordinates, or their rates of rates."""
        rim = self._n.r * q[TURN]
        return rim + q[GAP_1], (q[GAP_2] - rim if self.coordinates == 3 else -rim)

    def power(self, u: Value, q: Vector, v: Vector) -> Value:
        """Return the power of the drive, W."""
        return u * v[TURN] if self._n.by_torque else -u * self.heights(v)[1]

    def kinetic(self, q: Vector, v: Vector) -> Value:
        """Return the kinetic energy, J."""
        n, (v1, v2) = self._n, self.heights(v)
        return 0.5 * (n.inertia * v[TURN] * v[TURN] + n.m1 * v1 * v1 + n.m2 * v2 * v2)

    def potential(self, q: Vector, v: Vector) -> Value:
        """Return the potential energy of the masses, J."""
        x1, x2 = self.heights(q)
        return self._n.weight_1 * x1 + self._n.weight_2 * x2


class SlippingCord(Ropes):
    """The equations of masses on a cord that may slip, and is always taut.

    The coordinates are the angle and the slip c = x - r theta.
    """

    def __init__(self, n: LiftParameters, has_shaft_friction: bool) -> None:
        super().__init__(n, has_shaft_friction)
        self.coordinates = 2

    def contacts(self, scenario: PulleyScenario) -> tuple[Contact, ...]:
        """Return the contact of the cord: its friction T1 - T2 acts on the cord, along its slip."""
        n = self._n

        def limit(forces: Vector, s: Value, ratio: float) -> Value:
            # (ratio - 1) times the tension behind: T1 where it slips forward, else T2.
            behind = 0.5 * (1 + s) * forces[CAR] + 0.5 * (1 - s) * forces[OTHER]
            return (ratio - 1.0) * behind

        def roundoff(u: Value, forces: Vector) -> Value:
            return ROUNDING * n.static_ratio * (abs(forces[CAR]) + abs(forces[OTHER]))

        return (
            FrictionContact(
                CORD,
                SLIP,
                force=lambda forces: forces[CAR] - forces[OTHER],
                static_limit=lambda forces, s: limit(forces, s, n.static_ratio),
                kinetic_limit=lambda forces, s: limit(forces, s, n.kinetic_ratio),
                roundoff=roundoff,
                heat="energy_cord_friction",
            ),
        )

    def _taut(self, modes: Modes) -> tuple[bool, bool]:
        return True, True

    def balance(self, u: float, q: Sequence[float], v: Sequence[float], modes: Modes) -> Balance:
        """Return accelerations and tensions for the modes of shaft and cord."""
        sigma = modes[self._first]
        if sigma == STICK:
            return super().balance(u, q, v, modes)
        n = self._n
        force, torque = (0.0, u) if n.by_torque else (u, 0.0)
        torque -= n.damping * v[TURN]
        ratio = n.kinetic_ratio if sigma == FORWARD else 1.0 / n.kinetic_ratio
        weight_1, weight_2 = n.weight_1, n.weight_2 + force
        t1 = (weight_1 * n.m2 + weight_2 * n.m1) / (n.m2 + ratio * n.m1)
        t2 = ratio * t1
        of_cord = (t1 - weight_1) / n.m1
        unbalance = (t2 - t1) * n.r + torque
        if self._first and modes[0] == STICK:
            return Balance((0.0, of_cord), (-unbalance, t1, t2))
        friction = -modes[0] * n.r_k * (t1 + t2) if self._first else 0.0
        acceleration = (unbalance + friction) / n.inertia
        return Balance((acceleration, of_cord - n.r * acceleration), (friction, t1, t2))

    def heights(self, q: Vector) -> tuple[Value, Value]:
        """Return x1 = x and x2 = -x of the coordinates, or their rates of rates."""
        x = self._n.r * q[TURN] + q[SLIP]
        return x, -x
