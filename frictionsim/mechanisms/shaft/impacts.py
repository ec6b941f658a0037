"""Impacts of a body on its end stops: their number and speeds, and a warning of too many."""

from typing import Any

from frictionsim.results import Quantities, Quantity
from frictionsim.solvers.end_stops import EVENT
from frictionsim.solvers.mechanism import Trajectory

# A run with more impacts has a capture speed that is far below the speeds of its motion.
MANY_IMPACTS = 1000


def impact_quantities(trajectory: Trajectory) -> Quantities:
    """Return the number of impacts and the largest speed of one; None if there was none."""
    speeds = impact_speeds(trajectory)
    largest = float(speeds.max()) if speeds.size else None
    return {
        "impacts": Quantity(float(speeds.size), "1"),
        "impact_speed_max": Quantity(largest, "rad/s"),
    }


def impact_speeds(trajectory: Trajectory) -> Any:
    """Return the speeds of the body immediately before its impacts, (m,), rad/s.

    Events after the last sample, which a failed run may have, are ignored.
    """
    import numpy as np  # imported here because `check` does not need it

    if trajectory.velocity_before is None:
        return np.empty(0)
    end = trajectory.time[-1] if trajectory.time.size else -np.inf
    hits = [
        event.contact == EVENT and event.time <= end and speed != 0.0
        for event, speed in zip(trajectory.transitions, trajectory.velocity_before, strict=True)
    ]
    return np.abs(trajectory.velocity_before[np.array(hits, dtype=bool)])


def many_impacts(trajectory: Trajectory) -> list[str]:
    """Warn if the body bounces so often that the capture speed seems far too low."""
    count = impact_speeds(trajectory).size
    if count < MANY_IMPACTS:
        return []
    return [
        f"{count} impacts on the end stops, most of them negligible bounces; increase"
        " effects.end_stops.capture_speed"
    ]
