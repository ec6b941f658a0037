"""The signals that drive pulleys as compiled kernels read them.

Every signal is a sum of cubic pieces and, some, of one harmonic. The pieces of all pulleys stand in
one table; harmonics stand in another one, which is there only if a scenario has one.
"""

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.scenario.signals import Signal

    Array = npt.NDArray[np.float64]
    Indices = npt.NDArray[np.int64]


class PiecewiseCubics(NamedTuple):
    """Cubic pieces over time or speed u: c0 + c1 (u - knot) + ... from each knot to the next.

    The pieces of signal j are offsets[j] to offsets[j + 1] - 1; the first one has no lower end.
    `table` is (pieces, 5): knot, c0, c1, c2, c3.
    """

    offsets: "Indices"
    table: "Array"


class TimeTorques(NamedTuple):
    """Torques, N m, on these pulleys over time; `sines` as `stack_harmonics` returns them."""

    pulleys: "Indices"
    pieces: PiecewiseCubics
    sines: "Array | None"


class SpeedTorques(NamedTuple):
    """Torques, N m, on these pulleys over their own speed, rad/s."""

    pulleys: "Indices"
    pieces: PiecewiseCubics


class PrescribedSpeeds(NamedTuple):
    """Speeds, rad/s, that are prescribed for these pulleys over time."""

    pulleys: "Indices"
    pieces: PiecewiseCubics
    sines: "Array | None"


def stack_pieces(signals: "Sequence[Signal]") -> PiecewiseCubics:
    """Put the pieces of several signals into one table."""
    pieces = [signal.pieces() for signal in signals]
    offsets = np.cumsum([0, *map(len, pieces)], dtype=np.int64)
    return PiecewiseCubics(offsets, np.array([piece for of_one in pieces for piece in of_one]))


def stack_harmonics(signals: "Sequence[Signal]") -> "Array | None":
    """Return the harmonics of several signals; None if there is none among them.

    Returns
    -------
    (m, 3) array or None
        Amplitude, angular frequency in rad/s and phase in rad of each; zeros for what has none.
    """
    harmonics = [signal.harmonic() for signal in signals]
    if not any(harmonics):
        return None
    return np.array([harmonic or (0.0, 0.0, 0.0) for harmonic in harmonics])


@inline_kernel
def find_piece(
    pieces: PiecewiseCubics, j: int, u: float
) -> tuple[float, float, float, float, float]:
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
def value(pieces: PiecewiseCubics, j: int, u: float) -> float:
    """Return the value of signal j at u."""
    knot, c0, c1, c2, c3 = find_piece(pieces, j, u)
    x = u - knot
    return c0 + x * (c1 + x * (c2 + x * c3))


@inline_kernel
def derivative(pieces: PiecewiseCubics, j: int, u: float) -> float:
    """Return the derivative of signal j at u."""
    knot, _, c1, c2, c3 = find_piece(pieces, j, u)
    x = u - knot
    return c1 + x * (2.0 * c2 + x * 3.0 * c3)


@inline_kernel
def add_sine(values: "Array", pulleys: "Indices", t: float, sines: "Array | None") -> None:
    """Add the harmonics at time t to the values of these pulleys."""
    if sines is not None:
        for k in range(len(pulleys)):
            values[pulleys[k]] += sines[k, 0] * np.sin(sines[k, 1] * t + sines[k, 2])


@inline_kernel
def add_sine_derivative(
    values: "Array", pulleys: "Indices", t: float, sines: "Array | None"
) -> None:
    """Add the derivatives of the harmonics at time t."""
    if sines is not None:
        for k in range(len(pulleys)):
            values[pulleys[k]] += sines[k, 0] * sines[k, 1] * np.cos(sines[k, 1] * t + sines[k, 2])
