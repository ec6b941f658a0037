"""The adaptive Runge-Kutta-Fehlberg method of order 4(5).

The steps of one and of several coordinates, `rkf45.Step`, take the coefficients and write the sums
out for their few states; those of belts have loops over arrays (`belt_drive.rkf45`).
"""

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
