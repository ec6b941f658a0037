"""A pulley of given speed with masses on its cord, in closed form: an independent program.

The angle is the integral of the speed, so that a taut rope has the tension m (g +- r w'), and a
body on a slack one falls freely: the two sides do not depend on each other. A cord that sticks has
both of these tensions; one that slips has T2 = T1 exp(+-mu_k phi), and its acceleration follows
from m1 and m2 alone. What is left are the times of events, roots on a fine grid.
"""

from bisect import bisect_right
from itertools import pairwise
from math import exp, hypot, pi, radians
from typing import Any

import numpy as np
from scipy.optimize import brentq, minimize_scalar

Table = dict[str, Any]
GRID = 300  # places between two knots at which signs are looked at
NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)


class Speed:
    """A sum of signals: its integral, itself and its slope, and the knots of these."""

    def __init__(self, given: Any, end: float) -> None:
        self.terms = given if isinstance(given, list) else [given]
        knots = {0.0, end}
        for term in self.terms:
            if isinstance(term, dict) and "time" in term:
                knots |= {t for t in term["time"] if 0.0 < t < end}
            if isinstance(term, dict) and "smooth_step" in term:
                ends = (term["smooth_step"]["start"], term["smooth_step"]["stop"])
                knots |= {t for t in ends if 0.0 < t < end}
        self.knots = sorted(knots)

    def __call__(self, t: float, inside: float | None = None) -> tuple[float, float, float]:
        """Return angle, speed and its slope; the slope is that of the span of a time inside it."""
        each = [_integrals(term, t, t if inside is None else inside) for term in self.terms]
        return tuple(map(sum, zip(*each, strict=True)))  # type: ignore[return-value]


def _integrals(term: Any, t: float, inside: float) -> tuple[float, float, float]:
    if isinstance(term, int | float):
        return term * t, float(term), 0.0
    if "sine" in term:
        s = term["sine"]
        mean, size, phase = s.get("mean", 0.0), s["amplitude"], radians(s.get("phase_deg", 0.0))
        k = 2.0 * pi * s["frequency_hz"]
        x = k * t + phase
        angle = mean * t + size / k * (np.cos(phase) - np.cos(x))
        return angle, mean + size * np.sin(x), size * k * np.cos(x)
    if "smooth_step" in term:
        s = term["smooth_step"]
        rise, length = s["to"] - s["from"], s["stop"] - s["start"]

        def after(t: float) -> float:
            x = min(max((t - s["start"]) / length, 0.0), 1.0)
            return rise * (length * x**3 * (1.0 - 0.5 * x) + max(t - s["stop"], 0.0))

        x = min(max((t - s["start"]) / length, 0.0), 1.0)
        slope = 6.0 * rise / length * x * (1.0 - x)
        angle = s["from"] * t + after(t) - after(0.0)
        return angle, s["from"] + rise * x * x * (3.0 - 2.0 * x), slope
    times, values = term["time"], term["value"]

    def area(t: float) -> float:
        places = [times[0], *[x for x in times[1:] if x < t], t]
        heights = np.interp(places, times, values)
        return float(np.trapezoid(heights, places)) if t > times[0] else values[0] * (t - times[0])

    i = bisect_right(times, inside)
    slope = 0.0
    if 0 < i < len(times):
        slope = (values[i] - values[i - 1]) / (times[i] - times[i - 1])
    return area(t) - area(0.0), float(np.interp(t, times, values)), slope


class Lift:
    """What a scenario has, and the motion of its bodies."""

    def __init__(self, data: Table) -> None:
        masses, effects = data["effects"]["hanging_masses"], data["effects"]
        half = 0.5 * masses.get("rope", 0.0)
        self.r, self.inertia = data["mechanism"]["cord_radius"], data["mechanism"]["inertia"]
        self.m1, self.m2 = masses["car"] + half, masses["counterweight"] + half
        self.g, self.e = masses.get("g", 9.81), masses.get("restitution", 0.0)
        self.capture = masses.get("capture_speed", 1e-3)
        self.b = effects.get("viscous_damping", {}).get("coefficient", 0.0)
        shaft, cord = effects.get("shaft_friction"), effects.get("cord_friction")
        self.r_k = shaft["shaft_radius"] * shaft["mu_k"] / hypot(1.0, shaft["mu_k"]) if shaft else 0
        self.end = data["solver"]["duration"]
        self.speed = Speed(data["drive"]["speed"], self.end)
        self.heat = self.lost = 0.0
        if cord is None:
            self.events = {"car_rope": self._rope(1.0), "counterweight_rope": self._rope(-1.0)}
        else:
            self.ratios = tuple(exp(cord[mu] * radians(180.0)) for mu in ("mu_s", "mu_k"))
            self.events = {"cord": self._cord()}

    def _spans(self, start: float) -> list[tuple[float, float]]:
        edges = [start, *[t for t in self.speed.knots if t > start]]
        return list(pairwise(edges))

    def _first(self, value: Any, start: float, skip: int = 0) -> float | None:
        """Return the first time after which a number of (t, a time inside its span) is negative."""
        for low, high in self._spans(start):
            # Dense at the start: flights after a bounce are short.
            times = low + (high - low) * np.linspace(0.0, 1.0, GRID) ** 2
            middle = 0.5 * (low + high)
            values = [value(float(t), middle) for t in times]
            if skip == 0 and values[0] < 0.0:
                return low
            for k in range(max(skip, 1), GRID):
                at = float(times[k - 1]), float(times[k])
                if values[k] >= 0.0 and k > 1 and values[k - 2] > values[k - 1] <= values[k]:
                    span = float(times[k - 2]), at[1]  # a minimum between two places
                    least = minimize_scalar(
                        value,
                        bounds=span,
                        args=(middle,),
                        method="bounded",
                        options={"xatol": 1e-9},
                    )
                    if least.fun < 0.0:
                        at = span[0], float(least.x)
                if value(at[1], middle) < 0.0:
                    return float(brentq(value, *at, args=(middle,), xtol=1e-15, rtol=1e-15))
            skip = 0
        return None

    # Ropes.

    def _rope(self, sign: float) -> list[tuple[float, int, int]]:
        """Find the pieces of a side, +1 the car; return time, slack before, after of events."""
        m = self.m1 if sign > 0.0 else self.m2
        pieces, events, t = [], [], 0.0

        def tension(t: float, inside: float) -> float:
            return m * (self.g + sign * self.r * self.speed(t, inside)[2])

        def rim(t: float) -> tuple[float, float]:
            angle, w, _ = self.speed(t)
            return sign * self.r * angle, sign * self.r * w

        x, v, slack = *rim(0.0), False
        while t < self.end:
            if not slack:
                until = self._first(tension, t)
                pieces.append((t, self.end if until is None else until, None))
                if until is None:
                    break
                events.append((until, 0, 1))
                t, slack, (x, v) = until, True, rim(until)
                continue

            def gap(s: float, _: float, t: float = t, x: float = x, v: float = v) -> float:
                # Some roundoffs more, so that the gap of 0 at the start is none.
                return x + v * (s - t) - 0.5 * self.g * (s - t) ** 2 - rim(s)[0] + 1e-14

            until = self._first(gap, t, skip=5)
            pieces.append((t, self.end if until is None else until, (t, x, v)))
            if until is None:
                break
            x, _ = rim(until)
            closing = rim(until)[1] - (v - self.g * (until - t))
            e = self.e if closing >= self.capture else 0.0
            impulse = m * (1.0 + e) * closing
            self.heat += self.r_k * impulse * abs(self.speed(until)[1])
            self.lost += 0.5 * (1.0 - e * e) * m * closing**2
            t, v = until, rim(until)[1] + e * closing
            inside = next(0.5 * (a + b) for a, b in self._spans(t))
            slack = e > 0.0 or tension(t, inside) < 0.0
            events.append((until, 1, int(slack)))
        setattr(self, "car" if sign > 0.0 else "other", pieces)
        return events

    # A cord.

    def _cord(self) -> list[tuple[float, int, int]]:
        static, kinetic = self.ratios
        m1, m2, g, r = self.m1, self.m2, self.g, self.r
        pieces, events, t, mode, x, v = [], [], 0.0, 0, 0.0, r * self.speed(0.0)[1]

        def sticking(t: float, inside: float) -> tuple[float, float]:
            rim = r * self.speed(t, inside)[2]
            return m1 * (g + rim), m2 * (g - rim)

        def slipping(sigma: int) -> tuple[float, float]:
            ratio = kinetic**sigma
            t1 = 2.0 * m1 * m2 * g / (m2 + ratio * m1)
            return t1, ratio * t1

        def excess(t: float, inside: float) -> float:
            t1, t2 = sticking(t, inside)
            return min(static * t1 - t2, static * t2 - t1)

        while t < self.end:
            if mode == 0:
                until = self._first(excess, t)
                pieces.append((t, self.end if until is None else until, 0, x, v))
                if until is None:
                    break
                inside = next(0.5 * (a + b) for a, b in self._spans(until))
                t1, t2 = sticking(until, inside)
                mode = 1 if t2 > t1 else -1
                events.append((until, 0, mode))
            else:
                rise = slipping(mode)[0] / m1 - g

                def slip(s: float, _: float, t=t, v=v, rise=rise, mode=mode) -> float:  # type: ignore[no-untyped-def]
                    return mode * (v + rise * (s - t) - r * self.speed(s)[1])

                until = self._first(slip, t, skip=2)
                pieces.append((t, self.end if until is None else until, mode, x, v))
                if until is None:
                    break
                before, inside = mode, next(0.5 * (a + b) for a, b in self._spans(until))
                t1, t2 = sticking(until, inside)
                mode = 0 if excess(until, inside) >= 0.0 else 1 if t2 > t1 else -1
                events.append((until, before, mode))
                x, v = x + v * (until - t) + 0.5 * rise * (until - t) ** 2, v + rise * (until - t)
                t = until
                continue
            x, v, t = (
                x + r * (self.speed(until)[0] - self.speed(t)[0]),
                r * self.speed(until)[1],
                until,
            )
        self.car = pieces
        self._sticking, self._slipping = sticking, slipping
        return events

    # Numbers at a time.

    def tensions(self, t: float) -> tuple[float, float]:
        if "cord" in self.events:
            mode = next(p[2] for p in reversed(self.car) if t >= p[0])
            return self._slipping(mode) if mode else self._sticking(t, t)
        sides = []
        for pieces, sign, m in ((self.car, 1.0, self.m1), (self.other, -1.0, self.m2)):
            free = next(p[2] for p in reversed(pieces) if t >= p[0])
            sides.append(0.0 if free else m * (self.g + sign * self.r * self.speed(t)[2]))
        return sides[0], sides[1]

    def car_at(self, t: float) -> tuple[float, float]:
        """Return height and velocity of the car."""
        piece = next(p for p in reversed(self.car) if t >= p[0])
        angle, w, _ = self.speed(t)
        if "cord" in self.events:
            start, _, mode, x, v = piece
            if mode == 0:
                return x + self.r * (angle - self.speed(start)[0]), self.r * w
            rise, s = self._slipping(mode)[0] / self.m1 - self.g, t - start
            return x + v * s + 0.5 * rise * s * s, v + rise * s
        if piece[2] is None:
            return self.r * angle, self.r * w
        start, x, v = piece[2]
        return x + v * (t - start) - 0.5 * self.g * (t - start) ** 2, v - self.g * (t - start)

    def drive_torque(self, t: float) -> float:
        _, w, a = self.speed(t)
        t1, t2 = self.tensions(t)
        friction = self.r_k * (t1 + t2) * np.sign(w)
        return float(self.inertia * a - (t2 - t1) * self.r + self.b * w + friction)

    def works(self) -> tuple[float, float]:
        """Return the heat of the shaft's friction, and what the drive did but for impacts."""
        times = {t for each in self.events.values() for t, *_ in each} | set(self.speed.knots)
        turns = []
        for low, high in pairwise(self.speed.knots):
            grid = np.linspace(low, high, GRID)
            w = [self.speed(float(t))[1] for t in grid]
            turns += [
                float(brentq(lambda t: self.speed(t)[1], grid[i], grid[i + 1], xtol=1e-15))
                for i in range(GRID - 1)
                if w[i] * w[i + 1] < 0.0
            ]
        edges = sorted(times | set(turns))
        heat = work = 0.0
        for low, high in pairwise(edges):
            for a, b in zip(*(np.linspace(low, high, 13)[k : 12 + k] for k in (0, 1)), strict=True):
                for node, weight in zip(NODES, WEIGHTS, strict=True):
                    t = float(0.5 * (a + b) + 0.5 * (b - a) * node)
                    w, share = self.speed(t)[1], 0.5 * (b - a) * weight
                    heat += share * self.r_k * sum(self.tensions(t)) * abs(w)
                    work += share * self.drive_torque(t) * w
        return heat, work
