"""The fastest that a belt can do: its highest frequency and its fastest decay.

In a long straight chain every motion is a sum of waves P_k, phi_k ~ exp(i kappa k). Across the
belt, with the displacement y and the rotation phi of a body, a joint of stiffness c is stretched by

    d = (1 - e^(-i kappa)) y - (l/2)(1 + e^(-i kappa)) phi,

which has an energy c |d|^2/2; the tension T adds T l |phi|^2/2 and the bending stiffness b
b |1 - e^(-i kappa)|^2 |phi|^2/2, a pulley of the stiffness k under the belt k |y|^2/2. Along the
belt there is the joint alone. With the mass m and the inertia m l^2/12 of a body the highest
frequency of a slack chain is that of kappa = 0, at which all bodies turn alike: sqrt(12 c/m), not
the 2 sqrt(c/m) of the waves along it.
"""

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from frictionsim.mechanisms.belt_drive.equilibrium import Equilibrium
    from frictionsim.mechanisms.belt_drive.kernels.equations import ForceLaws

WAVES = 65  # wave numbers from 0 to pi; the highest frequency is at an end or between two of them
CONTACT_LOAD_FACTOR = 2.0  # contacts may be pressed so many times as deep as at rest


def max_frequency_and_decay(laws: "ForceLaws", equilibrium: "Equilibrium") -> tuple[float, float]:
    """Return the highest angular frequency, rad/s, and the fastest decay rate, 1/s.

    Bounds for a belt on its pulleys: each wave is taken as if it ran on a pulley throughout.
    """
    k, c, m = contact_stiffness(laws, equilibrium), laws.chain.stiffness, laws.chain.mass
    along = (4.0 * c + k) / m
    _, turning = transverse_frequencies(laws, equilibrium, k)
    return float(np.sqrt(max(turning, along))), max_decay_rate(laws)


def max_bending_frequency(laws: "ForceLaws", equilibrium: "Equilibrium") -> float:
    """Return the highest angular frequency of waves in which the belt bends, rad/s."""
    return float(np.sqrt(transverse_frequencies(laws, equilibrium, 0.0)[0]))


def transverse_frequencies(
    laws: "ForceLaws", equilibrium: "Equilibrium", k: float
) -> tuple[float, float]:
    """Return the largest squares of the frequencies in the two branches of waves across the belt.

    In the lower one bodies move across the belt and turn along with it, against tension and
    bending; in the upper one they turn against their neighbours, against the joints.
    """
    chain = laws.chain
    c, m, length = chain.stiffness, chain.mass, chain.length
    bending = laws.bending.stiffness if laws.bending else 0.0
    tension = CONTACT_LOAD_FACTOR * float(np.max(equilibrium.tension))
    kappa = np.linspace(0.0, np.pi, WAVES)
    shift, lever = 1.0 - np.exp(-1j * kappa), -0.5 * length * (1.0 + np.exp(-1j * kappa))
    yy = (c * np.abs(shift) ** 2 + k) / m
    inertia = chain.inertia
    turning = c * np.abs(lever) ** 2 + tension * length + bending * np.abs(shift) ** 2
    pp = turning / inertia
    yp = np.abs(c * shift.conj() * lever) / np.sqrt(m * inertia)
    mean, half = 0.5 * (yy + pp), np.sqrt(0.25 * (yy - pp) ** 2 + yp**2)
    lower = np.maximum(mean - half, 0.0)
    return float(np.max(lower)), float(np.max(mean + half))


def contact_stiffness(laws: "ForceLaws", equilibrium: "Equilibrium") -> float:
    """Return dN/dp of a contact that is pressed deeper than any is at rest, N/m."""
    c1, c2 = laws.contact
    force = CONTACT_LOAD_FACTOR * float(np.max(equilibrium.normal_force, initial=0.0))
    return float(np.sqrt(c2 * c2 + 4.0 * c1 * force))


def max_decay_rate(laws: "ForceLaws") -> float:
    """Return the fastest decay rate that dampers and exact stick have, 1/s."""
    m, inertia = laws.chain.mass, laws.chain.inertia
    rate = 0.0
    if laws.axial_damping is not None:
        rate += 4.0 * laws.axial_damping.coefficient / m
    if laws.contact_damping is not None:
        rate += laws.contact_damping.coefficient / m
    if laws.bending is not None:
        rate = max(rate, 4.0 * laws.bending.damping / inertia)
    if laws.set_valued is not None:
        rate = max(rate, 1.0 / laws.set_valued.relaxation_time)
    return rate
