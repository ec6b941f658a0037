"""Threlfall's friction curve: dry friction smoothed over a transition speed.

With x = |v|/v_t, the static limit L_s and the kinetic limit L_k

    F = L_s (3 x - x^3)/2                        x <= 1    up to the static limit
    F = L_s + (L_k - L_s) d^2 (3 - 2 d)      1 < x <= 1.5, d = 2 (x - 1), down to the kinetic
    F = L_k                                1.5 < x

as the joints of Adams have it, too [1]_. Without branches, so that the same lines serve one
coordinate as plain Python and the contacts of a belt as compiled vector instructions; compilation
may reorder their sums, which shows in the last bit only.

References
----------
.. [1] D. C. Threlfall, "The inclusion of Coulomb friction in mechanisms programs with particular
   reference to DRAM", Mechanism and Machine Theory 13, 1978, 475-483.
"""

KINETIC_FROM = 1.5  # transition speeds


def friction_curve(x: float, static_limit: float, kinetic_limit: float) -> float:
    """Return the size of the friction at a speed of x transition speeds, in the unit of the limits.

    Parameters
    ----------
    x : float, not negative
    static_limit, kinetic_limit : float
        N m of one coordinate, coefficients of friction of a belt. Above x = 1.5 a static limit of 0
        gives the kinetic one to the bit, below x = 1 the kinetic limit counts for nothing.
    """
    z = x if x < 1.0 else 1.0
    d = 2.0 * (x - 1.0)
    d = 0.0 if d < 0.0 else 1.0 if d > 1.0 else d
    rising = static_limit * (1.5 - 0.5 * z * z) * z
    return rising + (kinetic_limit - static_limit) * d * d * (3.0 - 2.0 * d)


def rising_part(x: float) -> float:
    """Return F/L_s up to x = 1, and 1 beyond."""
    z = x if x < 1.0 else 1.0
    return (1.5 - 0.5 * z * z) * z
