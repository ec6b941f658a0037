"""An independent reader of the transitions of belts, from the recorded channels."""

from typing import Any

import numpy as np

from frictionsim.results import BACKWARD, FORWARD, OPEN, SLACK, STICK, TAUT, Record
from tests.support.scenarios import scenario_run
from tests.support.second_way import Array
from tests.support.second_way_belt import walked

Events = list[tuple[float, str, int, int]]


def events(done: Record) -> Events:
    return [(e.time, e.contact, e.mode_from, e.mode_to) for e in done.transitions]


def ahead(done: Record, j: int) -> Array:
    """Return how fast the belt moves over the rim of a pulley, counter-clockwise, m/s.

    From places at neighbouring samples alone: neither friction nor slip is looked at.
    """
    c, pulley = done.channels, scenario_run(done).model_dump()["mechanism"]["pulleys"][j]
    vx, vy = (np.gradient(c[name], done.time, axis=0) for name in ("x", "y"))
    rim = np.gradient(c["pulley_angle"][:, j], done.time) * pulley["radius"]
    dx, dy = c["x"] - pulley["center"][0], c["y"] - pulley["center"][1]
    along = (vy * dx - vx * dy) / np.hypot(dx, dy) - rim[:, None]
    pressed = c["normal_force"] * (c["pulley_index"] == j)
    mean: Array = np.sum(pressed * along, axis=1) / np.sum(pressed, axis=1)
    return mean


def read_pulley(done: Record, j: int) -> list[int]:
    """Return the state of a pulley in every sample, body by body."""
    c, scenario = done.channels, scenario_run(done).model_dump(by_alias=True)
    name = done.members["pulley"][j]
    law = scenario["effects"]["belt_friction"]
    mu_k = law["pulleys"].get(name, law)["mu_k"] if law is not None else 0.0
    loaded = law is not None and name in scenario["drive"] and mu_k > 0.0
    modes = []
    for k in range(len(done.time)):
        on = [i for i, p in enumerate(c["pulley_index"][k]) if p == j]
        slides = loaded and not any(c["sticking"][k, i] for i in on)
        if slides:
            friction = abs(sum(c["friction_force"][k, i] for i in on))
            slides = friction >= 0.99 * mu_k * sum(c["normal_force"][k, i] for i in on)
        if not on:
            modes.append(OPEN)
        elif slides:
            slips = sum(c["normal_force"][k, i] * c["slip_velocity"][k, i] for i in on)
            modes.append(FORWARD if slips < 0.0 else BACKWARD)
        else:
            modes.append(STICK)
    return modes


def lasting(time: Any, name: str, states: list[int]) -> Events:
    """Return the changes of a state that three samples agree on, or ten to come back."""
    now, changes = states[0], []
    for k in range(1, len(states)):
        following = states[k : k + (3 if now in (STICK, TAUT) else 10)]
        complete = len(following) == (3 if now in (STICK, TAUT) else 10)
        if complete and set(following) == {states[k]} != {now}:
            changes.append((float(time[k]), name, now, states[k]))
            now = states[k]
    return changes


def read(done: Record) -> Events:
    c, names = done.channels, done.members["pulley"]
    count = len(names)
    transitions: Events = []
    for j, name in enumerate(names):
        transitions += lasting(done.time, name, read_pulley(done, j))
    tension = [walked(*row, count) for row in zip(c["tension"], c["pulley_index"], strict=True)]
    least = 0.01 * np.mean(c["tension"][0])
    for j, name in enumerate(names):
        states = [SLACK if row[j] < least else TAUT for row in tension]
        transitions += lasting(done.time, f"span.{name}.{names[(j + 1) % count]}", states)
    return sorted(transitions, key=lambda event: event[0])
