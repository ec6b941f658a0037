"""Units of keys that are varied."""

from typing import Any

import pytest

import frictionsim as fs
from tests.support.belt_scenarios import pair
from tests.support.scenarios import Scenario, shipped

ON_THE_BODY: dict[str, Any] = {"direction": [0.0, -1.0], "point": [0.1, 0.0]}


def shaft() -> Scenario:
    """Return a body with forces of several names, in one instant."""
    forces = [
        {"name": "load", "size": {"sine": {"amplitude": 2.0, "frequency_hz": 1.0}}, **ON_THE_BODY},
        {"name": "size", "size": 1.0, **ON_THE_BODY},
        {"name": "cord", "size": 3.0, "direction": [0.0, -1.0], "cord_radius": 0.1},
    ]
    couples = [{"name": "motor", "size": 1.0}]
    return shipped("shaft", forces=forces, couples=couples, solver__duration=1e-3)


def belt() -> Scenario:
    friction = {"mu_s": 0.6, "mu_k": 0.6, "pulleys": {"driven": {"mu_s": 0.6, "mu_k": 0.5}}}
    short = {"solver__backend": "moreau", "solver__rtol": None, "solver__duration": 1e-3}
    return pair(**short, effects__belt_friction=friction)


UNITS = [
    (shaft(), "mechanism.inertia", 1.0, "kg m^2"),
    (shaft(), "forces.1.size", 2.0, "N"),
    (shaft(), "forces.size.size", 2.0, "N"),  # of an entry with that name
    (shaft(), "forces.load.point.1", 0.1, "m"),
    (shaft(), "couples.motor.size", 2.0, "N m"),
    (shaft(), "forces.load.size.sine.frequency_hz", 2.0, "Hz"),
    (belt(), "effects.belt_friction.pulleys.driven.mu_k", 0.4, "1"),
]


@pytest.mark.parametrize(("data", "key", "value", "unit"), UNITS)
def test_entries_of_lists_have_the_unit_of_their_key(
    data: Scenario, key: str, value: float, unit: str
) -> None:
    swept = fs.sweep(data, {key: [value]}, workers=1)
    assert swept.status == "done"
    assert swept.dataset[key].attrs["units"] == unit
