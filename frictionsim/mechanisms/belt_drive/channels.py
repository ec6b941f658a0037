"""Channels of a belt drive, those of its default plot, and the samples of a run."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from frictionsim.results import Channel

if TYPE_CHECKING:
    import numpy.typing as npt

    from frictionsim.mechanisms.belt_drive.schema import BeltDriveScenario

    Array = npt.NDArray[np.float64]

CHANNELS = {
    "pulley_angle": Channel("rad", "angle of the pulley", "pulley"),
    "pulley_speed": Channel("rad/s", "angular velocity of the pulley", "pulley"),
    "pulley_torque": Channel("N m", "torque on the pulley from outside", "pulley"),
    "x": Channel("m", "x of the body's centre", "body"),
    "y": Channel("m", "y of the body's centre", "body"),
    "angle": Channel("rad", "angle of the body", "body"),
    "normal_force": Channel("N", "normal force of the pulley on the body", "body"),
    "friction_force": Channel("N", "friction of the rim on the belt, along z x n", "body"),
    "slip_velocity": Channel("m/s", "velocity of the rim less that of the belt on it", "body"),
    "sticking": Channel(
        "1",
        "1 where the body sticks to a pulley, else 0",
        "body",
        integer=True,
        flags=((0, "not_sticking"), (1, "sticking")),
    ),
    "pulley_index": Channel(
        "1",
        "pulley that the body touches, -1 none",
        "body",
        integer=True,
        flags=((-1, "none"),),  # a scenario's own pulleys: `channel_info`
    ),
    "tension": Channel("N", "tension, of the joint before the body", "joint"),
    "friction_work": Channel("J", "friction work of the body on all pulleys", "body"),
    "pulley_friction_work": Channel("J", "friction work of all bodies on the pulley", "pulley"),
    "energy_input": Channel("J", "work of the torques on the pulleys"),
    "energy_kinetic": Channel("J", "kinetic energy of belt and pulleys"),
    "energy_potential": Channel("J", "energy of springs and contacts, and of the weight"),
    "energy_friction": Channel("J", "heat of the dry friction"),
    "energy_damping": Channel("J", "heat of the dampers in belt and contacts"),
}
PANELS = ("pulley_torque", "pulley_speed", "pulley_angle")


def channels_of(pulleys: Sequence[str]) -> dict[str, Channel]:
    """Return the channels of a belt on named pulleys: the meanings of `pulley_index`."""
    index = CHANNELS["pulley_index"]
    flags = (*index.flags, *enumerate(pulleys))
    return CHANNELS | {"pulley_index": index._replace(flags=flags)}


class BeltSamples(NamedTuple):
    """The samples of a run, from which summary, audit, transitions and warnings follow.

    Attributes
    ----------
    scenario : BeltDriveScenario
    body_length : float, m
        Unstretched.
    pretension : float, N
        The mean tension at rest.
    time : (n,), s
    seen : dict of (n, ...)
        What `sampling` keeps of each sample, by name.
    """

    scenario: "BeltDriveScenario"
    body_length: float
    pretension: float
    time: "Array"
    seen: "dict[str, Array]"

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the pulleys."""
        return self.scenario.mechanism.names

    @property
    def spans(self) -> list[tuple[str, str]]:
        """The names of the pulleys that each span leads from and to."""
        return list(zip(self.names, (*self.names[1:], self.names[0]), strict=True))

    @property
    def radii(self) -> "Array":
        """The radii of the pulleys, (pulleys,), m."""
        return np.array([pulley.radius for pulley in self.scenario.mechanism.pulleys])
