"""A rigid body on a dry fixed shaft, under any forces and couples in its plane.

    I dw/dt = M - b w - k (q - q_0) + T,   |T| <= r_s R sticking,   T = -s r_k R sliding [1]_

q is the angle of the body, counter-clockwise, w = dq/dt, and s the sign of w. M is the moment of
all forces and couples about the axis and R the force between shaft and body. At rest, and without
an eccentric mass, it is the resultant F of all forces. The centre of an eccentric mass m at the
radius e accelerates, and the force on the shaft is F - m a, of which

    R^2 = (F_t - m e dw/dt)^2 + (F_n + m e w^2)^2

with the components F_t along and F_n across its path, so that friction and acceleration follow
from one quadratic equation. An end stop is a couple on the body, and no force on the shaft: see
`frictionsim.solvers.end_stops`.

References
----------
.. [1] "Analysis of friction systems on shafts", Int. J. Applied Engineering Research 13(11),
   2018, 8871-8881, eqs 1-24 and 30.

The model is in

    schema            the scenario's tables
    channels          what is recorded
    loads             forces and couples: moment and resultant over time, angle and speed
    equation          the equation of motion as data: friction, end stops, energies
    unknowns          the keys for which eq 24 can be solved
    balance           the body at rest, linear in one unknown, and the roots of eq 24
    statics           the body at rest, the smallest and the largest root over a turn
    free_body         where each force acts, for pictures
"""

from math import radians
from typing import Any

from frictionsim.mechanisms.effects import CONTACT_NAME
from frictionsim.mechanisms.shaft.channels import CHANNELS as CHANNELS
from frictionsim.mechanisms.shaft.channels import PANELS as PANELS
from frictionsim.mechanisms.shaft.equation import (
    load_on_shaft,
    loads_of,
    shaft_of,
    turns_with_body,
    weights_of,
)
from frictionsim.mechanisms.shaft.loads import Elapsed
from frictionsim.mechanisms.shaft.schema import ShaftScenario
from frictionsim.mechanisms.shaft.statics import breakaway_values, check_unknown
from frictionsim.mechanisms.shaft.statics import statics as statics
from frictionsim.mechanisms.single_dof import METRICS as METRICS
from frictionsim.mechanisms.single_dof import set_up, simulation_of, sqrt
from frictionsim.results import Quantities, Quantity
from frictionsim.solvers.end_stops import ENERGY, EVENT
from frictionsim.solvers.mechanism import (
    Mechanism,
    Trajectory,
    Value,
    equation_of,
    friction_of,
    stop_torque,
)

SCENARIO = ShaftScenario
ShaftScenario.CHECKS = (check_unknown,)

# A run with more impacts has a capture speed that is far below the speeds of its motion.
MANY_IMPACTS = 1000
# rad: to smaller motions an absolute tolerance is not small. They are sought at LOOKS + 1 times.
SMALL_MOTION, LOOKS = 1e-3, 8
LEAST_SHARE = 1e-100  # energies of smaller motions have no digits


def build(scenario: ShaftScenario) -> Mechanism:
    """Return the mechanism, composed of the effects in the scenario."""
    shaft, effects = shaft_of(scenario), scenario.effects

    def reaction(trajectory: Trajectory) -> tuple[Value, Value, Value]:
        """Return the size of the force on the shaft, and its components, N."""
        time, angle, velocity = trajectory.drive, trajectory.position, trajectory.velocity
        x, y = load_on_shaft(shaft, time, angle, velocity, trajectory.acceleration)
        return sqrt(x * x + y * y), x, y

    def channels(trajectory: Trajectory) -> dict[str, Value]:
        size, x, y = reaction(trajectory)
        angle, velocity = trajectory.position, trajectory.velocity
        torque, _, _ = shaft.torque_and_force(trajectory.drive, angle, velocity)
        values = {
            "applied_torque": torque,
            "shaft_reaction": size,
            "reaction_x": -x,
            "reaction_y": -y,
        }
        if shaft.stops:
            values["stop_torque"] = stop_torque(shaft.stops[0], torque, angle, velocity)
        return values

    breakaway = breakaway_values(scenario)

    def quantities(trajectory: Trajectory) -> Quantities:
        if not trajectory.time.size:
            return breakaway
        peak = float((reaction(trajectory)[0] + 0.0 * trajectory.time).max())
        values = {"shaft_reaction_peak": Quantity(peak, "N")} | breakaway
        return values | impact_quantities(trajectory) if shaft.stops else values

    turns = turns_with_body(scenario, shaft)

    def run_warnings(trajectory: Trajectory) -> list[str]:
        from frictionsim.simulation.run_warnings import hidden_turns

        warnings = many_impacts(trajectory) if shaft.stops else []
        if not turns:
            return warnings
        duration, interval = scenario.solver.duration, scenario.interval
        return warnings + hidden_turns(trajectory.position, trajectory.velocity, interval, duration)

    def is_turned(trajectory: Trajectory) -> bool:
        """Return whether a load has a moment, or the spring is deflected."""
        angle = float(trajectory.position[0])
        if any(spring.k * (angle - spring.q_0) for spring in shaft.spring):
            return True
        state = (trajectory.time, angle + 0.0 * trajectory.time, 0.0 * trajectory.time)
        loads = [*loads_of(scenario), *weights_of(scenario)]
        return any((load.over_samples(*state) * load.arms.at(angle)[0]).any() for load in loads)

    damping, friction = effects.viscous_damping, effects.shaft_friction
    flows = ("energy_input", *["energy_damping"] * bool(damping), *[ENERGY] * bool(shaft.stops))
    has_potential = bool(shaft.weight or shaft.spring)
    contact = friction_of(shaft, CONTACT_NAME, friction.law_of_contact()) if friction else None
    drive = Elapsed(tuple(load.size for load in loads_of(scenario) if load.over == "time"))
    return Mechanism(
        drive=drive,
        tolerance_share=tolerance_share(scenario, shaft, drive),
        contact=contact,
        channels=channels,
        quantities=quantities,
        stops=shaft.stops[0] if shaft.stops else None,
        run_warnings=run_warnings,
        is_turned=is_turned,
        **equation_of(shaft, flows, ("energy_kinetic", "energy_potential")[: 1 + has_potential]),
        **set_up(scenario),
    )


simulation = simulation_of(build)


def tolerance_share(scenario: ShaftScenario, shaft: Any, drive: Elapsed) -> float:
    """Return the share of the absolute tolerance that fits the motion, 1 of ordinary ones.

    Blocks that move by nanometres, as angles, are no motion to a tolerance of 1e-12. The size of
    the motion is the larger of the speed at the start and of the acceleration that the torques, at
    some times, and the limit of friction give the body in its place at the start; with a torsion
    spring, of what it swings by with these. Below SMALL_MOTION, it is the share.
    """
    start, effects = scenario.mechanism, scenario.effects
    q, fastest = radians(start.initial_angle_deg), 1.0
    if effects.torsion_spring:
        fastest = max(1.0, sqrt(effects.torsion_spring.stiffness / shaft.inertia))
    size = abs(start.initial_angular_velocity) / fastest
    for i in range(LOOKS + 1):
        u = drive(scenario.solver.duration * i / LOOKS)
        limit = shaft.static_limit(u, q) if effects.shaft_friction else 0.0
        torque = abs(shaft.applied_torque(u, q, 0.0)) + limit
        size = max(size, torque / (shaft.inertia * fastest * fastest))
    return max(size, LEAST_SHARE) if 0.0 < size < SMALL_MOTION else 1.0


def impact_quantities(trajectory: Trajectory) -> Quantities:
    """Return the number of impacts and the largest speed of one; None if there was none."""
    speeds = impact_speeds(trajectory)
    largest = float(speeds.max()) if speeds.size else None
    return {
        "impacts": Quantity(float(speeds.size), "1"),
        "impact_speed_max": Quantity(largest, "rad/s"),
    }


def impact_speeds(trajectory: Trajectory) -> Any:
    """Return the speeds of the body immediately before its impacts, (m,), rad/s.

    Events after the last sample, which a failed run may have, are ignored.
    """
    import numpy as np  # imported here because `check` does not need it

    if trajectory.velocity_before is None:
        return np.empty(0)
    end = trajectory.time[-1] if trajectory.time.size else -np.inf
    hits = [
        event.contact == EVENT and event.time <= end and speed != 0.0
        for event, speed in zip(trajectory.transitions, trajectory.velocity_before, strict=True)
    ]
    return np.abs(trajectory.velocity_before[np.array(hits, dtype=bool)])


def many_impacts(trajectory: Trajectory) -> list[str]:
    """Warn if the body bounces so often that the capture speed seems far too low."""
    count = impact_speeds(trajectory).size
    if count < MANY_IMPACTS:
        return []
    return [
        f"{count} impacts on the end stops, most of them negligible bounces; increase"
        " effects.end_stops.capture_speed"
    ]
