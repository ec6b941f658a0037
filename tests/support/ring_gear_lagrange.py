"""Lagrange's equations of a gear in a ring by SymPy; it shares no code with the package.

    python -m tests.support.ring_gear_lagrange      writes tests/data/epicyclic_ring_cases.json

It needs SymPy, which the tests do not: they read what it wrote. Positions are given, and everything
else is derived: the planet turns so that its point at the mesh stands still; kinetic and potential
energy give the motion without friction; the couple of the hinge works on the angle between planet
and crank, that of the mesh, its arm times the load, on the angle of the planet. The load is what
holds the centre of the planet radially, with or without its acceleration.

DOP853 at a relative tolerance of 1e-13 from event to event, with the works as further states.
"""

import json
from collections.abc import Callable
from math import copysign, radians
from pathlib import Path
from typing import Any

import numpy as np
import sympy as sp
from scipy.integrate import solve_ivp

DATA = Path(__file__).parents[1] / "data" / "epicyclic_ring_cases.json"
NAMES = "r1 r2 m_OA m_2 g M_A f"
Functions = dict[str, Callable[..., float]]


def derived(side: int, is_radial: bool) -> Functions:
    """Return functions of (q, v, constants); side is -1 for a planet in a ring, 1 on a sun."""
    t = sp.Symbol("t")
    r1, r2, m_crank, m_planet, g, hinge, arm = constants = sp.symbols(NAMES)
    q = sp.Function("q")(t)
    v = q.diff(t)
    radial = sp.Matrix([sp.cos(q), sp.sin(q)])
    center, contact = (r1 + side * r2) * radial, r1 * radial
    # The velocity of the planet's point at the mesh is that of its centre and of its rotation.
    rate = sp.Symbol("rate")
    lever = contact - center
    still = center.diff(t) + rate * sp.Matrix([-lever[1], lever[0]])
    (planet_rate,) = sp.solve(sp.simplify(still.dot(sp.Matrix([-sp.sin(q), sp.cos(q)]))), rate)
    length = r1 + side * r2
    crank = m_crank * length**2 / 3 * v**2 / 2
    planet = m_planet * center.diff(t).dot(center.diff(t)) / 2
    planet += m_planet * r2**2 / 2 * planet_rate**2 / 2
    potential = g * (m_crank * center[1] / 2 + m_planet * center[1])
    energy = sp.simplify(crank + planet)
    inertia = sp.simplify(sp.diff(sp.diff(energy, v), v))
    rest = sp.diff(sp.diff(energy, v), t) - sp.diff(energy, q) - inertia * v.diff(t)
    assert sp.simplify(rest) == 0
    turns = sp.simplify(planet_rate / v)
    acceleration = center.diff(t, 2) if is_radial else sp.zeros(2, 1)
    load = m_planet * (acceleration + sp.Matrix([0, g])).dot(radial)
    load = sp.simplify(load.subs(v.diff(t), 0))  # that of q'' has no radial part
    expressions = {
        "inertia": inertia,
        "weight": -sp.diff(potential, q),
        "potential": potential,
        "hinge": hinge * sp.Abs(turns - 1),
        "mesh": arm * sp.Abs(turns),
        "load": load,
        "turns": turns,
    }
    x, w = sp.symbols("x w")
    return {
        name: sp.lambdify((x, w, *constants), sp.sympify(e).subs(v, w).subs(q, x), "math")
        for name, e in expressions.items()
    }


class Gear:
    def __init__(self, scenario: dict[str, Any], functions: Functions) -> None:
        gear, effects = scenario["mechanism"], scenario["effects"]
        hinge, rolling = effects["hinge_friction"], effects["rolling_friction"]
        self.constants = [
            *(gear[key] for key in ("sun_radius", "planet_radius", "crank_mass", "planet_mass")),
            effects["gravity"]["g"],
            hinge["torque_kinetic"],
            rolling["arm"],
        ]
        self.static_over_kinetic = hinge["torque_static"] / hinge["torque_kinetic"]
        self.functions = functions
        torque = scenario["drive"]["torque"]
        (_, self.end), (self.first, self.last) = torque["time"], torque["value"]

    def __call__(self, name: str, q: float, v: float) -> float:
        return float(self.functions[name](q, v, *self.constants))

    def drive(self, t: float) -> float:
        return self.first + (self.last - self.first) * min(t / self.end, 1.0)

    def friction(self, q: float, v: float, hinge: float = 1.0) -> float:
        return hinge * self("hinge", q, v) + self("mesh", q, v) * abs(self("load", q, v))

    def limit(self, q: float) -> float:
        """Return the largest friction at rest, of which the load has no acceleration."""
        return self.friction(q, 0.0, self.static_over_kinetic)

    def rates(self, t: float, y: Any, s: int) -> list[float]:
        q, v = y[0], y[1]
        friction = s * self.friction(q, v)
        a = (self.drive(t) + self("weight", q, v) - friction) / self("inertia", q, v)
        return [v, a, self.drive(t) * v, friction * v]

    def leaves(self, t: float, q: float, end: float) -> tuple[float, int]:
        """Return when a gear at rest leaves it up to an end, and its direction; 0 if it stays."""
        limit, weight = self.limit(q), self("weight", q, 0.0)
        begin, stop = self.drive(t) + weight, self.drive(end) + weight
        if abs(begin) > limit * (1.0 + 1e-12):
            return t, int(copysign(1.0, begin))
        if abs(stop) <= limit:
            return end, 0
        s = int(copysign(1.0, stop))
        return t + (end - t) * (s * limit - begin) / (stop - begin), s


def motion(scenario: dict[str, Any], functions: Functions) -> dict[str, Any]:
    gear, duration = Gear(scenario, functions), scenario["solver"]["duration"]
    y = np.array([radians(scenario["mechanism"]["initial_angle_deg"]), 0.0, 0.0, 0.0])
    y[1] = scenario["mechanism"]["initial_angular_velocity"]
    t, events = 0.0, []
    breaks = [at for at in (gear.end, duration) if at <= duration]
    s = int(np.sign(y[1]))
    if s == 0:
        _, s = gear.leaves(0.0, y[0], 0.0)
        if s:  # it cannot hold
            events.append([0.0, 0, s, float(y[0])])
    while t < duration:
        end = next(at for at in breaks if at > t)
        if s == 0:
            t, s = gear.leaves(t, y[0], end)
            if s:
                events.append([t, 0, s, float(y[0])])
            continue

        def stops(t: float, y: Any, s: int) -> float:
            return s * y[1]

        def unloads(t: float, y: Any, s: int) -> float:
            return gear("load", y[0], y[1])

        stops.direction, stops.terminal, unloads.terminal = -1.0, True, True  # type: ignore[attr-defined]
        run = solve_ivp(
            gear.rates, (t, end), y, "DOP853", events=(stops, unloads), args=(s,),
            rtol=1e-13, atol=1e-15, max_step=0.01,
        )  # fmt: skip
        t, y = float(run.t[-1]), run.y[:, -1]
        if run.t_events[0].size:
            y[1] = 0.0
            _, after = gear.leaves(t, y[0], t)
            events.append([t, s, after, float(y[0])])
            s = after
        elif run.t_events[1].size:  # go beyond the kink by a step without events
            beyond = min(t + 1e-9, end)
            step = solve_ivp(gear.rates, (t, beyond), y, "DOP853", args=(s,), rtol=1e-13)
            t, y = beyond, step.y[:, -1]
    return {
        "event_count": len(events),
        "events": events,
        "final": y[:2].tolist(),
        "work": float(y[2]),
        "heat": float(y[3]),
        "turns": gear("turns", 0.0, 0.0),
    }


def drawn(number: int) -> dict[str, Any]:
    """Return a scene: nine in a ring of ten, one on a sun."""
    rng = np.random.default_rng(number)
    ring, end = 0.02 + 0.4 * rng.random(), round(0.2 + 0.6 * rng.random(), 3)
    side = 1 if number % 10 == 9 else -1
    planet, masses = round(ring * rng.uniform(0.1, 0.9), 4), rng.uniform(0.1, 3.0, 2).round(3)
    length = round(ring, 4) + side * planet
    weight = float((0.5 * masses[0] + masses[1]) * 9.81 * length)
    static = round(weight * rng.uniform(0.01, 0.2), 5)
    at_rest = number % 3 == 0
    return {
        "kind": "epicyclic",
        "mechanism": {
            "sun_radius": round(ring, 4),
            "planet_radius": planet,
            "mesh": "external" if side > 0 else "internal",
            "crank_mass": float(masses[0]),
            "planet_mass": float(masses[1]),
            "initial_angle_deg": round(rng.uniform(-180.0, 180.0), 3),
            "initial_angular_velocity": 0.0 if at_rest else round(rng.uniform(-6.0, 6.0), 3),
        },
        "drive": {
            "torque": {
                "time": [0.0, end],
                "value": (weight * rng.uniform(-1.2, 1.2, 2)).round(5).tolist(),
            }
        },
        "effects": {
            "gravity": {"g": 9.81},
            "hinge_friction": {
                "torque_static": static,
                "torque_kinetic": round(static * rng.uniform(0.5, 1.0), 5),
            },
            "rolling_friction": {
                "arm": round(planet * rng.uniform(0.002, 0.05), 6),
                "normal_load": "radial" if number % 2 else "weight",
            },
        },
        "solver": {"duration": 1.0},
    }


if __name__ == "__main__":
    known = {(side, radial): derived(side, radial) for side in (-1, 1) for radial in (False, True)}
    lines = []
    for number in range(100):
        scenario = drawn(number)
        side = 1 if scenario["mechanism"]["mesh"] == "external" else -1
        is_radial = scenario["effects"]["rolling_friction"]["normal_load"] == "radial"
        case = {"scenario": scenario} | motion(scenario, known[side, is_radial])
        lines.append(json.dumps(case, separators=(",", ":")))
        print(number, len(case["events"]), case["final"], flush=True)
    DATA.write_text("[\n" + ",\n".join(lines) + "\n]\n")
