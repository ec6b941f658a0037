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

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import numpy.typing as npt

from frictionsim.mechanisms.belt_drive.belt import mesh_scale

if TYPE_CHECKING:
    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario

Array = npt.NDArray[Any]  # of floats, or of complex numbers for derivatives
Indices = npt.NDArray[np.intp]


class Chain(NamedTuple):
    """The bodies of a belt: what their energies depend on.

    Attributes
    ----------
    bodies : int
    length, mass, inertia : float, m, kg, kg m^2
        Of a body, unstretched.
    turning : float, rad
        What the angles gain along the whole belt, 2 pi or -2 pi.
    stiffness, bending : float, N/m and N m/rad
        c = EA/l and EI/l of a joint.
    gravity : float, m/s^2
        Along -y.
    centers, radii : (2, pulleys) and (pulleys,), m
    quadratic, linear : (pulleys,), N/m^2 and N/m
        c1 and c2 of the contact of a body with each pulley.
    """

    bodies: int
    length: float
    mass: float
    inertia: float
    turning: float
    stiffness: float
    bending: float
    gravity: float
    centers: Array
    radii: Array
    quadratic: Array
    linear: Array


def chain_of(scenario: "BeltDriveScenario", body_length: float) -> Chain:
    """Return the chain of bodies of an unstretched length, m."""
    mechanism, effects = scenario.mechanism, scenario.effects
    belt, pulleys = mechanism.belt, mechanism.pulleys
    mass = belt.mass_per_length * body_length
    return Chain(
        belt.bodies,
        body_length,
        mass,
        mass * body_length**2 / 12.0,
        mechanism.path().total_turning,
        belt.axial_rigidity / body_length,
        effects.bending.rigidity / body_length if effects.bending is not None else 0.0,
        effects.gravity.g if effects.gravity is not None else 0.0,
        np.array([p.center for p in pulleys]).T,
        np.array([p.radius for p in pulleys]),
        _contact_numbers(scenario, "c1"),
        _contact_numbers(scenario, "c2"),
    )


def _contact_numbers(scenario: "BeltDriveScenario", key: str) -> Array:
    """Return c1 or c2 of the contact of a body with each pulley, (pulleys,); zeros without one."""
    mechanism, contact = scenario.mechanism, scenario.effects.contact
    if contact is None:
        return np.zeros(len(mechanism.pulleys))
    scale = mesh_scale(contact, mechanism.belt.bodies)
    return scale * np.array([contact.at(name, key) for name in mechanism.names])


class Shape(NamedTuple):
    """Where the bodies are, (..., n) each.

    Attributes
    ----------
    y : m
        Height of the centres.
    cos, sin : 1
        Directions.
    gap_x, gap_y, bend : m and rad
        How far joint k, before body k, is stretched and bent.
    pulley : (n,)
        The one whose rim is nearest.
    normal_x, normal_y, depth : 1 and m
        Outward normal there, and how deep the body is pressed; 0 where it does not touch.
    """

    y: Array
    cos: Array
    sin: Array
    gap_x: Array
    gap_y: Array
    bend: Array
    pulley: Indices
    normal_x: Array
    normal_y: Array
    depth: Array


def shape_of(
    chain: Chain, x: Array, y: Array, angle: Array, pulley: Indices | None = None
) -> Shape:
    """Return the shape of bodies at x and y, m, and angles, rad; `pulley` where it is known."""
    cos, sin, half = np.cos(angle), np.sin(angle), 0.5 * chain.length
    bend = angle - before(angle)
    bend[..., 0] += chain.turning
    if pulley is None:
        pulley = nearest_pulleys(chain, x, y)
    out_x, out_y = x - chain.centers[0, pulley], y - chain.centers[1, pulley]
    distance = np.sqrt(out_x * out_x + out_y * out_y)
    depth = chain.radii[pulley] - distance
    return Shape(
        y,
        cos,
        sin,
        # The difference of neighbours is exact: only the rounding of the coordinates is left.
        x - before(x) - half * (cos + before(cos)),
        y - before(y) - half * (sin + before(sin)),
        bend,
        pulley,
        out_x / distance,
        out_y / distance,
        np.where(depth.real > 0.0, depth, 0.0),
    )


def nearest_pulleys(chain: Chain, x: Array, y: Array) -> Indices:
    """Return the pulley whose rim is nearest to each body, (..., n)."""
    center_x, center_y = chain.centers[..., None]
    dx, dy = x[..., None, :] - center_x, y[..., None, :] - center_y
    depths = chain.radii[:, None] - np.sqrt(dx * dx + dy * dy)
    nearest: Indices = np.argmax(depths, axis=-2)
    return nearest


def before(values: Array) -> Array:
    """Return for each body or joint the value of the one before it; quicker than `np.roll`."""
    return np.concatenate((values[..., -1:], values[..., :-1]), axis=-1)


def after(values: Array) -> Array:
    """Return for each body or joint the value of the one after it."""
    return np.concatenate((values[..., 1:], values[..., :1]), axis=-1)


def energies(chain: Chain, shape: Shape) -> Array:
    """Return the energy of each body and of the joint before it, (..., n), J.

    One by one, so that a small change is not lost in the sum.
    """
    c1, c2, p = chain.quadratic[shape.pulley], chain.linear[shape.pulley], shape.depth
    stretched = 0.5 * chain.stiffness * (shape.gap_x**2 + shape.gap_y**2)
    bent = 0.5 * chain.bending * shape.bend**2
    pressed = (c1 * p / 3.0 + 0.5 * c2) * p**2
    total: Array = stretched + bent + pressed + chain.mass * chain.gravity * shape.y
    return total


def gradient(chain: Chain, shape: Shape) -> Array:
    """Return the derivatives of the energy by x, y and angle, (..., 3, n), N and N m."""
    pull_x, pull_y = chain.stiffness * shape.gap_x, chain.stiffness * shape.gap_y
    next_x, next_y = after(pull_x), after(pull_y)
    moment, pressed = chain.bending * shape.bend, normal_forces(chain, shape)
    lever_x, lever_y = -0.5 * chain.length * shape.sin, 0.5 * chain.length * shape.cos
    by_x = pull_x - next_x - pressed * shape.normal_x
    by_y = pull_y - next_y - pressed * shape.normal_y + chain.mass * chain.gravity
    by_angle = moment - after(moment) - lever_x * (pull_x + next_x) - lever_y * (pull_y + next_y)
    return np.stack((by_x, by_y, by_angle), axis=-2)


def length_gradient(chain: Chain, shape: Shape) -> Array:
    """Return the derivative of the springs' energy by the length of the bodies, (...,), N.

    At a given EA, so that c = EA/l: -sum F_k . ((e_k + e_(k-1))/2 + d_k/(2 l)) with F_k = c d_k.
    """
    part = 0.5 / chain.length
    along_x = 0.5 * (shape.cos + before(shape.cos)) + part * shape.gap_x
    along_y = 0.5 * (shape.sin + before(shape.sin)) + part * shape.gap_y
    pull = chain.stiffness * (shape.gap_x * along_x + shape.gap_y * along_y)
    total: Array = -np.sum(pull, axis=-1)
    return total


def normal_forces(chain: Chain, shape: Shape) -> Array:
    """Return the forces of the contacts' springs, (..., n), N: c1 p^2 + c2 p."""
    c1, c2 = chain.quadratic[shape.pulley], chain.linear[shape.pulley]
    forces: Array = (c1 * shape.depth + c2) * shape.depth
    return forces


def tensions(chain: Chain, shape: Shape) -> Array:
    """Return the forces of the joints' springs, (..., n), N."""
    pulls: Array = chain.stiffness * np.sqrt(shape.gap_x**2 + shape.gap_y**2)
    return pulls


def depth_under(chain: Chain, force: Array) -> Array:
    """Return how deep a body is pressed into each pulley by a force there, (pulleys,), m."""
    c1, c2 = chain.quadratic, chain.linear
    depth: Array = 2.0 * force / (c2 + np.sqrt(c2**2 + 4.0 * c1 * force))
    return depth


def contact_stiffness(chain: Chain, force: float) -> float:
    """Return dN/dp of the stiffest contact under a force, N/m: sqrt(c2^2 + 4 c1 N)."""
    return float(np.max(np.sqrt(chain.linear**2 + 4.0 * chain.quadratic * force)))


def energy_on_line(chain: Chain, line_length: float, place: Array) -> Array:
    """Return the energy of points, J, at places, (..., n), along a line of a length, m."""
    stretch = place - before(place) - chain.length
    stretch[..., 0] += line_length
    total: Array = 0.5 * chain.stiffness * np.sum(stretch**2, axis=-1)
    return total


def kinetic_energy(chain: Chain, velocities: Array, inertias: Array, speeds: Array) -> Array:
    """Return the kinetic energy of bodies and pulleys, (...,), J.

    `velocities` are those of bodies in x and y, m/s, and of their angles, rad/s, (..., 3, n), or of
    points along their line, (..., 1, n); `speeds`, (..., pulleys), rad/s, and the moments of
    `inertias`, kg m^2, are of the pulleys.
    """
    squares = np.sum(velocities**2, axis=-1)
    bodies = chain.mass * squares[..., :2].sum(axis=-1)
    turning = chain.inertia * squares[..., 2:].sum(axis=-1)
    total: Array = 0.5 * (bodies + turning + np.sum(inertias * speeds**2, axis=-1))
    return total
