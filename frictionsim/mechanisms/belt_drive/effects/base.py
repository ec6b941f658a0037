"""The parts of an effect on the bodies of a belt."""

from enum import IntEnum
from functools import cached_property
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

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


def next_rows(rows: Array) -> Array:
    """Return for each body, or joint, the row of the one after it."""
    return np.concatenate((rows[1:], rows[:1]))


class Shape:
    """The configuration of the bodies, of which energies are functions.

    Parameters
    ----------
    chain : Chain
    position : (n, 2), m
    angle : (n,), rad
    centers : (pulleys, 2), m
    radii : (pulleys,), m
    scale : float, m
        Makes a length of an angle in `Stiffness`.
    """

    def __init__(
        self,
        chain: Chain,
        position: Array,
        angle: Array,
        centers: Array,
        radii: Array,
        scale: float = 1.0,
    ) -> None:
        self.chain, self.position, self.angle = chain, position, angle
        self.centers, self.radii, self.scale = centers, radii, scale

    @cached_property
    def along(self) -> Array:
        """The directions of the bodies, (n, 2)."""
        return np.column_stack([np.cos(self.angle), np.sin(self.angle)])

    @cached_property
    def across(self) -> Array:
        """The normals to their left, (n, 2)."""
        return np.column_stack([-self.along[:, 1], self.along[:, 0]])

    @cached_property
    def gap(self) -> Array:
        """How far each joint is stretched, (n, 2), m; joint k is before body k."""
        # The difference of neighbours is exact: only the rounding of the coordinates is left.
        gap = self.position - previous_rows(self.position)
        gap -= 0.5 * self.chain.length * (self.along + previous_rows(self.along))
        return gap

    @cached_property
    def bend(self) -> Array:
        """How far each joint is bent, (n,), rad."""
        bend = self.angle - previous_rows(self.angle)
        bend[0] += self.chain.total_turning
        return bend

    @cached_property
    def rim(self) -> "Rim":
        """Where the bodies are on their pulleys."""
        offsets = self.position[:, None, :] - self.centers
        distances = np.hypot(offsets[..., 0], offsets[..., 1])
        pulley = np.argmax(self.radii - distances, axis=1)
        row = np.arange(len(self.position))
        distance = distances[row, pulley]
        depth = np.maximum(self.radii[pulley] - distance, 0.0)
        return Rim(pulley, offsets[row, pulley] / distance[:, None], distance, depth)


class Rim(NamedTuple):
    """The nearest pulley of each body, the outward normal there, and how deep it is pressed.

    `pulley` is (n,), `normal` (n, 2), `distance` from the centre (n,), m, and `depth` (n,), m, zero
    where there is no contact.
    """

    pulley: NDArray[np.intp]
    normal: Array
    distance: Array
    depth: Array


class Stiffness:
    """Second derivatives of an energy by x, y and scale times angle, N/m, to be added to.

    Attributes
    ----------
    body : (n, 3, 3)
        Of each body.
    ends : (3, 3)
        Of a body at a joint: every body has one at either end.
    coupling : (n, 3, 3)
        Of body k with body k - 1.
    """

    def __init__(self, bodies: int) -> None:
        self.body = np.zeros((bodies, 3, 3))
        self.ends = np.zeros((3, 3))
        self.coupling = np.zeros((bodies, 3, 3))


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

    def energies(self, parameters: Any, shape: Shape) -> Array:
        """Return the energy of each body or joint, (n,), J."""
        return np.zeros(len(shape.angle))

    def add_gradient(self, parameters: Any, shape: Shape, gradient: Array) -> None:
        """Add the derivatives of the energy by x, y and angle, (n, 3), N and N m."""

    def add_stiffness(self, parameters: Any, shape: Shape, stiffness: Stiffness) -> None:
        """Add the second derivatives of the energy."""

    def add_wave_stiffness(self, parameters: Any, waves: Waves) -> None:
        """Add the stiffness that waves meet."""

    def decay(self, parameters: Any, chain: Chain) -> Decay:
        """Return the highest decay rate of its dampers."""
        return Decay()
