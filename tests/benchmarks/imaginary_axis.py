"""Where explicit Runge-Kutta methods damp undamped waves, and where they make them grow.

Run it as `python -m tests.benchmarks.imaginary_axis`. A wave of the frequency omega is multiplied
by R(i omega h) in a step of the length h. Printed are the values of omega h at which |R| passes 1,
the last one over the number of stages, and by how much a wave grows a step at omega h = 0.55.
"""

import numpy as np

from frictionsim.solvers import runge_kutta_fehlberg as rkf


def stages(*rows: tuple[float, ...]) -> "np.ndarray[tuple[int, int], np.dtype[np.float64]]":
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
METHODS = {
    "Fehlberg, order 5": (FEHLBERG, (16 / 135, 0, 6656 / 12825, 28561 / 56430, -9 / 50, 2 / 55)),
    "Fehlberg, order 4": (FEHLBERG, (25 / 216, 0, 1408 / 2565, 2197 / 4104, -1 / 5, 0)),
    "Dormand-Prince, order 5": (
        DORMAND_PRINCE,
        (35 / 384, 0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84),
    ),
    "Cash-Karp, order 5": (CASH_KARP, (37 / 378, 0, 250 / 621, 125 / 594, 0, 512 / 1771)),
    "classical, order 4": (stages((0.5,), (0, 0.5), (0, 0, 1)), (1 / 6, 1 / 3, 1 / 3, 1 / 6)),
}


def main() -> None:
    """Print the table."""
    y = np.linspace(1e-3, 6.0, 60001)
    for name, (matrix, weights) in METHODS.items():
        power, growth = np.ones(len(weights)), np.ones(len(y), dtype=complex)
        for k in range(1, len(weights) + 1):
            growth += (np.array(weights) @ power) * (1j * y) ** k
            power = matrix @ power
        size = np.abs(growth)
        switches = y[np.flatnonzero(np.diff(size <= 1.0 + 1e-12))]
        print(
            f"{name}: {np.round(switches, 3)}, {switches[-1] / len(weights):.2f} a stage,"
            f" {np.interp(0.55, y, size) - 1.0:+.1e} at 0.55"
        )


if __name__ == "__main__":
    main()
