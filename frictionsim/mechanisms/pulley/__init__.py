"""A pulley on a dry fixed shaft: a force P on the cord lifts, holds or lowers a load W.

    I dw/dt = (P - W) r_e - b w + T,    |T| <= r_s R sticking,    T = -s r_k R sliding [1]_

theta > 0 lifts the load. The reaction of the shaft is R = |P + W| with P vertical and
sqrt(P^2 + W^2) with P horizontal. W and P are forces: as in the paper, the equation neglects the
inertia of the load, its effect on the cord tension, and the weight of the pulley. A torque on the
pulley may take the place of the force P. Masses on the cord, which may then fall slack or slip,
are in `masses`.

References
----------
.. [1] "Analysis of friction systems on shafts", Int. J. Applied Engineering Research 13(11),
   2018, 8871-8881, eqs 24 and 49-52.
"""

from frictionsim.mechanisms.pulley.channels import CHANNELS as CHANNELS
from frictionsim.mechanisms.pulley.channels import PANELS as PANELS
from frictionsim.mechanisms.pulley.equation import build as build
from frictionsim.mechanisms.pulley.schema import PulleyScenario
from frictionsim.mechanisms.pulley.statics import limit_forces as limit_forces
from frictionsim.mechanisms.pulley.statics import statics as statics
from frictionsim.mechanisms.single_dof import METRICS as METRICS
from frictionsim.mechanisms.single_dof import simulation_of

SCENARIO = PulleyScenario
simulation = simulation_of(build)
