"""The state of a midpoint step of fixed length, and the motion of pulleys in it."""

from typing import NamedTuple

from frictionsim.mechanisms.belt_drive.effects.belt_friction import total_friction
from frictionsim.mechanisms.belt_drive.equation import prescribed_speeds, pulley_torques
from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel
from frictionsim.mechanisms.belt_drive.kernels.system import (
    ALPHA,
    INERTIA,
    PULLEY_RADIUS,
    SPEED,
    SPEED_OLD,
    TORQUE,
    Array,
    Contacts,
    Indices,
    Pulleys,
    System,
)

# The numbers in `counts`: steps, steps since the search for candidates, 1 if dampers along the belt
# are solved for now, and how many steps were taken so.
STEPS, SINCE_SEARCH, IMPLICIT_NOW, IMPLICIT_STEPS = range(4)


class MoreauState(NamedTuple):
    """An integration between two steps, in arrays that its kernels write to.

    Attributes
    ----------
    y_old, y : (size,)
        The states at the start and the end of the last step.
    rate : (size,)
        Workspace.
    new : (rows, width)
        The kinematics that y begins with: a view.
    middle : (rows, width)
        The kinematics in the middle of a step: a view of y_old in the plane, of rate on a line.
    counts : (4,)
        STEPS, SINCE_SEARCH, IMPLICIT_NOW, IMPLICIT_STEPS.
    """

    y_old: Array
    y: Array
    rate: Array
    new: Array
    middle: Array
    counts: Indices


@inline_kernel
def predict_pulleys(t: float, h: float, y: Array, y_old: Array, system: System) -> None:
    """Write SPEED_OLD at the start of a step, and SPEED and TORQUE in its middle.

    The speeds of free pulleys there are extrapolated from `y_old`, of the start of the step before.
    """
    pulley, free, speeds = system.pulleys.table, system.pulleys.free, system.layout.speeds
    prescribed_speeds(t, system)
    for k in range(len(free)):
        pulley[SPEED, free[k]] = y[speeds + k]
    for j in range(pulley.shape[1]):
        pulley[SPEED_OLD, j] = pulley[SPEED, j]
    for k in range(len(free)):
        speed, before = y[speeds + k], y_old[speeds + k]
        pulley[SPEED, free[k]] = speed + 0.5 * (speed - before)
    prescribed_speeds(t + 0.5 * h, system)
    pulley_torques(t + 0.5 * h, system)


@inline_kernel
def free_pulley_speeds(h: float, pulleys: Pulleys) -> None:
    """Write into ALPHA the speeds after the step, without friction where they are free."""
    pulley = pulleys.table
    for j in range(pulley.shape[1]):
        pulley[ALPHA, j] = pulley[SPEED, j]
    for j in pulleys.free:
        pulley[ALPHA, j] = pulley[SPEED_OLD, j] + h * pulley[TORQUE, j] / pulley[INERTIA, j]


@inline_kernel
def finish_pulleys(h: float, y: Array, system: System) -> None:
    """Write the state of the pulleys after a step and the energy that was put in; reads ALPHA."""
    pulley, free, layout = system.pulleys.table, system.pulleys.free, system.layout
    for k in range(len(free)):
        y[layout.speeds + k] = pulley[ALPHA, free[k]]
    mean_reaction_torques(h, system.contacts, system.pulleys)
    for j in range(pulley.shape[1]):
        mean = 0.5 * (pulley[SPEED_OLD, j] + pulley[ALPHA, j])
        y[layout.angles + j] += h * mean
        y[layout.energies] += h * pulley[TORQUE, j] * mean
        pulley[SPEED, j] = pulley[ALPHA, j]


@inline_kernel
def mean_reaction_torques(h: float, contacts: Contacts, pulleys: Pulleys) -> None:
    """Write the mean TORQUE that it took to keep a prescribed speed."""
    pulley = pulleys.table
    for j in pulleys.prescribed:
        gained = pulley[INERTIA, j] * (pulley[ALPHA, j] - pulley[SPEED_OLD, j])
        pulley[TORQUE, j] = (gained + pulley[PULLEY_RADIUS, j] * total_friction(j, contacts)) / h
