"""Bodies that move in the plane: the search for those near a pulley, and their accelerations."""

from typing import TYPE_CHECKING, Any

import numpy as np

from frictionsim.mechanisms.belt_drive.effects import ordered_effects
from frictionsim.mechanisms.belt_drive.effects.base import Stage
from frictionsim.mechanisms.belt_drive.effects.belt_friction import (
    add_friction_forces,
    slip_velocities,
    solve_friction,
)
from frictionsim.mechanisms.belt_drive.kernels.contacts import (
    add_candidate,
    save_modes,
    set_initial_mode,
)
from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel, sum_of
from frictionsim.mechanisms.belt_drive.kernels.system import (
    CENTRE_X,
    CENTRE_Y,
    KINEMATIC_ROWS,
    PULLEY_RADIUS,
    PULLEY_X,
    PULLEY_Y,
    SIMD_WIDTH,
    SPEED,
    VX,
    VY,
    Array,
    Contacts,
    Plane,
    Pulleys,
    System,
    X,
    Y,
    clear_padding,
)
from frictionsim.mechanisms.belt_drive.kernels.wrap import (
    bend_joints,
    times_factor,
    update_bend_rates,
    update_wrap_factors,
)

if TYPE_CHECKING:
    from collections.abc import Iterable

    from frictionsim.mechanisms.belt_drive.effects.base import BeltEffect


@inline_kernel
def search_plane(plane: Plane, system: System, kinematics: Array) -> None:
    """Make candidates of the bodies within the skin of a rim."""
    contacts, pulleys, chain = system.contacts, system.pulleys, system.chain
    search_bodies(contacts, pulleys, chain.bodies, plane.skin, kinematics)
    bend_joints(chain, kinematics, system.workspace)
    update_wrap_factors(contacts.wrap, contacts, system.workspace)
    initial_contact_modes(kinematics, contacts, pulleys)


@inline_kernel
def search_bodies(
    contacts: Contacts, pulleys: Pulleys, bodies: int, skin: float, kinematics: Array
) -> None:
    """Write the candidates, with the modes that they had, or NEW_CONTACT."""
    x, y, table, count = kinematics[X], kinematics[Y], pulleys.table, pulleys.table.shape[1]
    save_modes(contacts)
    s = 0
    for j in range(count):
        contacts.offsets[j] = s
        reach = (table[PULLEY_RADIUS, j] + skin) ** 2
        for first in range(0, bodies, SIMD_WIDTH):
            nearest = np.inf
            for i in range(first, min(first + SIMD_WIDTH, bodies)):
                dx, dy = x[i] - table[PULLEY_X, j], y[i] - table[PULLEY_Y, j]
                nearest = min(nearest, dx * dx + dy * dy)
            if nearest >= reach:
                continue
            for i in range(first, first + SIMD_WIDTH):
                dx, dy = x[i] - table[PULLEY_X, j], y[i] - table[PULLEY_Y, j]
                near = i < bodies and dx * dx + dy * dy < reach
                add_candidate(contacts, s + i - first, i, table[PULLEY_RADIUS, j] if near else 0.0)
            s += SIMD_WIDTH
        for k in range(contacts.offsets[j], s):
            contacts.table[CENTRE_X, k] = table[PULLEY_X, j]
            contacts.table[CENTRE_Y, k] = table[PULLEY_Y, j]
    contacts.offsets[count] = s


@inline_kernel
def initial_contact_modes(kinematics: Array, contacts: Contacts, pulleys: Pulleys) -> None:
    """Have bodies that are new at a pulley stick if they have no slip, else slide."""
    table, pulley = contacts.table, pulleys.table
    for j in range(pulley.shape[1]):
        for s in range(contacts.offsets[j], contacts.offsets[j + 1]):
            i = contacts.body[s]
            dx, dy = kinematics[X, i] - table[CENTRE_X, s], kinematics[Y, i] - table[CENTRE_Y, s]
            moment = kinematics[VY, i] * dx - kinematics[VX, i] * dy
            along = times_factor(contacts.wrap, s, moment / np.sqrt(dx * dx + dy * dy))
            set_initial_mode(contacts, s, pulley[PULLEY_RADIUS, j] * pulley[SPEED, j] - along)


def sum_of_forces(effects: "Iterable[BeltEffect]") -> Any:
    """Return a kernel that writes the accelerations under forces, and returns the power damped."""
    return sum_of(
        {
            f"system.effects.{effect.key}, system, kinematics, ax, ay, aphi": effect.add_forces
            for effect in effects
            if effect.add_forces is not None
        },
        "system, kinematics, ax, ay, aphi",
    )


# Write the accelerations of the bodies without friction; return the power damped, W.
smooth_accelerations = sum_of_forces(ordered_effects())
# The same where nothing touches a pulley.
contactless_accelerations = sum_of_forces(
    e for e in ordered_effects() if e.stage is not Stage.CONTACT
)


@inline_kernel
def plane_accelerations(plane: Plane, h: float, state: Array, rate: Array, system: System) -> float:
    """Write the accelerations of the bodies; return the power damped, W."""
    layout, contacts, chain = system.layout, system.contacts, system.chain
    width, half = layout.width, layout.velocities
    ax, ay = rate[half : half + width], rate[half + width : half + 2 * width]
    aphi = rate[half + 2 * width : half + 3 * width]
    kinematics = state[: layout.angles].reshape((KINEMATIC_ROWS, width))
    damped = smooth_accelerations(system, kinematics, ax, ay, aphi)
    clear_padding(chain.bodies, ax, ay, aphi)
    update_bend_rates(contacts.wrap, chain, kinematics, system.workspace)
    slip_velocities(contacts, system.pulleys)
    solve_friction(system.effects.belt_friction, system, ax, ay, h)
    add_friction_forces(contacts, 1.0 / chain.mass, ax, ay)
    return damped
