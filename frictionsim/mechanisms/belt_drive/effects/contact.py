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
from pydantic import Field

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


class PulleyContactTable(Params):
    """Contact with one pulley; what is left out is as on the others."""

    c1: float | None = unit_field("N/m^2", "Quadratic stiffness there.", None, ge=0)
    c2: float | None = unit_field("N/m", "Linear stiffness there.", None, gt=0)
    damping: float | None = unit_field("N s/m", "Damping there.", None, ge=0)
    p_max: float | None = unit_field(
        "m", "Penetration from which on the damping acts in full there.", None, gt=0
    )


class ContactTable(Params):
    """`[effects.contact]`: eqs 9-11 of Kubas 2014, for one body; `pulleys.NAME` where they differ.

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
    pulleys: dict[str, PulleyContactTable] = Field(
        default_factory=dict,
        description="Contact with a pulley that differs; what is left out is as on the others.",
    )

    def at(self, pulley: str, key: str) -> float:
        """Return a number of the contact with a pulley: its own, or the common one."""
        own = getattr(self.pulleys.get(pulley), key, None)
        found: float = getattr(self, key) if own is None else own
        return found


class ContactDamping(NamedTuple):
    """Damping of a body's contact with each pulley, N s/m, in full from a depth, m, on."""

    coefficient: Array
    full_depth: Array


class ContactParameters(NamedTuple):
    """Penalty contact of a body with each pulley: c1 in N/m^2, c2 in N/m; its damping or None."""

    c1: Array
    c2: Array
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
    for s in range(count):
        inv_distance[s] = 1.0 / np.sqrt(nx[s] * nx[s] + ny[s] * ny[s])
    for j in range(len(contact.c1)):
        c1, c2 = contact.c1[j], contact.c2[j]
        for s in range(contacts.offsets[j], contacts.offsets[j + 1]):
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
        for j in range(len(damping.coefficient)):
            full, inv_full_depth = damping.coefficient[j], 1.0 / damping.full_depth[j]
            for s in range(contacts.offsets[j], contacts.offsets[j + 1]):
                depth = min(max((radius[s] - 1.0 / inv_distance[s]) * inv_full_depth, 0.0), 1.0)
                coefficient = full * depth * depth * (3.0 - 2.0 * depth)
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
        inv_mass = 1.0 / mass
        for s in range(count):
            more[s] = vx[s] * nx[s] + vy[s] * ny[s]
        for j in range(len(damping.coefficient)):
            full, inv_full_depth = damping.coefficient[j], 1.0 / damping.full_depth[j]
            for s in range(contacts.offsets[j], contacts.offsets[j + 1]):
                depth = min(max((radius[s] - 1.0 / inv_distance[s]) * inv_full_depth, 0.0), 1.0)
                b = full * depth * depth * (3.0 - 2.0 * depth)
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

        def of_pulleys(key: str) -> Array:
            return np.array([table.at(name, key) for name in scenario.mechanism.names])

        coefficient = scale * of_pulleys("damping")
        damping = ContactDamping(coefficient, of_pulleys("p_max")) if coefficient.any() else None
        return ContactParameters(scale * of_pulleys("c1"), scale * of_pulleys("c2"), damping)

    def dissipates(self, parameters: ContactParameters) -> bool:
        return parameters.damping is not None

    def energies(self, parameters: ContactParameters, shape: Shape) -> Array:
        depth, (c1, c2) = shape.rim.depth, coefficients(parameters, shape)
        energies: Array = (c1 * depth / 3.0 + 0.5 * c2) * depth**2
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
        fastest = float(np.max(damping.coefficient)) if damping is not None else 0.0
        return Decay(moving=fastest / chain.mass)


def coefficients(parameters: ContactParameters, shape: Shape) -> tuple[Array, Array]:
    """Return c1, N/m^2, and c2, N/m, of the pulley that is nearest to each body, (n,) both."""
    return parameters.c1[shape.rim.pulley], parameters.c2[shape.rim.pulley]


def normal_forces(parameters: ContactParameters, shape: Shape) -> Array:
    """Return the forces of the contacts' springs, (n,), N."""
    depth, (c1, c2) = shape.rim.depth, coefficients(parameters, shape)
    return (c1 * depth + c2) * depth


def radial_stiffness(parameters: ContactParameters, shape: Shape) -> Array:
    """Return dN/dp of each body, (n,), N/m."""
    depth, (c1, c2) = shape.rim.depth, coefficients(parameters, shape)
    return np.where(depth > 0.0, 2.0 * c1 * depth + c2, 0.0)


def stiffness_under(parameters: ContactParameters, force: float) -> float:
    """Return dN/dp of the stiffest contact when it is pressed by a force, N/m."""
    c1, c2, _ = parameters
    return float(np.max(np.sqrt(c2**2 + 4.0 * c1 * force)))


def depth_under(parameters: ContactParameters, force: Array) -> Array:
    """Return how deep the contact with each pulley is under a force there, (pulleys,), m."""
    c1, c2, _ = parameters
    depth: Array = 2.0 * force / (c2 + np.sqrt(c2**2 + 4.0 * c1 * force))
    return depth
