"""Scenarios of bodies between end stops."""

from math import degrees, inf, pi, sqrt
from typing import Any

from tests.support.end_stops_reference import Body
from tests.support.scenarios import Scenario, changed

LOAD, SHAFT_RADIUS = 100.0, 0.5  # N, m
PINNED = {"name": "load", "size": LOAD, "point": [0.0, 0.0], "direction": [0.0, -1.0]}


def coefficient(torque: float) -> float:
    """Return the coefficient of friction with which the pinned load gives a friction torque."""
    x = torque / (LOAD * SHAFT_RADIUS)
    return x / sqrt(1.0 - x * x)


def stopped(size: Any, **changes: Any) -> Scenario:
    """Return a body of 0.5 kg m^2 between stops at -50 and 60 deg under a couple, N m.

    `changes` are as of `tests.support.scenarios.pulley`.
    """
    data: Scenario = {
        "kind": "shaft",
        "mechanism": {"inertia": 0.5},
        "couples": [{"name": "drive", "size": size}],
        "effects": {
            "end_stops": {"lowest_angle_deg": -50.0, "highest_angle_deg": 60.0, "restitution": 0.6}
        },
        "solver": {"duration": 8.0, "rtol": 1e-11},
        "output": {"interval": 0.05},
    }
    return changed(data, **changes)


def with_friction(data: Scenario, static: float, kinetic: float, **keys: Any) -> Scenario:
    """Return the same scenario with dry friction of constant torques, N m."""
    table = {"mu_s": coefficient(static), "mu_k": coefficient(kinetic)} | keys
    table |= {"shaft_radius": SHAFT_RADIUS}
    return changed(data, forces=[PINNED], effects__shaft_friction=table)


def scenario_of(body: Body, **changes: Any) -> Scenario:
    wave = {
        "mean": body.mean,
        "amplitude": body.amplitude,
        "frequency_hz": body.frequency / (2.0 * pi),
        "phase_deg": degrees(body.phase),
    }
    stops = {"restitution": body.restitution, "capture_speed": body.capture}
    if body.lowest > -inf:
        stops["lowest_angle_deg"] = degrees(body.lowest)
    if body.highest < inf:
        stops["highest_angle_deg"] = degrees(body.highest)
    data = stopped(
        {"sine": wave},
        mechanism={
            "inertia": body.inertia,
            "initial_angle_deg": degrees(body.angle),
            "initial_angular_velocity": body.velocity,
        },
        effects__end_stops=stops,
        solver__duration=body.end,
        output__interval=0.25 * body.end,
    )
    if body.stiffness:
        spring = {"stiffness": body.stiffness, "free_angle_deg": degrees(body.free)}
        data = changed(data, effects__torsion_spring=spring)
    if body.damping:
        data = changed(data, effects__viscous_damping={"coefficient": body.damping})
    if body.static:
        data = with_friction(data, body.static, body.kinetic)
    return changed(data, **changes)
