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
    loads             forces and couples: moment and resultant over time, angle and speed
    equation          the terms of the equation of motion: friction, end stops, potential energy
    unknowns          the keys for which eq 24 can be solved
    balance           the body at rest, linear in one unknown, and the roots of eq 24
    statics           the body at rest, the smallest and the largest root over a turn
    free_body         where each force acts, for pictures
"""

from frictionsim.mechanisms.shaft.equation import (
    contact_of,
    impact_quantities,
    load_on_shaft,
    loads_of,
    many_impacts,
    potential_of,
    stops_of,
    terms_of,
    with_stops,
)
from frictionsim.mechanisms.shaft.loads import Elapsed, Loads
from frictionsim.mechanisms.shaft.schema import ShaftScenario
from frictionsim.mechanisms.shaft.statics import breakaway_values, check_unknown
from frictionsim.mechanisms.shaft.statics import statics as statics
from frictionsim.mechanisms.single_dof import METRICS as METRICS
from frictionsim.mechanisms.single_dof import kinetic_energy, set_up, simulation_of
from frictionsim.results import Quantities, Quantity
from frictionsim.solvers.mechanism import Mechanism, Trajectory, Value

SCENARIO = ShaftScenario
ShaftScenario.CHECKS = (check_unknown,)

# The channels of the default plot, from top to bottom.
PANELS = ("applied_torque", "friction_torque", "angular_velocity", "angle")


def build(scenario: ShaftScenario) -> Mechanism:
    """Return the mechanism, composed of the effects in the scenario."""
    terms, effects = terms_of(scenario), scenario.effects
    stops = stops_of(scenario, terms)
    driven = Loads(loads_of(scenario)[: len(scenario.forces) + len(scenario.couples)]).component(0)
    power_flows = {
        "energy_input": lambda time, angle, velocity: driven(time, angle, velocity) * velocity
    }
    if effects.viscous_damping is not None:
        b = effects.viscous_damping.coefficient
        power_flows["energy_damping"] = lambda time, angle, velocity: b * velocity * velocity
    if stops is not None:
        power_flows["energy_impact"] = lambda time, angle, velocity: 0.0
    stored_energies = {"energy_kinetic": kinetic_energy(scenario.inertia)}
    potential = potential_of(scenario)
    if potential is not None:
        stored_energies["energy_potential"] = potential

    def channels(trajectory: Trajectory) -> dict[str, Value]:
        time, angle, velocity = trajectory.drive, trajectory.position, trajectory.velocity
        x, y = load_on_shaft(scenario, terms, trajectory)
        torque = terms.applied_torque(time, angle, velocity)
        stop_channels = (
            {} if stops is None else {"stop_torque": stops.torque(torque, angle, velocity)}
        )
        return {
            "applied_torque": torque,
            **stop_channels,
            "shaft_reaction": (x * x + y * y) ** 0.5,
            "reaction_x": -x,
            "reaction_y": -y,
        }

    breakaway = breakaway_values(scenario)

    def quantities(trajectory: Trajectory) -> Quantities:
        if not trajectory.time.size:
            return breakaway
        x, y = load_on_shaft(scenario, terms, trajectory)
        peak = float(((x * x + y * y) ** 0.5 + 0.0 * trajectory.time).max())
        values = {"shaft_reaction_peak": Quantity(peak, "N")} | breakaway
        return values if stops is None else values | impact_quantities(trajectory)

    eccentric = effects.eccentric_mass
    turns = terms.loads.turns or (eccentric is not None and eccentric.first_moment > 0.0)

    def run_warnings(trajectory: Trajectory) -> list[str]:
        from frictionsim.simulation.run_warnings import hidden_turns

        warnings = [] if stops is None else many_impacts(trajectory)
        if not turns:
            return warnings
        duration, interval = scenario.solver.duration, scenario.interval
        return warnings + hidden_turns(trajectory.position, trajectory.velocity, interval, duration)

    return Mechanism(
        drive=Elapsed([load.size for load in terms.loads.over_time]),
        inertia=scenario.inertia,
        applied_torque=with_stops(terms.applied_torque, stops),
        contact=contact_of(scenario, terms, stops) if effects.shaft_friction else None,
        power_flows=power_flows,
        stored_energies=stored_energies,
        channels=channels,
        quantities=quantities,
        switching_surfaces=terms.loads.surfaces(),
        stops=stops,
        run_warnings=run_warnings,
        **set_up(scenario),
    )


simulation = simulation_of(build)
