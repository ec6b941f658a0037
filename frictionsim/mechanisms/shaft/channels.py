"""Channels of a body on a shaft, and those of its default plot."""

from frictionsim.mechanisms.journal import CHANNELS as JOURNAL_CHANNELS
from frictionsim.mechanisms.single_dof import base_channels
from frictionsim.results import Channel

CHANNELS = base_channels("body") | {
    "angle": Channel("rad", "angle of the body, positive counter-clockwise"),
    "applied_torque": Channel("N m", "torque on the body, of all but dry friction and end stops"),
    "drive_torque": Channel("N m", "torque of the drive that gives the speed, one of the applied"),
    "stop_torque": Channel("N m", "torque of an end stop on the body that rests on it"),
    "shaft_reaction": Channel("N", "reaction of the shaft"),
    **JOURNAL_CHANNELS,
    "reaction_x": Channel("N", "reaction of the shaft on the body, component to the right"),
    "reaction_y": Channel("N", "reaction of the shaft on the body, component upwards"),
    "energy_input": Channel("J", "work of the forces and couples"),
    "energy_kinetic": Channel("J", "kinetic energy of the body"),
    "energy_potential": Channel("J", "potential energy of the eccentric mass and the spring"),
    "energy_damping": Channel("J", "heat of viscous damping"),
    "energy_impact": Channel("J", "energy lost in impacts on the end stops"),
}
PANELS = ("drive_torque", "applied_torque", "friction_torque", "angular_velocity", "angle")
