"""The waves of a belt about its rest position, from its equations of motion."""

import numpy as np
from numpy.typing import NDArray

from tests.support.belt_kernels import BeltModel, find_contact_candidates, kinematics_of, rhs

Array = NDArray[np.float64]
CHANGE = 1e-8  # m


def waves(model: BeltModel) -> tuple[Array, Array]:
    """Return angular frequencies and shapes: columns of x, y and angles times a body's length."""
    n, width = model.system.chain.bodies, model.system.layout.width
    places = [row * width + i for row in range(3) for i in range(n)]
    # Frequencies of a motion in m and in rad: levers of a body's length make them alike.
    lever = np.repeat([1.0, 1.0, 1.0 / model.system.chain.length], n)
    matrix = np.zeros((3 * n, 3 * n))
    for column, place in enumerate(places):
        for sign in (1.0, -1.0):
            state, rate = model.state.copy(), np.zeros_like(model.state)
            state[place] += sign * CHANGE * lever[column]
            motion = kinematics_of(state, model.system.layout)
            find_contact_candidates(model.system, motion)
            rhs(0.0, 0.0, state, rate, model.system)
            moved = rate[[3 * width + p for p in places]] / lever
            matrix[:, column] += sign * moved / (2.0 * CHANGE)
    values, shapes = np.linalg.eig(matrix)
    return np.sqrt(np.maximum(-values.real, 0.0)), shapes.real
