"""The wrap factor: closed forms that a polygon of bodies misses."""

from functools import cache
from typing import Any

import numpy as np
import pytest

from frictionsim.results import Record
from tests.support.belt_scenarios import CONTINUED, Array, mirrored, pair, shipped
from tests.support.scenarios import Scenario, sound


def late(done: Record, name: str) -> Array:
    """Return the last fifth of a channel."""
    found: Array = done.channels[name][done.time >= 0.8 * done.time[-1]]
    return found


def joints_on(done: Record, pulley: int) -> Any:
    """Return which joints are between two bodies on a pulley, or on none, -1."""
    on = late(done, "pulley_index") == pulley
    return on & np.roll(on, 1, axis=1)


# --- the belt of the paper ------------------------------------------------------------------------

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
            output__channels=["tension", "pulley_index", "pulley_speed"],
            **changes,
        )
    )


def quantity(done: Record, name: str) -> float:
    value = done.quantities[name].value
    assert value is not None
    return value


def transmitted(done: Record) -> float:
    """Return T1 - T2 over the torque of the driver over its radius."""
    return (quantity(done, "tension_tight") - quantity(done, "tension_slack")) * 0.027 / 15.0


def slip_over_creep(done: Record) -> float:
    """Return the slip over the creep of a string, (T1 - T2)/EA."""
    tight, slack = (quantity(done, f"tension_{name}") for name in ("tight", "slack"))
    return quantity(done, "slip_percent") / 100.0 * 1.52e5 / (tight - slack)


@pytest.mark.parametrize("bending", LIMIT_OF_MESH)
def test_spans_balance_the_torque(bending: str) -> None:
    assert transmitted(paper(bending, True)) == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("bending", LIMIT_OF_MESH)
def test_the_slip_is_near_that_of_fine_meshes(bending: str) -> None:
    """A polygon of 150 bodies slips by half as much again."""
    found = slip_over_creep(paper(bending, True)) / LIMIT_OF_MESH[bending]
    assert found == pytest.approx(1.0, abs={"without": 0.08, "with": 0.18}[bending])


def arc_over_span(done: Record) -> float:
    """Return the mean tension on the driver over that between the pulleys."""
    tension = late(done, "tension")
    return float(np.mean(tension[joints_on(done, 0)]) / np.mean(tension[joints_on(done, -1)]))


@pytest.mark.parametrize("bending", LIMIT_OF_MESH)
def test_without_load_an_arc_has_the_tension_of_its_spans(bending: str) -> None:
    """But for what the soft contact does where a body comes on to it, and bending before that."""
    done = paper(bending, False)
    assert arc_over_span(done) == pytest.approx(1.0, abs={"without": 0.03, "with": 0.09}[bending])
    assert abs(quantity(done, "slip_percent")) < 0.02


# --- drawn belts ----------------------------------------------------------------------------------

# The driver comes to 10 rad/s, the driven pulley takes out 3 N m at that speed.
RUNNING = {"time": [0.0, 0.05], "value": [0.0, -10.0]}
# Contacts some 1e-5 m deep: on soft ones the forces of a body have another lever than the rim.
STIFF = 4e6  # N/m
BRAKED = {"speed": [-20.0, 20.0], "value": [6.0, -6.0]}


def belt(bodies: int, *pulleys: dict[str, Any]) -> Scenario:
    """Return a belt without gravity round pulleys of 2e-3 kg m^2, the second one driven."""
    return pair(
        mechanism__belt__bodies=bodies,
        mechanism__pulleys=[{"inertia": 2e-3, **pulley} for pulley in pulleys],
        drive={"driver": {"speed": RUNNING}, "driven": {"torque": BRAKED}},
        effects__contact={"c1": 0.0, "c2": STIFF, "damping": 20.0, "reference_bodies": 48},
        solver={"backend": "moreau", "duration": 0.6},
    )


def pulley(name: str, x: float, y: float, radius: float, **more: str) -> dict[str, Any]:
    return {"name": name, "center": [x, y], "radius": radius, **more}


LAYOUTS = {
    "two alike": (pulley("driver", 0.0, 0.0, 0.08), pulley("driven", 0.25, 0.0, 0.08)),
    "two unlike": (pulley("driver", 0.0, 0.0, 0.05), pulley("driven", 0.3, 0.04, 0.11)),
    "three": (
        pulley("driver", 0.0, 0.0, 0.06),
        pulley("driven", 0.35, 0.02, 0.1),
        pulley("idler", 0.15, 0.22, 0.05),
    ),
    "a roller on the back": (
        pulley("driver", 0.0, 0.0, 0.08),
        pulley("driven", 0.4, 0.01, 0.07),
        pulley("roller", 0.2, 0.055, 0.06, side="outside"),
    ),
}


@pytest.mark.parametrize("name", LAYOUTS)
@pytest.mark.parametrize("image", [False, True], ids=["", "mirrored"])
def test_drawn_belts_creep_and_balance_their_torques(name: str, image: bool) -> None:
    data = belt(96, *LAYOUTS[name])
    data = mirrored(data) if image else data
    done = sound(data)
    tight, slack = (quantity(done, f"tension_{name}") for name in ("tight", "slack"))
    creep = 100.0 * (tight - slack) / 1e4
    radius = data["mechanism"]["pulleys"][0]["radius"]
    torque = abs(float(np.mean(late(done, "pulley_torque")[:, 0])))
    # Bodies of 0.2 radii, on contacts that are not rigid; samples each 1 ms see some corners only.
    assert quantity(done, "slip_percent") == pytest.approx(creep, rel=0.3)
    assert tight - slack == pytest.approx(torque / radius, rel=8e-3)
