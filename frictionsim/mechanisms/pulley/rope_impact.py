"""The impact in which a slack rope of a pulley becomes taut.

Tensions are impulsive in it, so is the reaction of the shaft, the sum of both tensions, and with it
the friction of the shaft. The other forces are finite and have no part. Let J be the impulse of the
rope that becomes taut, w the speed of the pulley, positive against the pull of that rope, and d'
the rate of the gap; m is the body on the rope and m' that on the other side. With the impulse J' of
the other rope, while the shaft slides in direction s,

    m dv = dJ,    m' r dw = -dJ',    I dw = (dJ' - dJ) r - s r_k (dJ + dJ')
    dw/dJ = -k,   k = (r + s r_k)/(I + m' r (r - s r_k)),   dJ' = m' r k dJ,   m' = 0 if slack
    d(d')/dJ = 1/m + r k

At w = 0 the shaft locks if r_s >= r, as then r dJ <= r_s dJ; if not, s becomes -1. Where k < 0,
which takes r_k > r and s = -1, J' would be negative: the other rope falls slack, and m' = 0.

All speeds are linear in J, in pieces that end where the shaft stops. The rope takes the work -d' dJ
up while the gap closes, and gives the part e^2 of it back, the energetic restitution [1]_. In an
impact of one piece, d' after is -e d' before (Newton), which is no law for others: together with
friction, it may give more energy than there was.

References
----------
.. [1] W. J. Stronge, Rigid body collisions with friction, Proc. R. Soc. Lond. A 431, 1990.
"""

from math import inf, sqrt
from typing import NamedTuple

from frictionsim.mechanisms.pulley.schema import LiftParameters


class Impact(NamedTuple):
    """The end of an impact.

    Attributes
    ----------
    w : float, rad/s
        Speed of the pulley, positive against the pull of the rope that became taut.
    rate : float, m/s
        Of the gap, d'; exactly zero without restitution.
    other : float, kg
        m'; 0 if that rope was slack, or fell slack in the impact.
    absorbed, heat : float, J
        Work that the rope has taken up; heat of the friction of the shaft.
    """

    w: float
    rate: float
    other: float
    absorbed: float
    heat: float


def shock(
    n: LiftParameters, own: float, other: float, w: float, rate: float, restitution: float
) -> Impact:
    """Return the end of an impact of two masses, kg; `own` is m, and others are as in `Impact`."""
    work = absorbed = heat = 0.0
    left: float | None = None  # of the work, J, which the rope still gives back; None: it closes
    while left is None or left > 0.0:
        r_k, k = 0.0, 0.0
        if w != 0.0 or n.r_s < n.r:  # else it locks
            r_k = n.r_k
            shift = r_k if w > 0.0 else -r_k
            if n.r + shift < 0.0:
                other = 0.0
            k = (n.r + shift) / (n.inertia + other * n.r * (n.r - shift))
        softness = 1.0 / own + n.r * k
        until = 0.0 if left is None else sqrt(rate * rate + 2.0 * softness * left)
        impulse, stop = (until - rate) / softness, w / k if w * k > 0.0 else inf
        is_whole, dJ = impulse < stop, min(impulse, stop)
        w_old, rate_old = w, rate
        w, rate = w - k * dJ if is_whole else 0.0, rate + softness * dJ
        taken = -0.5 * (rate_old + rate) * dJ
        work += taken
        absorbed += max(taken, 0.0)
        heat += r_k * ((1.0 + other * n.r * k) * dJ) * 0.5 * abs(w_old + w)
        if left is not None:
            left = 0.0 if is_whole else left + taken
        elif is_whole or rate >= 0.0:
            rate, left = 0.0, restitution * restitution * work
    return Impact(w, rate, other, absorbed, heat)
