"""Sine and cosine of a number while a mechanism is stepped, and of an array afterwards."""

import math
from typing import Any


def sin(x: Any) -> Any:
    """Return the sine of a float, or of each element of an array."""
    return math.sin(x) if isinstance(x, float) else _numpy().sin(x)


def cos(x: Any) -> Any:
    """Return the cosine of a float, or of each element of an array."""
    return math.cos(x) if isinstance(x, float) else _numpy().cos(x)


def _numpy() -> Any:
    import numpy  # not where a scenario is only looked at

    return numpy
