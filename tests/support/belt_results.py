"""Results of belt drives made by hand: a belt round its pulleys with forces as a drive has them."""

from collections.abc import Sequence
from math import asin, atan2, cos, hypot, pi, sin
from typing import Any, NamedTuple

import numpy as np
import tomli_w
from numpy.typing import NDArray

from frictionsim.mechanisms.belt_drive.schema import CHANNELS as ALL
from frictionsim.results import Check, Quantity, Record, SolverStatistics
from tests.support.scenarios import made_record

Array = NDArray[np.float64]

BELT = {"axial_rigidity": 2e4, "pretension": 550.0}  # N; it stretches by 2.75 %
RIM_SPEED, RAMP = 0.6, 0.3  # m/s, counter-clockwise; s
MU = 1.0

CHANNELS = {name: of for name, of in ALL.items() if of.axis and "work" not in name}


class Pulley(NamedTuple):
    """A pulley; sense is +1 where the belt passes it counter-clockwise, -1 on its back."""

    name: str
    x: float
    y: float
    radius: float
    sense: int = 1


TWO = (Pulley("driver", 0.0, 0.0, 0.027), Pulley("driven", 0.515, 0.0, 0.027))
FOUR = (
    Pulley("crankshaft", 0.0, 0.0, 0.08),
    Pulley("generator", 0.28, 0.1, 0.03),
    Pulley("tensioner", 0.19, 0.155, 0.035, -1),
    Pulley("water_pump", 0.05, 0.26, 0.06),
)


def lay(pulleys: Sequence[Pulley]) -> tuple[Array, Array, Array]:
    """Return fine points (n, 2) of the belt from where it leaves the first pulley, their distances
    along it, and the pulley under each, -1 on a span.
    """
    n = len(pulleys)
    directions = []
    for i, a in enumerate(pulleys):
        b = pulleys[(i + 1) % n]
        dx, dy = b.x - a.x, b.y - a.y
        step = b.sense * b.radius - a.sense * a.radius
        directions.append(atan2(dy, dx) - asin(step / hypot(dx, dy)))
    points, under = [], []
    for i, direction in enumerate(directions):
        ends = [tangent(pulleys[i], direction), tangent(pulleys[(i + 1) % n], direction)]
        points.append(ends[0] + np.linspace(0.0, 1.0, 300)[:, None] * (ends[1] - ends[0]))
        under.append(np.full(300, -1))
        pulley, sense = pulleys[(i + 1) % n], pulleys[(i + 1) % n].sense
        sweep = sense * (sense * (directions[(i + 1) % n] - direction) % (2.0 * pi))
        turned = direction + np.linspace(0.0, sweep, 300)
        points.append(np.array([tangent(pulley, float(angle)) for angle in turned]))
        under.append(np.full(300, (i + 1) % n))
    line = np.concatenate(points)
    legs = np.hypot(*np.diff(line, axis=0).T)
    return line, np.concatenate([[0.0], np.cumsum(legs)]), np.concatenate(under)


def tangent(pulley: Pulley, direction: float) -> Array:
    """Return the point of a pulley at which the belt has a direction."""
    arm = pulley.sense * pulley.radius
    return np.array([pulley.x + arm * sin(direction), pulley.y - arm * cos(direction)])


def tension_at(place: Array, under: Array, distances: Array, torque: float) -> Array:
    """Return a tension that falls from pulley to pulley and, on the first one, rises back."""
    length = distances[-1]
    ends = distances[np.flatnonzero(np.diff(under))]
    knots = np.concatenate([[0.0], ends, [length]])
    falls = np.linspace(1.0, -1.0, len(knots) // 2)
    levels = BELT["pretension"] + 280.0 * torque * np.concatenate([np.repeat(falls, 2), [1.0]])
    return np.interp(place, knots, levels[: len(knots)])


def belt_run(
    pulleys: Sequence[Pulley] = TWO, bodies: int = 150, samples: int = 201, **changes: Any
) -> Record:
    """Return a run of 2 s; keywords replace what it holds, `effects` those of the scenario."""
    line, distances, under = lay(pulleys)
    time = np.linspace(0.0, 2.0, samples)
    load = np.minimum(time / RAMP, 1.0)
    run = np.where(time < RAMP, time**2 / (2.0 * RAMP), time - 0.5 * RAMP) * RIM_SPEED
    length = distances[-1]
    place = (run[:, None] + (np.arange(bodies) + 0.5) * length / bodies) % length
    joint = (place - 0.5 * length / bodies) % length
    nearest = np.minimum(np.searchsorted(distances, place), len(under) - 1)
    touched = under[nearest].astype(float)
    tension = np.array(
        [tension_at(j, under, distances, q) for j, q in zip(joint, load, strict=True)]
    )
    sense = np.array([p.sense for p in pulleys])
    radius = np.array([p.radius for p in pulleys])
    on = touched.astype(int)
    normal = np.where(on >= 0, tension * length / bodies / radius[on], 0.0)
    into = np.roll(tension, -1, axis=1) - tension
    sliding = (on >= 0) & (place % 0.05 > 0.015) & (time[:, None] > 0.1)
    slip = np.where(sliding, 0.008 * sense[on] * np.sign(into) * load[:, None], 0.0)
    speed = np.outer(load, RIM_SPEED * sense / radius) * (1.0 - 0.01 * np.arange(len(pulleys)))
    channels: dict[str, Any] = {
        "pulley_angle": np.cumsum(speed, axis=0) * time[-1] / max(samples - 1, 1),
        "pulley_speed": speed,
        "pulley_torque": np.outer(load, np.linspace(15.0, -15.0, len(pulleys))),
        "x": np.interp(place, distances, line[:, 0]),
        "y": np.interp(place, distances, line[:, 1]),
        "angle": 2.0 * pi * place / length,
        "normal_force": normal,
        "friction_force": np.where(on >= 0, np.clip(-into * sense[on], -MU * normal, normal), 0.0),
        "slip_velocity": slip,
        "sticking": ((on >= 0) & ~sliding).astype(float),
        "pulley_index": touched,
        "tension": tension,
    }
    effects = changes.pop("effects", {"belt_friction": {"mu_s": MU, "mu_k": MU}})
    numbers = tuple(map(str, range(bodies)))
    members = {"pulley": tuple(p.name for p in pulleys), "body": numbers, "joint": numbers}
    made = made_record(
        scenario(pulleys, bodies, effects),
        CHANNELS,
        members,
        {"time": time} | channels,
        transitions=changes.pop("transitions", []),
    )
    quantities, checks = {"final_time": Quantity(2.0, "s")}, {"energy_balance": Check(0.0, 1e-7)}
    statistics = SolverStatistics(100, 0, 100, 6 * bodies, 0.1)
    return made._replace(quantities=quantities, checks=checks, statistics=statistics, **changes)


def scenario(pulleys: Sequence[Pulley], bodies: int, effects: dict[str, Any]) -> str:
    """Return the scenario of the result as TOML, with the tension that channels have on average."""
    tables = [
        {
            "name": p.name,
            "center": [p.x, p.y],
            "radius": p.radius,
            "inertia": 2.4e-4,
            "side": "inside" if p.sense > 0 else "outside",
        }
        for p in pulleys
    ]
    belt = {"bodies": bodies, "mass_per_length": 0.1} | BELT
    data = {
        "kind": "belt_drive",
        "title": "Belt drive made by hand",
        "mechanism": {"belt": belt, "pulleys": tables},
        "effects": effects,
        "solver": {"backend": "moreau", "duration": 2.0},
        "output": {"interval": 0.004},
    }
    return tomli_w.dumps(data)
