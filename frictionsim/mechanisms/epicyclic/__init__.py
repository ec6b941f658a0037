"""An epicyclic gear: a crank carries a planet that rolls on a fixed sun.

phi is the angle of the crank from the horizontal, L = r1 + r2 its length, lambda = L/r2 the
rotations of the planet per turn of the crank, G the weights. Formulation `consistent` (derived by
both Lagrange and Newton-Euler):

    J phi'' = M_O - K cos phi + T,   J = (2 m_OA + 9 m_2) L^2/6,   K = (G_OA/2 + G_2) L
    sliding    T = -s (M_A r1/r2 + f N lambda)
    sticking   T holds while |T| <= M_As r1/r2 + f |G_2 sin phi| lambda
    N = |G_2 sin phi| (`weight`) or |G_2 sin phi - m_2 L phi'^2| (`radial`)

M_A is the friction couple of the hinge between planet and crank; its power is that of their
relative rotation phi' r1/r2. f is the arm of rolling friction at the mesh. The distribution of the
planet's radial load between crank and mesh is indeterminate; `normal_load` states an assumption.

Formulation `published` is eq 26 of [1]_ as published, for all directions of motion:

    J phi'' = M_O - (G_OA/2 + 2 G_2) L cos phi - M_A lambda - f G_2 sin phi lambda

It counts the weight of the planet twice, applies the couple of the hinge against the ground, and
its friction has positive power where phi' < 0 or sin phi < 0; it cannot stick.

References
----------
.. [1] Z. Mchedlishvili, Z. Tsitskishvili, doi 10.36073/1512-0996-2026-1-143-147.
"""

from frictionsim.mechanisms.epicyclic.channels import CHANNELS as CHANNELS
from frictionsim.mechanisms.epicyclic.channels import PANELS as PANELS
from frictionsim.mechanisms.epicyclic.equation import build as build
from frictionsim.mechanisms.epicyclic.equation import uniform_torque_mean as uniform_torque_mean
from frictionsim.mechanisms.epicyclic.schema import EpicyclicScenario
from frictionsim.mechanisms.epicyclic.statics import statics as statics
from frictionsim.mechanisms.single_dof import METRICS as METRICS
from frictionsim.mechanisms.single_dof import simulation_of

SCENARIO = EpicyclicScenario
simulation = simulation_of(build)
