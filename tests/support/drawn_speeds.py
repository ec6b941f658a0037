"""Drawn scenarios of each kind with kinetic friction over the speed, and an independent run."""

from collections.abc import Callable
from math import pi
from random import Random
from typing import Any

from tests.support.friction_curves import drawn_curve
from tests.support.shaft_reference import Table, solution
from tests.support.shaft_scenarios import FAMILIES, ramp, sine, step
from tests.support.shaft_scenarios import drawn as drawn_shaft
from tests.support.speed_bodies import Gear, MarbleMachine, pulley


def _signal(rng: Random, mean: float, size: float, duration: float) -> Table:
    """Return a signal that swings about a mean, and stays positive if that exceeds the size."""
    low, high = mean - size, mean + size
    return rng.choice(
        [
            ramp(0.0, mean, 0.3 * duration, high, 0.7 * duration, low, duration, mean),
            sine(mean, size, rng.uniform(1.0, 3.0) / duration, rng.uniform(0.0, 360.0)),
            step(*rng.sample([low, high], 2), 0.1 * duration, rng.uniform(0.4, 0.9) * duration),
        ]
    )


def _solver(duration: float) -> Table:
    return {
        "solver": {"backend": "events", "duration": duration, "rtol": 1e-11, "atol": 1e-13},
        "output": {"interval": duration},
    }


def shaft(rng: Random) -> Table:
    families = [i for i, family in enumerate(FAMILIES) if family.__name__ != "tie"]
    while True:
        _, data = drawn_shaft(rng.choice(families) + len(FAMILIES) * rng.randrange(50))
        journal = data["effects"]["shaft_friction"]
        if journal["mu_s"] > 0.0:
            speed = 3.0 * journal["shaft_radius"]
            journal["mu_k"] = drawn_curve(rng, journal["mu_s"], speed)
            return data


def a_pulley(rng: Random) -> Table:
    r, load, mu_s = rng.uniform(0.03, 0.2), rng.uniform(50.0, 2000.0), rng.uniform(0.1, 0.6)
    thick = r * rng.uniform(0.2, 0.6)
    inertia = load * r * rng.uniform(0.01, 0.3)
    effects: Table = {"shaft_friction": {"shaft_radius": thick, "mu_s": mu_s}}
    effects["shaft_friction"]["mu_k"] = drawn_curve(rng, mu_s, 3.0 * thick)
    if rng.random() < 0.6:
        effects["viscous_damping"] = {"coefficient": inertia * rng.uniform(0.05, 2.0)}
    return {
        "kind": "pulley",
        "mechanism": {
            "cord_radius": r,
            "inertia": inertia,
            "load": load,
            "initial_angular_velocity": rng.choice([0.0, rng.uniform(-4.0, 4.0)]),
        },
        "drive": {
            "force": _signal(rng, load, 0.6 * load, 1.5),
            "direction": rng.choice(["vertical", "horizontal"]),
        },
        "effects": effects,
        **_solver(1.5),
    }


def marble_machine(rng: Random) -> Table:
    slots, ratio, thick = 2 * rng.randint(2, 8), rng.uniform(1.0, 6.0), rng.uniform(0.002, 0.01)
    mu_s, inertia = rng.uniform(0.2, 0.8), rng.uniform(1e-4, 1e-3)
    worst = 0.007 * 9.81 * 0.057 * slots / pi
    effects: Table = {
        "gravity": {"g": 9.81},
        "shaft_friction": {"shaft_radius": thick, "mu_s": mu_s},
    }
    effects["shaft_friction"]["mu_k"] = drawn_curve(rng, mu_s, 3.0 * thick)
    if rng.random() < 0.6:
        effects["motor_inertia"] = {"inertia": rng.uniform(1e-5, 1e-4)}
    if rng.random() < 0.6:
        effects["viscous_damping"] = {"coefficient": rng.uniform(1e-4, 2e-3)}
    return {
        "kind": "marble_machine",
        "mechanism": {
            "pinion_radius": 0.018,
            "pressure_angle_deg": rng.uniform(0.0, 30.0),
            "gear_ratio": ratio,
            "mesh_azimuth_deg": rng.uniform(-180.0, 180.0),
            "slots": slots,
            "marble_mass": 0.007,
            "marble_circle_radius": 0.057,
            "gear_mass": 0.128,
            "gear_inertia": inertia,
            "initial_angle_deg": rng.uniform(0.0, 100.0),
            "initial_angular_velocity": rng.choice([0.0, rng.uniform(-3.0, 3.0)]),
        },
        "drive": {"torque": _signal(rng, worst / ratio, 0.8 * worst / ratio, 1.0)},
        "effects": effects,
        **_solver(1.0),
    }


def gear(rng: Random) -> Table:
    mechanism = {
        "sun_radius": rng.uniform(0.05, 0.2),
        "planet_radius": rng.uniform(0.03, 0.1),
        "crank_mass": rng.uniform(0.2, 1.0),
        "planet_mass": rng.uniform(0.5, 2.0),
        "initial_angle_deg": rng.uniform(-180.0, 180.0),
        "initial_angular_velocity": rng.choice([0.0, rng.uniform(-5.0, 5.0)]),
    }
    length = mechanism["sun_radius"] + mechanism["planet_radius"]
    weight = (0.5 * mechanism["crank_mass"] + mechanism["planet_mass"]) * 9.81 * length
    static, arm = rng.uniform(0.02, 0.1) * weight, rng.uniform(0.001, 0.02) * length
    hinge = {"torque_static": static}
    hinge["torque_kinetic"] = drawn_curve(rng, static, 3.0, "torque_c")
    mesh: Table = {"arm": arm, "normal_load": rng.choice(["weight", "radial"])}
    if rng.random() < 0.7:
        mesh["arm_kinetic"] = drawn_curve(rng, arm, 5.0, "arm_c")
    effects: Table = {"gravity": {"g": 9.81}}
    some = rng.choice([("hinge",), ("mesh",), ("hinge", "mesh")])
    effects |= {"hinge_friction": hinge} if "hinge" in some else {}
    effects |= {"rolling_friction": mesh} if "mesh" in some else {}
    return {
        "kind": "epicyclic",
        "mechanism": mechanism,
        "drive": {"torque": _signal(rng, 0.0, 1.3 * weight, 1.0)},
        "effects": effects,
        **_solver(1.0),
    }


KINDS: dict[str, tuple[Callable[[Random], Table], Callable[[Table], Any]]] = {
    "shaft": (shaft, lambda data: None),
    "pulley": (a_pulley, pulley),
    "marble_machine": (marble_machine, MarbleMachine),
    "epicyclic": (gear, Gear),
}


def drawn(kind: str, number: int) -> Table:
    """Return a drawn scenario of a kind."""
    return KINDS[kind][0](Random(f"{kind} over speed {number}"))


def independent(data: Table) -> Table:
    """Return events and final state by the independent program."""
    return solution(data, KINDS[data["kind"]][1](data))
