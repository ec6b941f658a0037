"""The rates of a guided string: tensions, normal forces and friction, in the order of a step."""

from typing import TYPE_CHECKING

import numpy as np

from frictionsim.mechanisms.belt_drive.effects.belt_friction import (
    slip_velocities,
    solve_friction,
)
from frictionsim.mechanisms.belt_drive.guided_string.line import (
    COUNT,
    FIRST_CANDIDATE,
    FIRST_POINT,
)
from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel
from frictionsim.mechanisms.belt_drive.kernels.layout import (
    ACROSS,
    ARC_LENGTH,
    ARC_START,
    BODY_VX,
    FRICTION,
    MIDDLE,
    NORMAL,
    NY,
    RADIUS,
    TENSION,
)

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.effects.axial import AxialParameters
    from frictionsim.mechanisms.belt_drive.effects.base import Chain
    from frictionsim.mechanisms.belt_drive.kernels.system import Contacts, PitchLine, System

    Array = npt.NDArray[np.float64]


@inline_kernel
def string_rates(
    line: "PitchLine | None", h: float, state: "Array", rate: "Array", system: "System"
) -> float:
    """Write the accelerations of a guided string; return the power its dampers take, W.

    h is the length of the step, s, that the published creep law asks for.
    """
    damped = 0.0
    if line is not None:
        layout, axial = system.layout, system.effects.axial_damping
        position = state[: layout.velocities]
        velocity = state[layout.velocities : layout.angles]
        acceleration = rate[layout.velocities : layout.angles]
        tensions(line.length, axial, system.chain, position, system.workspace)
        damped = add_damping(axial.damping, velocity, system.workspace[TENSION], system.chain)
        tension, inv_mass = system.workspace[TENSION], 1.0 / system.chain.mass
        for k in range(system.chain.bodies):
            acceleration[k] = inv_mass * (tension[k + 1] - tension[k])
        normal_forces(line, velocity, system)
        for s in range(system.contacts.offsets[-1]):
            system.contacts.table[BODY_VX, s] = velocity[system.contacts.body[s]]
        across = system.workspace[ACROSS]
        slip_velocities(system.contacts, system.pulleys)
        solve_friction(system.effects.belt_friction, system, acceleration, across, h)
        add_friction(inv_mass, system.contacts, acceleration)
    return damped


@inline_kernel
def add_friction(inv_mass: float, contacts: "Contacts", acceleration: "Array") -> None:
    """Add what the friction accelerates along the line."""
    friction, ny, body = contacts.table[FRICTION], contacts.table[NY], contacts.body
    for s in range(contacts.offsets[-1]):
        acceleration[body[s]] -= inv_mass * friction[s] * ny[s]


@inline_kernel
def tensions(
    length: float, axial: "AxialParameters", chain: "Chain", position: "Array", workspace: "Array"
) -> None:
    """Write the TENSION of the joints' springs, and the MIDDLE of each joint.

    `length` is that of the line, m. Joint n, behind the last point, is joint 0 a round further on.
    """
    n, c, rest = chain.bodies, axial.stiffness, axial.stiffness * chain.length
    tension, middle = workspace[TENSION], workspace[MIDDLE]
    for k in range(1, n):
        tension[k] = c * (position[k] - position[k - 1]) - rest
    for k in range(1, n):
        middle[k] = 0.5 * (position[k] + position[k - 1])
    tension[n] = c * (position[0] + length - position[n - 1]) - rest
    middle[n] = 0.5 * (position[0] + length + position[n - 1])
    tension[0], middle[0] = tension[n], middle[n] - length


@inline_kernel
def add_damping(
    damping: float | None, velocity: "Array", tension: "Array", chain: "Chain"
) -> float:
    """Add the forces of the dampers to the tensions; return the power that they take, W."""
    power = 0.0
    if damping is not None:
        n = chain.bodies
        for k in range(1, n):
            rate = velocity[k] - velocity[k - 1]
            tension[k] += damping * rate
            power += damping * rate * rate
        rate = velocity[0] - velocity[n - 1]
        tension[n] += damping * rate
        power += damping * rate * rate
        tension[0] = tension[n]
    return power


@inline_kernel
def normal_forces(line: "PitchLine", velocity: "Array", system: "System") -> None:
    """Write NORMAL; reads TENSION and MIDDLE."""
    table, mass = system.contacts.table, system.chain.mass
    tension, middle = system.workspace[TENSION], system.workspace[MIDDLE]
    for run in range(line.run_count[0]):
        i, s, count = (
            line.runs[FIRST_POINT, run],
            line.runs[FIRST_CANDIDATE, run],
            line.runs[COUNT, run],
        )
        start, arc, inv_radius = table[ARC_START, s], table[ARC_LENGTH, s], 1.0 / table[RADIUS, s]
        normal = table[NORMAL, s : s + count]
        before, after = middle[i : i + count], middle[i + 1 : i + 1 + count]
        pull, pull_after = tension[i : i + count], tension[i + 1 : i + 1 + count]
        v = velocity[i : i + count]
        for k in range(count):
            on_arc = min(max(after[k] - start, 0.0), arc) - min(max(before[k] - start, 0.0), arc)
            force = 0.5 * (pull[k] + pull_after[k]) - mass * v[k] * v[k] / (after[k] - before[k])
            normal[k] = max(force * on_arc * inv_radius, 0.0)
