"""What bounds the steps of a belt: its waves, its dampers, its friction; what a state may err by.

In a long straight chain every motion is a sum of waves P_k, phi_k ~ exp(i kappa k). Across the
belt, with the displacement y and the rotation phi of a body, a joint of stiffness c is stretched by

    d = (1 - e^(-i kappa)) y - (l/2)(1 + e^(-i kappa)) phi,

which has an energy c |d|^2/2; the tension T adds T l |phi|^2/2 and the bending stiffness b
b |1 - e^(-i kappa)|^2 |phi|^2/2, a pulley of the stiffness k under the belt k |y|^2/2. Along the
belt there is the joint alone, and a pulley under it. With the mass m and the inertia m l^2/12 of a
body the highest frequency of a slack chain is that of kappa = 0, at which all bodies turn alike:
sqrt(12 c/m), not the 2 sqrt(c/m) of the waves along it. A belt that is guided on its line has only
these.

All are bounds: each wave is taken as if it ran on a pulley throughout.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from frictionsim.mechanisms.belt_drive.belt import DAMPING, RADIUS, Array, Belt
from frictionsim.mechanisms.belt_drive.energy import contact_stiffness
from frictionsim.mechanisms.belt_drive.equilibrium import Rest

ComplexArray = NDArray[np.complex128]

WAVES = 65  # wave numbers from 0 to pi; the highest frequency is at an end or between two of them
LOAD_FACTOR = 2.0  # largest tensions and normal forces over those at rest
# A step has at most twice the relaxation time of friction, where 3.96 times is stable: a body whose
# friction changes between stick and slip inside the steps could go round its limit for ever.
FRICTION_MARGIN = 2.0
DAMPER_SHARES = np.linspace(0.0, 1.0, 5)  # bodies come on to pulleys and leave them
# The error of a body's rotation counts a tenth of that of its place over its length: the ends that
# it moves across a joint change the joint's length, and so its tension, in second order only.
ROTATION_TOLERANCE = 10.0


class Waves(NamedTuple):
    """The squares of the frequencies that waves have, (rad/s)^2.

    `along` is that of the shortest one along the belt; `across`, `turning` and `coupling`, (waves,)
    each, of displacements across it, of rotations, and between them; on a line there are none.
    """

    along: float
    across: Array
    turning: Array
    coupling: Array


def waves_of(belt: Belt, rest: Rest) -> Waves:
    """Return the waves of a belt on its pulleys."""
    c, m, inertia = belt.stiffness, belt.mass, belt.inertia
    if belt.line is not None:
        return Waves(4.0 * c / m, *np.zeros((3, 0)))
    behind = np.exp(-1j * np.linspace(0.0, np.pi, WAVES))
    shift, lever = 1.0 - behind, -belt.half * (1.0 + behind)
    pulley = deepest_contact_stiffness(belt, rest)
    tension = LOAD_FACTOR * float(np.max(rest.tension))
    turning = c * np.abs(lever) ** 2 + tension * belt.length
    return Waves(
        (4.0 * c + pulley) / m,
        (c * np.abs(shift) ** 2 + pulley) / m,
        turning / inertia + (belt.bending or 0.0) * np.abs(shift) ** 2,
        np.abs(c * shift.conj() * lever) / np.sqrt(m * inertia),
    )


def max_frequency(belt: Belt, rest: Rest) -> float:
    """Return the highest angular frequency of a belt, rad/s.

    Across the belt it is in the upper of two branches, in which bodies turn against their
    neighbours; in the lower one they move across the belt, against tension and bending.
    """
    along, across, turning, coupling = waves_of(belt, rest)
    half_gap = np.sqrt(0.25 * (across - turning) ** 2 + coupling**2)
    highest = np.max(0.5 * (across + turning) + half_gap, initial=along)
    return float(np.sqrt(highest))


def wave_eigenvalues(belt: Belt, rest: Rest) -> ComplexArray:
    """Return the eigenvalues of the belt's waves and of its friction, (m,), 1/s.

    Of waves across the belt, y'' = -K y - C y' of displacement and rotation, and of the shortest
    wave along it, with each share of the dampers; a slip that ends in stick decays with 1/tau.
    """
    along, across, turning, coupling = waves_of(belt, rest)
    moving, rotating = decay_rates(belt)
    matrix = np.zeros((len(DAMPER_SHARES), len(across), 4, 4))
    matrix[..., 0, 2] = matrix[..., 1, 3] = 1.0
    matrix[..., 2, 0], matrix[..., 3, 1] = -across, -turning
    matrix[..., 2, 1] = matrix[..., 3, 0] = -coupling
    shares = DAMPER_SHARES[:, None]
    matrix[..., 2, 2], matrix[..., 3, 3] = -shares * moving, -shares * rotating
    half = 0.5 * DAMPER_SHARES * moving
    root = np.sqrt(half**2 - along + 0j)
    friction = [-FRICTION_MARGIN * (belt.inv_tau or 0.0)]
    return np.concatenate([np.linalg.eigvals(matrix).ravel(), -half + root, -half - root, friction])


def decay_rates(belt: Belt) -> tuple[float, float]:
    """Return the fastest decay by dampers of velocities and of angular velocities, 1/s."""
    damping = 4.0 * (belt.damping or 0.0) + float(np.max(belt.pul[DAMPING]))
    return damping / belt.mass, 4.0 * (belt.bend_damping or 0.0)


def deepest_contact_stiffness(belt: Belt, rest: Rest) -> float:
    """Return dN/dp of a contact that is pressed deeper than any is at rest, N/m.

    sqrt(c2^2 + 4 c1 N) of the stiffest pulley, with the upper bound of N.
    """
    force = LOAD_FACTOR * float(np.max(rest.normal_force))
    return contact_stiffness(belt, force)


def error_scales(belt: Belt, rest: Rest) -> Array:
    """Return the scale of the error of each number of a state, (size,).

    It is infinite for energies and for what stands behind the last body.

    The stretch of a joint under the pretension, m, and the speed with which it swings, m/s; where a
    contact is less deep than that, or swings slower, its depth and speed.
    """
    stretch = float(np.mean(rest.tension)) / belt.stiffness
    speed = stretch * float(np.sqrt(belt.stiffness / belt.mass))
    if belt.line is None:
        # The smaller of stretch and depth decides how exactly positions have to be known.
        stiffness = deepest_contact_stiffness(belt, rest)
        depth = float(np.max(rest.normal_force)) / stiffness
        stretch = min(stretch, depth)
        speed = min(speed, depth * float(np.sqrt(stiffness / belt.mass)))
    scales = np.full(belt.size, np.inf)
    turning = ROTATION_TOLERANCE / belt.length
    rows = [1.0, 1.0, turning] if belt.line is None else [1.0]
    of_rows = np.outer([stretch, speed], rows).reshape(-1, 1)
    belt.kinematics(scales)[:, : belt.n] = of_rows
    radius = float(np.min(belt.pul[RADIUS]))
    scales[belt.angles : belt.speeds] = stretch / radius
    scales[belt.speeds : belt.energies] = speed / radius
    return scales
