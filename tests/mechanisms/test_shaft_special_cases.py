"""The statics of the pulley and of the marble machine as those of a body on a shaft."""

from math import cos, pi, radians, sin
from typing import Any

import pytest

import frictionsim as fs
from frictionsim.mechanisms.shaft.statics import breakaway_values
from tests.support.scenarios import Scenario, shipped

pytestmark = pytest.mark.quick

RELATIVE = 1e-12


def shaft(data: Scenario, **tables: Any) -> Scenario:
    """Return a body with the shaft friction of a scenario and other tables."""
    friction = data["effects"]["shaft_friction"]
    return {"kind": "shaft", "effects": {"shaft_friction": friction}} | tables


def limits(data: Scenario, name: str) -> tuple[float, float]:
    """Return the sizes of a force of impending motion: to lift, counter-clockwise, and to hold."""
    found = breakaway_values(fs.load(data | {"statics": {"unknown": f"forces.{name}.size"}}))
    lift, hold = (found[f"{name}_{s}clockwise"].value for s in ("counter_", ""))
    assert lift is not None
    assert hold is not None
    return lift, hold


@pytest.mark.parametrize("direction", ["vertical", "horizontal"])
@pytest.mark.parametrize(
    ("mu", "names"),
    [
        ("mu_s", ("force_to_lift", "force_to_hold")),
        ("mu_k", ("force_to_keep_lifting", "force_to_keep_lowering")),
    ],
)
def test_the_limit_forces_of_the_pulley(direction: str, mu: str, names: tuple[str, str]) -> None:
    pulley = shipped("pulley", drive__direction=direction)
    wanted = fs.static(pulley)
    pulley["effects"]["shaft_friction"]["mu_s"] = pulley["effects"]["shaft_friction"][mu]
    geometry = pulley["mechanism"]
    arm = geometry["cord_radius"]
    cords = [
        {"name": "load", "size": geometry["load"], "direction": [0.0, -1.0], "cord_radius": -arm},
        {
            "name": "pull",
            "size": 0.0,
            "direction": [0.0, -1.0] if direction == "vertical" else [-1.0, 0.0],
            "cord_radius": arm,
        },
    ]
    body = shaft(pulley, mechanism={"inertia": geometry["inertia"]}, forces=cords)
    forces = [wanted[name].value for name in names]
    assert limits(body, "pull") == pytest.approx(forces, rel=RELATIVE)


@pytest.mark.parametrize("slots", [2, 10])
@pytest.mark.parametrize("azimuth", [-90.0, 37.0, 120.0])
def test_the_limit_torques_of_the_marble_machine(slots: int, azimuth: float) -> None:
    """At a transfer: the tooth force on the gear, and the weight of each marble in its slot."""
    machine = shipped("marble_machine", mechanism__mesh_azimuth_deg=azimuth)
    geometry, g = machine["mechanism"], machine["effects"]["gravity"]["g"]
    geometry["slots"] = slots
    alpha, at = radians(geometry["pressure_angle_deg"]), radians(azimuth)
    gear_radius = geometry["gear_ratio"] * geometry["pinion_radius"]
    tooth = {
        "name": "tooth",
        "size": 0.0,
        "point": [gear_radius * cos(at), gear_radius * sin(at)],
        "direction": [cos(at + 0.5 * pi + alpha), sin(at + 0.5 * pi + alpha)],
    }
    circle = geometry["marble_circle_radius"]
    angles = [2.0 * pi * i / slots for i in range(slots // 2 + 1)]
    marbles = [
        {
            "name": f"marble{i}",
            "size": geometry["marble_mass"] * g,
            "point": [circle * sin(angle), -circle * cos(angle)],
            "direction": [0.0, -1.0],
        }
        for i, angle in enumerate(angles)
    ]
    body = shaft(
        machine,
        mechanism={"inertia": 1.0, "mass": geometry["gear_mass"]},
        forces=[tooth, *marbles],
    )
    body["effects"]["gravity"] = {"g": g}
    per_force = geometry["pinion_radius"] * cos(alpha)  # pinion torque
    wanted = fs.static(machine)
    lift, hold = limits(body, "tooth")
    assert lift * per_force == pytest.approx(wanted["torque_to_lift"].value, rel=RELATIVE)
    # Of two marbles at top and bottom there is no torque; what both leave is a difference.
    assert hold * per_force == pytest.approx(
        wanted["torque_to_hold"].value, rel=RELATIVE, abs=RELATIVE * lift * per_force
    )
