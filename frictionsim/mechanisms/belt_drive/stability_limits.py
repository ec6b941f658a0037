"""The fastest that a belt can do: its highest frequency and its fastest decay.

In a long straight chain every motion is a sum of waves P_k, phi_k ~ exp(i kappa k). Across the
belt, with the displacement y and the rotation phi of a body, a joint of stiffness c is stretched by

    d = (1 - e^(-i kappa)) y - (l/2)(1 + e^(-i kappa)) phi,

which has an energy c |d|^2/2; the tension T adds T l |phi|^2/2 and the bending stiffness b
b |1 - e^(-i kappa)|^2 |phi|^2/2, a pulley of the stiffness k under the belt k |y|^2/2: each effect
adds its own. Along the belt there is the joint alone. With the mass m and the inertia m l^2/12 of a
body the highest frequency of a slack chain is that of kappa = 0, at which all bodies turn alike:
sqrt(12 c/m), not the 2 sqrt(c/m) of the waves along it.
"""

from typing import TYPE_CHECKING

import numpy as np

from frictionsim.mechanisms.belt_drive.effects import in_order
from frictionsim.mechanisms.belt_drive.effects.base import Decay, Waves

if TYPE_CHECKING:
    from frictionsim.mechanisms.belt_drive.equilibrium import Equilibrium
    from frictionsim.mechanisms.belt_drive.kernels.system import System

WAVES = 65  # wave numbers from 0 to pi; the highest frequency is at an end or between two of them
CONTACT_LOAD_FACTOR = 2.0  # tensions and normal forces may be so many times those at rest


def max_frequency_and_decay(system: "System", equilibrium: "Equilibrium") -> tuple[float, float]:
    """Return the highest angular frequency, rad/s, and the fastest decay rate, 1/s.

    Bounds for a belt on its pulleys: each wave is taken as if it ran on a pulley throughout.
    """
    waves = _waves(system, equilibrium, on_pulleys=True)
    along = waves.along / system.chain.mass
    _, turning = transverse_frequencies(waves)
    return float(np.sqrt(max(turning, along))), max_decay_rate(system)


def max_bending_frequency(system: "System", equilibrium: "Equilibrium") -> float:
    """Return the highest angular frequency of waves in which the belt bends, rad/s."""
    waves = _waves(system, equilibrium, on_pulleys=False)
    return float(np.sqrt(transverse_frequencies(waves)[0]))


def _waves(system: "System", equilibrium: "Equilibrium", on_pulleys: bool) -> Waves:
    """Return the stiffness that waves meet on the pulleys, or in free spans."""
    waves = Waves(
        system.chain,
        np.linspace(0.0, np.pi, WAVES),
        CONTACT_LOAD_FACTOR * float(np.max(equilibrium.tension)),
        max_normal_force(equilibrium),
    )
    for effect in in_order():
        parameters = getattr(system.effects, effect.key)
        if parameters is not None and (on_pulleys or effect.on_free_spans):
            effect.add_wave_stiffness(parameters, waves)
    return waves


def transverse_frequencies(waves: Waves) -> tuple[float, float]:
    """Return the largest squares of the frequencies in the two branches of waves across the belt.

    In the lower one bodies move across the belt and turn along with it, against tension and
    bending; in the upper one they turn against their neighbours, against the joints.
    """
    mass, inertia = waves.chain.mass, waves.chain.inertia
    yy, pp = waves.across / mass, waves.turning / inertia
    yp = waves.coupling / np.sqrt(mass * inertia)
    mean, half = 0.5 * (yy + pp), np.sqrt(0.25 * (yy - pp) ** 2 + yp**2)
    lower = np.maximum(mean - half, 0.0)
    return float(np.max(lower)), float(np.max(mean + half))


def max_normal_force(equilibrium: "Equilibrium") -> float:
    """Return the largest normal force that is reckoned with, N."""
    return CONTACT_LOAD_FACTOR * float(np.max(equilibrium.normal_force, initial=0.0))


def max_decay_rate(system: "System") -> float:
    """Return the fastest decay rate that dampers and set-valued friction have, 1/s."""
    decay = _decay(system, of_explicit_dampers=False)
    rate = max(decay.moving, decay.turning)
    law = system.effects.belt_friction
    if law is not None and law.set_valued is not None:
        rate = max(rate, 1.0 / law.set_valued.relaxation_time)
    return rate


def explicit_decay(system: "System") -> float:
    """Return the fastest decay rate of the dampers that fixed steps extrapolate, 1/s."""
    return max(_decay(system, of_explicit_dampers=True))


def _decay(system: "System", of_explicit_dampers: bool) -> Decay:
    """Return the sum over the effects, or over those whose dampers fixed steps do not solve for."""
    found = [
        effect.decay(parameters, system.chain)
        for effect in in_order()
        if (parameters := getattr(system.effects, effect.key)) is not None
        and not (of_explicit_dampers and effect.solved_for_in_fixed_steps)
    ]
    return Decay(sum(d.moving for d in found), sum(d.turning for d in found))
