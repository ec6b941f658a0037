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

All speeds are linear in J, in two pieces at most. The rope takes the work -d' dJ up while the gap
closes, and gives the part e^2 of it back, the energetic restitution [1]_. In an impact of one
piece, d' after is -e d' before (Newton), which is no law for others: together with friction, it may
give more energy than there was.

References
----------
.. [1] W. J. Stronge, Rigid body collisions with friction, Proc. R. Soc. Lond. A 431, 1990.
"""

from math import inf, sqrt

from frictionsim.mechanisms.pulley.schema import LiftParameters


class Impact:
    """An impact under way.

    Attributes
    ----------
    w : float, rad/s
        Speed of the pulley, positive against the pull of the rope that becomes taut.
    rate : float, m/s
        Of the gap, d'.
    other : float, kg
        m'; 0 if that rope is slack, or falls slack in the impact.
    work, absorbed, heat : float, J
        Work that the rope holds, and has taken up; heat of the friction of the shaft.
    softness : float, 1/kg
        d(d')/dJ up to the next stop of the shaft.
    """

    def __init__(self, n: LiftParameters, own: float, other: float, w: float, rate: float) -> None:
        self._n, self._own, self.other, self.w, self.rate = n, own, other, w, rate
        self.work = self.absorbed = self.heat = 0.0
        self._begin_piece()

    def _begin_piece(self) -> None:
        """Find how an impulse changes the speeds, and that at which the shaft stops."""
        n, w = self._n, self.w
        self._r_k, self._k = n.r_k, 0.0
        if w == 0.0 and n.r_s >= n.r:
            self._r_k = 0.0  # it locks
        else:
            shift = n.r_k if w > 0.0 else -n.r_k
            if n.r + shift < 0.0:
                self.other = 0.0
            self._k = (n.r + shift) / (n.inertia + self.other * n.r * (n.r - shift))
        self.softness = 1.0 / self._own + n.r * self._k
        self._stop = w / self._k if w * self._k > 0.0 else inf

    def pull(self, impulse: float) -> bool:
        """Apply an impulse, N s, up to the stop of the shaft; return whether it is the whole."""
        k, w_old, rate_old, is_whole = self._k, self.w, self.rate, impulse < self._stop
        dJ = min(impulse, self._stop)
        self.w = w_old - k * dJ if is_whole else 0.0
        self.rate = rate_old + self.softness * dJ
        work = -0.5 * (rate_old + self.rate) * dJ
        self.work += work
        self.absorbed += max(work, 0.0)
        reaction = (1.0 + self.other * self._n.r * k) * dJ
        self.heat += self._r_k * reaction * 0.5 * abs(w_old + self.w)
        self._begin_piece()
        return is_whole


def shock(
    n: LiftParameters, own: float, other: float, w: float, rate: float, restitution: float
) -> Impact:
    """Return the end of an impact; the rate of the gap is exactly zero without restitution.

    Parameters
    ----------
    n : LiftParameters
    own, other : float, kg
        Masses on the rope that becomes taut, and on the other, zero if that is slack.
    w, rate, restitution : float
        As of `Impact`, before it.
    """
    impact = Impact(n, own, other, w, rate)
    while impact.rate < 0.0 and not impact.pull(-impact.rate / impact.softness):
        pass
    impact.rate = 0.0
    left = restitution * restitution * impact.work
    while left > 0.0:
        before, softness = impact.work, impact.softness
        until = sqrt(impact.rate * impact.rate + 2.0 * softness * left)
        if impact.pull((until - impact.rate) / softness):
            break
        left -= before - impact.work
    return impact
