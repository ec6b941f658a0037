"""The energy that the equilibrium minimises, with its first and second derivatives.

Each effect states its own part. Coordinates are x, y and scale times angle of each body and, where
the pretension is given, the length of the bodies.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np

from frictionsim.mechanisms.belt_drive.effects import ordered_effects
from frictionsim.mechanisms.belt_drive.effects.axial import (
    AxialEffect,
    AxialParameters,
    joint_tensions,
    length_gradient,
    length_stiffness,
)
from frictionsim.mechanisms.belt_drive.effects.base import BeltEffect, Shape, Stage, Stiffness
from frictionsim.mechanisms.belt_drive.effects.contact import ContactParameters
from frictionsim.mechanisms.belt_drive.geometry import Path, PulleyCircle
from frictionsim.mechanisms.belt_drive.kernels.system import Array, Chain

AXIAL = AxialEffect()


class EquilibriumProblem(NamedTuple):
    """The data of a search for the equilibrium.

    Attributes
    ----------
    path : Path
    pulleys : sequence of PulleyCircle
    centers, radii : (pulleys, 2) and (pulleys,), m
    bodies : int
    axial_rigidity : float, N
    contact : ContactParameters
    chain_of : callable
        Returns the `Chain` of bodies of a length, m.
    parameters_of : callable
        Returns the parameters of all effects on a `Chain`.
    scale : float, m
        Makes a length of an angle.
    """

    path: Path
    pulleys: Sequence[PulleyCircle]
    centers: Array
    radii: Array
    bodies: int
    axial_rigidity: float
    contact: ContactParameters
    chain_of: Callable[[float], Chain]
    parameters_of: Callable[[Chain], Any]
    scale: float


class Configuration(NamedTuple):
    """Where the bodies are, (n, 2) in m and (n,) in rad, and how long they are, m."""

    position: Array
    angle: Array
    length: float


class HeldParameters(NamedTuple):
    """Parameters that stay fixed while the energy is minimised.

    Attributes
    ----------
    chain : Chain
        Of the length that the parameters are for.
    effects : list of (BeltEffect, parameters)
        All but the springs along the belt, whose stiffness goes with the length.
    pull : float or None, N
        The force on the length of the bodies; None: they keep it.
    """

    chain: Chain
    effects: list[tuple[BeltEffect, Any]]
    pull: float | None


class Evaluation(NamedTuple):
    """A configuration, and the energy of each body there, J.

    One for each body, so that a small change is not lost in the sum.
    """

    configuration: Configuration
    shape: Shape
    axial: AxialParameters
    energies: Array

    @property
    def tensions(self) -> Array:
        """The forces of the joints, (n,), N."""
        return joint_tensions(self.axial, self.shape)


def held_parameters(belt: EquilibriumProblem, length: float, pull: float | None) -> HeldParameters:
    """Return the parameters that are held at a length of the bodies, m."""
    chain = belt.chain_of(length)
    parameters = belt.parameters_of(chain)
    effects = [
        (effect, effect_parameters)
        for effect in ordered_effects()
        if (effect_parameters := getattr(parameters, effect.key)) is not None
        and effect.key != AXIAL.key
        and effect.stage != Stage.FRICTION
    ]
    return HeldParameters(chain, effects, pull)


def evaluate(belt: EquilibriumProblem, held: HeldParameters, at: Configuration) -> Evaluation:
    """Return the energies at a configuration."""
    chain = held.chain._replace(length=at.length)
    shape = Shape(chain, at.position, at.angle, belt.centers, belt.radii, belt.scale)
    axial = AxialParameters(belt.axial_rigidity / at.length, None)
    energies = AXIAL.energies(axial, shape)
    for effect, parameters in held.effects:
        energies = energies + effect.energies(parameters, shape)
    return Evaluation(at, shape, axial, energies + (held.pull or 0.0) * at.length)


def gradient(belt: EquilibriumProblem, held: HeldParameters, at: Evaluation) -> Array:
    """Return the first derivatives, (3 n + 1,): of the bodies, last by their length."""
    bodies = np.zeros((belt.bodies, 3))
    AXIAL.add_gradient(at.axial, at.shape, bodies)
    for effect, parameters in held.effects:
        effect.add_gradient(parameters, at.shape, bodies)
    bodies[:, 2] /= belt.scale
    length = 0.0
    if held.pull is not None:
        length = belt.bodies * held.pull + length_gradient(belt.axial_rigidity, at.shape)
    return np.append(bodies, length)


class SecondDerivatives(NamedTuple):
    """Of each body, (n, 3, 3), of body k with k - 1, (n, 3, 3), and by the length: (n, 3), one."""

    own: Array
    coupling: Array
    border: Array | None
    corner: float


def second_derivatives(
    belt: EquilibriumProblem, held: HeldParameters, at: Evaluation
) -> SecondDerivatives:
    """Return the second derivatives of the energy."""
    stiffness = Stiffness(belt.bodies)
    AXIAL.add_stiffness(at.axial, at.shape, stiffness)
    for effect, parameters in held.effects:
        effect.add_stiffness(parameters, at.shape, stiffness)
    own = stiffness.body + 2.0 * stiffness.ends
    if held.pull is None:
        return SecondDerivatives(own, stiffness.coupling, None, 0.0)
    by_length = length_stiffness(belt.axial_rigidity, at.shape)
    return SecondDerivatives(own, stiffness.coupling, *by_length)
