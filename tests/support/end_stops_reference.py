"""An independent program for a body between end stops: closed forms between located events.

    I q'' = C + A sin(w t + p) - k (q - q0) - b q' - s T_k

The solution is a sum of exponentials, or a polynomial, and a sine. Its roots are found on a grid of
times and bisected. Nothing here is taken from the package.
"""

from cmath import exp, sqrt
from collections.abc import Callable
from math import inf
from typing import Any, NamedTuple

import numpy as np

SHORT, COARSE = 1e-7, 2e-3  # s, of the grid
TIE = 1e-7


class Tied(Exception):
    """The next event depends on rounding."""


class Body(NamedTuple):
    """A body with its torques and stops; SI units, rad."""

    inertia: float
    mean: float  # C
    amplitude: float  # A
    frequency: float  # w, rad/s
    phase: float  # p
    stiffness: float
    free: float
    damping: float
    static: float  # T_s; 0 for no dry friction
    kinetic: float  # T_k
    lowest: float
    highest: float
    restitution: float
    capture: float
    angle: float
    velocity: float
    end: float  # s

    def torque(self, t: Any, q: float) -> Any:
        """Return the torque at rest."""
        wave = self.amplitude * np.sin(self.frequency * t + self.phase)
        return self.mean + wave - self.stiffness * (q - self.free)

    def side(self, q: float) -> int:
        return int(q >= self.highest) - int(q <= self.lowest)

    def motion(self, t0: float, q0: float, v0: float, s: int) -> Callable[[Any], tuple[Any, Any]]:
        """Return angle and velocity as functions of time, while sliding in direction s."""
        inertia, k, b, w = self.inertia, self.stiffness, self.damping, self.frequency
        constant = self.mean + k * self.free - s * self.kinetic
        response = k - inertia * w * w + 1j * w * b
        wave = self.amplitude * exp(1j * self.phase) / response if self.amplitude else 0.0

        def forced(t: Any) -> tuple[Any, Any]:
            rotating = wave * np.exp(1j * w * t)
            q, v = rotating.imag, (1j * w * rotating).imag
            x = t - t0
            if k > 0.0:
                return q + constant / k, v
            if b > 0.0:
                return q + constant / b * x, v + constant / b
            return q + constant / inertia * x * x / 2.0, v + constant / inertia * x

        q1, v1 = forced(t0)
        dq, dv = q0 - q1, v0 - v1
        root = sqrt(b * b - 4.0 * inertia * k)
        r1, r2 = (-b + root) / (2.0 * inertia), (-b - root) / (2.0 * inertia)

        def at(t: Any) -> tuple[Any, Any]:
            q, v = forced(t)
            x = t - t0
            if r1 == r2 == 0.0:
                return q + dq + dv * x, v + dv
            c1, c2 = (dv - r2 * dq) / (r1 - r2), (r1 * dq - dv) / (r1 - r2)
            e1, e2 = c1 * np.exp(r1 * x), c2 * np.exp(r2 * x)
            return q + (e1 + e2).real, v + (r1 * e1 + r2 * e2).real

        return at


def grid(t: float, end: float) -> Any:
    """Return times from t to the end, ever denser towards t."""
    dense = t + np.geomspace(SHORT, COARSE, 500)
    times = np.concatenate((dense, np.arange(t + 2 * COARSE, end, COARSE), [end]))
    return times[times <= end]


def first(condition: Callable[[Any], Any], t: float, end: float) -> float:
    """Return the first time after t at which a condition holds; inf if it never does."""
    times = grid(t, end)
    holds = np.flatnonzero(condition(times))
    if not holds.size:
        return inf
    i = holds[0]
    low, high = (t if i == 0 else times[i - 1]), times[i]
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if condition(middle) else (middle, high)
    return float(high)


def events_of(body: Body) -> tuple[list[tuple[Any, ...]], float, float, list[float]]:
    """Return the events (time, name, from, to, angle), final angle and velocity, impact speeds."""
    t, q, v, mode = 0.0, body.angle, body.velocity, int(np.sign(body.velocity))
    events: list[tuple[Any, ...]] = []
    speeds: list[float] = []
    while True:
        side = body.side(q)
        if side * v > 0.0:  # an impact
            speed = abs(v)
            if abs(speed - body.capture) < TIE * body.capture:
                raise Tied
            before, v = int(np.sign(v)), 0.0
            if speed >= body.capture and body.restitution > 0.0:
                v = -side * body.restitution * speed
            mode = int(np.sign(v)) if v or not body.static else start(body, t, q, side)
            events.append((t, "stop", before, mode, q))
            speeds.append(speed)
            if v == 0.0 and body.static == 0.0:
                mode = 0
        if v == 0.0 and mode == 0 and (body.static or side):
            began = first_start(body, t, q, side)
            if began == inf:
                return events, q, 0.0, speeds
            t, s = began, start(body, began, q, side, exact=False)
            events.append((t, "shaft" if body.static else "stop", 0, s, q))
            mode = s
        at = body.motion(t, q, v, mode)
        hit = first(
            lambda x, at=at: (
                ((at(x)[0] > body.highest) & (at(x)[1] > 0.0))
                | ((at(x)[0] < body.lowest) & (at(x)[1] < 0.0))
            ),
            t,
            body.end,
        )
        rest = inf
        if body.static:
            rest = first(lambda x, at=at, s=mode: s * at(x)[1] < -1e-13, t, min(hit, body.end))
        if min(hit, rest) == inf:
            q, v = at(body.end)
            return events, float(q), float(v), speeds
        t = min(hit, rest)
        q, v = map(float, at(t))
        if hit <= rest:
            q = body.highest if v > 0.0 else body.lowest
            continue
        before, v = mode, 0.0
        mode = start(body, t, q, 0)
        events.append((t, "shaft", before, mode, q))


def start(body: Body, t: float, q: float, side: int, exact: bool = True) -> int:
    torque = body.torque(t, q)
    if exact and abs(abs(torque) - body.static) < TIE * body.static:
        raise Tied
    s = 1 if torque > 0.0 else -1
    return s if s != side and (abs(torque) > body.static or not exact) else 0


def first_start(body: Body, t: float, q: float, side: int) -> float:
    """Return when a body at rest begins to move, s; inf if it stays."""

    def moves(x: Any) -> Any:
        torque = body.torque(x, q)
        up, down = torque > body.static, torque < -body.static
        return (up & (side != 1)) | (down & (side != -1))

    return t if moves(t) else first(moves, t, body.end)


def drawn_body(rng: Any) -> Body:
    """Return a body with drawn torques, stops, friction, spring and damper."""
    inertia = float(10.0 ** rng.uniform(-1.3, 0.5))
    scale = inertia * float(10.0 ** rng.uniform(0.0, 1.2))  # N m
    spring, both = rng.random() < 0.5, rng.random()
    stiffness = scale * float(rng.uniform(0.2, 3.0)) if spring else 0.0
    damping = inertia * float(rng.uniform(0.05, 0.5)) if rng.random() < 0.5 else 0.0
    static = scale * float(rng.uniform(0.05, 0.5)) if rng.random() < 0.6 else 0.0
    return Body(
        inertia=inertia,
        mean=scale * float(rng.uniform(-1.0, 1.0)),
        amplitude=scale * float(rng.uniform(0.0, 1.5)),
        frequency=float(rng.uniform(0.5, 5.0)),
        phase=float(rng.uniform(0.0, 6.0)),
        stiffness=stiffness,
        free=float(rng.uniform(-1.0, 1.0)) if spring else 0.0,
        damping=damping,
        static=static,
        kinetic=static * float(rng.choice([0.6, 0.9, 1.0])),
        lowest=-inf if both < 0.2 else float(rng.uniform(-1.5, -0.3)),
        highest=inf if both > 0.8 else float(rng.uniform(0.3, 1.5)),
        restitution=float(rng.choice([0.0, 0.3, 0.6, 0.9])),
        capture=float(10.0 ** rng.uniform(-3.0, -1.5)),
        angle=0.0 if rng.random() < 0.5 else float(rng.uniform(-0.3, 0.3)),
        velocity=0.0 if rng.random() < 0.5 else float(rng.uniform(-2.0, 2.0)),
        end=4.0,
    )
