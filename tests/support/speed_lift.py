"""A lift whose frictions of shaft and cord are over the speed: Newton and Euler for each body.

The five unknowns are theta'', x'', both tensions and the friction torque T of the shaft:

    m1 x'' = T1 - m1 g,   -m2 x'' = T2 - m2 g - P,   I theta'' = (T2 - T1) r + tau - b theta' + T

with theta'' = 0 or T = -s r_k (T1 + T2), and x'' = r theta'' or T2 = T1 exp(+-mu_k phi), r_k and
mu_k at the speeds of shaft and cord. DOP853 goes from event to event at 1e-13; of the combinations
that hold after an event it takes the one that holds most contacts, the fewest changed.
"""

from collections.abc import Callable
from itertools import product
from math import exp, hypot, radians
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from tests.support.friction_curves import corners, curve
from tests.support.shaft_reference import Table, size_of

RTOL, ATOL = 1e-13, 1e-15
NEAR = 1e-10  # relative to weights: a limit that is so near is not exceeded
STEPS = 200  # at least, so that no margin is passed over and back


class Lift:
    def __init__(self, data: Table) -> None:
        mechanism, effects, drive = data["mechanism"], data["effects"], data["drive"]
        masses, cord = effects["hanging_masses"], effects.get("cord_friction")
        half = 0.5 * masses.get("rope", 0.0)
        self.m1, self.m2, self.g = masses["car"] + half, masses["counterweight"] + half, masses["g"]
        self.r, self.inertia = mechanism["cord_radius"], mechanism["inertia"]
        self.b = effects.get("viscous_damping", {"coefficient": 0.0})["coefficient"]
        self.force, self.torque = (size_of(drive.get(name, 0.0)) for name in ("force", "torque"))
        journal = effects["shaft_friction"]
        self.thick, mu_s = journal["shaft_radius"], journal["mu_s"]
        self.r_s = self.thick * mu_s / hypot(1.0, mu_s)
        self.mu_k = curve(journal["mu_k"], mu_s)
        self.corners = [[speed / self.thick for speed in corners(journal["mu_k"])]]
        self.contacts, self.wrap = ["shaft"], 0.0
        if cord:
            self.contacts.append("cord")
            self.wrap, self.cord_s = radians(cord["wrap_deg"]), cord["mu_s"]
            self.cord_k = curve(cord["mu_k"], cord["mu_s"])
            self.corners.append(corners(cord["mu_k"]))
        self.size = self.g * (self.m1 + self.m2)

    def slips(self, y: Any) -> list[float]:
        """Return the speeds of shaft and cord, of theta, x and their rates."""
        return [y[2], y[3] - self.r * y[2]][: len(self.contacts)]

    def exactly(self, y: Any, modes: tuple[int, ...]) -> Any:
        """Return a state without the rounding of what holds."""
        theta, x, w, v = y
        w = 0.0 if modes[0] == 0 else w
        return np.array([theta, x, w, v if len(modes) > 1 and modes[1] else self.r * w])

    def solve(self, t: float, y: Any, modes: tuple[int, ...]) -> Any:
        """Return theta'', x'', T1, T2 and T."""
        r, s = self.r, modes[0]
        sigma = modes[1] if len(modes) > 1 else 0
        pull = self.m2 * self.g + self.force.value(t)
        rows = [
            [0.0, self.m1, -1.0, 0.0, 0.0],
            [0.0, -self.m2, 0.0, -1.0, 0.0],
            [self.inertia, 0.0, r, -r, -1.0],
        ]
        right = [-self.m1 * self.g, -pull, self.torque.value(t) - self.b * y[2], 0.0, 0.0]
        mu = self.mu_k(self.thick * y[2])
        r_k = self.thick * mu / hypot(1.0, mu)
        rows.append([0.0, 0.0, s * r_k, s * r_k, 1.0] if s else [1.0, 0.0, 0.0, 0.0, 0.0])
        rows.append([r, -1.0, 0.0, 0.0, 0.0])
        if sigma:
            ratio = exp(sigma * self.cord_k(y[3] - r * y[2]) * self.wrap)
            rows[-1] = [0.0, 0.0, ratio, -1.0, 0.0]
        return np.linalg.solve(np.array(rows), np.array(right))

    def margins(self, t: float, y: Any, modes: tuple[int, ...]) -> list[tuple[float, float]]:
        """Return of each contact that holds what is left forward and backward, in newtons."""
        *_, t1, t2, T = self.solve(t, y, modes)
        limit = self.r_s * (t1 + t2)
        both = [((limit + T) / self.r, (limit - T) / self.r)]
        if len(modes) > 1:
            ratio = exp(self.cord_s * self.wrap)
            both.append((ratio * t1 - t2, ratio * t2 - t1))
        return both

    def rates(self, t: float, y: Any, modes: tuple[int, ...]) -> list[float]:
        a, rise, *_ = self.solve(t, y, modes)
        return [y[2], y[3], a, rise]

    def holds(self, t: float, y: Any, modes: tuple[int, ...], released: dict[int, int]) -> bool:
        """Return whether a combination is one: limits kept, and what begins to slip does so."""
        a, rise, *_ = self.solve(t, y, modes)
        gains = [a, rise - self.r * a]
        for i, (slip, margin) in enumerate(
            zip(self.slips(y), self.margins(t, y, modes), strict=True)
        ):
            if modes[i] == 0 and min(margin) < -NEAR * self.size:
                return False
            if modes[i] and slip == 0.0 and i not in released and not modes[i] * gains[i] > 0.0:
                return False
        return True

    def next_modes(
        self, t: float, y: Any, before: tuple[int, ...], released: dict[int, int]
    ) -> tuple[int, ...]:
        each = []
        for i, slip in enumerate(self.slips(y)):
            each.append([released[i]] if i in released else [0, 1, -1] if slip == 0.0 else [
                1 if slip > 0.0 else -1])  # fmt: skip
        able = [modes for modes in product(*each) if self.holds(t, y, modes, released)]
        return min(
            able,
            key=lambda modes: (
                sum(m != 0 for m in modes),
                sum(a != b for a, b in zip(modes, before, strict=True)),
            ),
        )


def _events(lift: Lift, modes: tuple[int, ...], t: float, y: Any, fresh: set[int]) -> list[Any]:
    """Return what ends a motion: name, function, whether it falls."""
    found: list[tuple[tuple[str, int, int], Callable[[float, Any], float]]] = []
    for i, mode in enumerate(modes):
        if mode == 0:
            for side, way in ((0, 1), (1, -1)):

                def margin(t: float, y: Any, i: int = i, side: int = side) -> float:
                    return lift.margins(t, y, modes)[i][side]

                found.append((("gives way", i, way), margin))
            continue
        if i not in fresh:
            found.append((("rests", i, 0), lambda t, y, i=i, mode=mode: mode * lift.slips(y)[i]))
        for speed in lift.corners[i]:
            if abs(abs(lift.slips(y)[i]) - speed) > 1e-8 * speed:
                found.append(
                    (("corner", i, 0), lambda t, y, i=i, speed=speed: abs(lift.slips(y)[i]) - speed)
                )
    events = []
    for name, function in found:
        function.terminal = True  # type: ignore[attr-defined]
        function.direction = 0.0 if name[0] == "corner" else -1.0  # type: ignore[attr-defined]
        events.append((name, function))
    return events


def _run(lift: Lift, modes: tuple[int, ...], t: float, y: Any, until: float, **more: Any) -> Any:
    return solve_ivp(
        lambda t, y: lift.rates(t, y, modes),
        (t, until),
        y,
        method="DOP853",
        rtol=RTOL,
        atol=ATOL,
        **more,
    )


def polished(lift: Lift, modes: tuple[int, ...], i: int, done: Any) -> tuple[float, Any]:
    """Return time and state at which a contact comes to rest, by steps that end there."""
    begin, y, size = float(done.t[-2]), done.y[:, -2], float(done.t[-1] - done.t[-2])

    def slip(t: float) -> float:
        return modes[i] * lift.slips(_run(lift, modes, begin, y, t).y[:, -1])[i]

    late = begin + size * 1.05
    t = float(brentq(slip, begin + 1e-3 * size, late, xtol=1e-15, rtol=1e-15))
    return t, _run(lift, modes, begin, y, t).y[:, -1]


def solution(data: Table) -> Table:
    """Return the events of shaft and cord, and the last angle, slip and their rates."""
    lift, end = Lift(data), data["solver"]["duration"]
    w = data["mechanism"].get("initial_angular_velocity", 0.0)
    y, t = np.array([0.0, 0.0, w, lift.r * w]), 0.0
    knots = {k for size in (lift.force, lift.torque) for k in size.knots}
    stops = sorted({k for k in knots if 0.0 < k < end} | {end})
    modes = tuple(int(np.sign(slip)) if abs(slip) > NEAR else 0 for slip in lift.slips(y))
    seen, released, fresh = [], dict[int, int](), set[int]()
    refind = True
    while t < end:
        if refind:
            after = lift.next_modes(t, y, modes, released)
            for i, name in enumerate(lift.contacts):
                if after[i] != modes[i]:
                    seen.append((t, name, modes[i], after[i], float(y[0])))
                    fresh |= {i} if after[i] else set()
            modes, released = after, {}
        stop = next(k for k in stops if k > t)
        until = min(stop, t + 1e-5 * end) if fresh else stop
        events = _events(lift, modes, t, y, fresh)
        functions = [function for _, function in events]
        done = _run(lift, modes, t, y, until, max_step=end / STEPS, events=functions)
        t, y, refind = float(done.t[-1]), done.y[:, -1], False
        for (what, i, way), times in zip([n for n, _ in events], done.t_events, strict=True):
            if len(times) and what != "corner":
                refind = True
                if what == "gives way":
                    released[i] = way
                else:
                    t, y = polished(lift, modes, i, done)
                    held = [*modes[:i], 0, *modes[i + 1 :]]
                    y = lift.exactly(y, tuple(held))
        y = lift.exactly(y, modes)
        assert all(modes[i] * lift.slips(y)[i] > 0.0 for i in fresh)
        fresh = set()
    return {"events": seen, "final": [*map(float, y[[0, 2]]), *lift.slips(y)[1:]]}
