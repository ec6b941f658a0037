"""A belt drive: thin rigid bodies joined by springs and dampers, on any number of pulleys.

Each body has (x, y, phi), each pulley an angle: 3 nb + np degrees of freedom [1]_. A scenario
without contact asks for no motion across the belt, which is then a string guided along its line,
of nb + np degrees of freedom. The model is in

    schema            the scenario's tables, and the channels of its results
    geometry          the line of an ideal belt round its pulleys
    energy            the energies that a belt stores, and their gradient
    equilibrium       the belt at rest, where the energy is least, and its quantities
    belt              from a scenario to numbers and rows, one flat tuple
    limits            waves, dampers and friction, which bound the steps; scales of errors
    compilation       decorators of kernels, and where compiled ones are kept
    kernels           the equations of motion, compiled
    dampers           those along the belt that fixed steps solve for
    rkf45, moreau     the methods
    belt_simulation   from step to step
    sampling          the channels, and what summary and audit need of each sample
    slip              the slip of the drive, and the tensions of its spans
    quantities        the summary and the audit
    transitions       full slip and grip, lift-off, slack spans
    run_warnings      the warnings of a run
    study             metrics, settings and meshes of a study of cost and accuracy

References
----------
.. [1] K. Kubas, "A two-dimensional discrete model for dynamic analysis of belt transmission with
   dry friction", Archive of Mechanical Engineering 61(4), 2014.
"""

from typing import TYPE_CHECKING

from frictionsim.mechanisms.belt_drive import study as mesh_study
from frictionsim.mechanisms.belt_drive.equilibrium import statics
from frictionsim.mechanisms.belt_drive.schema import PANELS, BeltDriveScenario
from frictionsim.mechanisms.belt_drive.study import METRICS, ladders, references, tighter

if TYPE_CHECKING:
    from frictionsim.simulation.mechanism import Simulation

__all__ = [
    "METRICS",
    "PANELS",
    "SCENARIO",
    "ladders",
    "mesh_study",
    "references",
    "simulation",
    "statics",
    "tighter",
]


SCENARIO = BeltDriveScenario


def simulation(scenario: BeltDriveScenario) -> "Simulation":
    """Return the simulation of a scenario."""
    from frictionsim.mechanisms.belt_drive.belt_simulation import BeltDrive

    return BeltDrive(scenario)
