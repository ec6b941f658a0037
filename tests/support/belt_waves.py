"""The waves of a belt about its rest position, from its equations of motion."""

import numpy as np
from numpy.typing import NDArray

from tests.support.belt_kernels import BeltModel, find_contacts, rates

Array = NDArray[np.float64]
CHANGE = 1e-8  # m


def waves(model: BeltModel) -> tuple[Array, Array]:
    """Return angular frequencies and shapes: columns of x, y and angles times a body's length."""
    n, width = model.belt.n, model.belt.width
    places = [row * width + i for row in range(3) for i in range(n)]
    # Frequencies of a motion in m and in rad: levers of a body's length make them alike.
    lever = np.repeat([1.0, 1.0, 1.0 / model.belt.length], n)
    matrix = np.zeros((3 * n, 3 * n))
    for column, place in enumerate(places):
        for sign in (1.0, -1.0):
            state, rate = model.state.copy(), np.zeros_like(model.state)
            state[place] += sign * CHANGE * lever[column]
            find_contacts(model.belt, state)
            rates(0.0, 0.0, state, rate, model.belt)
            moved = rate[[3 * width + p for p in places]] / lever
            matrix[:, column] += sign * moved / (2.0 * CHANGE)
    values, shapes = np.linalg.eig(matrix)
    return np.sqrt(np.maximum(-values.real, 0.0)), shapes.real
