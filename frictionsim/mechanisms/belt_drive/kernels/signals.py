"""The torques and speeds of pulleys as compiled kernels read them.

Every signal but a sine consists of pieces that are polynomials of third degree at most; the
pieces of all pulleys stand in one table. Sines stand in another one, which is there only if a
scenario has one.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel

if TYPE_CHECKING:
    import numpy.typing as npt

    Array = npt.NDArray[np.float64]
    Indices = npt.NDArray[np.int64]


class PiecewiseCubics(NamedTuple):
    """Cubic pieces over time or speed u: c0 + c1 (u - knot) + ... from each knot to the next.

    The pieces of signal j are first[j] to first[j + 1] - 1; the first one has no lower end.
    `table` is (pieces, 5): knot, c0, c1, c2, c3.
    """

    offsets: "Indices"
    table: "Array"


Piece = tuple[float, float, float, float, float]
"""Knot and four coefficients."""


def stack_pieces(signals: Sequence[Sequence[Piece]]) -> PiecewiseCubics:
    """Put the pieces of several signals into one table."""
    offsets = np.cumsum([0, *(len(signal) for signal in signals)], dtype=np.int64)
    return PiecewiseCubics(offsets, np.array([piece for signal in signals for piece in signal]))


def linear_pieces(points: Sequence[float], values: Sequence[float]) -> list[Piece]:
    """Return straight lines from point to point, constant before the first and after the last."""
    pieces = [(points[0], values[0], 0.0, 0.0, 0.0)]
    ends = zip(points, points[1:], values, values[1:], strict=False)
    pieces += [(u0, v0, (v1 - v0) / (u1 - u0), 0.0, 0.0) for u0, u1, v0, v1 in ends]
    pieces.append((points[-1], values[-1], 0.0, 0.0, 0.0))
    return pieces


def pieces_in_time(table: Any) -> list[Piece]:
    """Return the pieces of a signal in time of the scenario; of a sine its mean."""
    if isinstance(table, int | float):
        return [(0.0, float(table), 0.0, 0.0, 0.0)]
    if hasattr(table, "sine"):
        return [(0.0, table.sine.mean, 0.0, 0.0, 0.0)]
    if hasattr(table, "smooth_step"):
        s = table.smooth_step
        rise, width = s.after - s.before, s.stop - s.start
        return [
            (s.start, s.before, 0.0, 0.0, 0.0),
            (s.start, s.before, 0.0, 3.0 * rise / width**2, -2.0 * rise / width**3),
            (s.stop, s.after, 0.0, 0.0, 0.0),
        ]
    return linear_pieces(table.time, table.value)


def sines_of(tables: Sequence[Any]) -> "Array | None":
    """Return the sines of several signals in time; None if there is none among them.

    Returns
    -------
    (m, 3) array or None
        Amplitude, angular frequency in rad/s and phase in rad of each; zeros for what is none.
    """
    if not any(hasattr(table, "sine") for table in tables):
        return None
    sines = np.zeros((len(tables), 3))
    for k, table in enumerate(tables):
        if hasattr(table, "sine"):
            s = table.sine
            sines[k] = s.amplitude, 2.0 * np.pi * s.frequency_hz, np.radians(s.phase_deg)
    return sines


@inline_kernel
def find_piece(pieces, j, u):
    """Return the piece of signal j at u: knot and coefficients."""
    low, high = pieces.offsets[j], pieces.offsets[j + 1]
    while high - low > 1:
        middle = (low + high) // 2
        if pieces.table[middle, 0] <= u:
            low = middle
        else:
            high = middle
    p = pieces.table[low]
    return p[0], p[1], p[2], p[3], p[4]


@inline_kernel
def value(pieces, j, u):
    """Return the value of signal j at u."""
    knot, c0, c1, c2, c3 = find_piece(pieces, j, u)
    x = u - knot
    return c0 + x * (c1 + x * (c2 + x * c3))


@inline_kernel
def derivative(pieces, j, u):
    """Return the derivative of signal j at u."""
    knot, _, c1, c2, c3 = find_piece(pieces, j, u)
    x = u - knot
    return c1 + x * (2.0 * c2 + x * 3.0 * c3)


@inline_kernel
def add_sine(values, targets, t, sines):
    """Add the sines at time t to the values of the pulleys `which`."""
    if sines is not None:
        for k in range(len(targets)):
            values[targets[k]] += sines[k, 0] * np.sin(sines[k, 1] * t + sines[k, 2])


@inline_kernel
def add_sine_derivative(values, targets, t, sines):
    """Add the derivatives of the sines at time t."""
    if sines is not None:
        for k in range(len(targets)):
            values[targets[k]] += sines[k, 0] * sines[k, 1] * np.cos(sines[k, 1] * t + sines[k, 2])
