"""An epicyclic gear on a fixed sun or in a fixed ring. See `epicyclic.equation`."""

from frictionsim.mechanisms.epicyclic.equation import build as build
from frictionsim.mechanisms.epicyclic.equation import statics as statics
from frictionsim.mechanisms.epicyclic.schema import CHANNELS as CHANNELS
from frictionsim.mechanisms.epicyclic.schema import PANELS as PANELS
from frictionsim.mechanisms.epicyclic.schema import EpicyclicScenario
from frictionsim.mechanisms.single_dof import METRICS as METRICS
from frictionsim.mechanisms.single_dof import simulation_of

SCENARIO = EpicyclicScenario
simulation = simulation_of(build)
