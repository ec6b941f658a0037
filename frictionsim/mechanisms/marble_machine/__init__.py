"""A marble machine: a pinion drives a gear whose slots lift marbles, on a dry shaft.

theta is the angle of the gear. n = slots/2 marbles are on its rising half, at the angles
delta + p j from the bottom, j = 0 .. n - 1, with the pitch p = 2 pi/slots and
delta = theta mod p. When delta reaches p, one marble leaves at the top and the next is picked up
at the bottom.

    I theta'' = k T_p - M_L(theta) - b theta' + T,    I = I_gear + n m R^2 + k^2 J
    M_L = m g R sum_j sin(delta + p j) = m g R cos(delta - p/2)/sin(p/2)
    |T| <= r_s R_shaft sticking,  T = -s r_k R_shaft sliding
    R_shaft = sqrt((c_z T_m)^2 + (W + c_y T_m)^2),   T_m = T_p - J k theta''

T_p is the torque on the pinion, k the gear ratio, W the weight of gear and marbles. The teeth
press with T_m/(r_p cos alpha) along the line of action: with the pinion at azimuth psi from the
horizontal through the gear's centre and a gear that turns counter-clockwise, at psi + 90 deg +
alpha; c_z and c_y are its components per torque, c_y downwards.

The structure follows [1]_; missing data of the paper are reconstructed. The centripetal force of
the marbles and the impact of the pick-up are neglected.

References
----------
.. [1] "Analysis of friction systems on shafts", Int. J. Applied Engineering Research 13(11),
   2018, 8871-8881, eqs 24 and 53-58.
"""

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
