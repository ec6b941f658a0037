"""The pulley with hanging masses in closed form: an independent program, with 50 digits.

Newton and Euler for each body, x1 and x2 upwards from the start, theta > 0 lifts the car:

    m1 x1'' = T1 - m1 g,   m2 x2'' = T2 - m2 g - P,   m = car or counterweight + rope/2
    I theta'' = (T2 - T1) r + tau - b theta' + T,   |T| <= r_s (T1 + T2),   sliding r_k

A side is taut (x1' = r theta', x2' = -r theta') or slack (tension zero). With cord friction the
cord sticks to the pulley, exp(-mu_s phi) <= T2/T1 <= exp(mu_s phi), or slips, T2 = T1
exp(+-mu_k phi). In each combination all motions are curves (`lift_curves`), as the drive is
piecewise a polynomial or a sine. The next combination is one that holds just after the event, by
the first derivative that is not zero; and the one with the fewest contacts released.
"""

from dataclasses import dataclass, field, replace
from itertools import product
from typing import Any

from mpmath import mp, mpf

from tests.support.lift_curves import (
    ROUNDING,
    Curve,
    Number,
    first_fall,
    holds_after_start,
    piece_of_signal,
    response,
)

TIE = mpf(10) ** -11  # N m or N: a limit that is exceeded by rounding only is not exceeded
STICK = 0


@dataclass(frozen=True)
class Lift:
    r: Number
    inertia: Number
    m1: Number
    m2: Number
    g: Number
    e: Number
    capture: Number
    r_s: Number
    r_k: Number
    b: Number
    static_ratio: Number  # exp(mu_s phi); 0 without cord friction
    kinetic_ratio: Number
    force: Any
    torque: Any
    end: Number

    @classmethod
    def of(cls, data: dict[str, Any]) -> "Lift":
        effects, drive = data["effects"], data["drive"]
        masses = effects["hanging_masses"]
        half = mpf(masses.get("rope", 0.0)) / 2
        shaft, cord = effects.get("shaft_friction"), effects.get("cord_friction")

        def radius(mu: str) -> Number:
            if shaft is None:
                return mpf(0)
            return mpf(shaft["shaft_radius"]) * mp.sin(mp.atan(mpf(shaft[mu])))

        def ratio(mu: str) -> Number:
            if cord is None:
                return mpf(0)
            return mp.exp(mpf(cord[mu]) * mp.radians(mpf(cord.get("wrap_deg", 180.0))))

        return cls(
            r=mpf(data["mechanism"]["cord_radius"]),
            inertia=mpf(data["mechanism"]["inertia"]),
            m1=mpf(masses["car"]) + half,
            m2=mpf(masses["counterweight"]) + half,
            g=mpf(masses.get("g", 9.81)),
            e=mpf(masses.get("restitution", 0.0)),
            capture=mpf(masses.get("capture_speed", 1e-3)),
            r_s=radius("mu_s"),
            r_k=radius("mu_k"),
            b=mpf(effects.get("viscous_damping", {}).get("coefficient", 0.0)),
            static_ratio=ratio("mu_s"),
            kinetic_ratio=ratio("mu_k"),
            force=drive.get("force", 0.0),
            torque=drive.get("torque", 0.0),
            end=mpf(data["solver"]["duration"]),
        )


@dataclass(frozen=True)
class State:
    """Positions and velocities of the pulley, car and counterweight, rad and m."""

    angle: Number
    w: Number
    x1: Number
    v1: Number
    x2: Number
    v2: Number


@dataclass(frozen=True)
class Combination:
    """The modes of the contacts: of the shaft and of the cord 0, 1, -1; which sides are taut."""

    shaft: int
    cord: int = STICK
    taut: tuple[bool, bool] = (True, True)


@dataclass(frozen=True)
class Motion:
    """A piece of the motion, from `start` to `end`, s: curves of u = t - start."""

    start: Number
    end: Number
    modes: Combination
    angle: Curve
    w: Curve
    x1: Curve
    v1: Curve
    x2: Curve
    v2: Curve
    t1: Curve
    t2: Curve
    force: Curve
    torque: Curve
    margins: dict[str, Curve]

    def state(self, u: Number) -> State:
        curves = (self.angle, self.w, self.x1, self.v1, self.x2, self.v2)
        return State(*(curve(u) for curve in curves))


@dataclass
class Solution:
    lift: Lift
    pieces: list[Motion] = field(default_factory=list)
    events: list[tuple[Number, str, int, int, Number]] = field(default_factory=list)
    # Time, rope, speed of closing, and the energies lost in the rope and by friction.
    impacts: list[tuple[Number, str, Number, Number, Number]] = field(default_factory=list)
    first_angle: Number = 0

    def at(self, t: float) -> tuple[Motion, Number]:
        """Return the piece of a time and the time since its start."""
        for piece in reversed(self.pieces):
            if t >= piece.start:
                return piece, mpf(t) - piece.start
        raise ValueError(t)

    def of(self, contact: str) -> list[tuple[float, int, int, float]]:
        """Return the changes of one contact: time, mode before, mode after, angle."""
        return [
            (float(t), before, after, float(angle))
            for t, name, before, after, angle in self.events
            if name == contact
        ]


def motion(lift: Lift, t: Number, state: State, modes: Combination) -> Motion:
    """Return the motion from t on in one combination, up to the next knot of a signal."""
    force, until = piece_of_signal(lift.force, t)
    torque, until_torque = piece_of_signal(lift.torque, t)
    end = min(until, until_torque, lift.end)
    down1, down2 = Curve((lift.m1 * lift.g,)), force + lift.m2 * lift.g
    (q1, q2), s, r = modes.taut, modes.shaft, lift.r
    arm1, arm2 = r + s * lift.r_k, r - s * lift.r_k  # of the tensions, with friction
    zero = Curve((mpf(0),))
    if modes.cord != STICK:
        ratio = lift.kinetic_ratio**modes.cord
        rise = (down2 - ratio * down1) * (1 / (lift.m2 + ratio * lift.m1))
        t1 = down1 + lift.m1 * rise
        t2 = down2 - lift.m2 * rise
        mass, push = lift.inertia, arm2 * t2 - arm1 * t1 + torque
    else:
        mass = lift.inertia + q1 * lift.m1 * r * arm1 + q2 * lift.m2 * r * arm2
        push = q2 * arm2 * down2 - q1 * arm1 * down1 + torque
    if mass <= 0:
        raise ValueError("friction exceeds inertia: no motion is consistent")
    w = response(mass, lift.b, push, state.w) if s else zero
    angle, alpha = w.integral(state.angle), w.slope()
    if modes.cord != STICK:
        v1 = rise.integral(state.v1)
        v2 = -v1
    else:
        t1 = q1 * (down1 + (lift.m1 * r) * alpha)
        t2 = q2 * (down2 - (lift.m2 * r) * alpha)
        v1 = r * w if q1 else (-(1 / lift.m1) * down1).integral(state.v1)
        v2 = -r * w if q2 else (-(1 / (lift.m2 or 1)) * down2).integral(state.v2)
    x1, x2 = v1.integral(state.x1), v2.integral(state.x2)
    sides = Motion(t, end, modes, angle, w, x1, v1, x2, v2, t1, t2, force, torque, {})
    return replace(sides, margins=margins(lift, sides))


def margins(lift: Lift, of: Motion) -> dict[str, Curve]:
    modes, r = of.modes, lift.r
    values = {}
    if modes.shaft == STICK:
        moment = (of.t2 - of.t1) * r + of.torque
        limit = lift.r_s * (of.t1 + of.t2)
        values |= {"shaft+": limit - moment, "shaft-": limit + moment}
    else:
        values["stop"] = modes.shaft * of.w
    if lift.static_ratio == 0:
        for i, tension, gap in ((0, of.t1, of.x1 - r * of.angle), (1, of.t2, of.x2 + r * of.angle)):
            if modes.taut[i]:
                # A massless end has the tension of the force.
                if i == 0 or lift.m2 > 0:
                    values[f"slack{i + 1}"] = tension
            else:
                values[f"taut{i + 1}"] = gap
    elif modes.cord == STICK:
        values["cord+"] = lift.static_ratio * of.t1 - of.t2
        values["cord-"] = lift.static_ratio * of.t2 - of.t1
    else:
        values["grip"] = modes.cord * (of.v1 - r * of.w)
    return values


def tolerance_of(name: str) -> Number:
    return TIE if name[:-1] in ("shaft", "cord", "slack") else mpf(0)


def violated(lift: Lift, of: Motion) -> set[str]:
    """Return which margins are negative just after the start of a motion."""
    moving = ("stop", "grip")
    return {
        name[:-1] if name not in moving else name
        for name, curve in of.margins.items()
        if not holds_after_start(curve, max(tolerance_of(name), ROUNDING), name in moving)
    }


def next_combination(lift: Lift, t: Number, state: State) -> tuple[Combination, Motion]:
    """Return the combination that holds from t on: sticking and taut wherever that is possible."""
    r = lift.r
    shaft_modes = (0, 1, -1) if state.w == 0 else (1 if state.w > 0 else -1,)
    gaps = ((state.x1 - r * state.angle, state.v1 - r * state.w),)
    gaps += ((state.x2 + r * state.angle, state.v2 + r * state.w),)
    if lift.static_ratio:
        slip = gaps[0][1]
        cord_modes = (0, 1, -1) if abs(slip) < ROUNDING else (1 if slip > 0 else -1,)
        sides: Any = [(True, True)]
    else:
        cord_modes = (0,)
        sides = product(
            *([False] if gap > ROUNDING or rate > ROUNDING else [True, False] for gap, rate in gaps)
        )
    rest = Combination(shaft_modes[0], cord_modes[0], (True, True))
    faults = violated(lift, motion(lift, t, state, rest)) if lift.static_ratio else set()
    able = []
    for shaft, cord, taut in product(shaft_modes, cord_modes, list(sides)):
        modes = Combination(shaft, cord, taut)
        candidate = motion(lift, t, state, modes)
        if violated(lift, candidate):
            continue
        released = (shaft != rest.shaft) + (cord != rest.cord) + (not taut[0]) + (not taut[1])
        # Of two with as many contacts released: the one that keeps those which need not be.
        needless = (shaft != rest.shaft and "shaft" not in faults) + (
            cord != rest.cord and "cord" not in faults
        )
        able.append((released, needless, len(able), modes, candidate))
    if not able:
        raise ValueError(f"no combination is consistent at t = {t}")
    able.sort(key=lambda entry: entry[:3])
    return able[0][3], able[0][4]


def force_per_impulse(lift: Lift, own: int, s: int, other_taut: bool) -> tuple[Number, Number]:
    """Return the effect of a unit impulse of the rope on side `own` while the shaft slides by s.

    The change of the speed of the pulley, positive against the pull, and the other rope's impulse.
    """
    far = (lift.m2, lift.m1)[own]
    # I dw = (dK - 1) r - s r_k (1 + dK),  far (-r dw) = dK
    matrix = mp.matrix([[lift.inertia, -(lift.r - s * lift.r_k)], [far * lift.r, 1]])
    if other_taut:
        dw, pull = mp.lu_solve(matrix, mp.matrix([-(lift.r + s * lift.r_k), 0]))
        if pull >= 0:
            return dw, pull
    return -(lift.r + s * lift.r_k) / lift.inertia, mpf(0)


def impact(lift: Lift, side: int, state: State, taut: tuple[bool, bool], log: Any) -> State:
    """Return the state after the cord of a side (0, 1) has become taut with a shock.

    The friction of the shaft is part of it, in proportion to both impulses. The rope gives the part
    e^2 of the work back that it has taken up, and the shaft may stop or turn meanwhile.
    """
    r, sign = lift.r, 1 - 2 * side
    own = (lift.m1, lift.m2)[side]
    first = (state.v1 - r * state.w, state.v2 + r * state.w)[side]
    e = lift.e if -first >= lift.capture else mpf(0)
    rate, w, other = first, sign * state.w, taut[1 - side]
    impulse = held = heat = mpf(0)
    to_return, taken = None, mpf(0)
    while to_return is None or to_return > 0:
        locked = w == 0 and lift.r_s >= r
        s = 1 if w > 0 else -1
        dw, pull = (mpf(0), mpf(0)) if locked else force_per_impulse(lift, side, s, other)
        other = other and (pull > 0 or dw <= 0)
        slope = 1 / own - r * dw
        if to_return is None:
            needed = -rate / slope
        else:
            needed = (mp.sqrt(rate**2 + 2 * slope * to_return) - rate) / slope
        stop = -w / dw if w * dw < 0 else mp.inf
        j = min(stop, needed)
        work = -(rate + slope * j / 2) * j
        heat += 0 if locked else lift.r_k * (1 + pull) * abs(w + dw * j / 2) * j
        impulse, rate = impulse + j, rate + slope * j
        w = mpf(0) if j == stop else w + dw * j
        held += work
        if to_return is not None:
            to_return = mpf(0) if j == needed else to_return + work
        elif j == needed:
            taken, to_return = held, e**2 * held
    after = replace(state, w=sign * w)
    speed = r * w * sign if side == 0 else -r * w * sign
    v = (state.v1, state.v2)[side] + impulse / own if e else speed
    after = replace(after, v1=v) if side == 0 else replace(after, v2=v)
    if other:
        after = replace(after, v2=-speed) if side == 0 else replace(after, v1=-speed)
    log(-first, (1 - e**2) * taken, heat)
    return after


def solve(data: dict[str, Any], pieces: int = 20_000) -> Solution:
    """Return the motion of a scenario up to its end."""
    lift = Lift.of(data)
    mechanism = data["mechanism"]
    angle = mp.radians(mpf(mechanism.get("initial_angle_deg", 0.0)))
    w = mpf(mechanism.get("initial_angular_velocity", 0.0))
    r, start = lift.r, angle
    # The gaps are x1 - r theta and x2 + r theta: the angle counts from the start in here.
    state = State(mpf(0), w, mpf(0), r * w, mpf(0), -r * w)
    solution, t = Solution(lift, first_angle=start), mpf(0)
    modes, step = next_combination(lift, t, state)
    # Whatever is at rest at the start is recorded as if it had stuck before.
    record(solution, t, Combination(int(mp.sign(w))), modes, state.angle + start)
    for _ in range(pieces):
        name, length = first_event(lift, step)
        state = step.state(length)
        solution.pieces.append(replace(step, end=t + length, angle=step.angle + start))
        t = t + length
        if t >= lift.end:
            return solution
        if name == "knot":
            t = step.end  # exactly
            step = motion(lift, t, state, modes)
            continue
        before, state = modes, after_event(lift, name, state, modes, t, solution)
        modes, step = next_combination(lift, t, state)
        record(solution, t, before, modes, state.angle + start)
    raise AssertionError("too many events")


def first_event(lift: Lift, step: Motion) -> tuple[str, Number]:
    """Return the cause and the time of the end of a piece: a margin, or `knot` of a signal."""
    name, length = "knot", step.end - step.start
    for margin, curve in step.margins.items():
        at = first_fall(curve, length, tolerance_of(margin))
        if at is not None and at < length:
            name, length = margin, at
    return name, length


def after_event(
    lift: Lift, name: str, state: State, modes: Combination, t: Number, solution: Solution
) -> State:
    """Return the state after an event: what is zero is exactly zero; after an impact, if it was."""
    r = lift.r
    if name == "stop":
        state = replace(state, w=mpf(0))
        taut1 = modes.taut[0] and modes.cord == STICK
        taut2 = modes.taut[1] and modes.cord == STICK
        state = replace(state, v1=mpf(0) if taut1 else state.v1, v2=mpf(0) if taut2 else state.v2)
    elif name == "grip":
        state = replace(state, v1=r * state.w, v2=-r * state.w)
    elif name in ("taut1", "taut2"):
        side = int(name[-1]) - 1
        rim = r * state.angle
        state = replace(state, x1=rim) if side == 0 else replace(state, x2=-rim)

        def log(speed: Number, loss: Number, heat: Number) -> None:
            rope = ("car rope", "counterweight rope")[side]
            solution.impacts.append((t, rope, speed, loss, heat))

        state = impact(lift, side, state, modes.taut, log)
    return state


def record(
    solution: Solution, t: Number, before: Combination, after: Combination, angle: Number
) -> None:
    pairs = (
        ("shaft", before.shaft, after.shaft),
        ("cord", before.cord, after.cord),
        ("car rope", int(not before.taut[0]), int(not after.taut[0])),
        ("counterweight rope", int(not before.taut[1]), int(not after.taut[1])),
    )
    for contact, old, new in pairs:
        if old != new:
            solution.events.append((t, contact, old, new, angle))
