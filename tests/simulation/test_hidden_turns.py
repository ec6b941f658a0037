"""Every kind of which something depends on an angle warns of samples that do not resolve it."""

from math import pi
from typing import Any

import pytest

import frictionsim as fs

TURN = "is longer than a tenth of a turn"


def warned(scenario: fs.Scenario) -> list[str]:
    return [text for text in fs.solve(scenario).warnings if TURN in text]


def gear(speed: float, interval: float) -> fs.Scenario:
    planet = {"sun_radius": 0.12, "planet_radius": 0.03, "crank_mass": 0.5, "planet_mass": 0.3}
    return fs.load(
        {
            "kind": "epicyclic",
            "mechanism": planet,
            "drive": {"speed": speed},
            "solver": {"duration": 5.0},
            "output": {"interval": interval},
        }
    )


def machine(speed: float, interval: float) -> fs.Scenario:
    start = {"mechanism.initial_angular_velocity": speed, "solver.duration": 0.5}
    return fs.load("marble_machine").replace(start | {"output.interval": interval})


def belt(speed: float, interval: float) -> fs.Scenario:
    pulleys = [
        {"name": "a", "center": [0.0, 0.0], "radius": 0.05, "inertia": 1e-3},
        {"name": "b", "center": [0.4, 0.0], "radius": 0.02, "inertia": 1e-3},
    ]
    belt = {"bodies": 30, "mass_per_length": 0.1, "axial_rigidity": 1e4, "pretension": 300.0}
    return fs.load(
        {
            "kind": "belt_drive",
            "mechanism": {"belt": belt, "pulleys": pulleys},
            "drive": {"a": {"speed": speed}},
            "effects": {
                "belt_friction": {"mu_s": 0.3, "mu_k": 0.3},
                "axial_damping": {"coefficient": 5.0},
            },
            "solver": {"duration": 0.1, "backend": "moreau"},
            "output": {"interval": interval},
        }
    )


@pytest.mark.parametrize(
    ("of", "speed", "ratio"),
    [
        (gear, 7.0, 1.0),
        (gear, -40.0, 1.0),
        (gear, 0.5, 1.0),
        (machine, 60.0, 1.0),
        (belt, 40.0, 2.5),
        (belt, -200.0, 2.5),
    ],
)
def test_more_than_a_tenth_of_a_turn_between_samples_is_warned_of(
    of: Any, speed: float, ratio: float
) -> None:
    # The belt's smaller pulley turns faster, and overshoots by a third at the start.
    tenth = 0.1 * 2.0 * pi / abs(ratio * speed)
    texts = warned(of(speed, 1.1 * tenth))
    assert len(texts) == 1
    assert "do not resolve what depends on the angle; give " in texts[0]
    assert not warned(of(speed, 0.6 * tenth))


def test_what_stays_within_a_tenth_of_a_turn_is_resolved() -> None:
    assert not warned(gear(0.12, 5.0))
    assert warned(gear(0.13, 5.0))


@pytest.mark.parametrize(
    "name",
    ["epicyclic", "hoist_drum", "lift", "marble_machine", "pulley", "shaft", "swing_door"],
)
def test_the_shipped_scenarios_are_fine_enough(name: str) -> None:
    assert not warned(fs.load(name))
