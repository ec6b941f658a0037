"""The impact that takes up a slack rope over a pulley on a dry shaft.

Tensions are impulsive in it, so is the reaction of the shaft, the sum of both tensions, and with
it the friction of the shaft. The other forces are finite and have no part. Let J be the impulse of
the rope that is taken up, w the speed of the pulley, positive against the pull of that rope, and
d' the rate of the gap; m is the body on the rope and m' that on the other side. With the impulse
J' of the other rope, while the shaft slides in direction s,

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
from typing import NamedTuple

from frictionsim.mechanisms.pulley.schema import LiftParameters


class Shock(NamedTuple):
    """The state after an impact, and the energy lost.

    Attributes
    ----------
    w : float, rad/s
    rate : float, m/s
        Of the gap; exactly zero without restitution.
    other_slackens : bool
        The rope of the other side, taut before, does not pull in the impact: its body flies on.
    rope_loss, heat : float, J
        What is lost in the rope and by the friction of the shaft.
    """

    w: float
    rate: float
    other_slackens: bool
    rope_loss: float
    heat: float


def shock(
    n: LiftParameters, masses: tuple[float, float], w: float, rate: float, restitution: float
) -> Shock:
    """Return what an impact leaves.

    Parameters
    ----------
    n : LiftParameters
    masses : (float, float), kg
        On the rope that is taken up, and on the other, zero if that is slack.
    w : float, rad/s
        Speed of the pulley, positive against the pull of the rope that is taken up.
    rate : float, m/s
        Of the gap, negative.
    restitution : float
    """
    impact = _Impact(n, masses, w, rate)
    while impact.rate < 0.0 and not impact.pull(-impact.rate / impact.softness):
        pass
    impact.rate = 0.0
    given_back = restitution * restitution * impact.work
    while given_back > 0.0:
        softness, rate = impact.softness, impact.rate
        until = sqrt(rate * rate + 2.0 * softness * given_back)
        before = impact.work
        if impact.pull((until - rate) / softness):
            break
        given_back -= before - impact.work
    rope_loss = (1.0 - restitution * restitution) * impact.taken_up
    return Shock(impact.w, impact.rate, impact.other_slackens, rope_loss, impact.heat)


class _Impact:
    """An impact under way: speeds and works, advanced piece by piece."""

    def __init__(
        self, n: LiftParameters, masses: tuple[float, float], w: float, rate: float
    ) -> None:
        self._n = n
        self._own, self._other = masses
        self.w, self.rate = w, rate
        self.work = self.taken_up = self.heat = 0.0  # work that the rope holds, and has taken up
        self.other_slackens = False
        self._begin_piece()

    def _begin_piece(self) -> None:
        """Set how the speeds depend on the impulse, from here to the next stop of the shaft."""
        n = self._n
        self._slowing = self._friction = 0.0
        if self.w != 0.0 or n.r_s < n.r:
            shift = n.r_k if self.w > 0.0 else -n.r_k
            self._slowing = (n.r + shift) / (n.inertia + self._other * n.r * (n.r - shift))
            if self._slowing < 0.0:
                self.other_slackens = self._other > 0.0
                self._other = 0.0
                self._slowing = (n.r + shift) / n.inertia
            self._friction = n.r_k * (1.0 + self._other * n.r * self._slowing)
        self.softness = 1.0 / self._own + n.r * self._slowing

    def pull(self, impulse: float) -> bool:
        """Advance by an impulse, N s, or until the shaft stops; return whether by all of it."""
        stop = self.w / self._slowing if self.w * self._slowing > 0.0 else inf
        whole = impulse < stop
        step = impulse if whole else stop
        w = self.w - self._slowing * step if whole else 0.0
        rate = self.rate + self.softness * step
        work = -0.5 * (self.rate + rate) * step
        self.work += work
        self.taken_up += max(work, 0.0)
        self.heat += self._friction * 0.5 * abs(self.w + w) * step
        self.w, self.rate = w, rate
        if not whole:
            self._begin_piece()
        return whole
