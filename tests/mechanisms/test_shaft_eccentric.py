"""A load that passes zero, or close to it, on a shaft with an eccentric mass."""

from itertools import pairwise
from math import atan, cos, exp, hypot, log1p, pi, radians, sin
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from frictionsim.results import failures
from tests.support.scenarios import simulate

AMPLITUDE, FREQUENCY, PHASE, INERTIA, SPEED = 100.0, 7.0, radians(50.0), 0.05, 20.0
R_K = 0.02 * sin(atan(0.5))


def reversing(eccentric: dict[str, float] | None) -> dict[str, Any]:
    """Return a body that coasts while the force through its axis changes its sign."""
    wave = {"amplitude": AMPLITUDE, "frequency_hz": FREQUENCY, "phase_deg": 50.0}
    effects: dict[str, Any] = {
        "shaft_friction": {"shaft_radius": 0.02, "mu_s": 0.75, "mu_k": 0.5},
    }
    if eccentric is not None:
        effects["eccentric_mass"] = eccentric
    return {
        "kind": "shaft",
        "mechanism": {"inertia": INERTIA, "initial_angular_velocity": SPEED},
        "forces": [
            {"name": "load", "size": {"sine": wave}, "direction": [0.0, -1.0], "point": [0.0, 0.0]}
        ],
        "effects": effects,
        "solver": {"duration": 1.0, "rtol": 1e-11},
        "output": {"interval": 0.1},
    }


def final_angle(data: dict[str, Any]) -> float:
    return float(simulate(data).channels["angle"][-1])


@pytest.mark.parametrize("eccentric", [{"mass": 1.0, "radius": 0.0}, {"mass": 0.0, "radius": 1.0}])
def test_an_eccentric_mass_without_first_moment_changes_nothing(
    eccentric: dict[str, float],
) -> None:
    assert final_angle(reversing(eccentric)) == final_angle(reversing(None))


def test_a_rotor_that_nothing_but_its_eccentric_mass_loads_coasts_down() -> None:
    """Without gravity, I w' = -r_k R with R^2 = (m e w')^2 + (m e w^2)^2: w' = -beta w^2."""
    mass, radius, start, duration = 3.0, 0.1, 30.0, 20.0
    p, inertia = mass * radius, 0.5 + mass * radius**2
    friction = {"shaft_radius": 0.02, "mu_s": 0.75, "mu_k": 0.5}
    data = {
        "kind": "shaft",
        "mechanism": {"inertia": 0.5, "initial_angular_velocity": start},
        "effects": {
            "eccentric_mass": {"mass": mass, "radius": radius},
            "shaft_friction": friction,
        },
        "solver": {"duration": duration, "rtol": 1e-11},
        "output": {"interval": 0.01},
    }
    run = simulate(data)
    beta = R_K * p / (inertia**2 - (R_K * p) ** 2) ** 0.5
    final = {name: float(run.channels[name][-1]) for name in ("angle", "angular_velocity")}
    assert final["angular_velocity"] == pytest.approx(start / (1 + beta * start * duration), 1e-10)
    assert final["angle"] == pytest.approx(log1p(beta * start * duration) / beta, rel=1e-10)
    speed, rate = run.channels["angular_velocity"], run.channels["angular_acceleration"]
    assert run.channels["shaft_reaction"] == pytest.approx(p * np.hypot(speed**2, rate), rel=1e-12)
    # Its static limit has no load: the check of the law goes by the kinetic one.
    assert failures(run.checks) == ""


@pytest.mark.parametrize("damping", [0.0, 0.3])
def test_a_body_that_only_damping_brakes_needs_no_force(damping: float) -> None:
    data = {
        "kind": "shaft",
        "mechanism": {"inertia": 0.5, "initial_angular_velocity": 8.0},
        "effects": {"viscous_damping": {"coefficient": damping}},
        "solver": {"duration": 2.0, "rtol": 1e-11},
    }
    final = float(simulate(data).channels["angular_velocity"][-1])
    assert final == pytest.approx(8.0 * exp(-damping / 0.5 * 2.0), rel=1e-10)


def test_a_load_that_passes_close_to_zero() -> None:
    """Against steps of order 8 that end close to the reversals of the force."""
    mass = radius = 1e-3
    p = mass * radius
    inertia = INERTIA + p * radius

    def rates(t: float, y: Any) -> list[float]:
        q, v = y
        force = -AMPLITUDE * sin(2.0 * pi * FREQUENCY * t + PHASE)
        along, normal = force * cos(q), force * sin(q) + p * v * v
        a = 0.0
        for _ in range(60):  # inertia a = -R_K |(along - p a, normal)|
            size = hypot(along - p * a, normal)
            a -= (inertia * a + R_K * size) / (inertia - R_K * p * (along - p * a) / size)
        return [v, a]

    crossings = [(k * pi - PHASE) / (2.0 * pi * FREQUENCY) for k in range(1, 16)]
    near = [t + s * 10.0**-k for t in crossings for k in (4, 5, 6, 7, 8) for s in (1.0, -1.0)]
    cuts = sorted({0.0, 1.0, *(t for t in (*crossings, *near) if 0.0 < t < 1.0)})
    y = np.array([0.0, SPEED])
    for begin, end in pairwise(cuts):
        y = solve_ivp(rates, (begin, end), y, method="DOP853", rtol=1e-12, atol=1e-14).y[:, -1]
    found = final_angle(reversing({"mass": mass, "radius": radius}))
    assert found == pytest.approx(y[0], abs=3e-10, rel=0.0)
