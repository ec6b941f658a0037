"""A pulley on a dry shaft in motion, with its load."""

from typing import TYPE_CHECKING

import numpy as np

from frictionsim.motion.frames import channel_at, frame_times, state_at
from frictionsim.motion.parts import Body, Disc, Line, Motion
from frictionsim.scenario.recorded import scenario_value

if TYPE_CHECKING:
    from frictionsim.results import Record

SHAFT_SEEN = 0.04  # of the pulley's radius: a thinner shaft is drawn so


def motion(result: "Record") -> Motion:
    """Return the motion of a result.

    Raises
    ------
    InputError
        If it lacks samples, channels or keys.
    """
    times = frame_times(result)
    radius = float(scenario_value(result, "mechanism", "cord_radius"))
    angle = channel_at(result, "angle", times)
    still = np.zeros_like(times)
    mark = np.array([[0.0, 0.0], [0.0, radius]])
    wheel = Body(
        "pulley", (Disc(0.0, 0.0, radius, "moving"), Line(mark, "marked")), still, still, angle
    )
    shaft = Body("shaft", (Disc(0.0, 0.0, SHAFT_SEEN * radius, "fixed"),), still, still, still)
    state = state_at(result, "mode", times) if "mode" in result.channels else None
    reach = 1.2 * radius
    return Motion(times, (wheel, shaft), (-reach, reach, -reach, reach), state)
