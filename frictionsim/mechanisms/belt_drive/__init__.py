"""A belt drive: thin rigid bodies joined by springs and dampers, on any number of pulleys.

Each body has (x, y, phi), each pulley an angle: 3 nb + np degrees of freedom [1]_. The model is in

    parameters     the scenario's tables
    path           the line of an ideal belt round its pulleys
    equilibrium    the belt at rest at its pretension
    chain          forces between the bodies
    contact        normal forces of the pulleys, and friction with exact stick
    courses        torques and speeds over time
    equations      the rate of the state, of the above
    waves          the fastest frequency and decay, which bound the steps
    assembly       from a scenario to arrays
    belt_drive     from step to step
    observation    what is recorded
    spans          the tension of each span
    figures        the summary and the audit, of which torque_balance is a part
    run_warnings   what to know before trusting them
    cost           what the cost of accuracy is judged by, and the settings to compare

References
----------
.. [1] K. Kubas, "A two-dimensional discrete model for dynamic analysis of belt transmission with
   dry friction", Archive of Mechanical Engineering 61(4), 2014.
"""

from typing import TYPE_CHECKING

from frictionsim.mechanisms.belt_drive.schema import Scene
from frictionsim.mechanisms.belt_drive.work_precision import MEASURES, ladders, references, tighter
from frictionsim.results import Quantities

if TYPE_CHECKING:
    from frictionsim.simulation.base import Simulation

__all__ = [
    "MEASURES",
    "PANELS",
    "Scene",
    "ladders",
    "references",
    "simulation",
    "statics",
    "tighter",
]

# What a plot shows, from top to bottom.
PANELS = ("pulley_torque", "pulley_speed", "pulley_angle")


def simulation(scene: Scene) -> "Simulation":
    """Return what simulates a scene."""
    from frictionsim.mechanisms.belt_drive.simulation import (
        BeltDrive,  # numba, if it is needed at all
    )

    return BeltDrive(scene)


def statics(scene: Scene) -> Quantities:
    """Return the belt at rest at its pretension, without friction."""
    from frictionsim.mechanisms.belt_drive.statics import rest_figures

    return rest_figures(scene)
