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
d2 = x2 + r theta, grows, and is taken up by an impact, of which the friction of the shaft is a
part (`frictionsim.mechanisms.pulley.rope_impact`).

With cord friction, x is the displacement of the cord, x1 = x and x2 = -x. It sticks while
exp(-mu_s phi) <= T2/T1 <= exp(mu_s phi); slipping in direction sigma = sign(x' - r w),
T2 = T1 exp(sigma mu_k phi) [1]_.

References
----------
.. [1] J. A. Eytelwein, Handbuch der Statik fester Koerper, 1808: the capstan equation.
"""

from collections.abc import Sequence
from math import radians
from typing import Any

from frictionsim.mechanisms.journal_friction import CONTACT_NAME, ROUNDING
from frictionsim.mechanisms.pulley.lift_outputs import (
    CAR,
    CAR_ROPE,
    CORD,
    COUNTERWEIGHT_ROPE,
    OTHER,
    SLIP,
    TORQUE,
    outputs,
)
from frictionsim.mechanisms.pulley.rope_impact import shock
from frictionsim.mechanisms.pulley.schema import LiftParameters, PulleyScenario
from frictionsim.results import FORWARD, STICK, TAUT
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
        """Return what the impact leaves in which the rope of a side is taken up."""
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
