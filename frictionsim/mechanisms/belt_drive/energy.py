"""The energies of a belt and their gradient: what holds it at rest, and what an audit adds up.

Body k has the centre P_k and the direction e_k = (cos phi_k, sin phi_k); joint k joins the right
end of body k - 1 to the left end of body k [1]_. With the length l of a body

    E = sum c/2 |d_k|^2 + EI/(2 l) (phi_k - phi_(k-1))^2 + c1 p_k^3/3 + c2 p_k^2/2 + m g y_k
    d_k = P_k - P_(k-1) - (l/2) (e_k + e_(k-1)),   c = EA/l,   m = rho l,   p = R - |P - C| > 0

Points of a belt that is guided on a line have the springs alone. Everything here takes arrays whose
last axis is that of the bodies, also complex ones: a gradient at u + i h v has the derivative along
v in its imaginary part, exact to rounding for any small h [2]_.

References
----------
.. [1] K. Kubas, "A two-dimensional discrete model for dynamic analysis of belt transmission with
   dry friction", Archive of Mechanical Engineering 61(4), 2014, eqs 6, 7, 20 to 22.
.. [2] W. Squire, G. Trapp, "Using complex variables to estimate derivatives of real functions",
   SIAM Review 40(1), 1998.
"""

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from frictionsim.mechanisms.belt_drive.belt import (
    LINEAR,
    PHI,
    PX,
    PY,
    QUADRATIC,
    RADIUS,
    Belt,
    X,
    Y,
)

Array = npt.NDArray[Any]  # of floats, or of complex numbers for derivatives


class Shape(NamedTuple):
    """Where the bodies are, (..., n) each."""

    y: Array  # m, height of the centres
    cos: Array  # directions
    sin: Array
    gap_x: Array  # m, how far joint k, before body k, is stretched
    gap_y: Array
    bend: Array  # rad, and bent
    pulley: npt.NDArray[np.intp]  # the one whose rim is nearest
    normal_x: Array  # outward normal there
    normal_y: Array
    depth: Array  # m, how deep the body is pressed; 0 where it does not touch


def shape_of(belt: Belt, places: Array) -> Shape:
    """Return the shape of bodies at x and y, m, and angles, rad, (..., 3, n)."""
    x, y, angle = places[..., X, :], places[..., Y, :], places[..., PHI, :]
    cos, sin = np.cos(angle), np.sin(angle)
    bend = angle - before(angle)
    bend[..., 0] += belt.turning
    center_x, center_y, radius = belt.pul[[PX, PY, RADIUS]]
    dx, dy = x[..., None, :] - center_x[:, None], y[..., None, :] - center_y[:, None]
    pulley = np.argmax(radius[:, None] - np.sqrt(dx * dx + dy * dy), axis=-2)
    out_x, out_y = x - center_x[pulley], y - center_y[pulley]
    distance = np.sqrt(out_x * out_x + out_y * out_y)
    depth = radius[pulley] - distance
    return Shape(
        y,
        cos,
        sin,
        # The difference of neighbours is exact: only the rounding of the coordinates is left.
        x - before(x) - belt.half * (cos + before(cos)),
        y - before(y) - belt.half * (sin + before(sin)),
        bend,
        pulley,
        out_x / distance,
        out_y / distance,
        np.where(depth.real > 0.0, depth, 0.0),
    )


def before(values: Array) -> Array:
    """Return for each body or joint the value of the one before it; quicker than `np.roll`."""
    return np.concatenate((values[..., -1:], values[..., :-1]), axis=-1)


def after(values: Array) -> Array:
    """Return for each body or joint the value of the one after it."""
    return np.concatenate((values[..., 1:], values[..., :1]), axis=-1)


def energies(belt: Belt, shape: Shape) -> Array:
    """Return the energy of each body and of the joint before it, (..., n), J.

    One by one, so that a small change is not lost in the sum.
    """
    c1, c2, p = belt.pul[QUADRATIC, shape.pulley], belt.pul[LINEAR, shape.pulley], shape.depth
    stretched = 0.5 * belt.stiffness * (shape.gap_x**2 + shape.gap_y**2)
    bent = 0.5 * _bending(belt) * shape.bend**2
    pressed = (c1 * p / 3.0 + 0.5 * c2) * p**2
    total: Array = stretched + bent + pressed + belt.mass * (belt.gravity or 0.0) * shape.y
    return total


def _bending(belt: Belt) -> float:
    """Return EI/l, N m/rad."""
    return (belt.bending or 0.0) * belt.inertia


def gradient(belt: Belt, shape: Shape) -> Array:
    """Return the derivatives of the energy by x, y and angle, (..., 3, n), N and N m."""
    pull_x, pull_y = belt.stiffness * shape.gap_x, belt.stiffness * shape.gap_y
    next_x, next_y = after(pull_x), after(pull_y)
    moment, pressed = _bending(belt) * shape.bend, normal_forces(belt, shape)
    by_x = pull_x - next_x - pressed * shape.normal_x
    by_y = pull_y - next_y - pressed * shape.normal_y + belt.mass * (belt.gravity or 0.0)
    turning = shape.sin * (pull_x + next_x) - shape.cos * (pull_y + next_y)
    return np.stack((by_x, by_y, moment - after(moment) + belt.half * turning), axis=-2)


def normal_forces(belt: Belt, shape: Shape) -> Array:
    """Return the forces of the contacts' springs, (..., n), N: c1 p^2 + c2 p."""
    c1, c2 = belt.pul[QUADRATIC, shape.pulley], belt.pul[LINEAR, shape.pulley]
    forces: Array = (c1 * shape.depth + c2) * shape.depth
    return forces


def tensions(belt: Belt, shape: Shape) -> Array:
    """Return the forces of the joints' springs, (..., n), N."""
    pulls: Array = belt.stiffness * np.sqrt(shape.gap_x**2 + shape.gap_y**2)
    return pulls


def contact_stiffness(belt: Belt, force: float) -> float:
    """Return dN/dp of the stiffest contact under a force, N/m: sqrt(c2^2 + 4 c1 N)."""
    return float(np.max(np.sqrt(belt.pul[LINEAR] ** 2 + 4.0 * belt.pul[QUADRATIC] * force)))


def energy_on_line(belt: Belt, line_length: float, place: Array) -> Array:
    """Return the energy of points, J, at places, (..., n), along a line of a length, m."""
    stretch = place - before(place) - belt.length
    stretch[..., 0] += line_length
    total: Array = 0.5 * belt.stiffness * np.sum(stretch**2, axis=-1)
    return total


def kinetic_energy(belt: Belt, velocities: Array, inertias: Array, speeds: Array) -> Array:
    """Return the kinetic energy of bodies and pulleys, (...,), J.

    `velocities` are those of bodies in x and y, m/s, and of their angles, rad/s, (..., 3, n), or of
    points along their line, (..., 1, n); `speeds`, (..., pulleys), rad/s, and the moments of
    `inertias`, kg m^2, are of the pulleys.
    """
    squares = np.sum(velocities**2, axis=-1)
    bodies = belt.mass * squares[..., :2].sum(axis=-1)
    turning = belt.inertia * squares[..., 2:].sum(axis=-1)
    total: Array = 0.5 * (bodies + turning + np.sum(inertias * speeds**2, axis=-1))
    return total
