"""The line that a string is guided along, and the points of the string that are near a pulley.

Points do not overtake each other. Those near a pulley have numbers that follow each other, but for
one place where the last one is followed by the first: they are listed as runs, over which a loop
needs no table of indices.
"""

from typing import TYPE_CHECKING

import numpy as np

from frictionsim.mechanisms.belt_drive.kernels.candidate_list import (
    add_candidate,
    fill_up,
    save_modes,
    set_initial_mode,
)
from frictionsim.mechanisms.belt_drive.kernels.jit import inline_kernel
from frictionsim.mechanisms.belt_drive.kernels.layout import (
    ARC_LENGTH,
    ARC_START,
    BODY_VY,
    INV_DISTANCE,
    NX,
    NY,
    POSITION,
    PULLEY_RADIUS,
    SPEED,
    VELOCITY,
)

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.kernels.system import PitchLine, System

    Array = npt.NDArray[np.float64]
    Indices = npt.NDArray[np.int64]

# A point is a candidate this many body lengths before its arc and after it: half a length, or more
# where it is stretched, touches first, and the rest is for the steps until the next search.
SKIN = 2.0

# Rows of the runs: number of the first point and of the first candidate, how many there are, and
# their pulley.
FIRST_POINT, FIRST_CANDIDATE, COUNT, PULLEY = range(4)
RUN_ROWS = 4


@inline_kernel
def line_candidates(line: "PitchLine | None", system: "System", kinematics: "Array") -> None:
    """Make candidates of the points on the arcs, and near their ends.

    NX and NY are the normal in the frame of the belt, whose first axis is along it.
    """
    if line is not None:
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
