"""The signals that drive pulleys as compiled kernels read them.

All drives are of one type, whatever signals they have, so that kernels are compiled for all of them
at once: each signal is a row, a sum of cubic pieces and a harmonic, of amplitude zero where it has
none. The pieces of all rows stand in one table.
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

# What a signal gives: a torque, N m, over time or over the speed of the pulley; a speed, rad/s.
TORQUE_OVER_TIME, TORQUE_OVER_SPEED, SPEED_OVER_TIME = range(3)


class Signals(NamedTuple):
    """The signals of a drive, one in a row; those of one pulley add.

    Attributes
    ----------
    pulleys, kinds : (rows,)
        The pulley that a signal drives, and TORQUE_OVER_TIME, TORQUE_OVER_SPEED or SPEED_OVER_TIME.
    offsets : (rows + 1,)
        The pieces of row k are offsets[k] to offsets[k + 1] - 1; the first has no lower end.
    pieces : (pieces, 5)
        Knot and c0 to c3 of c0 + c1 (u - knot) + ... over time or speed u, from each knot on.
    harmonics : (rows, 3)
        Amplitude, angular frequency, rad/s, and phase, rad.
    """

    pulleys: "Indices"
    kinds: "Indices"
    offsets: "Indices"
    pieces: "Array"
    harmonics: "Array"


def stack_signals(rows: "Sequence[tuple[int, int, Signal]]") -> Signals:
    """Return the signals of pulleys as one, from the index of a pulley, the kind and the signal."""
    pieces = [signal.pieces() for *_, signal in rows]
    harmonics = [signal.harmonic() or (0.0, 0.0, 0.0) for *_, signal in rows]
    return Signals(
        np.array([pulley for pulley, *_ in rows], dtype=np.int64),
        np.array([kind for _, kind, _ in rows], dtype=np.int64),
        np.cumsum([0, *map(len, pieces)], dtype=np.int64),
        np.array([piece for of_one in pieces for piece in of_one]).reshape(-1, 5),
        np.array(harmonics).reshape(-1, 3),
    )


@inline_kernel
def find_piece(signals: Signals, k: int, u: float) -> tuple[float, float, float, float, float]:
    """Return the piece of signal k at u: knot and coefficients."""
    low, high = signals.offsets[k], signals.offsets[k + 1]
    while high - low > 1:
        middle = (low + high) // 2
        if signals.pieces[middle, 0] <= u:
            low = middle
        else:
            high = middle
    p = signals.pieces[low]
    return p[0], p[1], p[2], p[3], p[4]


@inline_kernel
def value(signals: Signals, k: int, u: float) -> float:
    """Return the value of signal k at u."""
    knot, c0, c1, c2, c3 = find_piece(signals, k, u)
    x = u - knot
    found = c0 + x * (c1 + x * (c2 + x * c3))
    amplitude, frequency, phase = signals.harmonics[k]
    if amplitude != 0.0:
        found += amplitude * np.sin(frequency * u + phase)
    return found


@inline_kernel
def derivative(signals: Signals, k: int, u: float) -> float:
    """Return the derivative of signal k at u."""
    knot, _, c1, c2, c3 = find_piece(signals, k, u)
    x = u - knot
    found = c1 + x * (2.0 * c2 + x * 3.0 * c3)
    amplitude, frequency, phase = signals.harmonics[k]
    if amplitude != 0.0:
        found += amplitude * frequency * np.cos(frequency * u + phase)
    return found
