"""Channels of a pulley, and those of its default plot."""

from frictionsim.mechanisms.journal import CHANNELS as JOURNAL_CHANNELS
from frictionsim.mechanisms.single_dof import (
    SINGLE_DOF_MODES,
    base_channels,
)
from frictionsim.results import Channel

SLACK_SIDES = ((0, "none"), (1, "car"), (2, "counterweight"), (3, "both"))
CHANNELS = base_channels("pulley") | {
    "angle": Channel("rad", "angle of the pulley, positive where the load rises"),
    "drive_force": Channel("N", "force on the cord"),
    "drive_torque": Channel("N m", "torque on the pulley"),
    "shaft_reaction": Channel("N", "reaction of the shaft"),
    **JOURNAL_CHANNELS,
    "rope_tension_car": Channel("N", "tension of the cord on the side of the car"),
    "rope_tension_counterweight": Channel(
        "N", "tension of the cord on the side of the counterweight"
    ),
    "car_position": Channel("m", "height of the car above its start"),
    "car_velocity": Channel("m/s", "velocity of the car, upward"),
    "car_acceleration": Channel("m/s^2", "acceleration of the car, upward"),
    "counterweight_position": Channel("m", "height of the counterweight above its start"),
    "counterweight_velocity": Channel("m/s", "velocity of the counterweight, upward"),
    "slack": Channel("1", "sides on which the cord is slack", integer=True, flags=SLACK_SIDES),
    "cord_slip": Channel("m", "slip of the cord on the pulley, positive when lifting"),
    "cord_mode": Channel(
        "1", "of the cord on the pulley: 0 sticking, +1 and -1 slipping", "", True, SINGLE_DOF_MODES
    ),
    "energy_input": Channel("J", "work of the drive"),
    "energy_kinetic": Channel("J", "kinetic energy of the pulley and of the masses on the cord"),
    "energy_potential": Channel("J", "potential energy of the load and of the masses"),
    "energy_damping": Channel("J", "heat of viscous damping"),
    "energy_cord_friction": Channel("J", "heat of the cord slipping over the pulley"),
    "energy_impact": Channel("J", "energy lost when a slack cord becomes taut"),
}
# The channels of the default plot, from top to bottom.
PANELS = (
    "drive_force",
    "drive_torque",
    "rope_tension_car",
    "rope_tension_counterweight",
    "friction_torque",
    "angular_velocity",
    "angle",
    "car_velocity",
    "car_position",
    "cord_slip",
)
