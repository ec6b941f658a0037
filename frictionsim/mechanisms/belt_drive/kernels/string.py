"""A belt without motion across itself: a string of mass points, guided along its pitch line.

The pitch line is that of an ideal taut belt: arcs of the pulleys' radii and straight spans. Each of
the n points has one coordinate s along it; joint k is before point k, and c = EA/l its stiffness
with the unstretched length l. With the middles m_k = (s_(k-1) + s_k)/2 the point k stands for the
belt from m_k to m_(k+1), of which the length a_k lies on the arc of a pulley of radius R:

    T_k   = c (s_k - s_(k-1) - l) + b (s_k' - s_(k-1)')
    N_k   = ((T_k + T_(k+1))/2 - m s_k'^2/(m_(k+1) - m_k)) a_k/R,   N_k >= 0
    m s_k'' = T_(k+1) - T_k + sigma F_k,     I omega' = M - R sum F_k
    slip  = R omega - sigma s_k',            |F_k| <= mu N_k

where sigma is +1 where the belt passes the pulley counter-clockwise, else -1, and F_k the friction,
by the same laws as for bodies in the plane [1]_. In full slip this is the equation of Euler and
Eytelwein, in creep that of Reynolds, both to second order in l.

There is no bending, weight, vibration across the belt, sag, lift-off from a pulley, or penetration
of a contact. Where the belt would have to leave its line, its normal force is zero and a joint
under pressure pushes: the run warns of both.

Points do not overtake each other. Those near a pulley have numbers that follow each other, but for
one place where the last one is followed by the first: they are listed as runs, over which a loop
needs no table of indices.

References
----------
.. [1] M. J. Leamy, T. M. Wasfy, "Analysis of belt-drive mechanics using a creep-rate-dependent
   friction law", Journal of Applied Mechanics 69(6), 2002.
"""

from typing import TYPE_CHECKING

import numpy as np

from frictionsim.mechanisms.belt_drive.effects.belt_friction import slip_velocities, solve_friction
from frictionsim.mechanisms.belt_drive.kernels.contacts import (
    add_candidate,
    fill_up,
    save_modes,
    set_initial_mode,
)
from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel
from frictionsim.mechanisms.belt_drive.kernels.system import (
    ACROSS,
    ARC_LENGTH,
    ARC_START,
    BODY_VX,
    BODY_VY,
    FRICTION,
    INV_DISTANCE,
    MIDDLE,
    NORMAL,
    NX,
    NY,
    POSITION,
    PULLEY_RADIUS,
    RADIUS,
    SPEED,
    TENSION,
    VELOCITY,
    Array,
    Chain,
    Contacts,
    PitchLine,
    System,
)

if TYPE_CHECKING:
    from frictionsim.mechanisms.belt_drive.effects.axial import AxialParameters


# A point is a candidate this many body lengths before its arc and after it: half a length, or more
# where it is stretched, touches first, and the rest is for the steps until the next search.
SKIN = 2.0

# Rows of the runs: number of the first point and of the first candidate, how many there are, and
# their pulley.
FIRST_POINT, FIRST_CANDIDATE, COUNT, PULLEY = range(4)
RUN_ROWS = 4


@inline_kernel
def search_line(line: PitchLine, system: System, kinematics: Array) -> None:
    """Make candidates of the points on the arcs, and near their ends.

    NX and NY are the normal in the frame of the belt, whose first axis is along it.
    """
    contacts, pulley = system.contacts, system.pulleys.table
    position, velocity = kinematics[POSITION], kinematics[VELOCITY]
    table, runs, skin = contacts.table, line.runs, SKIN * system.chain.length
    save_modes(contacts)
    s, run = 0, -1
    for j in range(pulley.shape[1]):
        contacts.offsets[j] = first = s
        before = -2
        for i in range(system.chain.bodies):
            turns = np.floor((position[i] - line.starts[j] + skin) / line.length)
            start = line.starts[j] + turns * line.length
            if position[i] - start < line.arcs[j] + skin:
                if i != before + 1:
                    run += 1
                    runs[FIRST_POINT, run], runs[FIRST_CANDIDATE, run] = i, s
                    runs[COUNT, run], runs[PULLEY, run] = 0, j
                runs[COUNT, run] += 1
                before = i
                add_candidate(contacts, s, i, pulley[PULLEY_RADIUS, j])
                rim = pulley[PULLEY_RADIUS, j] * pulley[SPEED, j]
                set_initial_mode(contacts, s, rim - line.senses[j] * velocity[i])
                table[ARC_START, s], table[ARC_LENGTH, s] = start, line.arcs[j]
                s += 1
        s = fill_up(contacts, first, s)
        for k in range(first, s):
            table[NX, k], table[NY, k] = 0.0, -line.senses[j]
            table[BODY_VY, k] = table[INV_DISTANCE, k] = 0.0
    contacts.offsets[-1] = s
    line.run_count[0] = run + 1


@inline_kernel
def string_accelerations(
    line: PitchLine, h: float, state: Array, rate: Array, system: System
) -> float:
    """Write the accelerations of the points; return the power their dampers take, W."""
    layout, axial = system.layout, system.effects.axial_damping
    position = state[: layout.velocities]
    velocity = state[layout.velocities : layout.angles]
    acceleration = rate[layout.velocities : layout.angles]
    tensions(line.length, axial, system.chain, position, system.workspace)
    damped = add_damping(axial.damping, velocity, system.workspace[TENSION], system.chain)
    tension, inv_mass = system.workspace[TENSION], 1.0 / system.chain.mass
    for k in range(system.chain.bodies):
        acceleration[k] = inv_mass * (tension[k + 1] - tension[k])
    string_normal_forces(line, velocity, system)
    for s in range(system.contacts.offsets[-1]):
        system.contacts.table[BODY_VX, s] = velocity[system.contacts.body[s]]
    across = system.workspace[ACROSS]
    slip_velocities(system.contacts, system.pulleys)
    solve_friction(system.effects.belt_friction, system, acceleration, across, h)
    add_friction(inv_mass, system.contacts, acceleration)
    return damped


@inline_kernel
def add_friction(inv_mass: float, contacts: Contacts, acceleration: Array) -> None:
    """Add what the friction accelerates along the line."""
    friction, ny, body = contacts.table[FRICTION], contacts.table[NY], contacts.body
    for s in range(contacts.offsets[-1]):
        acceleration[body[s]] -= inv_mass * friction[s] * ny[s]


@inline_kernel
def tensions(
    length: float, axial: "AxialParameters", chain: Chain, position: Array, workspace: Array
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
def add_damping(damping: float | None, velocity: Array, tension: Array, chain: Chain) -> float:
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
def string_normal_forces(line: PitchLine, velocity: Array, system: System) -> None:
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
