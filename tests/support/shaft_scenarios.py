"""Scenarios of a body on a dry shaft, and the same scenario in other units, mirrored, turned."""

import copy
from collections.abc import Callable
from math import cos, radians, sin
from random import Random
from typing import Any

Table = dict[str, Any]
RADIUS, DURATION = 0.02, 1.0  # m, s


def shaft_scenario(forces: list[Table], couples: list[Table], **more: Any) -> Table:
    effects = {"shaft_friction": {"shaft_radius": RADIUS, "mu_s": 0.4, "mu_k": 0.25}}
    return {
        "kind": "shaft",
        "mechanism": {"inertia": 0.05, **more.get("mechanism", {})},
        "forces": [{"name": f"f{i}", **force} for i, force in enumerate(forces)],
        "couples": [{"name": f"c{i}", "size": size} for i, size in enumerate(couples)],
        "effects": effects | more.get("effects", {}),
        "solver": {"backend": "events", "duration": DURATION, "rtol": 1e-11},
    }


def ramp(*points: float) -> Table:
    return {"time": list(points[::2]), "value": list(points[1::2])}


def sine(mean: float, amplitude: float, hz: float, phase: float = 0.0) -> Table:
    keys = ("mean", "amplitude", "frequency_hz", "phase_deg")
    return {"sine": dict(zip(keys, (mean, amplitude, hz, phase), strict=True))}


def step(before: float, after: float, start: float, stop: float) -> Table:
    return {"smooth_step": {"from": before, "to": after, "start": start, "stop": stop}}


def signal(rng: Random, size: float) -> Any:
    a, b, c = (rng.uniform(-size, size) for _ in range(3))
    begin = rng.uniform(0.05, 0.5)
    end = begin + rng.uniform(0.05, 0.4)
    return rng.choice(
        [a, ramp(0.0, a, begin, b, end, c), sine(a, b, rng.uniform(0.5, 6.0), rng.uniform(0, 360)),
         step(a, b, begin, end)]
    )  # fmt: skip


# --- the same motion, seen otherwise --------------------------------------------------------------


def each_size(data: Table, change: Callable[[str, Any], Any]) -> Table:
    """Return a copy with each size replaced; `change` takes "forces" or "couples", and the size."""
    data = copy.deepcopy(data)
    for name in ("forces", "couples"):
        for table in data.get(name, []):
            table["size"] = change(name, table["size"])
    return data


VALUES = {"value", "mean", "amplitude", "from", "to"}


def scaled_size(size: Any, factor: float, time: float = 1.0) -> Any:
    """Return a size times a factor, over a time that runs so much longer."""
    if not isinstance(size, dict):
        return size * factor
    powers = {"time": time, "start": time, "stop": time, "frequency_hz": 1.0 / time}
    powers |= {"speed": 1.0 / time} | dict.fromkeys(VALUES, factor)
    scaled = {}
    for key, value in size.items():
        by = powers.get(key, 1.0)
        if isinstance(value, dict):
            scaled[key] = scaled_size(value, factor, time)
        else:
            scaled[key] = [x * by for x in value] if isinstance(value, list) else value * by
    return scaled


def in_units(data: Table, mass: float, length: float, time: float) -> Table:
    """Return the scenario with all numbers of mass, length and time so much larger."""
    power = mass * (length / time) ** 2  # of a moment
    data = each_size(
        data, lambda name, s: scaled_size(s, power / (length if name == "forces" else 1.0), time)
    )
    for table in data["forces"]:
        if "point" in table:
            table["point"] = [length * x for x in table["point"]]
        if "cord_radius" in table:
            table["cord_radius"] *= length
    powers = {
        "inertia": mass * length**2, "mass": mass, "initial_angular_velocity": 1.0 / time,
        "g": length / time**2, "radius": length, "shaft_radius": length,
        "coefficient": power * time, "stiffness": power, "duration": time,
    }  # fmt: skip
    for table in (data["mechanism"], data["solver"], *data["effects"].values()):
        for key in table.keys() & powers.keys():
            table[key] *= powers[key]
    return data


def turned(data: Table, degrees: float) -> Table:
    """Return the scenario with all vectors turned; without gravity, whose direction is fixed."""
    data = copy.deepcopy(data)
    c, s = cos(radians(degrees)), sin(radians(degrees))
    for table in data["forces"]:
        for key in {"point", "direction"} & table.keys():
            x, y = table[key]
            table[key] = [c * x - s * y, s * x + c * y]
    if "eccentric_mass" in data["effects"]:
        data["effects"]["eccentric_mass"]["azimuth_deg"] += degrees
    return data


def mirrored(data: Table) -> Table:
    """Return the scenario mirrored, x to -x: its angles are those of the scenario times -1."""

    def other_hand(name: str, size: Any) -> Any:
        sign = 1.0 if name == "forces" else -1.0
        if not isinstance(size, dict):
            return sign * size
        size = scaled_size(size, sign)
        for key in {"speed", "angle_deg"} & size.keys():
            size[key] = [-x for x in reversed(size[key])]
            size["value"] = size["value"][::-1]
        return size

    data = each_size(data, other_hand)
    for table in data.get("forces", []):
        for key in {"point", "direction"} & table.keys():
            table[key] = [-table[key][0], table[key][1]]
        if "cord_radius" in table:
            table["cord_radius"] *= -1.0
    for key in {"initial_angle_deg", "initial_angular_velocity"} & data["mechanism"].keys():
        data["mechanism"][key] *= -1.0
    effects = data["effects"]
    if "eccentric_mass" in effects:
        mass = effects["eccentric_mass"]
        mass["azimuth_deg"] = 180.0 - mass.get("azimuth_deg", 0.0)
    if "torsion_spring" in effects:
        effects["torsion_spring"]["free_angle_deg"] *= -1.0
    return data
