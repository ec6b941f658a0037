"""Bodies on a shaft with drawn forces, and where these act: complex numbers, without the package.

A place or force (x, y) is the number x + iy; what turns with the body is multiplied by exp(iq).
"""

from typing import Any

import numpy as np

from tests.support.second_way import signal

TIMES = np.linspace(0.0, 2.0, 21)
Table = dict[str, Any]


def drawn_shaft(number: int) -> Table:
    """Return a scenario with forces of all forms, couples, and some of the effects."""
    rng = np.random.default_rng(number)

    def pair(size: float = 1.0) -> list[float]:
        return [float(x) for x in size * rng.normal(size=2)]

    def size() -> Any:
        a, b, c = (float(x) for x in 100.0 * rng.normal(size=3))
        return (
            a,
            {"time": [0.0, 1.0, 2.0], "value": [a, b, c]},
            {"speed": [-3.0, 0.0, 4.0], "value": [a, b, c]},
            {"angle_deg": [-90.0, 10.0, 120.0], "value": [a, b, c]},
        )[int(rng.integers(4))]

    forces: list[Table] = []
    for i, (turning, going) in enumerate([(0, 0), (0, 1), (1, 0), (1, 1)]):
        forces.append(
            {
                "name": f"force-{i}",
                "size": size(),
                "point": pair(0.3),
                "direction": pair(),
                "point_turns": bool(turning),
                "direction_turns": bool(going),
            }
        )
    cord = float(rng.uniform(0.1, 0.3) * rng.choice([-1.0, 1.0]))
    forces.append({"name": "cord", "size": size(), "cord_radius": cord, "direction": pair()})
    effects: Table = {
        "gravity": {"g": 9.81},
        "shaft_friction": {"shaft_radius": 0.02, "mu_s": 0.3, "mu_k": 0.2},
    }
    if number % 2:
        azimuth = float(rng.uniform(-180.0, 180.0))
        effects["eccentric_mass"] = {"mass": 3.0, "radius": 0.15, "azimuth_deg": azimuth}
    if number % 3:
        effects["torsion_spring"] = {"stiffness": 5.0, "free_angle_deg": float(rng.normal())}
    if number % 4:
        effects["viscous_damping"] = {"coefficient": 0.4}
    return {
        "kind": "shaft",
        "mechanism": {"inertia": 2.0, "mass": 8.0},
        "forces": forces,
        "couples": [{"name": "motor", "size": size()}],
        "effects": effects,
        "solver": {"duration": 2.0},
    }


def drawn_motion(number: int) -> Table:
    """Return channels of a motion that no solver made: angle, its derivatives, friction torque."""
    rng = np.random.default_rng(1000 + number)
    a, b, c = rng.normal(size=3)
    return {
        "time": TIMES,
        "angle": a + b * TIMES + c * np.sin(2.0 * TIMES),
        "angular_velocity": b + 2.0 * c * np.cos(2.0 * TIMES),
        "angular_acceleration": -4.0 * c * np.sin(2.0 * TIMES),
        "friction_torque": rng.normal() * np.cos(TIMES),
    }


def size_of(size: Any, channels: Table) -> Any:
    over = {"speed": channels["angular_velocity"], "angle_deg": np.degrees(channels["angle"])}
    for key, values in over.items():
        if isinstance(size, dict) and key in size:
            return np.interp(values, size[key], size["value"])
    return signal(size, channels["time"])


def acting(scenario: Table, channels: Table) -> dict[str, tuple[Any, Any]]:
    """Return where each force acts, m, and the force, N, over time."""
    turn = np.exp(1j * channels["angle"])
    forces = {}
    for force in scenario.get("forces", ()):
        along = complex(*force["direction"])
        along /= abs(along)
        if "cord_radius" in force:
            # A quarter turn clockwise from the pull, so that it turns the body counter-clockwise.
            place = force["cord_radius"] * along * -1j * np.ones_like(turn)
        else:
            place = complex(*force["point"]) * (turn if force.get("point_turns", True) else 1.0)
        way = along * (turn if force.get("direction_turns", False) else 1.0)
        forces[force["name"]] = place * np.ones_like(turn), size_of(force["size"], channels) * way
    effects, one = scenario.get("effects", {}), np.ones_like(turn)
    g = effects.get("gravity", {"g": 0.0})["g"]
    mass = scenario["mechanism"].get("mass", 0.0)
    if g * mass:
        forces["weight of the body"] = 0.0 * one, -1j * g * mass * one
    if "eccentric_mass" in effects:
        eccentric = effects["eccentric_mass"]
        at = eccentric["radius"] * np.exp(1j * np.radians(eccentric.get("azimuth_deg", 0.0))) * turn
        # The acceleration of a point on a circle: d^2/dt^2 of at.
        speed, rate = channels["angular_velocity"], channels["angular_acceleration"]
        acceleration = at * (1j * rate - speed**2)
        if g:
            forces["weight of the eccentric mass"] = at, -1j * g * eccentric["mass"] * one
        forces["inertia force of the eccentric mass"] = at, -eccentric["mass"] * acceleration
    return forces


def couples(scenario: Table, channels: Table) -> dict[str, Any]:
    torques = {c["name"]: size_of(c["size"], channels) for c in scenario.get("couples", ())}
    effects = scenario.get("effects", {})
    if "torsion_spring" in effects:
        spring = effects["torsion_spring"]
        free = np.radians(spring.get("free_angle_deg", 0.0))
        torques["torsion spring"] = -spring["stiffness"] * (channels["angle"] - free)
    if "viscous_damping" in effects:
        b = effects["viscous_damping"]["coefficient"]
        torques["viscous damping"] = -b * channels["angular_velocity"]
    return torques


def moment(place: Any, force: Any) -> Any:
    return (np.conj(place) * force).imag
