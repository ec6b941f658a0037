"""The adaptive Runge-Kutta-Fehlberg method of order 4(5).

The steps of one and of several coordinates, `rkf45.Step`, take the coefficients and write the sums
out for their few states. The functions below are for the arrays of belts, as kernels: long sums are
split into two loops, because compilers vectorise loops over a few arrays only.
"""

from collections.abc import MutableSequence

State = MutableSequence[float]

# Fehlberg 1969 (NASA TR R-315), table III, formula 2: nodes, stages, order 5, error estimate.
C2, C3, C4, C6 = 1 / 4, 3 / 8, 12 / 13, 1 / 2  # C5 = 1
A21 = 1 / 4
A31, A32 = 3 / 32, 9 / 32
A41, A42, A43 = 1932 / 2197, -7200 / 2197, 7296 / 2197
A51, A52, A53, A54 = 439 / 216, -8.0, 3680 / 513, -845 / 4104
A61, A62, A63, A64, A65 = -8 / 27, 2.0, -3544 / 2565, 1859 / 4104, -11 / 40
B1, B3, B4, B5, B6 = 16 / 135, 6656 / 12825, 28561 / 56430, -9 / 50, 2 / 55
E1, E3, E4, E5, E6 = 1 / 360, -128 / 4275, -2197 / 75240, 1 / 50, 2 / 55  # order 5 - order 4

MIN_TRIAL_STEP = 1e-100  # s, for the estimate of the first step
# Units in the last place of the time: a step that is cut so short is not repeated.
MIN_REPEATED_ULPS = 16.0


def stage_2(h: float, y: State, k1: State, stage: State) -> None:
    """Write the state of the second stage, at t + C2 h; h is the length of the step, s."""
    for i in range(len(y)):
        stage[i] = y[i] + h * (A21 * k1[i])


def stage_3(h: float, y: State, k1: State, k2: State, stage: State) -> None:
    """Write the state of the third stage, at t + C3 h."""
    for i in range(len(y)):
        stage[i] = y[i] + h * (A31 * k1[i] + A32 * k2[i])


def stage_4(h: float, y: State, k1: State, k2: State, k3: State, stage: State) -> None:
    """Write the state of the fourth stage, at t + C4 h."""
    for i in range(len(y)):
        stage[i] = y[i] + h * (A41 * k1[i] + A42 * k2[i] + A43 * k3[i])


def stage_5(h: float, y: State, k1: State, k2: State, k3: State, k4: State, stage: State) -> None:
    """Write the state of the fifth stage, at t + h."""
    for i in range(len(y)):
        stage[i] = y[i] + h * (A51 * k1[i] + A52 * k2[i])
    for i in range(len(y)):
        stage[i] += h * (A53 * k3[i] + A54 * k4[i])


def stage_6(
    h: float, y: State, k1: State, k2: State, k3: State, k4: State, k5: State, stage: State
) -> None:
    """Write the state of the sixth stage, at t + C6 h."""
    for i in range(len(y)):
        stage[i] = y[i] + h * (A61 * k1[i] + A62 * k2[i] + A63 * k3[i])
    for i in range(len(y)):
        stage[i] += h * (A64 * k4[i] + A65 * k5[i])


def error_estimate_5(
    h: float, k1: State, k3: State, k4: State, k5: State, k6: State, error: State
) -> None:
    """Write the difference of the solutions of order 5 and 4."""
    for i in range(len(k1)):
        error[i] = h * (E1 * k1[i] + E3 * k3[i] + E4 * k4[i])
    for i in range(len(k1)):
        error[i] += h * (E5 * k5[i] + E6 * k6[i])
