"""A pulley on a dry fixed shaft. See `pulley.equation`."""

from frictionsim.mechanisms.pulley.equation import build as build
from frictionsim.mechanisms.pulley.schema import CHANNELS as CHANNELS
from frictionsim.mechanisms.pulley.schema import PANELS as PANELS
from frictionsim.mechanisms.pulley.schema import PulleyScenario
from frictionsim.mechanisms.pulley.statics import statics as statics
from frictionsim.mechanisms.single_dof import METRICS as METRICS
from frictionsim.mechanisms.single_dof import simulation_of

SCENARIO = PulleyScenario
simulation = simulation_of(build)
