"""Channels of a belt drive, and those of its default plot."""

from collections.abc import Sequence

from frictionsim.results import Channel

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
