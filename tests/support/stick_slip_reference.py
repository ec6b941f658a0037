"""A block on a belt, held by a spring, whose friction falls with its slip: an independent program.

In the room the block is at x, and the belt at V t. It sticks with x' = V until the spring pulls
with F(0), and slips with m x'' = -k x + F(V - x') until x' = V again. DOP853 at 1e-13 goes from
event to event; the end of a slip is the root of integrations up to it.
"""

from collections.abc import Callable
from typing import NamedTuple

from scipy.integrate import solve_ivp
from scipy.optimize import brentq

RTOL, ATOL = 1e-13, 1e-16
FIRST, PART = 0.02, 0.25  # over the natural frequency: by the first one no slip has ended


class Cycle(NamedTuple):
    """Times at which a slip begins and ends, s, and the places of the block there, m."""

    begin: float
    end: float
    x_begin: float
    x_end: float


def cycles(
    m: float, k: float, belt: float, friction: Callable[[float], float], count: int
) -> list[Cycle]:
    """Return the first cycles of a block that sticks at the start, with the spring relaxed.

    `friction` is that of the speed of the slip, not negative.
    """
    found, t, x, natural = list[Cycle](), 0.0, 0.0, (m / k) ** 0.5
    for _ in range(count):
        stretch = friction(0.0) / k
        t += (stretch - x) / belt
        x_begin = stretch

        def run(y: list[float], duration: float) -> list[float]:
            done = solve_ivp(
                lambda t, y: [y[1], (friction(max(belt - y[1], 0.0)) - k * y[0]) / m],
                (0.0, duration),
                y,
                method="DOP853",
                rtol=RTOL,
                atol=ATOL,
                max_step=0.02 * natural,
            )
            return [float(number) for number in done.y[:, -1]]

        early, y = FIRST * natural, run([x_begin, belt], FIRST * natural)
        while (later := run(y, PART * natural))[1] < belt:
            early, y = early + PART * natural, later
        left = brentq(lambda at: run(y, at)[1] - belt, 0.0, PART * natural, xtol=1e-15)  # noqa: B023
        duration, x = early + float(left), run(y, left)[0]
        found.append(Cycle(t, t + duration, x_begin, x))
        t += duration
    return found
