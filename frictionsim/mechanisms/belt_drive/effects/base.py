"""The parts of an effect on the bodies of a belt."""

from enum import IntEnum
from typing import Any, ClassVar, NamedTuple

import numpy as np

from frictionsim.mechanisms.belt_drive.kernels.system import Array, Chain
from frictionsim.scenario.schema import Params


class BeltProperties(NamedTuple):
    """The data that an effect computes its parameters from, with its table.

    Attributes
    ----------
    chain : Chain
    axial_rigidity : float, N
    pulleys : tuple of str
        Their names.
    """

    chain: Chain
    axial_rigidity: float
    pulleys: tuple[str, ...]


def previous_rows(rows: Array) -> Array:
    """Return for each body or joint the row of the one before it; quicker than `np.roll`."""
    return np.concatenate((rows[-1:], rows[:-1]))


class Waves:
    """The stiffness that waves exp(i kappa k) meet, N/m, N m and N, to be added to.

    Attributes
    ----------
    chain : Chain
    tension, normal_force : float, N
        Upper bounds.
    shift : (m,)
        1 - exp(-i kappa): the difference of neighbours.
    lever : (m,), m
        What a joint is stretched by for an angle.
    along : float
        Along the belt, at the shortest wave.
    across, turning, coupling : (m,)
        Of displacements across the belt, of angles, and between them.
    """

    def __init__(self, chain: Chain, kappa: Array, tension: float, normal_force: float) -> None:
        self.chain, self.tension, self.normal_force = chain, tension, normal_force
        self.shift = 1.0 - np.exp(-1j * kappa)
        self.lever = -0.5 * chain.length * (1.0 + np.exp(-1j * kappa))
        self.along = 0.0
        self.across = np.zeros(len(kappa))
        self.turning = np.zeros(len(kappa))
        self.coupling = np.zeros(len(kappa))


class Decay(NamedTuple):
    """Decay rates by dampers, 1/s: of velocities and of angular velocities."""

    moving: float = 0.0
    turning: float = 0.0


class Stage(IntEnum):
    """What a force acts on, in the order in which forces are added."""

    JOINT = 0
    BODY = 1
    CONTACT = 2
    FRICTION = 3


class BeltEffect:
    """An effect; the defaults are those of an effect without that part.

    Attributes
    ----------
    key : str
        Of its table in `[effects]`, and of its parameters in the `System`.
    table : type of Params
        The table.
    stage : Stage
    add_forces : BeltKernel or None
        add_forces(parameters, system, kinematics, ax, ay, aphi): add to the accelerations of the
        bodies, m/s^2 and rad/s^2, (width,) each, and return the power that is damped, W. Where the
        parameters are None it is compiled to nothing.
    on_guided_string : bool
        A belt that is guided along its pitch line can have it.
    solved_for_in_fixed_steps : bool
        Its dampers do not bound the steps of `moreau`, which solves for them.
    """

    key: str
    table: type[Params]
    stage = Stage.BODY
    add_forces: ClassVar[Any] = None
    on_guided_string = False
    solved_for_in_fixed_steps = False

    def parameters(self, table: Any, belt: BeltProperties) -> Any:
        """Return the parameters of the force, a tuple of numbers; None where it is absent.

        `table` is None where the scenario lacks the effect.
        """
        return None

    def dissipates(self, parameters: Any) -> bool:
        """Return whether it has a damper."""
        return False

    def add_wave_stiffness(self, parameters: Any, waves: Waves) -> None:
        """Add the stiffness that waves meet."""

    def decay(self, parameters: Any, chain: Chain) -> Decay:
        """Return the highest decay rate of its dampers."""
        return Decay()
