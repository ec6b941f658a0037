"""What the contacts of a belt may hold in a checkpoint, before a kernel takes it for indices."""

from typing import TYPE_CHECKING

import numpy as np

from frictionsim.mechanisms.belt_drive.kernels.layout import (
    BACKWARD,
    CENTRE_X,
    CENTRE_Y,
    FORWARD,
    INERTIA,
    KINETIC,
    MODE,
    PULLEY_RADIUS,
    PULLEY_X,
    PULLEY_Y,
    RADIUS,
    SIMD_WIDTH,
    STATIC,
    STICKING,
)
from frictionsim.solvers.state_values import (
    DIRECTION,
    FLAG,
    NON_NEGATIVE,
    Expected,
    FixedRows,
    Rows,
    Values,
)

if TYPE_CHECKING:
    from frictionsim.mechanisms.belt_drive.kernels.system import System


def contact_values(system: "System") -> dict[str, Expected]:
    """Return the valid values of the arrays of `BeltModel.contact_state`, by name."""
    capacity, width = len(system.contacts.body), system.layout.width
    largest = float(np.max(system.pulleys.table[PULLEY_RADIUS]))
    coefficients = dict.fromkeys((STATIC, KINETIC, FORWARD, BACKWARD), NON_NEGATIVE)
    candidates = {RADIUS: Values(0.0, largest), MODE: DIRECTION, STICKING: FLAG}
    return {
        "contact_offsets": Values(0.0, capacity, whole=True, ascending=True),
        "contact_bodies": Values(0.0, width - SIMD_WIDTH - 1, whole=True),
        "contacts": Rows({**candidates, **coefficients}),
        "release": NON_NEGATIVE,
        "pulleys": FixedRows(system.pulleys.table[: INERTIA + 1].copy()),
    }


def offsets_fault(system: "System") -> str:
    """Return the array that cannot divide candidates by their pulleys, in full vectors."""
    offsets = system.contacts.offsets
    return "contact_offsets" if offsets[0] != 0 or np.any(offsets % SIMD_WIDTH) else ""


def block_fault(system: "System") -> str:
    """Return the array that does not go with the others, of bodies that move in the plane.

    The candidates of a pulley are blocks of neighbours, each at most once, and some of each block
    are near the pulley: their radius is that of it.
    """
    if fault := offsets_fault(system):
        return fault
    contacts, pulleys, bodies = system.contacts, system.pulleys.table, system.layout.bodies
    count = int(contacts.offsets[-1])
    pulley = np.repeat(np.arange(pulleys.shape[1]), np.diff(contacts.offsets))
    blocks = contacts.body[:count].astype(np.int64).reshape(-1, SIMD_WIDTH)
    first = blocks[:, 0]
    neighbours = np.array_equal(blocks, first[:, None] + np.arange(SIMD_WIDTH))
    again = (np.diff(first) <= 0) & (np.diff(pulley[::SIMD_WIDTH]) == 0)
    if not neighbours or np.any(first % SIMD_WIDTH) or np.any(first >= bodies) or again.any():
        return "contact_bodies"
    table = contacts.table[:, :count]
    near = table[RADIUS] > 0.0
    of_pulley = (
        (table[RADIUS] == pulleys[PULLEY_RADIUS, pulley])
        & (table[CENTRE_X] == pulleys[PULLEY_X, pulley])
        & (table[CENTRE_Y] == pulleys[PULLEY_Y, pulley])
        & (blocks.ravel() < bodies)
    )
    some = near.reshape(-1, SIMD_WIDTH).any(axis=1)
    return "" if np.all(of_pulley[near]) and some.all() else "contacts"
