"""The parts of belts that tests call by name: all that they know of the inside stands here.

What is compiled, what is needed to call it, the path of the ideal belt, the belt at rest, and the
steppers. Whoever moves one of these changes this file alone; scenarios, runs and results of belts
are asked by `frictionsim` itself.
"""

from functools import cache
from typing import Any, NamedTuple

import numba
import numpy as np
from numpy.typing import NDArray

from frictionsim.mechanisms.belt_drive import belt as row
from frictionsim.mechanisms.belt_drive import dampers, kernels, limits, moreau, rkf45
from frictionsim.mechanisms.belt_drive.belt import Belt, belt_of, initial_state
from frictionsim.mechanisms.belt_drive.belt_simulation import stepper_of as _stepper_of
from frictionsim.mechanisms.belt_drive.equilibrium import Rest, at_rest
from frictionsim.mechanisms.belt_drive.geometry import PulleyCircle, belt_path

__all__ = ["PulleyCircle", "belt_path", "row"]

Array = NDArray[np.float64]
COMPILED_MODULES = (kernels, dampers, rkf45, moreau)


class BeltModel(NamedTuple):
    """A belt drive at rest, and its state at the start, (size,)."""

    belt: Belt
    rest: Rest
    state: Array

    @property
    def error_scales(self) -> Array:
        """The scale of the error of each state; infinite for energies."""
        return limits.error_scales(self.belt, self.rest)

    @property
    def eigenvalues(self) -> limits.ComplexArray:
        """The eigenvalues of the waves and of friction, 1/s."""
        return limits.wave_eigenvalues(self.belt, self.rest)

    @property
    def max_frequency(self) -> float:
        """The highest angular frequency, rad/s."""
        return limits.max_frequency(self.belt, self.rest)


def assemble(scenario: Any) -> BeltModel:
    """Return the belt drive of a scenario at rest."""
    rest = at_rest(scenario)
    belt = belt_of(scenario, rest.body_length)
    return BeltModel(belt, rest, initial_state(belt, rest.x, rest.y, rest.angle))


def stepper_of(model: BeltModel, scenario: Any) -> Any:
    """Return the stepper of a scenario's method, from the state of a model."""
    return _stepper_of(scenario, *model)


def compiled(function: Any) -> Any:
    """Return a part of kernels, compiled, as Python can call it: the part itself must not be."""

    @numba.njit
    def call(*arguments: Any) -> Any:
        return function(*arguments)

    return call


@cache
def _callable(part: Any) -> Any:
    return compiled(part) if hasattr(part, "py_func") else part


def find_contacts(belt: Belt, state: Array) -> None:
    """List the runs of bodies near pulleys; those that are new have a mode afterwards."""
    _callable(kernels.search)(belt, belt.kinematics(state), belt.plane, belt.line, belt.wrap)


def rates(t: float, h: float, state: Array, rate: Array, belt: Belt) -> None:
    """Write the rate of a state; h is the length of the step, s, for a creep without a time."""
    parts = belt.plane, belt.line, belt.inv_tau, belt.wear
    _callable(kernels.rhs)(t, h, state, rate, belt, *parts)
