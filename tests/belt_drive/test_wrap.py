"""The wrap factor: closed forms that a polygon of bodies misses, for the belt of the paper."""

from functools import cache
from typing import Any

import numpy as np
import pytest

from frictionsim.results import Record
from tests.support.belt_scenarios import CONTINUED, Array, shipped
from tests.support.cases import one_in
from tests.support.scenarios import sound


def late(done: Record, name: str) -> Array:
    """Return the last fifth of a channel."""
    values: Array = done.channels[name][done.time >= 0.8 * done.time[-1]]
    return values


def joints_on(done: Record, pulley: int) -> Any:
    """Return which joints are between two bodies on a pulley, or on none, -1."""
    on = late(done, "pulley_index") == pulley
    return on & np.roll(on, 1, axis=1)


# What a soft contact leaves of the slip in fine meshes, 1200 bodies, over the creep of a string.
LIMIT_OF_MESH = {"with": 0.91, "without": 0.92}


@cache
def paper(bending: str, loaded: bool) -> Record:
    """Run the drive of 150 bodies, at 15 N m or without load, until it is steady."""
    changes: dict[str, Any] = {"drive__driven__torque": CONTINUED}
    if not loaded:
        changes = {
            "drive__driver": {"speed": {"time": [0.0, 0.1], "value": [0.0, -25.0]}},
            "drive__driven__torque": {"time": [0.0], "value": [0.0]},
        }
    if bending == "without":
        changes["effects__bending__rigidity"] = 1e-9
    return sound(
        shipped(
            "belt_drive",
            solver__duration=1.0 if loaded else 0.6,
            output={"interval": 1e-3, "channels": ["tension", "pulley_index", "pulley_speed"]},
            **changes,
        )
    )


def quantity(done: Record, name: str) -> float:
    value = done.quantities[name].value
    assert value is not None
    return value


def slip_over_creep(done: Record) -> float:
    """Return the slip over the creep of a string, (T1 - T2)/EA."""
    tight, slack = (quantity(done, f"tension_{name}") for name in ("tight", "slack"))
    return quantity(done, "slip_percent") / 100.0 * 1.52e5 / (tight - slack)


@pytest.mark.slow
@pytest.mark.parametrize("bending", LIMIT_OF_MESH)
def test_the_slip_is_near_that_of_fine_meshes(bending: str) -> None:
    """A polygon of 150 bodies slips by half as much again."""
    ratio = slip_over_creep(paper(bending, True)) / LIMIT_OF_MESH[bending]
    assert ratio == pytest.approx(1.0, abs={"without": 0.08, "with": 0.18}[bending])


def arc_over_span(done: Record) -> float:
    """Return the mean tension on the driver over that between the pulleys."""
    tension = late(done, "tension")
    return float(np.mean(tension[joints_on(done, 0)]) / np.mean(tension[joints_on(done, -1)]))


@pytest.mark.parametrize("bending", one_in(2, LIMIT_OF_MESH))
def test_without_load_an_arc_has_the_tension_of_its_spans(bending: str) -> None:
    """Except for seating in the soft contact, and bending before it."""
    done = paper(bending, False)
    assert arc_over_span(done) == pytest.approx(1.0, abs={"without": 0.03, "with": 0.09}[bending])
    assert abs(quantity(done, "slip_percent")) < 0.02
