"""Contact of the bodies with the rims of the pulleys.

With n the unit vector from the centre of a pulley of radius R to the centre of a body, at the
distance r from it:

    p = R - r,   N = c1 p^2 + c2 p + delta(p) b p',   N >= 0               [1]_ eqs 6, 7, 9-11

References
----------
.. [1] K. Kubas, Archive of Mechanical Engineering 61(4), 2014.
"""

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frictionsim.mechanisms.belt_drive.effects.base import (
    Array,
    BeltEffect,
    Chain,
    Decay,
    Shape,
    Stage,
    Stiffness,
    Waves,
)
from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel
from frictionsim.mechanisms.belt_drive.kernels.layout import (
    BODY_VX,
    BODY_VY,
    CENTRE_X,
    CENTRE_Y,
    INV_DISTANCE,
    NORMAL,
    NX,
    NY,
    RADIUS,
    STICK_BIAS,
    VX,
    VY,
    X,
    Y,
)
from frictionsim.mechanisms.belt_drive.kernels.wrap import update_wrap_factors
from frictionsim.scenario.schema import Params, unit_field

if TYPE_CHECKING:
    from frictionsim.mechanisms.belt_drive.kernels.system import Contacts, System
    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario


class ContactTable(Params):
    """`[effects.contact]`: eqs 9-11 of Kubas 2014, for one body.

    With `reference_bodies` the numbers are for a body of a belt of so many; each body of another
    mesh has its part by length, so that the mesh can be refined.
    """

    c1: float = unit_field("N/m^2", "Quadratic stiffness of the contact of a body.", 0.0, ge=0)
    c2: float = unit_field("N/m", "Linear stiffness of the contact of a body.", gt=0)
    damping: float = unit_field("N s/m", "Damping of the contact of a body.", 0.0, ge=0)
    p_max: float = unit_field(
        "m", "Penetration from which on the damping acts in full.", 1e-3, gt=0
    )
    reference_bodies: int | None = unit_field(
        "1", "Bodies of the belt that these numbers are for; without it any mesh.", None, gt=0
    )


class ContactDamping(NamedTuple):
    """Damping of a body's contact, N s/m, in full from a depth, m, on."""

    coefficient: float
    full_depth: float


class ContactParameters(NamedTuple):
    """Penalty contact of a body: c1 in N/m^2, c2 in N/m, and its damping or None."""

    c1: float
    c2: float
    damping: ContactDamping | None = None


@inline_kernel
def contact_forces(kinematics: Array, contacts: "Contacts", contact: ContactParameters) -> None:
    """Write where the bodies are on their pulleys, how they move, and the spring's part of N.

    Reads X, Y, VX, VY; writes NX, NY, INV_DISTANCE, BODY_VX, BODY_VY, NORMAL.
    """
    x, y, vx, vy = kinematics[X], kinematics[Y], kinematics[VX], kinematics[VY]
    body, table, count = contacts.body, contacts.table, contacts.offsets[-1]
    nx, ny, normal, inv_distance = table[NX], table[NY], table[NORMAL], table[INV_DISTANCE]
    centre_x, centre_y, radius = table[CENTRE_X], table[CENTRE_Y], table[RADIUS]
    body_vx, body_vy = table[BODY_VX], table[BODY_VY]
    for s in range(count):
        i = body[s]
        nx[s], ny[s] = x[i] - centre_x[s], y[i] - centre_y[s]
        body_vx[s], body_vy[s] = vx[i], vy[i]
    c1, c2 = contact.c1, contact.c2
    for s in range(count):
        inv_distance[s] = 1.0 / np.sqrt(nx[s] * nx[s] + ny[s] * ny[s])
    for s in range(count):
        p = max(radius[s] - 1.0 / inv_distance[s], 0.0)
        normal[s] = p * (c1 * p + c2)
    for s in range(count):
        nx[s] *= inv_distance[s]
    for s in range(count):
        ny[s] *= inv_distance[s]


@inline_kernel
def add_contact_damping(contacts: "Contacts", damping: ContactDamping | None) -> float:
    """Add the damping's part of NORMAL, which never pulls; return the power it takes, W."""
    power = 0.0
    if damping is not None:
        table = contacts.table
        normal, nx, ny, vx, vy = table[NORMAL], table[NX], table[NY], table[BODY_VX], table[BODY_VY]
        radius, inv_distance = table[RADIUS], table[INV_DISTANCE]
        inv_full_depth = 1.0 / damping.full_depth
        for s in range(contacts.offsets[-1]):
            depth = min(max((radius[s] - 1.0 / inv_distance[s]) * inv_full_depth, 0.0), 1.0)
            coefficient = damping.coefficient * depth * depth * (3.0 - 2.0 * depth)
            rate = -(vx[s] * nx[s] + vy[s] * ny[s])
            damped = max(normal[s] + coefficient * rate, 0.0)
            power += (damped - normal[s]) * rate
            normal[s] = damped
    return power


@inline_kernel
def add_midpoint_contact_damping(
    h: float,
    mass: float,
    contacts: "Contacts",
    damping: ContactDamping | None,
    ax: Array,
    ay: Array,
) -> float:
    """Add the dampers of the contacts, at the mean of the old and the new velocity along n.

    With the acceleration A along n without it and the coefficient b that mean is
    (v + h A/2)/(1 + h b/(2 m)): stable at any b. Reads the velocities BODY_VX and BODY_VY expected
    in the middle of the step; adds to NORMAL, ax and ay. Return the power damped, W.
    """
    power = 0.0
    if damping is not None:
        table = contacts.table
        normal, nx, ny, more = table[NORMAL], table[NX], table[NY], table[STICK_BIAS]
        vx, vy, radius = table[BODY_VX], table[BODY_VY], table[RADIUS]
        inv_distance, count = table[INV_DISTANCE], contacts.offsets[-1]
        inv_mass, inv_full_depth = 1.0 / mass, 1.0 / damping.full_depth
        for s in range(count):
            more[s] = vx[s] * nx[s] + vy[s] * ny[s]
        for s in range(count):
            depth = min(max((radius[s] - 1.0 / inv_distance[s]) * inv_full_depth, 0.0), 1.0)
            b = damping.coefficient * depth * depth * (3.0 - 2.0 * depth)
            rate = -more[s] / (1.0 + 0.5 * h * b * inv_mass)
            more[s] = max(b * rate, -normal[s])
            power += more[s] * rate
        for s in range(count):
            i = contacts.body[s]
            normal[s] += more[s]
            ax[i] += inv_mass * more[s] * nx[s]
            ay[i] += inv_mass * more[s] * ny[s]
    return power


@inline_kernel
def add_normal_forces(contacts: "Contacts", inv_mass: float, ax: Array, ay: Array) -> None:
    """Add what the normal forces accelerate."""
    normal, nx, ny = contacts.table[NORMAL], contacts.table[NX], contacts.table[NY]
    for s in range(contacts.offsets[-1]):
        i = contacts.body[s]
        ax[i] += inv_mass * normal[s] * nx[s]
        ay[i] += inv_mass * normal[s] * ny[s]


@inline_kernel
def add_contacts(
    contact: ContactParameters,
    system: "System",
    kinematics: Array,
    ax: Array,
    ay: Array,
    aphi: Array,
) -> float:
    """Add the normal forces; return the power that their dampers take, W."""
    contacts = system.contacts
    contact_forces(kinematics, contacts, contact)
    count = contacts.offsets[-1]
    update_wrap_factors(contacts.wrap, contacts.body, count, system.chain, kinematics)
    power = add_contact_damping(contacts, contact.damping)
    add_normal_forces(contacts, 1.0 / system.chain.mass, ax, ay)
    return power


def mesh_scale(scenario: "BeltDriveScenario") -> float:
    """Return the ratio of a body's contact to the one that the scenario gives."""
    reference = scenario.effects.contact.reference_bodies
    return 1.0 if reference is None else reference / scenario.mechanism.belt.bodies


class ContactEffect(BeltEffect):
    """`[effects.contact]`."""

    key = "contact"
    table = ContactTable
    stage = Stage.CONTACT
    add_forces = add_contacts
    solved_for_in_fixed_steps = True
    on_free_spans = False

    def parameters(self, scenario: "BeltDriveScenario", chain: Chain) -> ContactParameters | None:
        table = scenario.effects.contact
        if table is None:
            return None
        scale = mesh_scale(scenario)
        damping = ContactDamping(table.damping * scale, table.p_max) if table.damping else None
        return ContactParameters(table.c1 * scale, table.c2 * scale, damping)

    def dissipates(self, parameters: ContactParameters) -> bool:
        return parameters.damping is not None

    def energies(self, parameters: ContactParameters, shape: Shape) -> Array:
        depth = shape.rim.depth
        energies: Array = (parameters.c1 * depth / 3.0 + 0.5 * parameters.c2) * depth**2
        return energies

    def add_gradient(self, parameters: ContactParameters, shape: Shape, gradient: Array) -> None:
        gradient[:, :2] -= normal_forces(parameters, shape)[:, None] * shape.rim.normal

    def add_stiffness(self, parameters: ContactParameters, shape: Shape, to: Stiffness) -> None:
        rim = shape.rim
        outward = rim.normal[:, :, None] * rim.normal[:, None, :]
        around = -normal_forces(parameters, shape) / rim.distance
        radial = radial_stiffness(parameters, shape) - around
        to.body[:, :2, :2] += radial[:, None, None] * outward
        to.body[:, :2, :2] += around[:, None, None] * np.eye(2)

    def add_wave_stiffness(self, parameters: ContactParameters, waves: Waves) -> None:
        stiffness = stiffness_under(parameters, waves.normal_force)
        waves.along += stiffness
        waves.across += stiffness

    def decay(self, parameters: ContactParameters, chain: Chain) -> Decay:
        damping = parameters.damping
        return Decay(moving=damping.coefficient / chain.mass if damping is not None else 0.0)


def normal_forces(parameters: ContactParameters, shape: Shape) -> Array:
    """Return the forces of the contacts' springs, (n,), N."""
    depth = shape.rim.depth
    return (parameters.c1 * depth + parameters.c2) * depth


def radial_stiffness(parameters: ContactParameters, shape: Shape) -> Array:
    """Return dN/dp of each body, (n,), N/m."""
    depth = shape.rim.depth
    return np.where(depth > 0.0, 2.0 * parameters.c1 * depth + parameters.c2, 0.0)


def stiffness_under(parameters: ContactParameters, force: float) -> float:
    """Return dN/dp of a contact that is pressed by a force, N/m."""
    c1, c2, _ = parameters
    return float(np.sqrt(c2 * c2 + 4.0 * c1 * force))


def depth_under(parameters: ContactParameters, force: Array) -> Array:
    """Return how deep contacts are that are pressed by forces, m."""
    c1, c2, _ = parameters
    depth: Array = 2.0 * force / (c2 + np.sqrt(c2**2 + 4.0 * c1 * force))
    return depth
