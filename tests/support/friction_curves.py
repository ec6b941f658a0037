"""Kinetic friction over the speed, as scenarios have it, for independent programs."""

from collections.abc import Callable
from typing import Any

import numpy as np


def curve(kinetic: Any, static: float) -> Callable[[float], float]:
    """Return kinetic friction of a speed, that of a number, of points or of Stribeck."""
    if isinstance(kinetic, int | float):
        return lambda speed: float(kinetic)
    if "stribeck" in kinetic:
        (fast,) = (x for key, x in kinetic["stribeck"].items() if key not in ("speed", "exponent"))
        scale, exponent = kinetic["stribeck"]["speed"], kinetic["stribeck"]["exponent"]
        return lambda speed: (
            fast + (static - fast) * float(np.exp(-((abs(speed) / scale) ** exponent)))
        )
    x, y = kinetic["speed"], kinetic["value"]

    def linear(speed: float) -> float:
        v = abs(speed)
        for a, b, at_a, at_b in zip(x[:-1], x[1:], y[:-1], y[1:], strict=True):
            if a <= v < b:
                return at_a + (at_b - at_a) * (v - a) / (b - a)
        return y[0] if v < x[0] else y[-1]

    return linear


def corners(kinetic: Any) -> list[float]:
    """Return speeds at which to begin anew: where the slope jumps, and in the fall of Stribeck."""
    if isinstance(kinetic, int | float):
        return []
    if "stribeck" in kinetic:
        scale, exponent = kinetic["stribeck"]["speed"], kinetic["stribeck"]["exponent"]
        return [scale * x ** (1.0 / exponent) for x in (0.3, 3.0, 30.0)]
    return [x for x in kinetic["speed"] if x]
