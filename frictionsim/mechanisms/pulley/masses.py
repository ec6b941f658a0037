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
d2 = x2 + r theta, grows, and closes with an impact.

With cord friction, x is the displacement of the cord, x1 = x and x2 = -x. It sticks while
exp(-mu_s phi) <= T2/T1 <= exp(mu_s phi); slipping in direction sigma = sign(x' - r w),
T2 = T1 exp(sigma mu_k phi) [1]_.

In the impact of a slack rope that becomes taut, tensions are impulsive, so is the reaction of the
shaft, the sum of both tensions, and with it the friction of the shaft. The other forces are finite
and have no part. Let J be the impulse of the rope that becomes taut, w the speed of the pulley,
positive against the pull of that rope, and d' the rate of the gap; m is the body on the rope and
m' that on the other side. With the impulse J' of the other rope, while the shaft slides in
direction s,

    m dv = dJ,    m' r dw = -dJ',    I dw = (dJ' - dJ) r - s r_k (dJ + dJ')
    dw/dJ = -k,   k = (r + s r_k)/(I + m' r (r - s r_k)),   dJ' = m' r k dJ,   m' = 0 if slack
    d(d')/dJ = 1/m + r k

At w = 0 the shaft locks if r_s >= r, as then r dJ <= r_s dJ; if not, s becomes -1. Where k < 0,
which takes r_k > r and s = -1, J' would be negative: the other rope falls slack, and m' = 0.

All speeds are linear in J, in two pieces at most. The rope takes the work -d' dJ up while the gap
closes, and gives the part e^2 of it back, the energetic restitution [2]_. In an impact of one
piece, d' after is -e d' before (Newton), which is no law for others: together with friction, it may
give more energy than there was.

References
----------
.. [1] J. A. Eytelwein, Handbuch der Statik fester Koerper, 1808: the capstan equation.
.. [2] W. J. Stronge, Rigid body collisions with friction, Proc. R. Soc. Lond. A 431, 1990.
"""

from collections.abc import Callable, Sequence
from math import inf, radians, sqrt
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.mechanisms.effects import (
    CONTACT_NAME,
    ROUNDING,
    Damping,
    Journal,
    damping_of,
    journal_of,
    with_damping,
    with_damping_power,
)
from frictionsim.mechanisms.pulley.schema import LiftParameters, PulleyScenario
from frictionsim.mechanisms.pulley.statics import impending_motion_of_lift
from frictionsim.results import FORWARD, SLACK, STICK, Check, Quantities, Quantity, Transition
from frictionsim.scenario.signal_tables import extremes
from frictionsim.scenario.signals import Curve, curve_of
from frictionsim.solvers.compilation import compilable
from frictionsim.solvers.contacts import (
    Contact,
    Form,
    Friction,
    MultiContactMechanism,
    PackedContacts,
    Unilateral,
    Value,
    Vector,
    table_of,
)
from frictionsim.solvers.multi_contact_state import ACCELERATION, FORCES, HEATS, MODES

if TYPE_CHECKING:
    from frictionsim.solvers.mechanism import Trajectory


TORQUE, CAR, OTHER = 0, 1, 2  # in the forces of the balance: friction torque of the shaft, T1, T2
SLIP = 1  # coordinate of a cord that may slip, x - r theta
CORD, CAR_ROPE, COUNTERWEIGHT_ROPE = "cord", "car_rope", "counterweight_rope"
ROPES = {CAR_ROPE: "car", COUNTERWEIGHT_ROPE: "counterweight"}
# A tension at the located start of slack is below zero by the roundoff of the location.
TENSION_ROUNDOFF = 1e-12
Heights = Callable[[Any], tuple[Any, Any]]


def outputs(
    scenario: PulleyScenario, contacts: Sequence[Contact], heights: Heights
) -> dict[str, Any]:
    """Return the arguments of the mechanism that say what is recorded.

    Parameters
    ----------
    scenario : PulleyScenario
    contacts : sequence of Contact
    heights : callable
        The heights of car and counterweight, of the coordinates.
    """
    names = [contact.name for contact in contacts]
    n = scenario.lift_parameters
    weights = n.weight_1 + n.weight_2 + _largest_magnitude(scenario.drive.force, scenario)

    def channels(trajectory: "Trajectory") -> dict[str, Any]:
        q, v, a = trajectory.position, trajectory.velocity, trajectory.acceleration
        forces, modes = trajectory.forces, dict(zip(names, trajectory.modes, strict=True))
        x1, x2 = heights(_displacements(q, scenario))
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

    def quantities(trajectory: "Trajectory") -> Quantities:
        return impending_motion_of_lift(scenario) | _sample_quantities(
            trajectory, channels(trajectory), names
        )

    def checks(trajectory: "Trajectory") -> dict[str, Check]:
        tensions = trajectory.forces[CAR:]
        lowest = float(np.min(tensions, initial=0.0))
        largest = max(weights, float(np.max(np.abs(tensions), initial=0.0)))
        return {"rope_tension": Check(-lowest / largest if lowest else 0.0, TENSION_ROUNDOFF)}

    def run_warnings(trajectory: "Trajectory") -> list[str]:
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


def _displacements(q: Any, scenario: PulleyScenario) -> Any:
    """Return the coordinates, the angle from its start."""
    moved = np.array(q)
    moved[0] -= np.radians(scenario.mechanism.initial_angle_deg)
    return moved


def _sample_quantities(
    trajectory: "Trajectory", channels: dict[str, Any], names: Sequence[str]
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


def _first(trajectory: "Trajectory", applies: Callable[[Transition], bool]) -> float | None:
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


class Impact(NamedTuple):
    """An impact under way.

    Attributes
    ----------
    w : float, rad/s
        Speed of the pulley, positive against the pull of the rope that becomes taut.
    rate : float, m/s
        Of the gap.
    other : float, kg
        Mass on the rope of the other side; 0 if that is slack, or does not pull in the impact.
    work, absorbed, heat : float, J
        Work that the rope holds, and has taken up; heat of the friction of the shaft.
    """

    w: float
    rate: float
    other: float
    work: float
    absorbed: float
    heat: float


@compilable
def slowing_of(n: LiftParameters, other: float, w: float) -> float:
    """Return k, by how much an impulse slows the pulley down, up to the next stop of the shaft."""
    if w == 0.0 and n.r_s >= n.r:
        return 0.0
    shift = n.r_k if w > 0.0 else -n.r_k
    return (n.r + shift) / (n.inertia + other * n.r * (n.r - shift))


@compilable
def begun(n: LiftParameters, impact: Impact) -> Impact:
    """Return an impact at the begin of a piece: the other rope falls slack where k < 0."""
    w, rate, other, work, absorbed, heat = impact
    if slowing_of(n, other, w) < 0.0:
        other = 0.0
    return Impact(w, rate, other, work, absorbed, heat)


@compilable
def softness_of(n: LiftParameters, own: float, impact: Impact) -> float:
    """Return by how much an impulse changes the rate of the gap."""
    return 1.0 / own + n.r * slowing_of(n, impact.other, impact.w)


@compilable
def stop_of(n: LiftParameters, impact: Impact) -> float:
    """Return the impulse at which the shaft stops, N s; inf if it does not."""
    slowing = slowing_of(n, impact.other, impact.w)
    return impact.w / slowing if impact.w * slowing > 0.0 else inf


@compilable
def pulled(n: LiftParameters, own: float, impact: Impact, impulse: float) -> Impact:
    """Return an impact after an impulse, N s, at most to the stop of the shaft."""
    slowing, stop = slowing_of(n, impact.other, impact.w), stop_of(n, impact)
    step = min(impulse, stop)
    w = impact.w - slowing * step if impulse < stop else 0.0
    rate = impact.rate + softness_of(n, own, impact) * step
    work = -0.5 * (impact.rate + rate) * step
    friction = n.r_k * (1.0 + impact.other * n.r * slowing)
    if impact.w == 0.0 and n.r_s >= n.r:
        friction = 0.0
    heat = friction * 0.5 * abs(impact.w + w) * step
    absorbed = impact.absorbed + max(work, 0.0)
    return Impact(w, rate, impact.other, impact.work + work, absorbed, impact.heat + heat)


@compilable
def shock(
    n: LiftParameters, own: float, other: float, w: float, rate: float, restitution: float
) -> Impact:
    """Return the end of an impact; the rate of the gap is exactly zero without restitution.

    Parameters
    ----------
    n : LiftParameters
    own, other : float, kg
        Masses on the rope that becomes taut, and on the other, zero if that is slack.
    w, rate, restitution : float
        As of `Impact`, before it; the rate is negative.
    """
    impact = begun(n, Impact(w, rate, other, 0.0, 0.0, 0.0))
    while impact.rate < 0.0:
        impulse = -impact.rate / softness_of(n, own, impact)
        whole = impulse < stop_of(n, impact)
        impact = pulled(n, own, impact, impulse)
        if whole:
            break
        impact = begun(n, impact)
    w, rate, other, work, absorbed, heat = impact
    impact = Impact(w, 0.0, other, work, absorbed, heat)
    returned = restitution * restitution * work
    while returned > 0.0:
        softness, before = softness_of(n, own, impact), impact.work
        until = sqrt(impact.rate * impact.rate + 2.0 * softness * returned)
        impulse = (until - impact.rate) / softness
        whole = impulse < stop_of(n, impact)
        impact = pulled(n, own, impact, impulse)
        if whole:
            break
        impact = begun(n, impact)
        returned -= before - impact.work
    return impact


TURN, GAP_1, GAP_2 = 0, 1, 2  # coordinates


@compilable
def shaft_sticks(journal: tuple[Journal, ...], s: Any) -> bool:
    """Return whether there is dry friction in the shaft, and it sticks."""
    if len(journal) == 0:
        return False
    return s[MODES] == STICK


@compilable
def shift_of(journal: tuple[Journal, ...], s: Any) -> float:
    """Return s r_k of a shaft that slides, m."""
    if len(journal) == 0:
        return 0.0
    return s[MODES] * journal[0].r_k


class Cord(NamedTuple):
    """The ratio of the tensions of a cord that slips."""

    ratio: float


class Lift(NamedTuple):
    """The equations of masses on a cord, which may fall slack, or with cord friction slip.

    The coordinates are the angle and the gaps; a massless end has none, since its tension is P. A
    cord that may slip is always taut: its slip is in the place of the gaps. The shaft, if it has
    friction, is the first contact.

    Attributes
    ----------
    P_per_u, tau_per_u : float
        The drive is a force P on the cord or a torque tau on the pulley: 1 and 0, or 0 and 1.
    """

    drive: Curve
    contacts: PackedContacts
    coordinates: int
    n: LiftParameters
    P_per_u: float
    tau_per_u: float
    journal: tuple[Journal, ...]
    damping: tuple[Damping, ...]
    cord: tuple[Cord, ...]

    def balance(self, u: float, s: Any, y: int) -> None:
        """Write accelerations and tensions for the modes of shaft and cord."""
        if not write_slipping(self.cord, self, u, s, y):
            write_rigid(self, u, s, y)

    def impact(self, contact: int, restitution: float, s: Any, y: int) -> None:
        """Change the state by the impact in which the rope of a side becomes taut."""
        n, first, v = self.n, len(self.journal), y + self.coordinates
        side = contact - first
        sign = 1.0 - 2.0 * side
        gap, far = v + GAP_1 + side, v + GAP_2 - side
        own, other = (n.m1, n.m2) if side == 0 else (n.m2, n.m1)
        if s[MODES + first + 1 - side] == SLACK:
            other = 0.0
        w = s[v + TURN]
        after = shock(n, own, other, sign * w, s[gap], restitution)
        s[v + TURN], s[gap] = sign * after.w, after.rate
        if self.coordinates == 3 and after.other == 0.0:
            # The body of a slack rope flies on, the rim changes its speed.
            s[far] += n.r * (after.w - sign * w)
        s[HEATS + contact] += (1.0 - restitution * restitution) * after.absorbed
        if first > 0:
            s[HEATS] += after.heat

    def heights(self, angle: Value, first: Value, last: Value) -> tuple[Value, Value]:
        """Return x1 and x2, or their rates, of the coordinates: the angle, the next, the last."""
        rim = self.n.r * angle
        if self.coordinates == 3:
            return rim + first, last - rim
        return rim + first, -(rim + len(self.cord) * first)

    def powers(self, u: float, s: Any, y: int) -> tuple[float, ...]:
        """Return the powers of drive and damping, W."""
        v, n = y + self.coordinates, self.coordinates
        w = s[v + TURN]
        rise = self.heights(w, s[v + 1], s[v + n - 1])[1]
        drive = self.tau_per_u * u * w - self.P_per_u * u * rise
        powers: tuple[float, ...] = with_damping_power((drive,), self.damping, w)
        return powers

    def stored_energies(self, q: Vector, v: Vector) -> tuple[Value, Value]:
        """Return the kinetic energy, and the potential one of the masses, J."""
        n, w = self.n, v[TURN]
        x1, x2 = self.heights(q[TURN], q[1], q[-1])
        v1, v2 = self.heights(w, v[1], v[-1])
        kinetic = 0.5 * (n.inertia * w * w + n.m1 * v1 * v1 + n.m2 * v2 * v2)
        return kinetic, n.m1 * n.g * x1 + n.m2 * n.g * x2


@compilable
def write_rigid(lift: Lift, u: float, s: Any, y: int) -> None:
    """Write accelerations and tensions of a cord that does not slip."""
    n, w = lift.n, s[y + lift.coordinates + TURN]
    weight_1, weight_2 = n.m1 * n.g, n.m2 * n.g + lift.P_per_u * u
    torque = with_damping(lift.tau_per_u * u, lift.damping, w)
    # Of a side that is always taut, the mode is that of the cord, or 0 as of any that is not there.
    first = MODES + len(lift.journal)
    taut_1, taut_2 = s[first] != SLACK, s[first + 1] != SLACK
    sticks, shift = shaft_sticks(lift.journal, s), shift_of(lift.journal, s)
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
    s[FORCES + TORQUE] = -((t2 - t1) * n.r + torque) if sticks else -shift * (t1 + t2)
    s[FORCES + CAR], s[FORCES + OTHER] = t1, t2
    s[ACCELERATION + TURN] = acceleration
    s[ACCELERATION + GAP_1] = 0.0 if taut_1 else -weight_1 / n.m1 - rim
    if lift.coordinates == 3:
        s[ACCELERATION + GAP_2] = 0.0 if taut_2 else rim - weight_2 / n.m2


@compilable
def write_slipping(cord: tuple[Cord, ...], lift: Lift, u: float, s: Any, y: int) -> bool:
    """Write accelerations and tensions of a cord that slips; return whether it does."""
    if len(cord) == 0:
        return False
    sigma, n = s[MODES + len(lift.journal)], lift.n
    if sigma == STICK:
        return False
    torque = with_damping(lift.tau_per_u * u, lift.damping, s[y + lift.coordinates + TURN])
    ratio = cord[0].ratio if sigma == FORWARD else 1.0 / cord[0].ratio
    weight_1, weight_2 = n.m1 * n.g, n.m2 * n.g + lift.P_per_u * u
    t1 = (weight_1 * n.m2 + weight_2 * n.m1) / (n.m2 + ratio * n.m1)
    t2 = ratio * t1
    cord_acceleration = (t1 - weight_1) / n.m1
    unbalance = (t2 - t1) * n.r + torque
    acceleration, friction = 0.0, -unbalance
    if not shaft_sticks(lift.journal, s):
        friction = -shift_of(lift.journal, s) * (t1 + t2)
        acceleration = (unbalance + friction) / n.inertia
    s[ACCELERATION + TURN] = acceleration
    s[ACCELERATION + SLIP] = cord_acceleration - n.r * acceleration
    s[FORCES + TORQUE], s[FORCES + CAR], s[FORCES + OTHER] = friction, t1, t2
    return True


def mechanism_with_masses(scenario: PulleyScenario) -> MultiContactMechanism:
    """Return the mechanism, composed of the effects in the scenario."""
    n, start, effects = scenario.lift_parameters, scenario.mechanism, scenario.effects
    masses, shaft = effects.hanging_masses, effects.shaft_friction
    assert masses is not None  # of which it is one
    contacts = [_shaft(n)] if shaft else []
    cord = (Cord(n.kinetic_ratio),) if effects.cord_friction else ()
    coordinates = 2 if cord or n.m2 == 0.0 else 3
    if cord:
        contacts.append(_cord(n))
    else:
        law = Unilateral(masses.restitution, masses.capture_speed)
        contacts += [_rope(n, law, side) for side in range(coordinates - 1)]
    damping = damping_of(effects.viscous_damping)
    flows = ("energy_input", *(["energy_damping"] if damping else []))
    system = Lift(
        curve_of(scenario.drive_signal),
        table_of(contacts),
        coordinates,
        n,
        P_per_u=0.0 if n.by_torque else 1.0,
        tau_per_u=1.0 if n.by_torque else 0.0,
        journal=journal_of(shaft),
        damping=damping,
        cord=cord,
    )
    rest = (0.0,) * (coordinates - 1)
    return MultiContactMechanism(
        drive=scenario.drive_signal,
        system=system,
        contacts=tuple(contacts),
        power_flows=flows,
        stored_energies=("energy_kinetic", "energy_potential"),
        position=(radians(start.initial_angle_deg), *rest),
        velocity=(start.initial_angular_velocity, *rest),
        effects=scenario.effect_names,
        channel_info=scenario.CHANNELS,
        **outputs(scenario, contacts, lambda q: system.heights(q[TURN], q[1], q[-1])),
    )


# The forms of contacts are of 1, the drive, and the forces T, T1, T2.


def _shaft(n: LiftParameters) -> Contact:
    """Return the contact of the shaft: its friction T has the limits r_s (T1 + T2)."""
    static, kinetic = (0.0, 0.0, 0.0, n.r_s, n.r_s), (0.0, 0.0, 0.0, n.r_k, n.r_k)
    driving = ROUNDING * (1.0 if n.by_torque else n.r)
    return Contact(
        CONTACT_NAME,
        TURN,
        Friction((static, static), (kinetic, kinetic)),
        force=(0.0, 0.0, 1.0, 0.0, 0.0),
        roundoff=(0.0, driving, ROUNDING, ROUNDING * n.r, ROUNDING * n.r),
    )


def _rope(n: LiftParameters, law: Unilateral, side: int) -> Contact:
    """Return the contact of a rope, 0 of the car: its force is its tension."""
    driving = ROUNDING / n.r if n.by_torque else ROUNDING
    weights = ROUNDING * (n.weight_1 + n.weight_2)
    tension = (0.0, 0.0, 0.0, 1.0, 0.0) if side == 0 else (0.0, 0.0, 0.0, 0.0, 1.0)
    roundoff = (weights, driving, 0.0, 0.0, 0.0)
    return Contact((CAR_ROPE, COUNTERWEIGHT_ROPE)[side], GAP_1 + side, law, tension, roundoff)


def _cord(n: LiftParameters) -> Contact:
    """Return the contact of the cord: its friction T1 - T2 acts on the cord, along its slip.

    The limit is (ratio - 1) times the tension behind: T1 where it slips forward, else T2.
    """

    def limits(ratio: float) -> tuple[Form, Form]:
        return (0.0, 0.0, 0.0, ratio - 1.0, 0.0), (0.0, 0.0, 0.0, 0.0, ratio - 1.0)

    law = Friction(limits(n.static_ratio), limits(n.kinetic_ratio), heat="energy_cord_friction")
    tensions = ROUNDING * n.static_ratio
    roundoff = (0.0, 0.0, 0.0, tensions, tensions)
    return Contact(CORD, SLIP, law, (0.0, 0.0, 0.0, 1.0, -1.0), roundoff)
