"""A marble machine on a dry shaft. See `marble_machine.equation`."""

from frictionsim.mechanisms.marble_machine.equation import build as build
from frictionsim.mechanisms.marble_machine.schema import CHANNELS as CHANNELS
from frictionsim.mechanisms.marble_machine.schema import PANELS as PANELS
from frictionsim.mechanisms.marble_machine.schema import MarbleMachineScenario
from frictionsim.mechanisms.marble_machine.statics import statics as statics
from frictionsim.mechanisms.single_dof import METRICS as METRICS
from frictionsim.mechanisms.single_dof import simulation_of

SCENARIO = MarbleMachineScenario
simulation = simulation_of(build)
