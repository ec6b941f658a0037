"""Where the load of a contact reverses within a step: its size has a corner at zero."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from frictionsim.solvers.root_finding import bracket_root
from frictionsim.solvers.stepper import Stepper

if TYPE_CHECKING:
    from frictionsim.solvers.mechanism import Mechanism


def reversal_in_step(
    load: Callable[[float, float, float], tuple[float, float]],
    mechanism: "Mechanism",
    stepper: Stepper,
) -> float:
    """Return when the load of a contact has turned by a right angle since the begin of a step, s.

    A load that passes zero turns by two at once, where its size, and friction with it, has a
    corner. The end of the step if it has not turned so far.
    """
    drive, y_old, y = mechanism.drive, stepper.y_old, stepper.y
    x_old, up_old = load(drive(stepper.t_old), y_old[0], y_old[1])

    def against(u: float, q: float, v: float) -> float:
        x, up = load(u, q, v)
        return -(x * x_old + up * up_old)

    if not against(drive(stepper.t), y[0], y[1]) > 0.0:
        return stepper.t

    def inside(t: float) -> float:
        state = stepper.interpolate(t)
        return against(drive(t), state[0], state[1])

    if not inside(stepper.t) > 0.0:  # the interpolant may differ by roundoff
        return stepper.t
    return bracket_root(inside, stepper.t_old, stepper.t)[1]
