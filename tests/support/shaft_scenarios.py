"""Drawn scenarios of a body on a dry shaft, and the same scenario in other units, mirrored, turned.

`python -m tests.support.shaft_scenarios` recomputes tests/data/shaft_cases.json.
"""

import copy
import json
from collections.abc import Callable
from math import cos, hypot, radians, sin
from pathlib import Path
from random import Random
from typing import Any

import numpy as np

from tests.support.shaft_reference import Body, solution

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


def force(rng: Random, size: Any) -> Table:
    angle = rng.uniform(0.0, 360.0)
    table = {"size": size, "direction": [cos(radians(angle)), sin(radians(angle))]}
    if rng.random() < 0.25:
        return table | {"cord_radius": rng.choice([-1.0, 1.0]) * rng.uniform(0.03, 0.2)}
    return table | {
        "point": [rng.choice([-1.0, 1.0]) * rng.uniform(0.05, 0.2), rng.uniform(-0.2, 0.2)],
        "point_turns": rng.random() < 0.7,
        "direction_turns": rng.random() < 0.5,
    }


def some_effects(rng: Random) -> Table:
    effects: Table = {}
    if rng.random() < 0.6:
        effects["gravity"] = {"g": 9.81}
    if rng.random() < 0.6:
        effects["eccentric_mass"] = {
            "mass": rng.uniform(0.1, 2.0), "radius": rng.uniform(0.02, 0.15),
            "azimuth_deg": rng.uniform(-180.0, 180.0),
        }  # fmt: skip
    if rng.random() < 0.6:
        effects["viscous_damping"] = {"coefficient": rng.uniform(0.01, 0.3)}
    if rng.random() < 0.4:
        effects["torsion_spring"] = {
            "stiffness": rng.uniform(0.5, 20.0), "free_angle_deg": rng.uniform(-40.0, 40.0)
        }  # fmt: skip
    return effects


def any_loads(rng: Random) -> Table:
    forces = [force(rng, signal(rng, 60.0)) for _ in range(rng.randint(1, 4))]
    couples = [signal(rng, 4.0) for _ in range(rng.randint(0, 2))]
    return shaft_scenario(
        forces, couples, effects=some_effects(rng), mechanism={"mass": rng.uniform(0, 5)}
    )


def load_through_zero(rng: Random) -> Table:
    """One force that reverses, as it rests and as it slides."""
    size = rng.uniform(10.0, 50.0)
    begin, velocity = rng.uniform(0.1, 0.3), rng.choice([0.0, rng.uniform(-5.0, 5.0)])
    over_time = rng.choice(
        [ramp(0.0, -0.2 * size, begin, 0.0, 0.7, size, 1.0, -size), sine(0.0, size, 2.0),
         step(-size, size, 0.0, 2.0 * begin)]
    )  # fmt: skip
    one = force(rng, over_time) | {"cord_radius": rng.choice([0.006, 0.03])}
    for key in ("point", "point_turns", "direction_turns"):
        one.pop(key, None)
    couple = rng.choice([0.0, rng.uniform(-0.3, 0.3)])
    return shaft_scenario([one], [couple], mechanism={"initial_angular_velocity": velocity})


def resultant_vanishes(rng: Random) -> Table:
    """Two opposite forces, exactly or nearly equal at one time, and a couple."""
    size, angle = rng.uniform(50.0, 200.0), radians(rng.uniform(0.0, 360.0))
    angle = rng.choice([0.0, angle])
    near = rng.choice([0.0, 0.0, 1e-1, 1e-3, 1e-6, 1e-9])
    d = [cos(angle), sin(angle)]
    against = [-cos(angle + near), -sin(angle + near)]
    changes = rng.choice(
        [ramp(0.0, 0.0, 1.0, 2.0 * size), sine(size, 0.9 * size, 2.0, 40.0),
         step(0.2 * size, 1.7 * size, 0.1, 0.9)]
    )  # fmt: skip
    through = {"point": [0.0, 0.0]}
    forces = [{"size": size, "direction": d, **through}, {"size": changes, "direction": against}]
    forces[1] |= rng.choice([through, {"cord_radius": rng.uniform(-0.01, 0.01)}])
    couple = rng.choice([rng.uniform(0.01, 0.2), sine(0.0, rng.uniform(0.1, 0.9), 3.0), 1.5])
    mechanism = {"initial_angular_velocity": rng.choice([0.0, 0.0, 3.0, -3.0])}
    effects = rng.choice([{}, {"viscous_damping": {"coefficient": 0.1}}])
    return shaft_scenario(forces, [couple], mechanism=mechanism, effects=effects)


def tie(rng: Random) -> Table:
    """The torque rises exactly to the limit, and stays there or falls; numbers of few bits."""
    mu = 0.75
    limit = RADIUS * mu / hypot(1.0, mu)
    load = 2.0 ** rng.randint(4, 9)
    top = limit * load
    over = rng.choice([1.0, 1.0, 1.0, 1.0 + 1e-9, 1.0 - 1e-9])
    rises = rng.choice(
        [ramp(0.0, 0.0, 0.3, over * top), step(0.0, over * top, 0.1, 0.6),
         ramp(0.0, 0.0, 0.3, over * top, 0.5, 0.3 * top, 0.8, over * top),
         sine(0.0, over * top, 2.0)]
    )  # fmt: skip
    couples = [rises, step(0.0, rng.choice([0.0, 0.5 * top]), 0.85, 0.95)]
    data = shaft_scenario(
        [{"size": load, "direction": [0.0, -1.0], "point": [0.0, 0.0]}], couples,
        effects={"shaft_friction": {
            "shaft_radius": RADIUS, "mu_s": mu, "mu_k": rng.choice([0.5, mu])}},
    )  # fmt: skip
    data["solver"]["duration"] = 1.3
    return data


def equal_coefficients(rng: Random) -> Table:
    data = any_loads(rng)
    mu = rng.choice([0.0, rng.uniform(0.1, 1.5)])
    data["effects"]["shaft_friction"] |= {"mu_s": mu, "mu_k": mu}
    return data


def narrow_peak(rng: Random) -> Table:
    """Sine, ramp and step at once: the margin peaks a little above or below zero."""
    hz = rng.uniform(5.0, 40.0)
    load = {"size": sine(rng.uniform(80, 200), rng.uniform(5, 40), rng.uniform(0.5, 3.0)),
            "direction": [0.3, -1.0], "point": [0.0, 0.0]}  # fmt: skip
    other = force(rng, step(rng.uniform(0, 5), rng.uniform(0, 5), 0.2, 0.7))
    couples = [sine(0.0, rng.uniform(0.05, 0.3), hz, rng.uniform(0, 360)),
               ramp(0.0, 0.0, 0.6, rng.uniform(-0.2, 0.2), 1.0, 0.0)]  # fmt: skip
    data = shaft_scenario([load, other], [*couples, 0.0])
    # The constant couple that puts the highest peak at zero, by sampling; then a little beside.
    body = Body(data)
    t = np.linspace(0.0, DURATION, 200_001)
    top = float(np.max(body.margin(t, 0.0, 1)))
    data["couples"][2]["size"] = -top + rng.choice([1e-4, 1e-6, 1e-7, -1e-5, -1e-7])
    return data


def tables(rng: Random) -> Table:
    """Sizes over angle and speed; their kinks are passed both ways, and started on."""
    size = rng.uniform(20.0, 60.0)
    over_angle = {"angle_deg": [-90.0, -20.0, 0.0, 15.0, 60.0],
                  "value": [rng.uniform(-size, size) for _ in range(5)]}  # fmt: skip
    over_speed = {"speed": [-6.0, -1.0, 0.0, 0.5, 4.0], "value": [3.0, 1.5, 0.5, 0.2, -2.0]}
    driver = sine(0.0, rng.uniform(2.0, 6.0), rng.uniform(1.0, 3.0), rng.uniform(0, 360))
    start = {"initial_angle_deg": rng.choice([0.0, 15.0, -20.0, rng.uniform(-30, 30)]),
             "initial_angular_velocity": rng.choice([0.0, 0.5, -1.0, 4.0])}  # fmt: skip
    sizes = rng.choice([[over_speed], [over_speed, over_angle], []])
    data = shaft_scenario(
        [force(rng, over_angle), force(rng, 40.0)],
        [driver, *sizes[:1]],
        mechanism=start,
        effects=some_effects(rng),
    )
    if len(sizes) == 2:
        data["forces"].append({"name": "f2", **force(rng, sizes[1])})
    return data


def fast_sines(rng: Random) -> Table:
    sizes = [sine(rng.uniform(-30, 30), rng.uniform(10, 60), rng.uniform(30, 120)) for _ in "ab"]
    couple = sine(0.0, rng.uniform(0.5, 3.0), rng.uniform(30, 120), 50.0)
    data = shaft_scenario([force(rng, size) for size in sizes], [couple], effects=some_effects(rng))
    data["solver"]["duration"] = 0.25
    return data


def many_turns(rng: Random) -> Table:
    loads = [force(rng, signal(rng, 20.0)) for _ in range(3)]
    effects = some_effects(rng) | {
        "gravity": {"g": 9.81},
        "eccentric_mass": {"mass": rng.uniform(0.5, 3.0), "radius": 0.1, "azimuth_deg": 30.0},
    }
    effects.pop("torsion_spring", None)
    start = {"initial_angular_velocity": rng.choice([-1.0, 1.0]) * rng.uniform(20.0, 60.0)}
    return shaft_scenario(
        loads, [signal(rng, 3.0)], mechanism=start | {"mass": 3.0}, effects=effects
    )


FAMILIES: list[Callable[[Random], Table]] = [
    any_loads, load_through_zero, resultant_vanishes, tie, equal_coefficients,
    narrow_peak, tables, fast_sines, many_turns, any_loads,
]  # fmt: skip


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


def delayed(data: Table, seconds: float) -> Table:
    """Return the scenario with all signals so much later; it has to rest at the start."""

    def later(name: str, size: Any) -> Any:
        if not isinstance(size, dict):
            return size
        size = copy.deepcopy(size)
        if "time" in size:
            size["time"] = [t + seconds for t in size["time"]]
        if "sine" in size:
            size["sine"]["phase_deg"] -= 360.0 * size["sine"]["frequency_hz"] * seconds
        for key in {"start", "stop"} & size.get("smooth_step", {}).keys():
            size["smooth_step"][key] += seconds
        return size

    data = each_size(data, later)
    data["solver"]["duration"] += seconds
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


def drawn(number: int) -> tuple[str, Table]:
    """Return a scenario and its name; every third one is seen otherwise."""
    rng = Random(f"shaft {number}")
    family = FAMILIES[number % len(FAMILIES)]
    data = family(rng)
    view = rng.randrange(9)
    if view == 0:
        data = mirrored(data)
    elif view == 1:
        data = turned(data, rng.uniform(0.0, 360.0))
    elif view == 2 and family is not tie:
        data = in_units(data, *(10.0 ** rng.uniform(-2.0, 2.0) for _ in "ml"), 1.0)
    return f"{family.__name__}_{number}", data


def case(number: int) -> Table:
    """Return a drawn scenario with its events and final state, as in tests/data."""
    name, data = drawn(number)
    reference = solution(data)
    count = len(reference["events"])
    return {"name": name, "scenario": data, "event_count": count} | {
        key: reference[key] for key in ("events", "final")
    }


if __name__ == "__main__":
    rows = ",\n".join(json.dumps(case(number), separators=(",", ":")) for number in range(100))
    stored = Path(__file__).parents[1] / "data" / "shaft_cases.json"
    stored.write_text(f"[\n{rows}\n]\n")
