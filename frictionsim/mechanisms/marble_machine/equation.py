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

from collections.abc import Callable
from functools import partial
from math import cos, hypot, sin, sqrt
from typing import Any

from frictionsim.errors import counted
from frictionsim.mechanisms.effects import ROUNDING, journal_friction, viscous_damping
from frictionsim.mechanisms.journal import journal_channels
from frictionsim.mechanisms.marble_machine.schema import (
    MarbleMachineParameters,
    MarbleMachineScenario,
)
from frictionsim.mechanisms.marble_machine.statics import (
    GearMesh,
    impending_motion_torques,
    mesh_of,
)
from frictionsim.mechanisms.single_dof import MultiplesOf, one_coordinate, start_of
from frictionsim.results import STICK, Quantities, Quantity
from frictionsim.scenario.signal_tables import signal_from
from frictionsim.scenario.signals import Constant, Signal
from frictionsim.simulation.mechanism import Derived, Mechanism, Samples
from frictionsim.solvers.system import INPUT, OneCoordinate, Term


def build(scenario: MarbleMachineScenario) -> Mechanism:
    """Return the mechanism, composed of the effects in the scenario."""
    geometry, effects = scenario.mechanism, scenario.effects
    k, p, n, m = geometry.gear_ratio, geometry.pitch, geometry.carried, geometry.marble_mass
    R, g = geometry.marble_circle_radius, effects.g
    J = effects.motor_inertia.inertia if effects.motor_inertia else 0.0
    I = scenario.inertia  # noqa: E741
    weight = (geometry.gear_mass + n * m) * g
    lift, half_sine, half = m * g * R, sin(0.5 * p), 0.5 * p
    largest = lift / half_sine
    c_z, c_y = mesh = mesh_of(geometry)
    drive, pinion_torque = _pinion_torque(scenario)

    def load(theta: float) -> float:
        return largest * cos(theta % p - half)

    def potential(theta: float) -> float:  # of the marbles, delivered ones included
        return lift * (2.0 * (theta // p) + sin(theta % p - half) / half_sine + 1.0)

    def reaction(torque: float) -> float:
        return hypot(c_z * torque, weight + c_y * torque)

    terms = [Term(lambda T_p, q, w: k * T_p, INPUT)]
    if effects.gravity:
        terms.append(Term(lambda T_p, q, w: -load(q), potential=potential))
    terms += viscous_damping(effects.viscous_damping)
    friction = journal_friction(
        effects.shaft_friction,
        reaction=lambda T_p, q: reaction(T_p),
        roundoff=lambda T_p, q: ROUNDING * (k * abs(T_p) + largest),
    )
    journal = effects.shaft_friction
    if friction and J and journal and journal.normal_load is None:
        radius = journal.radius_over_speed
        of = partial(_kinetic_limit, mesh=mesh, weight=weight, ratio=J * k / I)
        friction = friction._replace(
            kinetic=(lambda T_p, q, w, s, M: of(radius.at(w))(T_p, q, w, s, M))
            if radius.varies
            else of(radius.at_rest)
        )
    channels = ["motor_torque", "shaft_reaction", "carried_marbles"]
    system = OneCoordinate(
        drive,
        pinion_torque,
        I,
        terms,
        friction,
        start=start_of(scenario),
        surfaces=(MultiplesOf(p, "transfer"),),
        channels=(*channels, *(["load_torque"] if effects.gravity else [])),
        recorded=lambda T_p, q, w, a: [
            *(T_p, reaction(T_p - J * k * a), n),
            *([load(q)] if effects.gravity else []),
        ],
    )

    def quantities(samples: Samples) -> Quantities:
        values = impending_motion_torques(scenario)
        if samples.time.size:
            cell, span = samples["angle"] // p, float(samples.time[-1])
            values["marbles_delivered"] = Quantity(float(cell.max() - cell[0]), "1")
            values["motor_torque_peak"] = Quantity(samples.largest("motor_torque"), "N m")
            if span > 0.0:
                power = float(samples["energy_input"][-1]) / span
                values["motor_power_mean"] = Quantity(power, "W")
        return values

    return one_coordinate(
        scenario,
        system,
        quantities,
        run_warnings=lambda samples: _run_warnings(scenario, samples),
        derived={**journal_channels(effects.shaft_friction, I), **_tooth_forces(geometry, J)},
    )


def _tooth_forces(geometry: MarbleMachineParameters, J: float) -> dict[str, Derived]:
    """Return the channels of the force between the teeth, eqs 53 and 54, of T_m."""
    r_p, k, slope = geometry.pinion_radius, geometry.gear_ratio, geometry.tooth_slope

    def tangential(time: Any, of: Any, run: Samples) -> Any:
        return (of["motor_torque"] - J * k * of["angular_acceleration"]) / r_p

    return {
        "tooth_force_tangential": tangential,
        "tooth_force_radial": lambda time, of, run: slope * tangential(time, of, run),
    }


def _pinion_torque(
    scenario: MarbleMachineScenario,
) -> tuple[Signal, Callable[[float, float, float], float] | None]:
    """Return the drive u and the torque of the pinion, of (t, theta, theta').

    It is T_p = u (None), or of a motor with the speed w_0 without load T_p = u (1 - k theta'/w_0).
    """
    motor, table = scenario.drive.motor, scenario.drive.torque
    if motor is None:
        assert table is not None  # checked by the model of the drive
        return signal_from(table), None
    u, slope = motor.stall_torque, scenario.mechanism.gear_ratio / motor.no_load_speed
    return Constant(u), lambda t, q, w: u * (1.0 - slope * w)


def _kinetic_limit(
    r_k: float, mesh: GearMesh, weight: float, ratio: float
) -> Callable[[float, float, float, int, float], float]:
    """Return the kinetic limit with the inertia J of motor and pinion, by which T_m differs.

    With ratio = J k/I > 0 and I theta'' = M - s F, the limit F = r_k R_shaft(T_m) is the root of

        T_m = T_0 + ratio s F,  T_0 = T_p - ratio M
        A F^2 - 2 B F - C = 0,  A = 1 - (r_k c ratio)^2,  B = r_k^2 ratio s (c^2 T_0 + W c_y),
        C = (r_k R_shaft(T_0))^2,  c^2 = c_z^2 + c_y^2

    with one non-negative root, since r_k c ratio < 1: the shaft is thinner than the gear.
    """
    c_z, c_y = mesh
    c_2 = c_z * c_z + c_y * c_y
    A = 1.0 - r_k * r_k * c_2 * ratio * ratio

    def limit(T_p: float, q: float, w: float, s: int, M: float) -> float:
        T_0 = T_p - ratio * M
        B = r_k * r_k * ratio * s * (c_2 * T_0 + weight * c_y)
        root_C = r_k * hypot(c_z * T_0, weight + c_y * T_0)
        return (B + sqrt(B * B + A * (root_C * root_C))) / A

    return limit


def _run_warnings(scenario: MarbleMachineScenario, samples: Samples) -> list[str]:
    """Return warnings if the gear ran back, stands still under a torque, or is sampled coarsely."""
    from frictionsim.simulation.run_warnings import (  # imports numpy, not needed by `check`
        against_drive,
        hidden_turns,
    )

    angle, torque = samples["angle"], samples["motor_torque"]
    duration, interval = scenario.solver.duration, scenario.interval
    warnings = hidden_turns(angle, samples["angular_velocity"], interval, duration)
    back, cell = against_drive(samples.time, torque, angle), angle // scenario.mechanism.pitch
    if back and angle[-1] < angle[0]:
        carried = counted(round(cell[0] - cell[-1]), "marble")
        warnings.append(f"the gear {back}: it carried {carried} back")
    rests = [e.time for e in samples.transitions if e.mode_to == STICK != e.mode_from]
    if rests and samples["mode"][-1] == STICK and torque[-1] > 0.0:
        warnings.append(
            f"the gear stands still from {rests[-1]:.6g} s on, although the torque on the pinion is"
            f" {torque[-1]:.6g} N m at the end"
        )
    return warnings
