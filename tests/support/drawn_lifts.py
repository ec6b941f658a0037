"""Drawn scenarios of a pulley with hanging masses: a family for each regime, from a seed."""

from math import exp, hypot, pi
from typing import Any

import numpy as np

Scenario = dict[str, Any]
G = 9.81


class _Draw:
    """A generator of numbers and signals."""

    def __init__(self, seed: int) -> None:
        self._rng = np.random.default_rng(seed)

    def __call__(self, low: float, high: float) -> float:
        """Return a number between two, with seven digits."""
        return float(f"{self._rng.uniform(low, high):.7g}")

    def size(self, low: float, high: float) -> float:
        """Return a number between two, evenly in its logarithm."""
        return float(f"{np.exp(self._rng.uniform(np.log(low), np.log(high))):.7g}")

    def one_of(self, *choices: Any) -> Any:
        return choices[int(self._rng.integers(len(choices)))]

    def signal(self, form: str, mean: float, size: float, duration: float) -> Any:
        """Return a signal that swings about a mean."""
        if form == "linear":
            count = int(self._rng.integers(3, 6))
            times = np.linspace(0.0, duration, count + 1)
            values = [self(mean - size, mean + size) for _ in times]
            return {"time": [float(f"{t:.6g}") for t in times], "value": [mean, *values[1:]]}
        if form == "sine":
            sine = {
                "mean": mean,
                "amplitude": size,
                "frequency_hz": self(1.0, 2.0) / duration,
                "phase_deg": self.one_of(0.0, 180.0) + self(-20.0, 20.0),
            }
            return {"sine": sine}
        ends = [mean - size, mean + size]
        first = self.one_of(0, 1)
        step = {"from": ends[first], "to": ends[1 - first], "start": 0.1 * duration}
        return {"smooth_step": step | {"stop": self(0.3, 0.8) * duration}}


def base(draw: _Draw, unlike: float = 1.6) -> Scenario:
    """Return masses, pulley and shaft without a drive."""
    r, car = draw.size(0.05, 0.5), draw.size(2.0, 800.0)
    counterweight = car * draw.size(1 / unlike, unlike)
    rope = draw.one_of(0.0, 0.1 * car)
    inertia = (2 * car + rope) * r * r * draw.size(0.03, 10.0)
    mu_s, hung = draw(0.1, 0.4), draw.one_of(0.0, draw(0.0, 0.5) * car)
    data: Scenario = {
        "kind": "pulley",
        "mechanism": {
            "cord_radius": r,
            "inertia": inertia,
            "initial_angle_deg": draw.one_of(0.0, draw(-90.0, 90.0)),
        },
        "drive": {},
        "effects": {
            "hanging_masses": {
                "car": car + hung,
                "counterweight": counterweight,
                "rope": rope,
                "g": G,
            },
            "shaft_friction": {
                "shaft_radius": r * draw(0.1, 0.5),
                "mu_s": mu_s,
                "mu_k": mu_s * draw.one_of(1.0, draw(0.4, 0.95)),
            },
        },
        "solver": {"backend": "events", "duration": 2.0, "rtol": 1e-11, "atol": 1e-13},
        "output": {"interval": 0.25},
    }
    if draw.one_of(True, False):
        data["effects"]["viscous_damping"] = {"coefficient": inertia * draw.size(0.1, 3.0)}
    return data


def numbers(data: Scenario) -> tuple[float, float, float, float]:
    """Return the weights of both sides, N, the cord radius, m, and the static friction radius."""
    masses, mechanism = data["effects"]["hanging_masses"], data["mechanism"]
    shaft, half = data["effects"]["shaft_friction"], masses["rope"] / 2
    first = (masses["car"] + half) * masses["g"]
    second = (masses["counterweight"] + half) * masses["g"]
    r_s = shaft["shaft_radius"] * shaft["mu_s"] / hypot(1.0, shaft["mu_s"])
    return first, second, mechanism["cord_radius"], r_s


def driven(draw: _Draw, data: Scenario, kind: str, form: str, strength: float) -> Scenario:
    """Add a force or torque about the one that balances, in multiples of the limit at rest."""
    first, second, r, r_s = numbers(data)
    limit, duration = r_s * (first + second), data["solver"]["duration"]
    if kind == "torque":
        data["drive"]["torque"] = draw.signal(
            form, (first - second) * r, strength * limit, duration
        )
        return data
    balance = first - second
    if balance < 0.0:  # the counterweight gives way, so that the cord is pulled
        data["effects"]["hanging_masses"]["counterweight"] *= 0.8 * first / second
        first, second, r, r_s = numbers(data)
        balance = first - second
    # P also loads the shaft: |(P - balance) r| = r_s (P + first + second)
    lift = r_s * 2 * first / (r - r_s)
    size = min(strength * lift, 0.999 * balance)
    data["drive"]["force"] = draw.signal(form, balance, size, duration)
    return data


FORMS = ("linear", "sine", "smooth_step")


def taut(seed: int) -> Scenario:
    """Return a scenario with friction on the shaft and a drive that moves it both ways."""
    draw = _Draw(seed)
    return driven(draw, base(draw), ("force", "torque")[seed % 2], FORMS[seed % 3], draw(1.5, 4.0))


def thrown(seed: int) -> Scenario:
    """Return one whose torque accelerates the pulley faster than a body falls: slack on a side."""
    draw = _Draw(seed)
    data = base(draw)
    first, second, r, _ = numbers(data)
    data["effects"]["hanging_masses"]["restitution"] = 0.0 if seed % 2 else draw(0.1, 0.6)
    data["effects"]["hanging_masses"]["capture_speed"] = 0.02
    mass = data["mechanism"]["inertia"] + (first + second) / G * r * r
    size = draw(1.3, 2.5) * mass * G / r
    data["solver"]["duration"] = duration = 1.2
    data["drive"]["torque"] = draw.signal(FORMS[seed % 3], 0.0, size, duration)
    return data


def jammed(seed: int) -> Scenario:
    """Return a thrown one on so thick a shaft that it locks in the shocks of its ropes."""
    draw, data = _Draw(1000 + seed), thrown(seed)
    mechanism, shaft = data["mechanism"], data["effects"]["shaft_friction"]
    shaft["mu_s"] = mu = 0.5
    shaft["mu_k"] = mu * draw.one_of(1.0, 0.9)
    shaft["shaft_radius"] = mechanism["cord_radius"] * draw(1.02, 1.2) * hypot(1.0, mu) / mu
    data["effects"]["hanging_masses"]["restitution"] = draw.one_of(0.0, draw(0.1, 0.6))
    return data


def pushed(seed: int) -> Scenario:
    """Return one whose force passes through zero until the counterweight rises without it."""
    draw = _Draw(seed)
    data = base(draw)
    first, second, *_ = numbers(data)
    data["effects"]["hanging_masses"]["restitution"] = draw.one_of(0.0, draw(0.1, 0.5))
    data["effects"]["hanging_masses"]["capture_speed"] = 0.02
    size = draw(1.2, 2.0) * second
    data["drive"]["force"] = draw.signal(FORMS[seed % 3], first - second, size, 2.0)
    data["solver"]["duration"] = 1.5
    return data


def gripped(seed: int) -> Scenario:
    """Return one with cord friction; the drive takes the cord past its grip, and the shaft too."""
    draw = _Draw(seed)
    data = base(draw, 1.2)
    first, second, r, _ = numbers(data)
    wrap = draw(90.0, 270.0)
    # static grip a little above what rest asks for
    needed = abs(np.log(first / second)) / (wrap * pi / 180.0)
    mu_s = needed + draw(0.03, 0.15)
    data["effects"]["cord_friction"] = {
        "mu_s": mu_s,
        "mu_k": mu_s * draw.one_of(1.0, draw(0.6, 0.95)),
        "wrap_deg": wrap,
    }
    ratio = exp(mu_s * wrap * pi / 180.0)
    transmitted = min(first, second) * (ratio - 1.0) * r
    size = draw(1.2, 3.0) * (transmitted + data["mechanism"]["inertia"] * G / r * draw(0.1, 0.5))
    data["mechanism"]["initial_angular_velocity"] = draw.one_of(0.0, draw(-1.0, 1.0) / r)
    data["drive"]["torque"] = draw.signal(FORMS[seed % 3], (first - second) * r, size, 2.0)
    return data


def massless(seed: int) -> Scenario:
    """Return one without counterweight and rope: the force pulls the bare cord."""
    draw = _Draw(seed)
    data = base(draw)
    data["effects"]["hanging_masses"] |= {"counterweight": 0.0, "rope": 0.0}
    return driven(draw, data, "force", FORMS[seed % 3], draw(1.5, 4.0))


def light(seed: int) -> Scenario:
    """Return one whose pulley has hardly any inertia; bodies and cord decide."""
    data = (taut, thrown, gripped)[seed % 3](seed)
    data["mechanism"]["inertia"] *= 1e-4 if seed % 3 == 0 else 0.03
    return data


def heavy(seed: int) -> Scenario:
    """Return one whose pulley has a thousand times the inertia of the bodies."""
    data = taut(seed)
    data["mechanism"]["inertia"] *= 1e3
    return data


def loose(seed: int) -> Scenario:
    """Return one with so little wrap that shaft and cord reach their limits about together."""
    data = gripped(seed)
    data["effects"]["cord_friction"]["wrap_deg"] = 30.0 + seed % 50
    return data


FAMILIES = {
    family.__name__: family
    for family in (taut, thrown, jammed, pushed, gripped, massless, light, heavy, loose)
}
