"""A rigid body on a dry fixed shaft, under any forces and couples in its plane.

The model is in

    schema            the scenario's tables and channels
    loads             forces and couples: moment and resultant over time, angle and speed
    equation          the equation of motion as a sum of terms, and its dry friction
    balance           the unknowns of eq 24, the body at rest, linear in one, and the roots
    turn              the smallest and the largest root over a turn
    statics           the body at rest, its roots, and what is said about them
"""

from math import sqrt
from typing import Any

from frictionsim.mechanisms.journal import journal_channels
from frictionsim.mechanisms.shaft.equation import Shaft, system_of
from frictionsim.mechanisms.shaft.schema import CHANNELS as CHANNELS
from frictionsim.mechanisms.shaft.schema import PANELS as PANELS
from frictionsim.mechanisms.shaft.schema import ShaftScenario
from frictionsim.mechanisms.shaft.statics import breakaway_values, check_unknown
from frictionsim.mechanisms.shaft.statics import statics as statics
from frictionsim.mechanisms.single_dof import METRICS as METRICS
from frictionsim.mechanisms.single_dof import one_coordinate, simulation_of, start_of
from frictionsim.results import Quantities, Quantity
from frictionsim.simulation.mechanism import Mechanism, Samples
from frictionsim.solvers.system import STOP

SCENARIO = ShaftScenario
ShaftScenario.CHECKS = (check_unknown,)

# A run with more impacts has a capture speed that is far below the speeds of its motion.
MANY_IMPACTS = 1000
# rad: to smaller motions an absolute tolerance is not small. They are sought at LOOKS + 1 times.
SMALL_MOTION, LOOKS = 1e-3, 8
LEAST_SHARE = 1e-100  # energies of smaller motions have no digits


def build(scenario: ShaftScenario) -> Mechanism:
    """Return the mechanism, composed of the effects in the scenario."""
    shaft = Shaft(scenario)
    system, breakaway = system_of(scenario, shaft), breakaway_values(scenario)

    def quantities(samples: Samples) -> Quantities:
        if not samples.time.size:
            return breakaway
        values = {"shaft_reaction_peak": Quantity(float(samples["shaft_reaction"].max()), "N")}
        return values | breakaway | (impact_quantities(samples) if shaft.stops else {})

    def run_warnings(samples: Samples) -> list[str]:
        from frictionsim.simulation.run_warnings import hidden_turns

        warnings = many_impacts(samples) if shaft.stops else []
        if not shaft.turns:
            return warnings
        motion, duration = (samples["angle"], samples["angular_velocity"]), scenario.solver.duration
        return warnings + hidden_turns(*motion, scenario.interval, duration)

    def torques(t: float) -> list[float]:
        angle = start_of(scenario)[0]
        loads = [*shaft.loads, *shaft.weights]
        moments = [load.arms.at(angle)[0] * load.at_rest(t, angle) for load in loads]
        k, q_0 = shaft.spring or (0.0, 0.0)
        return [*moments, -k * (angle - q_0)]

    return one_coordinate(
        scenario,
        system,
        quantities,
        run_warnings=run_warnings,
        torques=torques,
        tolerance_share=1.0 if scenario.drive else tolerance_share(scenario, shaft),
        prescribed=scenario.drive is not None,
        derived=journal_channels(scenario.effects.shaft_friction, shaft.inertia),
    )


simulation = simulation_of(build)


def tolerance_share(scenario: ShaftScenario, shaft: Shaft) -> float:
    """Return the share of the absolute tolerance that fits the motion, 1 of ordinary ones.

    Blocks that move by nanometres, as angles, are no motion to a tolerance of 1e-12. The size of
    the motion is the larger of the speed at the start and of the acceleration that the torques, at
    some times, and the limit of friction give the body in its place at the start; with a torsion
    spring, of what it swings by with these. Below SMALL_MOTION, it is the share.
    """
    (q, velocity), fastest = start_of(scenario), 1.0
    if shaft.spring is not None:
        fastest = max(1.0, sqrt(shaft.spring[0] / shaft.inertia))
    size = abs(velocity) / fastest
    for i in range(LOOKS + 1):
        u = shaft.acting(scenario.solver.duration * i / LOOKS, q, 0.0)
        torque, stops = shaft.torque(u, q, 0.0), shaft.stops
        torque = 0.0 if stops is not None and stops.takes(q, 0.0, torque) else abs(torque)
        torque += shaft.static_limit(u, q)
        size = max(size, torque / (shaft.inertia * fastest * fastest))
    return max(size, LEAST_SHARE) if 0.0 < size < SMALL_MOTION else 1.0


def impact_quantities(samples: Samples) -> Quantities:
    """Return the number of impacts and the largest speed of one; None if there was none."""
    speeds = impact_speeds(samples)
    largest = float(speeds.max()) if speeds.size else None
    return {
        "impacts": Quantity(float(speeds.size), "1"),
        "impact_speed_max": Quantity(largest, "rad/s"),
    }


def impact_speeds(samples: Samples) -> Any:
    """Return the speeds of the body immediately before its impacts, (m,), rad/s.

    Events after the last sample, which a failed run may have, are ignored.
    """
    import numpy as np  # imported here because `check` does not need it

    speeds, end = np.abs(samples.before["angular_velocity"]), samples.time[-1]
    hits = np.array([e.contact == STOP and e.time <= end for e in samples.transitions], dtype=bool)
    return speeds[hits & (speeds != 0.0)]


def many_impacts(samples: Samples) -> list[str]:
    """Warn if the body bounces so often that the capture speed seems far too low."""
    count = impact_speeds(samples).size
    if count < MANY_IMPACTS:
        return []
    return [
        f"{count} impacts on the end stops, most of them negligible bounces; increase"
        " effects.end_stops.capture_speed"
    ]
