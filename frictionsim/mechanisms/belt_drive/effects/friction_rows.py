"""The loops over contacts of set-valued friction that write several rows at once."""

from typing import TYPE_CHECKING

import numpy as np

from frictionsim.mechanisms.belt_drive.effects.base import Array
from frictionsim.mechanisms.belt_drive.kernels.jit import loop_kernel
from frictionsim.mechanisms.belt_drive.kernels.layout import SIMD_WIDTH
from frictionsim.mechanisms.belt_drive.kernels.runs import run_end
from frictionsim.mechanisms.belt_drive.kernels.wrap import mass_ratio, times_factor, wrap_rate

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.kernels.wrap import WrapFactors

    Bodies = npt.NDArray[np.uint64]


@loop_kernel
def sticking_rows(
    inv_relaxation_time: float,
    bodies: tuple["Bodies", Array, Array, Array, Array],
    moving: tuple[Array, Array, Array, Array, Array, Array],
    wrap: "WrapFactors | None",
    normal: tuple[Array, Array, Array],
    written: tuple[Array, Array, Array],
    count: int,
) -> None:
    """Write STICK_BIAS and the limits of the friction, N, of so many candidates."""
    (body, ax, ay, bend, bend_rate), (nx, ny, vx, vy, inv_distance, slip) = bodies, moving
    (force, forward, backward), (bias, forward_limit, backward_limit) = normal, written
    start = 0
    while start < count:
        end = run_end(body, start, count)
        for s in range(np.uint64(start), np.uint64(end)):
            i = s + (body[start] - np.uint64(start))
            along = vy[s] * nx[s] - vx[s] * ny[s]
            turning = along * (vx[s] * nx[s] + vy[s] * ny[s]) * inv_distance[s]
            own = times_factor(wrap, s, turning - (ay[i] * nx[s] - ax[i] * ny[s]))
            own -= wrap_rate(wrap, i, bend, bend_rate) * along
            bias[s] = slip[s] * inv_relaxation_time + own
            forward_limit[s] = forward[s] * force[s]
            backward_limit[s] = backward[s] * force[s]
        start = end


@loop_kernel
def project_rows(
    part: tuple[int, int],
    rim: float,
    mass: float,
    wrap: "WrapFactors | None",
    read: tuple[Array, Array, Array],
    friction: Array,
    sticking: Array,
) -> None:
    """Write the rows of `project_friction` of one pulley."""
    bias, forward, backward = read
    for block in range(part[0], part[1], SIMD_WIDTH):
        for s in range(block, block + SIMD_WIDTH):
            needed = mass * mass_ratio(wrap, s) * (rim + bias[s])
            limited = min(max(needed, -backward[s]), forward[s])
            friction[s], sticking[s] = limited, 1.0 if limited == needed else 0.0


@loop_kernel
def add_friction_rows(
    body: "Bodies",
    count: int,
    inv_mass: float,
    wrap: "WrapFactors | None",
    contact: tuple[Array, Array, Array],
    ax: Array,
    ay: Array,
) -> None:
    """Add what the friction of so many candidates accelerates."""
    friction, nx, ny = contact
    start = 0
    while start < count:
        end = run_end(body, start, count)
        for s in range(np.uint64(start), np.uint64(end)):
            i = s + (body[start] - np.uint64(start))
            force = inv_mass * times_factor(wrap, s, friction[s])
            ax[i] -= force * ny[s]
            ay[i] += force * nx[s]
        start = end
