"""The pulley with hanging masses by DOP853 at rtol 1e-13: a third way, for any signal.

Newton and Euler for pulley, car and counterweight are one linear system of six equations, which
numpy solves for the accelerations, the tensions and the friction torque of one combination of
modes. What holds after an event is found by trying: the margins a hundredth of a microsecond later.
It shares with `lift_reference` only the parameters; its numbers are those of double precision.
"""

from collections.abc import Callable
from itertools import product
from math import pi, sin
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from tests.support.lift_reference import Lift

LATER = 1e-8  # s
TOLERANCE = 1e-9  # N, N m, m/s^2: rounding of a margin just after an event


class Modes(NamedTuple):
    """Modes of shaft and cord, and which sides are slack."""

    shaft: int
    cord: int
    slack: tuple[bool, bool]


def value(signal: Any) -> Callable[[float], float]:
    """Return a signal of a scenario as a function of time."""
    if isinstance(signal, (int, float)):
        return lambda t: float(signal)
    if "time" in signal:
        return lambda t: float(np.interp(t, signal["time"], signal["value"]))
    if "sine" in signal:
        s = signal["sine"]
        phase = s.get("phase_deg", 0.0) * pi / 180.0
        return lambda t: (
            s.get("mean", 0.0) + s["amplitude"] * sin(2 * pi * s["frequency_hz"] * t + phase)
        )
    s = signal["smooth_step"]

    def smooth(t: float) -> float:
        x = min(max((t - s["start"]) / (s["stop"] - s["start"]), 0.0), 1.0)
        return float(s["from"] + (s["to"] - s["from"]) * x * x * (3 - 2 * x))

    return smooth


def knots(signal: Any) -> list[float]:
    if not isinstance(signal, dict) or "sine" in signal:
        return []
    step = signal.get("smooth_step")
    return [step["start"], step["stop"]] if step else list(signal["time"])


class Integration:
    """One run; `events` are (time, contact, mode before, mode after, angle)."""

    def __init__(self, data: dict[str, Any]) -> None:
        self.lift = Lift.of(data)
        self.p = {
            name: float(x) for name, x in vars(self.lift).items() if name not in ("force", "torque")
        }
        self.force, self.torque = value(self.lift.force), value(self.lift.torque)
        self.knots = sorted({*knots(self.lift.force), *knots(self.lift.torque), self.p["end"]})
        w = data["mechanism"].get("initial_angular_velocity", 0.0)
        self.y = np.array([0.0, w, 0.0, self.p["r"] * w, 0.0, -self.p["r"] * w])
        self.events: list[tuple[float, str, int, int, float]] = []

    def solve_modes(self, t: float, y: Any, modes: Modes) -> Any:
        """Return alpha, x1'', x2'', T1, T2 and the friction torque."""
        p, r = self.p, self.p["r"]
        force, torque = self.force(t), self.torque(t)
        a, c = np.zeros((6, 6)), np.zeros(6)
        a[0, :] = p["inertia"], 0, 0, r, -r, -1
        c[0] = torque - p["b"] * y[1]
        a[1, 1], a[1, 3], c[1] = p["m1"], -1, -p["m1"] * p["g"]
        a[2, 2], a[2, 4], c[2] = p["m2"], -1, -p["m2"] * p["g"] - force
        if modes.shaft == 0:
            a[3, 0] = 1
        else:
            a[3, 3:] = modes.shaft * p["r_k"], modes.shaft * p["r_k"], 1
        if modes.cord:
            a[4, 1:3] = 1, 1
            a[5, 3:5] = p["kinetic_ratio"] ** modes.cord, -1
        else:
            for row, slack, sign in ((4, modes.slack[0], -1), (5, modes.slack[1], 1)):
                if slack:
                    a[row, row - 1] = 1
                else:
                    a[row, 0], a[row, row - 3] = sign * r, 1
        return np.linalg.solve(a, c)

    def margins(self, t: float, y: Any, modes: Modes) -> dict[str, float]:
        p, r = self.p, self.p["r"]
        z = self.solve_modes(t, y, modes)
        t1, t2 = z[3], z[4]
        found = {}
        if modes.shaft == 0:
            moment, limit = (t2 - t1) * r + self.torque(t), p["r_s"] * (t1 + t2)
            found |= {"shaft+": limit - moment, "shaft-": limit + moment}
        else:
            found["stop"] = modes.shaft * y[1]
        if p["static_ratio"] == 0.0:
            found["side1"] = y[2] - r * y[0] if modes.slack[0] else t1
            found["side2"] = y[4] + r * y[0] if modes.slack[1] else t2
        elif modes.cord == 0:
            found |= {"cord+": p["static_ratio"] * t1 - t2, "cord-": p["static_ratio"] * t2 - t1}
        else:
            found["grip"] = modes.cord * (y[3] - r * y[1])
        return found

    def possible(self, t: float, modes: Modes, open_side: tuple[bool, bool]) -> bool:
        """Return whether a combination holds a moment later; contacts at rest by acceleration."""
        r, z = self.p["r"], self.solve_modes(t, self.y, modes)
        v = self.y[1::2] + LATER * z[:3]
        x = self.y[0::2] + LATER * (self.y[1::2] + v) / 2
        y = np.ravel(np.column_stack([x, v]))
        z, found = self.solve_modes(t + LATER, y, modes), self.margins(t + LATER, y, modes)
        if "stop" in found and self.y[1] == 0.0:
            found["stop"] = modes.shaft * z[0] - 2 * TOLERANCE
        if "grip" in found and abs(self.y[3] - r * self.y[1]) < 1e-12:
            found["grip"] = modes.cord * (z[1] - r * z[0]) - 2 * TOLERANCE
        for i, sign in ((0, -1), (1, 1)):
            if modes.slack[i]:
                found[f"side{i + 1}"] = 1.0 if open_side[i] else z[i + 1] + sign * r * z[0]
        return all(margin >= -TOLERANCE for margin in found.values())

    def choose(self, t: float) -> Modes:
        r, y = self.p["r"], self.y
        shafts = (0, 1, -1) if y[1] == 0.0 else (1 if y[1] > 0 else -1,)
        slip = y[3] - r * y[1]
        cords: tuple[int, ...] = (0,)
        sides = [(False, False)]
        open_side = (False, False)
        if self.p["static_ratio"]:
            cords = (0, 1, -1) if abs(slip) < 1e-12 else (1 if slip > 0 else -1,)
        else:
            gaps = (y[2] - r * y[0], y[4] + r * y[0])
            rates = (slip, y[5] + r * y[1])
            open_side = (gaps[0] > 1e-9 or rates[0] > 1e-9, gaps[1] > 1e-9 or rates[1] > 1e-9)
            ends = ([True] if o else [False, True] for o in open_side)
            sides = [s for s in product(*ends) if not (s[1] and self.p["m2"] == 0.0)]
        able = [
            modes
            for modes in map(Modes, *zip(*product(shafts, cords, sides), strict=True))
            if self.possible(t, modes, open_side)
        ]
        return min(able, key=lambda m: (m.shaft != 0) + (m.cord != 0) + sum(m.slack))

    def run(self) -> "Integration":
        t = 0.0
        modes = self.choose(t)
        self._record(t, Modes(int(np.sign(self.y[1])), 0, (False, False)), modes)
        while t < self.p["end"]:
            end = next(k for k in self.knots if k > t)
            names = list(self.margins(t, self.y, modes))
            functions = [self._event(name, modes) for name in names]
            done = solve_ivp(
                lambda t, y, m=modes: np.ravel(np.column_stack([y[1::2], self._slope(t, y, m)])),
                (t, end),
                self.y,
                method="DOP853",
                rtol=1e-13,
                atol=1e-14,
                events=functions,
                max_step=self.p["end"] / 100.0,
                first_step=self._first_step(t, end, modes),
            )
            t, self.y = float(done.t[-1]), done.y[:, -1].copy()
            self._clear_rounding(modes)
            for name, times in zip(names, done.t_events, strict=True):
                if len(times):
                    self._settle(name, modes)
                    before, modes = modes, self.choose(t)
                    self._record(t, before, modes)
        return self

    def _first_step(self, t: float, end: float, modes: Modes) -> float | None:
        """Return a step shorter than the flight of a body that has just bounced, s."""
        y, r, z = self.y, self.p["r"], self.solve_modes(t, self.y, modes)
        rates = (y[3] - r * y[1], y[5] + r * y[1])
        pulls = (r * z[0] - z[1], -r * z[0] - z[2])
        flights = [
            0.1 * rate / pull
            for slack, rate, pull in zip(modes.slack, rates, pulls, strict=True)
            if slack and rate > 1e-9 and pull > 0.0
        ]
        return min([*flights, end - t]) if flights else None

    def _clear_rounding(self, modes: Modes) -> None:
        y, r = self.y, self.p["r"]
        if modes.shaft == 0:
            y[1] = 0.0
        for i, sign in ((0, 1.0), (1, -1.0)):
            if modes.cord == 0 and not modes.slack[i]:
                y[3 + 2 * i] = sign * r * y[1]

    def _slope(self, t: float, y: Any, modes: Modes) -> Any:
        return self.solve_modes(t, y, modes)[:3]

    def _event(self, name: str, modes: Modes) -> Callable[[float, Any], float]:
        def function(t: float, y: Any) -> float:
            return self.margins(t, y, modes)[name]

        function.terminal, function.direction = True, -1.0  # type: ignore[attr-defined]
        return function

    def _settle(self, name: str, modes: Modes) -> None:
        """Set what is zero at an event to zero, and apply the law of impact."""
        p, y, r = self.p, self.y, self.p["r"]
        if name == "stop":
            self._clear_rounding(modes._replace(shaft=0))
        if name == "grip":
            y[3], y[5] = r * y[1], -r * y[1]
        if name.startswith("side") and modes.slack[int(name[-1]) - 1]:
            i = int(name[-1]) - 1
            sign = 1.0 - 2.0 * i
            y[2 + 2 * i] = sign * r * y[0]
            rate = y[3 + 2 * i] - sign * r * y[1]
            e = p["e"] if -rate >= p["capture"] else 0.0
            y[1::2], other_slack = Impact(p, i, modes.slack[1 - i]).run(y[1::2], e)
            if e == 0.0:
                y[3 + 2 * i] = sign * r * y[1]
            if not other_slack:
                y[5 - 2 * i] = -sign * r * y[1]

    def _record(self, t: float, before: Modes, after: Modes) -> None:
        pairs = (
            ("shaft", before.shaft, after.shaft),
            ("cord", before.cord, after.cord),
            ("car rope", int(before.slack[0]), int(after.slack[0])),
            ("counterweight rope", int(before.slack[1]), int(after.slack[1])),
        )
        for contact, old, new in pairs:
            if old != new:
                self.events.append((t, contact, old, new, float(self.y[0])))


class Impact:
    """The impact of a rope: Newton, Euler and Coulomb for each body, integrated over its impulse.

    The state is w, v1, v2 and the work that the rope holds.
    """

    def __init__(self, p: dict[str, float], side: int, other_slack: bool) -> None:
        self.p, self.side, self.slack = p, side, other_slack
        self.row = np.zeros(3)  # of the rate of the gap
        self.row[0], self.row[1 + side] = -p["r"] * (1 - 2 * side), 1.0

    def changes(self, w: float) -> Any:
        """Return the changes of w, v1, v2 per impulse, and the other rope's impulse."""
        p, r, near, far = self.p, self.p["r"], 1 + self.side, 2 - self.side
        a, c = np.zeros((5, 5)), np.zeros(5)  # w, v1, v2, the other rope, friction torque
        sign = 1 - 2 * self.side
        # I dw = sign r (dK - 1) + dT: the car's rope turns the pulley backward
        a[0, 0], a[0, 3], a[0, 4], c[0] = p["inertia"], -sign * r, -1.0, -sign * r
        a[1, near], c[1] = p[f"m{near}"], 1.0
        a[2, far], a[2, 3] = p[f"m{far}"] or 1.0, -1.0
        if self.slack or p[f"m{far}"] == 0.0:
            a[3, 3] = 1.0
        else:
            a[3, 0], a[3, far] = -sign * r, -1.0
        if w == 0.0 and p["r_s"] >= r:
            a[4, 0] = 1.0
        else:
            s = np.sign(w) if w else -sign
            a[4, 3], a[4, 4], c[4] = s * p["r_k"], 1.0, -s * p["r_k"]
        found = np.linalg.solve(a, c)[:4]
        return found * (np.abs(found) > 1e-13 * np.max(np.abs(found)))  # at rest is exactly zero

    def run(self, v: Any, e: float) -> tuple[Any, bool]:
        """Return w, v1, v2 after the impact, and whether the other rope is slack."""
        y, goal = np.array([*v, 0.0]), 0.0
        unit = self.p[f"m{1 + self.side}"] * abs(float(self.row @ v))
        for phase in ("closing", "opening"):
            if phase == "opening":
                goal = (1.0 - e * e) * y[3]
                if e == 0.0:
                    break
            while True:
                y, name = self._piece(y, unit, phase, goal)
                if name == phase:
                    break
        return y[:3], self.slack

    def _piece(self, y: Any, unit: float, phase: str, goal: float) -> tuple[Any, str]:
        slopes = self.changes(y[0])
        if slopes[3] < 0.0 and not self.slack:
            self.slack = True
            slopes = self.changes(y[0])

        def slope(x: float, y: Any) -> Any:
            return unit * np.append(slopes[:3], -self.row @ y[:3])

        def stop(x: float, y: Any) -> float:
            return float(y[0])

        def done(x: float, y: Any) -> float:
            return float(self.row @ y[:3]) if phase == "closing" else float(y[3] - goal)

        stop.direction = float(-np.sign(y[0])) or 2.0  # type: ignore[attr-defined]
        done.direction = 1.0 if phase == "closing" else -1.0  # type: ignore[attr-defined]
        stop.terminal = done.terminal = True  # type: ignore[attr-defined]
        events = [done, stop] if y[0] else [done]
        solver = {"method": "DOP853", "rtol": 1e-13, "atol": 1e-15}
        found = solve_ivp(slope, (0.0, 1e6), y, events=events, **solver)
        y = found.y[:, -1].copy()
        if len(found.t_events[0]):
            return y, phase
        y[0] = 0.0
        return y, "stop"
