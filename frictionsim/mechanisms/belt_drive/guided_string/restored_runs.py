"""What the runs of candidates of a guided string may hold in a checkpoint."""

from typing import TYPE_CHECKING

import numpy as np

from frictionsim.mechanisms.belt_drive.guided_string.line import PitchLine
from frictionsim.mechanisms.belt_drive.kernels.layout import PULLEY_RADIUS, RADIUS
from frictionsim.mechanisms.belt_drive.restored_contacts import offsets_fault
from frictionsim.solvers.state_values import Expected, Values

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.kernels.system import System

    Indices = npt.NDArray[np.int64]


def run_values(line: PitchLine, system: "System") -> dict[str, Expected]:
    """Return what the arrays of the runs may hold, by name."""
    capacity = max(len(system.contacts.body), system.layout.bodies)
    return {
        "runs": Values(0.0, capacity, whole=True),
        "run_count": Values(0.0, line.runs.shape[1], whole=True),
    }


def run_fault(line: PitchLine, system: "System") -> str:
    """Return the array that does not go with the others; empty if all do.

    A run lists candidates of one pulley and points that follow each other; each candidate that is
    near a pulley is in one run.
    """
    if fault := offsets_fault(system):
        return fault
    contacts, radii = system.contacts, system.pulleys.table[PULLEY_RADIUS]
    points, candidates, counts, pulleys = line.runs[:, : int(line.run_count[0])]
    if np.any(counts < 1) or np.any(pulleys >= len(radii)):
        return "runs"
    low, high = contacts.offsets[pulleys], contacts.offsets[pulleys + 1]
    inside = (candidates >= low) & (candidates + counts <= high)
    if not np.all(inside & (points + counts <= system.layout.bodies)):
        return "runs"
    near = np.flatnonzero(contacts.table[RADIUS, : contacts.offsets[-1]] > 0.0)
    if np.sum(counts) != len(near):
        return "runs"
    listed = _counted_from(candidates, counts)
    if not np.array_equal(listed, near):
        return "runs"
    if not np.array_equal(contacts.body[listed].astype(np.int64), _counted_from(points, counts)):
        return "contact_bodies"
    radius = contacts.table[RADIUS, listed]
    return "" if np.array_equal(radius, np.repeat(radii[pulleys], counts)) else "contacts"


def _counted_from(starts: "Indices", counts: "Indices") -> "Indices":
    """Return start, start + 1, ... of each run, one behind the other."""
    before = np.cumsum(counts) - counts
    numbers: Indices = np.repeat(starts - before, counts) + np.arange(int(np.sum(counts)))
    return numbers
