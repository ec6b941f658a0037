"""A marble machine on a dry shaft. See `marble_machine.equation`."""

from frictionsim.mechanisms.marble_machine.channels import CHANNELS as CHANNELS
from frictionsim.mechanisms.marble_machine.channels import PANELS as PANELS
from frictionsim.mechanisms.marble_machine.equation import build as build
from frictionsim.mechanisms.marble_machine.schema import MarbleMachineScenario
from frictionsim.mechanisms.marble_machine.statics import statics_of
from frictionsim.mechanisms.single_dof import METRICS as METRICS
from frictionsim.mechanisms.single_dof import simulation_of
from frictionsim.results import Quantities

SCENARIO = MarbleMachineScenario
simulation = simulation_of(build)


def statics(scenario: MarbleMachineScenario) -> Quantities:
    """Return the torques of impending motion on the pinion (eq 24) and their components."""
    return statics_of(scenario.mechanism, scenario.effects, scenario.drive.motor)
