"""Where explicit Runge-Kutta methods damp undamped waves, and where they make them grow.

Run it as `python -m tests.benchmarks.imaginary_axis`. A wave of the frequency omega is multiplied
by R(i omega h) in a step of the length h. Printed are the values of omega h at which |R| passes 1,
the last one over the number of stages, by how much a wave grows a step at omega h = 0.55 and 1,
the least omega h at which a damped wave grows, and the end of the stable part of the real axis.
"""

import numpy as np
from numpy.typing import NDArray

from frictionsim.solvers import runge_kutta_fehlberg as rkf

Array = NDArray[np.float64]


def stages(*rows: tuple[float, ...]) -> Array:
    """Return the matrix of a method from its rows, the first of which is empty."""
    matrix = np.zeros((len(rows) + 1, len(rows) + 1))
    for i, row in enumerate(rows, start=1):
        matrix[i, : len(row)] = row
    return matrix


FEHLBERG = stages(
    (rkf.A21,),
    (rkf.A31, rkf.A32),
    (rkf.A41, rkf.A42, rkf.A43),
    (rkf.A51, rkf.A52, rkf.A53, rkf.A54),
    (rkf.A61, rkf.A62, rkf.A63, rkf.A64, rkf.A65),
)
DORMAND_PRINCE = stages(
    (1 / 5,),
    (3 / 40, 9 / 40),
    (44 / 45, -56 / 15, 32 / 9),
    (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729),
    (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656),
)
CASH_KARP = stages(
    (1 / 5,),
    (3 / 40, 9 / 40),
    (3 / 10, -9 / 10, 6 / 5),
    (-11 / 54, 5 / 2, -70 / 27, 35 / 27),
    (1631 / 55296, 175 / 512, 575 / 13824, 44275 / 110592, 253 / 4096),
)
CLASSICAL = stages((0.5,), (0, 0.5), (0, 0, 1))
FEHLBERG_5 = np.array([rkf.B1, 0.0, rkf.B3, rkf.B4, rkf.B5, rkf.B6])
DIFFERENCE = np.array([rkf.E1, 0.0, rkf.E3, rkf.E4, rkf.E5, rkf.E6])
METHODS = {
    "Fehlberg, order 5": (FEHLBERG, FEHLBERG_5),
    "Fehlberg, order 4": (FEHLBERG, FEHLBERG_5 - DIFFERENCE),
    **{
        f"Fehlberg, s = {s}": (FEHLBERG, FEHLBERG_5 + s * DIFFERENCE)
        for s in (0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
    },
    "Dormand-Prince, order 5": (
        DORMAND_PRINCE,
        np.array([35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84]),
    ),
    "Cash-Karp, order 5": (CASH_KARP, np.array([37 / 378, 0, 250 / 621, 125 / 594, 0, 512 / 1771])),
    "classical, order 4": (CLASSICAL, np.array([1 / 6, 1 / 3, 1 / 3, 1 / 6])),
}
DAMPING_RATIOS = np.linspace(0.0, 1.0, 41)


def polynomial(matrix: Array, weights: Array) -> Array:
    """Return the coefficients of R(z), the highest power first."""
    power, coefficients = np.ones(len(weights)), [1.0]
    for _ in weights:
        coefficients.append(float(weights @ power))
        power = matrix @ power
    return np.array(coefficients[::-1])


def main() -> None:
    y = np.linspace(1e-3, 6.0, 60001)
    for name, (matrix, weights) in METHODS.items():
        coefficients = polynomial(matrix, weights)
        size = np.abs(np.polyval(coefficients, 1j * y))
        switches = y[np.flatnonzero(np.diff(size <= 1.0 + 1e-12))]
        real = y[np.argmax(np.abs(np.polyval(coefficients, -y)) > 1.0)]
        roots = np.exp(1j * (np.pi / 2 + np.arcsin(DAMPING_RATIOS)))
        damped = np.abs(np.polyval(coefficients, np.outer(y, roots))) > 1.0 + 1e-9
        worst = np.min(np.where(damped.any(axis=0), y[np.argmax(damped, axis=0)], np.inf)[1:])
        print(
            f"{name}: {np.round(switches, 3)}, {switches[-1] / len(weights):.2f} a stage,"
            f" {np.interp(0.55, y, size) - 1.0:+.1e} at 0.55, {np.interp(1.0, y, size) - 1.0:+.1e}"
            f" at 1, damped waves from {worst:.2f}, real axis {real:.2f}"
        )


if __name__ == "__main__":
    main()
