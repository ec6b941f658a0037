"""Sine and cosine of a float, in a step, or of an array, in post-processing."""

import math
from typing import Any


def sin(x: Any) -> Any:
    """Return the sine of a float, or of each element of an array."""
    return math.sin(x) if isinstance(x, float) else _numpy().sin(x)


def cos(x: Any) -> Any:
    """Return the cosine of a float, or of each element of an array."""
    return math.cos(x) if isinstance(x, float) else _numpy().cos(x)


def _numpy() -> Any:
    import numpy  # imported here because `check` does not need it

    return numpy
