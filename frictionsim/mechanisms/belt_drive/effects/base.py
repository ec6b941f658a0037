"""The parts of an effect on the bodies of a belt."""

from enum import IntEnum
from typing import Any, ClassVar, NamedTuple

import numpy as np

from frictionsim.mechanisms.belt_drive.kernels.system import Array, Chain


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
    stage : Stage
    add_forces : BeltKernel or None
        add_forces(parameters, system, kinematics, ax, ay, aphi): add to the accelerations of the
        bodies, m/s^2 and rad/s^2, (width,) each, and return the power that is damped, W. Where the
        parameters are None it is compiled to nothing.
    """

    key: str
    stage = Stage.BODY
    add_forces: ClassVar[Any] = None

    def parameters(self, table: Any, belt: BeltProperties) -> Any:
        """Return the parameters of the force, a tuple of numbers; None where it is absent.

        `table` is None where the scenario lacks the effect.
        """
        return None
