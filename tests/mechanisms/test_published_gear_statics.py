"""Static values of the published epicyclic gear are those of its own equation."""

from math import cos, radians, sin

import pytest

import frictionsim as fs

DRAWN = [(0.0, 1.2, 0.15), (60.0, 0.7, 0.05), (200.0, 2.5, 0.4)]


@pytest.mark.parametrize(("angle", "planet_mass", "couple"), DRAWN)
def test_static_is_of_eq_28(angle: float, planet_mass: float, couple: float) -> None:
    overrides = {
        "mechanism.formulation": "published",
        "mechanism.initial_angle_deg": angle,
        "mechanism.planet_mass": planet_mass,
        "effects.hinge_friction.torque_kinetic": couple,
        "effects.hinge_friction.torque_static": couple,
    }
    scenario = fs.load("epicyclic", overrides)
    values = {name: q.value for name, q in fs.static(scenario).items()}
    assert not any(name.startswith("torque_to_start") for name in values)
    data = scenario.to_dict()
    gear, g = data["mechanism"], data["effects"]["gravity"]["g"]
    length = gear["sun_radius"] + gear["planet_radius"]
    turns = length / gear["planet_radius"]
    weights = (0.5 * gear["crank_mass"] + 2.0 * planet_mass) * g * length
    arm = data["effects"]["rolling_friction"]["arm"]
    phi = radians(angle)
    rolling = arm * planet_mass * g * sin(phi) * turns
    assert values["gravity_moment"] == pytest.approx(weights, rel=1e-13)  # roundoff
    eq_28 = weights * cos(phi) + couple * turns + rolling
    assert values["uniform_torque_at_start"] == pytest.approx(eq_28, rel=1e-13)
    done = fs.solve(scenario, {"solver.duration": 0.01})
    recorded = float(done.dataset["uniform_torque"].values[0])
    assert recorded == pytest.approx(eq_28, rel=1e-13)


def test_the_shipped_gear_has_the_printed_moment() -> None:
    both = {
        formulation: fs.static("epicyclic", {"mechanism.formulation": formulation})
        for formulation in ("consistent", "published")
    }
    assert both["published"]["gravity_moment"].value == pytest.approx(4.94424, rel=1e-12)
    assert both["consistent"]["gravity_moment"].value == pytest.approx(2.82528, rel=1e-12)
    assert "torque_to_start_forward" in both["consistent"]
