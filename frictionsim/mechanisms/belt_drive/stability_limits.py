"""Bounds on the motion of a belt: highest frequency, fastest decay, eigenvalues.

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

from frictionsim.mechanisms.belt_drive.effects import ordered_effects
from frictionsim.mechanisms.belt_drive.effects.base import Decay, Waves

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.equilibrium import Rest
    from frictionsim.mechanisms.belt_drive.kernels.system import System

    ComplexArray = npt.NDArray[np.complex128]

WAVES = 65  # wave numbers from 0 to pi; the highest frequency is at an end or between two of them
CONTACT_LOAD_FACTOR = 2.0  # largest tensions and normal forces over those at rest
# A step has at most twice the relaxation time of friction, where 3.96 times is stable: a body whose
# friction changes between stick and slip inside the steps could go round its limit for ever.
FRICTION_MARGIN = 2.0
DAMPER_SHARES = np.linspace(0.0, 1.0, 5)  # bodies come on to pulleys and leave them


def max_frequency_and_decay(system: "System", equilibrium: "Rest") -> tuple[float, float]:
    """Return the highest angular frequency, rad/s, and the fastest decay rate, 1/s.

    Bounds for a belt on its pulleys: each wave is taken as if it ran on a pulley throughout.
    """
    waves = waves_on_pulleys(system, equilibrium)
    square = max(waves.along / system.chain.mass, max_transverse_square(waves))
    return float(np.sqrt(square)), max_decay_rate(system)


def eigenvalues(system: "System", equilibrium: "Rest") -> "ComplexArray":
    """Return the eigenvalues of the belt's waves and of its friction, (m,), 1/s.

    Of waves across the belt, y'' = -K y - C y' of displacement and rotation, and of the shortest
    wave along it, with each share of the dampers; a slip that ends in stick decays with 1/tau.
    """
    waves, decay = waves_on_pulleys(system, equilibrium), damping_rates(system)
    mass, inertia = system.chain.mass, system.chain.inertia
    shares = DAMPER_SHARES[:, None]
    matrix = np.zeros((len(DAMPER_SHARES), WAVES, 4, 4))
    matrix[..., 0, 2] = matrix[..., 1, 3] = 1.0
    matrix[..., 2, 0] = -waves.across / mass
    matrix[..., 3, 1] = -waves.turning / inertia
    matrix[..., 2, 1] = matrix[..., 3, 0] = -waves.coupling / np.sqrt(mass * inertia)
    matrix[..., 2, 2], matrix[..., 3, 3] = -shares * decay.moving, -shares * decay.turning
    return np.concatenate(
        [
            np.linalg.eigvals(matrix).ravel(),
            oscillator_eigenvalues(waves.along / mass, decay.moving),
            [-FRICTION_MARGIN * friction_rate(system)],
        ]
    )


def oscillator_eigenvalues(square: float, decay: float) -> "ComplexArray":
    """Return the eigenvalues of x'' = -square x - share decay x' for all shares, (m,), 1/s."""
    half = 0.5 * DAMPER_SHARES * decay
    root = np.sqrt(half**2 - square + 0j)
    return np.concatenate([-half + root, -half - root])


def waves_on_pulleys(system: "System", equilibrium: "Rest") -> Waves:
    """Return the stiffness that waves meet, as if they ran on a pulley throughout."""
    waves = Waves(
        system.chain,
        np.linspace(0.0, np.pi, WAVES),
        CONTACT_LOAD_FACTOR * float(np.max(equilibrium.tension)),
        max_normal_force(equilibrium),
    )
    for effect in ordered_effects():
        parameters = getattr(system.effects, effect.key)
        if parameters is not None:
            effect.add_wave_stiffness(parameters, waves)
    return waves


def max_transverse_square(waves: Waves) -> float:
    """Return the largest square of the frequencies of waves across the belt, (rad/s)^2.

    It is in the upper of two branches, in which bodies turn against their neighbours; in the lower
    one they move across the belt, against tension and bending.
    """
    mass, inertia = waves.chain.mass, waves.chain.inertia
    yy, pp = waves.across / mass, waves.turning / inertia
    yp = waves.coupling / np.sqrt(mass * inertia)
    upper = 0.5 * (yy + pp) + np.sqrt(0.25 * (yy - pp) ** 2 + yp**2)
    return float(np.max(upper))


def max_normal_force(equilibrium: "Rest") -> float:
    """Return the upper bound of a normal force, N."""
    return CONTACT_LOAD_FACTOR * float(np.max(equilibrium.normal_force, initial=0.0))


def max_decay_rate(system: "System") -> float:
    """Return the fastest decay rate that dampers and set-valued friction have, 1/s."""
    return max(*damping_rates(system), friction_rate(system))


def friction_rate(system: "System") -> float:
    """Return the rate at which set-valued friction ends a slip in stick, 1/s; 0 of other laws."""
    law = system.effects.belt_friction
    set_valued = law is not None and law.set_valued is not None
    return 1.0 / law.set_valued.relaxation_time if set_valued else 0.0


def explicit_decay(system: "System") -> float:
    """Return the fastest decay rate of the dampers that fixed steps extrapolate, 1/s."""
    return max(damping_rates(system, of_explicit_dampers=True))


def damping_rates(system: "System", of_explicit_dampers: bool = False) -> Decay:
    """Return the sum over the effects, or over those whose dampers fixed steps do not solve for."""
    rates = [
        effect.decay(parameters, system.chain)
        for effect in ordered_effects()
        if (parameters := getattr(system.effects, effect.key)) is not None
        and not (of_explicit_dampers and effect.solved_for_in_fixed_steps)
    ]
    return Decay(sum(d.moving for d in rates), sum(d.turning for d in rates))
