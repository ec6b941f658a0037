"""Contact of the bodies with the rims of the pulleys.

With n the unit vector from the centre of a pulley of radius R to the centre of a body, at the
distance r from it:

    p = R - r,   N = c1 p^2 + c2 p + delta(p) b p',   N >= 0               [1]_ eqs 6, 7, 9-11

References
----------
.. [1] K. Kubas, Archive of Mechanical Engineering 61(4), 2014.
"""

from typing import NamedTuple

import numpy as np

from frictionsim.mechanisms.belt_drive.effects.base import (
    BeltEffect,
    BeltProperties,
    Stage,
)
from frictionsim.mechanisms.belt_drive.kernels.contacts import run_end
from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel, loop_kernel
from frictionsim.mechanisms.belt_drive.kernels.system import (
    VX,
    VY,
    Array,
    ContactRows,
    Contacts,
    System,
    X,
    Y,
    contact_rows,
)
from frictionsim.mechanisms.belt_drive.kernels.wrap import update_wrap_factors
from frictionsim.mechanisms.belt_drive.schema import ContactTable

TINY = 1e-300  # what fills a block up may stand in the centre of a pulley


class ContactDamping(NamedTuple):
    """Damping of a body's contact with each pulley, N s/m, in full from a depth, m, on."""

    coefficient: Array
    full_depth: Array


class ContactParameters(NamedTuple):
    """Penalty contact of a body with each pulley: c1 in N/m^2, c2 in N/m; its damping or None."""

    c1: Array
    c2: Array
    damping: ContactDamping | None = None


@loop_kernel
def press_bodies(
    kinematics: Array, contacts: Contacts, rows: ContactRows, contact: ContactParameters
) -> None:
    """Write the rows of `contact_forces`."""
    body, offsets = contacts.body, contacts.offsets
    for j in range(len(contact.c1)):
        c1, c2, start, count = contact.c1[j], contact.c2[j], offsets[j], offsets[j + 1]
        while start < count:
            end = run_end(body, start, count)
            for s in range(np.uint64(start), np.uint64(end)):
                i = s + (body[start] - np.uint64(start))
                dx, dy = kinematics[X, i] - rows.centre_x[s], kinematics[Y, i] - rows.centre_y[s]
                rows.vx[s], rows.vy[s] = kinematics[VX, i], kinematics[VY, i]
                square = dx * dx + dy * dy + TINY
                inverse = 1.0 / np.sqrt(square)
                p = max(rows.radius[s] - square * inverse, 0.0)
                rows.normal[s] = p * (c1 * p + c2)
                rows.nx[s], rows.ny[s] = dx * inverse, dy * inverse
                rows.inv_distance[s] = inverse
            start = end


@inline_kernel
def contact_forces(kinematics: Array, contacts: Contacts, contact: ContactParameters) -> None:
    """Write where the bodies are on their pulleys, how they move, and the spring's part of N.

    Reads X, Y, VX, VY; writes NX, NY, INV_DISTANCE, BODY_VX, BODY_VY, NORMAL.
    """
    press_bodies(kinematics, contacts, contact_rows(contacts.table), contact)


@inline_kernel
def damper_share(share: float) -> float:
    """Return how much of the damper of a contact acts at such a share of the full depth."""
    bounded = min(max(share, 0.0), 1.0)
    return bounded * bounded * (3.0 - 2.0 * bounded)


@inline_kernel
def add_contact_damping(contacts: Contacts, damping: ContactDamping | None) -> float:
    """Add the damping's part of NORMAL, which never pulls; return the power it takes, W."""
    power = 0.0
    if damping is not None:
        rows = contact_rows(contacts.table)
        normal, nx, ny, vx, vy = rows.normal, rows.nx, rows.ny, rows.vx, rows.vy
        radius, inv_distance = rows.radius, rows.inv_distance
        for j in range(len(damping.coefficient)):
            full, inv_full_depth = damping.coefficient[j], 1.0 / damping.full_depth[j]
            for s in range(contacts.offsets[j], contacts.offsets[j + 1]):
                depth = radius[s] - 1.0 / inv_distance[s]
                coefficient = full * damper_share(depth * inv_full_depth)
                rate = -(vx[s] * nx[s] + vy[s] * ny[s])
                damped = max(normal[s] + coefficient * rate, 0.0)
                power += (damped - normal[s]) * rate
                normal[s] = damped
    return power


@inline_kernel
def add_normal_forces(contacts: Contacts, inv_mass: float, ax: Array, ay: Array) -> None:
    """Add what the normal forces accelerate."""
    add_normal_rows(contacts, contact_rows(contacts.table), inv_mass, ax, ay)


@loop_kernel
def add_normal_rows(
    contacts: Contacts, rows: ContactRows, inv_mass: float, ax: Array, ay: Array
) -> None:
    """Write the rows of `add_normal_forces`."""
    body, normal, nx, ny = contacts.body, rows.normal, rows.nx, rows.ny
    start, count = 0, contacts.offsets[-1]
    while start < count:
        end = run_end(body, start, count)
        for s in range(np.uint64(start), np.uint64(end)):
            i = s + (body[start] - np.uint64(start))
            ax[i] += inv_mass * normal[s] * nx[s]
            ay[i] += inv_mass * normal[s] * ny[s]
        start = end


@inline_kernel
def add_contacts(
    contact: ContactParameters, system: System, kinematics: Array, ax: Array, ay: Array, aphi: Array
) -> float:
    """Add the normal forces, which bodies in the plane have; return the power damped, W."""
    contacts = system.contacts
    contact_forces(kinematics, contacts, contact)
    update_wrap_factors(contacts.wrap, contacts, system.workspace)
    power = add_contact_damping(contacts, contact.damping)
    add_normal_forces(contacts, 1.0 / system.chain.mass, ax, ay)
    return power


def mesh_scale(table: ContactTable, bodies: int) -> float:
    """Return the ratio of a body's contact to the one that the scenario gives."""
    reference = table.reference_bodies
    return 1.0 if reference is None else reference / bodies


class ContactEffect(BeltEffect):
    """`[effects.contact]`."""

    key = "contact"
    stage = Stage.CONTACT
    add_forces = add_contacts

    def parameters(
        self, table: ContactTable | None, belt: BeltProperties
    ) -> ContactParameters | None:
        if table is None:
            return None
        scale = mesh_scale(table, belt.chain.bodies)

        def pulley_values(key: str) -> Array:
            return np.array([table.at(name, key) for name in belt.pulleys])

        coefficient = scale * pulley_values("damping")
        damping = ContactDamping(coefficient, pulley_values("p_max")) if coefficient.any() else None
        return ContactParameters(scale * pulley_values("c1"), scale * pulley_values("c2"), damping)
