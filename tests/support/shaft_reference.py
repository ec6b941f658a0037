"""An independent program for a body on a dry shaft; it shares no code with the package.

Newton's and Euler's laws as they stand. Vectors of the plane are complex numbers: a product with
exp(i q) turns one by q, and the imaginary part of conj(a) b is the cross product a x b.

A force at the point P has the moment P x F about the axis. The eccentric mass is a second body
with the acceleration a = (i alpha - w^2) c, fixed to the first, and the reaction N of the shaft
follows from both together,

    N = m a - sum of F,    I alpha + c x (m a) = sum of P x F + C - b w - k (q - q_0) + T,

with T = -s r_k |N| for sliding in direction s. N holds alpha, and T with it: alpha is found by
iteration. At rest the body holds while |M| <= r_s |N|.

Motion is integrated by DOP853 at a relative tolerance of 1e-13 from event to event; an event is
located in the integrator's interpolant, and then by integrating to it. At rest, the margin of the
contact is sampled, each of its maxima is refined, and the first excess is bisected.
"""

import cmath
from bisect import bisect_right
from collections.abc import Callable
from functools import partial
from math import copysign, hypot, inf, pi, radians, sin
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import DOP853
from scipy.optimize import brentq, minimize_scalar

from tests.support.friction_curves import corners, curve

Table = dict[str, Any]
RTOL = 1e-13
ATOL = 1e-15
PARTS = 8  # of a step, at whose ends events are looked for
NEAR = 1e-11  # relative: an event so near to the begin of a step is that begin
TIE = 1e-13  # relative: the contact holds if torque and limit differ by less


class Size(NamedTuple):
    """The size of a force or couple: of what, its values, and where its slope jumps."""

    over: str
    value: Callable[[Any], Any]
    knots: list[float]
    fastest: float = 0.0  # Hz


def size_of(table: Any) -> Size:
    if isinstance(table, int | float):
        return Size("time", lambda t: table + 0.0 * t, [])
    for key, over in (("time", "time"), ("speed", "speed"), ("angle_deg", "angle")):
        if key in table:
            x = [radians(a) for a in table[key]] if over == "angle" else list(table[key])
            return Size(over, partial(_interpolated, x, table["value"]), x)
    if "sine" in table:
        s = table["sine"]
        omega, phase = 2.0 * pi * s["frequency_hz"], radians(s.get("phase_deg", 0.0))
        mean, amplitude = s.get("mean", 0.0), s["amplitude"]

        def wave(t: Any) -> Any:
            angle = omega * t + phase
            return mean + amplitude * (sin(angle) if isinstance(t, float) else np.sin(angle))

        return Size("time", wave, [], s["frequency_hz"])
    s = table["smooth_step"]

    def step(t: Any) -> Any:
        x = (t - s["start"]) / (s["stop"] - s["start"])
        x = min(max(x, 0.0), 1.0) if isinstance(t, float) else np.clip(x, 0.0, 1.0)
        return s["from"] + (s["to"] - s["from"]) * x * x * (3.0 - 2.0 * x)

    return Size("time", step, [s["start"], s["stop"]])


def _interpolated(x: list[float], y: list[float], t: Any) -> Any:
    if not isinstance(t, float):
        return np.interp(t, x, y)
    i = bisect_right(x, t)
    if i in (0, len(x)):
        return y[0 if i == 0 else -1]
    return (y[i - 1] * (x[i] - t) + y[i] * (t - x[i - 1])) / (x[i] - x[i - 1])


def cross(a: complex, b: Any) -> Any:
    return a.real * b.imag - a.imag * b.real


class Body:
    def __init__(self, scenario: Table) -> None:
        mechanism, effects = scenario["mechanism"], scenario.get("effects", {})
        self.inertia = mechanism["inertia"]
        self.forces, self.couples = [], []
        for force in scenario.get("forces", []):
            d = complex(*force["direction"])
            d /= abs(d)
            if "cord_radius" in force:
                point, turns = -1j * force["cord_radius"] * d, False  # point x d = cord_radius
            else:
                point, turns = complex(*force["point"]), force.get("point_turns", True)
            self.forces.append(
                (size_of(force["size"]), point, turns, d, force.get("direction_turns", False))
            )
        self.couples = [size_of(couple["size"]) for couple in scenario.get("couples", [])]
        self.damping = effects.get("viscous_damping", {"coefficient": 0.0})["coefficient"]
        spring = effects.get("torsion_spring", {"stiffness": 0.0})
        self.stiffness = spring["stiffness"]
        self.free = radians(spring.get("free_angle_deg", 0.0))
        self.weight = effects.get("gravity", {"g": 0.0})["g"] * -1j
        self.mass = mechanism.get("mass", 0.0)
        eccentric = effects.get("eccentric_mass", {"mass": 0.0, "radius": 0.0})
        self.m = eccentric["mass"]
        self.arm = cmath.rect(eccentric["radius"], radians(eccentric.get("azimuth_deg", 0.0)))
        journal = effects.get("shaft_friction", {"shaft_radius": 0.0, "mu_s": 0.0, "mu_k": 0.0})
        r = journal["shaft_radius"]
        self.r_s = r * journal["mu_s"] / hypot(1.0, journal["mu_s"])
        self.shaft_radius, self.mu_k = r, curve(journal["mu_k"], journal["mu_s"])
        self.corners = [speed / r for speed in corners(journal["mu_k"])]
        self.r_k = self.kinetic_radius(0.0)
        self.sizes = [force[0] for force in self.forces] + self.couples

    def kinetic_radius(self, w: float) -> float:
        mu = self.mu_k(self.shaft_radius * w)
        return self.shaft_radius * mu / hypot(1.0, mu)

    def applied(self, t: Any, q: float, w: float) -> tuple[Any, Any]:
        """Return the moment of all but friction, and the resultant of all forces."""
        turn = cmath.exp(1j * q)
        at = {"time": t, "speed": w, "angle": q}
        arm = self.arm * turn
        total = self.mass * self.weight + self.m * self.weight
        moment = cross(arm, self.m * self.weight)
        moment += -self.damping * w - self.stiffness * (q - self.free)
        for size, point, point_turns, direction, direction_turns in self.forces:
            force = size.value(at[size.over]) * (direction * turn if direction_turns else direction)
            moment = moment + cross(point * turn if point_turns else point, force)
            total = total + force
        for size in self.couples:
            moment = moment + size.value(at[size.over])
        return moment, total

    def acceleration(self, t: float, q: float, w: float, s: int) -> tuple[float, complex]:
        """Return the angular acceleration in direction s, and the reaction of the shaft."""
        moment, force = self.applied(t, q, w)
        arm = self.arm * cmath.exp(1j * q)
        alpha, r_k = moment / self.inertia if self.inertia else 0.0, self.kinetic_radius(w)
        for _ in range(60):
            pull = self.m * (1j * alpha - w * w) * arm
            reaction = pull - force
            friction = -s * r_k * abs(reaction)
            rest = self.inertia * alpha + cross(arm, pull) - moment - friction
            # Newton's method: the derivative is positive, and the residual convex or concave.
            growth = self.inertia + cross(arm, self.m * 1j * arm)
            if r_k and abs(reaction) > 0.0:
                along = (reaction.conjugate() * (self.m * 1j * arm)).real / abs(reaction)
                growth += s * r_k * along
            change = rest / growth
            alpha -= change
            if abs(change) <= 4e-16 * abs(alpha) or self.m == 0.0:
                break
        return alpha, self.m * (1j * alpha - w * w) * arm - force

    def margin(self, t: Any, q: float, s: int) -> Any:
        """Return torque in direction s minus the static limit at rest."""
        moment, force = self.applied(t, q, 0.0)
        return s * moment - self.r_s * abs(force)

    def scale(self, q: float, t: Any) -> Any:
        moment = sum(abs(size.value(t)) for size in self.couples if size.over == "time")
        for size, point, *_ in self.forces:
            if size.over == "time":
                moment = moment + abs(size.value(t)) * (abs(point) + self.r_s)
        moment = moment + self.stiffness * abs(q - self.free)
        return moment + abs(self.weight) * (
            self.m * abs(self.arm) + self.r_s * (self.m + self.mass)
        )


class Solution:
    """The motion of a scenario: `events` are (time, mode before, mode after, angle)."""

    def __init__(self, scenario: Table, body: Any = None) -> None:
        self.body = body = Body(scenario) if body is None else body
        self.end = scenario["solver"]["duration"]
        mechanism = scenario["mechanism"]
        self.q = radians(mechanism.get("initial_angle_deg", 0.0))
        self.w = mechanism.get("initial_angular_velocity", 0.0)
        self.t, self.events = 0.0, []
        self.size = 1.0 + abs(self.w)
        self.force = 1e-300  # the largest reaction so far
        knots = {k for size in body.sizes if size.over == "time" for k in size.knots}
        self.stops = sorted({k for k in knots if 0.0 < k < self.end} | {self.end})
        self.fastest = max((size.fastest for size in body.sizes), default=0.0)
        self.angles = [k for size in body.sizes if size.over == "angle" for k in size.knots]
        self.angles += getattr(body, "angles", [])
        self.speeds = [k for size in body.sizes if size.over == "speed" for k in size.knots]
        self.speeds += [s * speed for speed in body.corners for s in (1, -1)]
        mode = int(copysign(1, self.w)) if self.w else self.from_rest()
        if self.w == 0.0 and mode:
            self.events.append((0.0, 0, mode, self.q))
        while self.t < self.end:
            new = self.slide(mode) if mode else self.rest()
            if self.t < self.end and new != mode:
                self.events.append((self.t, mode, new, self.q))
            mode = new

    def from_rest(self) -> int:
        tie = TIE * self.body.scale(self.q, self.t) + 1e-300
        margins = {s: self.body.margin(self.t, self.q, s) for s in (1, -1)}
        return next((s for s in (1, -1) if margins[s] > tie), 0)

    def rest(self) -> int:
        """Rest until the first excess, and return the direction that follows."""
        for stop in self.stops[bisect_right(self.stops, self.t) :]:
            times = [(self.excess(self.t, stop, s), s) for s in (1, -1)]
            at, s = min(times)
            if at < inf:
                self.t = at
                return s
            self.t = stop
        return 0

    def excess(self, a: float, b: float, s: int) -> float:
        """Return the first time in a piece at which the margin exceeds zero, else inf."""
        body, q = self.body, self.q
        t = np.linspace(a, b, int(400 + 60 * self.fastest * (b - a)))
        g = body.margin(t, q, s) + 0.0 * t
        tie = TIE * np.max(body.scale(q, t)) + 1e-300
        last = len(t) - 1
        for i in range(last + 1):
            top, at = g[i], t[i]
            if 0 < i < last and g[i] >= g[i - 1] and g[i] >= g[i + 1] and g[i] <= tie:
                minimum = minimize_scalar(
                    lambda x: -body.margin(float(x), q, s),
                    bounds=(t[i - 1], t[i + 1]), method="bounded", options={"xatol": 1e-12},
                )  # fmt: skip
                if -minimum.fun > top:
                    top, at = -minimum.fun, minimum.x
            if top > tie:
                low, high = (t[i - 1] if i else a), float(at)
                if body.margin(float(low), q, s) > 0.0:
                    return float(low)
                return float(brentq(lambda x: body.margin(x, q, s), low, high, xtol=1e-15))
        return inf

    def slide(self, s: int) -> int:
        """Slide to the next stop or the end, and return the mode that follows."""
        started = abs(self.w) > 0.0
        longest = inf
        while self.t < self.end:
            stop = self.stops[bisect_right(self.stops, self.t)]
            stepper = self.stepper(self.t, [self.q, self.w], stop, s, longest)
            t, y, n = self.t, [self.q, self.w], self.reaction(self.t, self.q, self.w, s)
            while stepper.status == "running":
                stepper.step()
                event = self.first_event(stepper, t, y, n, s, started)
                if event is None and not started and s * stepper.y[1] <= 0.0:
                    longest = 0.1 * (stepper.t - t)  # it has not begun to move within the step
                    if longest < 1e-13:
                        raise RuntimeError("no motion after a breakaway")
                    break
                if event is not None:
                    self.t, (self.q, self.w) = event[1], self.state_at(t, y, event[1], s)
                    if event[0] == "rest":
                        self.w = 0.0
                        return self.from_rest()
                    started = True
                    break
                started, longest = True, inf
                t, y = stepper.t, list(stepper.y)
                n = self.reaction(t, *y, s)
                self.t, (self.q, self.w) = t, y
        return s

    def reaction(self, t: float, q: float, w: float, s: int) -> complex:
        force = self.body.acceleration(t, q, w, s)[1]
        self.force = max(self.force, abs(force))
        return force

    def stepper(self, t: float, y: list[float], stop: float, s: int, longest: float) -> DOP853:
        def rate(t: float, y: Any) -> list[float]:
            q, w = float(y[0]), float(y[1])
            return [w, self.body.acceleration(float(t), q, w, s)[0]]

        return DOP853(rate, t, y, stop, rtol=RTOL, atol=ATOL, max_step=longest)

    def state_at(self, t: float, y: list[float], end: float, s: int) -> tuple[float, float]:
        if end <= t:
            return y[0], y[1]
        stepper = self.stepper(t, y, end, s, inf)
        while stepper.status == "running":
            stepper.step()
        return float(stepper.y[0]), float(stepper.y[1])

    def first_event(
        self, stepper: DOP853, t: float, y: list[float], n: complex, s: int, started: bool
    ) -> tuple[str, float] | None:
        """Return the first event of a step: rest, or where the right-hand side is not smooth."""
        dense = stepper.dense_output()
        x = np.linspace(t, stepper.t, PARTS + 1)
        states = [(float(a), float(b)) for a, b in dense(x).T]
        states[0], states[-1] = (y[0], y[1]), (float(stepper.y[0]), float(stepper.y[1]))

        def toward(t: float, q: float, w: float) -> float:
            return (n.conjugate() * self.reaction(t, q, w, s)).real

        tests: list[tuple[str, Callable[[float, float, float], float]]] = [
            ("rest", lambda t, q, w: s * w),
            *(("kink", lambda t, q, w, k=k: q - k) for k in self.angles),
            *(("kink", lambda t, q, w, k=k: w - k) for k in self.speeds if k),
        ]
        if self.body.r_k and abs(n) > NEAR * self.force:
            tests.append(("kink", lambda t, q, w: toward(t, q, w) / abs(n) / self.force))
        events = []
        for name, test in tests:
            before = test(float(x[0]), *states[0])
            if name == "kink" and abs(before) < NEAR * self.size:
                before = 0.0  # the step begins there
            for i in range(1, PARTS + 1):
                after = test(float(x[i]), *states[i])
                crosses = before > 0.0 >= after or (name == "kink" and before < 0.0 <= after)
                if crosses and x[i] > t:
                    events.append(
                        (self.polished(test, t, y, s, float(x[i - 1]), float(x[i])), name)
                    )
                    break
                before = after if after != 0.0 or name == "rest" else before
        if not events:
            return None
        at, name = min(events)
        return name, at

    def polished(
        self, test: Any, t: float, y: list[float], s: int, low: float, high: float
    ) -> float:
        def value(x: float) -> float:
            return test(x, *self.state_at(t, y, x, s))

        if value(low) * value(high) >= 0.0:
            return high
        return float(brentq(value, low, high, xtol=1e-15, rtol=1e-15))


def solution(scenario: Table, body: Any = None) -> Table:
    """Return events and final state; of another body, if it has what `Solution` takes of one."""
    result = Solution(scenario, body)
    return {"events": [list(event) for event in result.events], "final": [result.q, result.w]}
