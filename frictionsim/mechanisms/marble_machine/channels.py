"""Channels of a marble machine, and those of its default plot."""

from frictionsim.mechanisms.journal import CHANNELS as JOURNAL_CHANNELS
from frictionsim.mechanisms.single_dof import (
    base_channels,
)
from frictionsim.results import Channel

CHANNELS = base_channels("gear") | {
    "friction_torque": Channel("N m", "torque of the dry friction, along the angle of the gear"),
    "motor_torque": Channel("N m", "torque on the pinion"),
    "load_torque": Channel("N m", "moment of the marbles, against the angle of the gear"),
    "shaft_reaction": Channel("N", "reaction of the shaft of the gear"),
    **JOURNAL_CHANNELS,
    "tooth_force_tangential": Channel("N", "force of the pinion's teeth on the gear, tangential"),
    "tooth_force_radial": Channel("N", "force of the pinion's teeth on the gear, to its axis"),
    "carried_marbles": Channel("1", "marbles on the gear", integer=True),
    "energy_input": Channel("J", "work of the torque on the pinion"),
    "energy_kinetic": Channel("J", "kinetic energy of gear, marbles and motor"),
    "energy_potential": Channel("J", "potential energy of the marbles, delivered ones included"),
    "energy_damping": Channel("J", "heat of viscous damping"),
}
PANELS = ("motor_torque", "load_torque", "friction_torque", "angular_velocity", "angle")
