"""Channels of an epicyclic gear, and those of its default plot."""

from frictionsim.mechanisms.single_dof import (
    base_channels,
)
from frictionsim.results import Channel

CHANNELS = base_channels("crank") | {
    "angle": Channel("rad", "angle of the crank from the horizontal"),
    "planet_velocity": Channel("rad/s", "angular velocity of the planet"),
    "drive_torque": Channel("N m", "torque on the crank"),
    "uniform_torque": Channel("N m", "torque that would turn the crank uniformly forward here"),
    "normal_load": Channel("N", "load of the rolling friction at the mesh"),
    "friction_torque": Channel("N m", "friction of hinge and mesh, on the crank"),
    "tracer_x": Channel("m", "horizontal place of the tracer point"),
    "tracer_y": Channel("m", "vertical place of the tracer point"),
    "energy_input": Channel("J", "work of the torque on the crank"),
    "energy_kinetic": Channel("J", "kinetic energy of crank and planet"),
    "energy_potential": Channel("J", "potential energy of the weights in the equation"),
    "energy_friction": Channel("J", "heat of hinge and mesh"),
}
PANELS = ("drive_torque", "uniform_torque", "friction_torque", "angular_velocity", "angle")
