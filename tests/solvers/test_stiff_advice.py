"""A smoothed law is stiff: messages name the methods for it, and these solve it quickly."""

from collections.abc import Callable
from pathlib import Path

import pytest

import frictionsim as fs

Told = Callable[..., tuple[str, str]]

LAW = "effects.shaft_friction.law=regularised"
SPEED = "effects.shaft_friction.transition_speed="
SPRING = {
    "kind": "shaft",
    "mechanism": {"inertia": 1.0, "initial_angular_velocity": 5.0},
    "forces": [{"name": "clamp", "size": 1000.0, "point": [0.0, 0.0], "direction": [0.0, -1.0]}],
    "effects": {
        "torsion_spring": {"stiffness": 1.0},
        "shaft_friction": {
            "shaft_radius": 0.0125,
            "mu_s": 4.0 / 3.0,
            "mu_k": 4.0 / 3.0,
            "law": "regularised",
            "transition_speed": 1e-4,
        },
    },
    "solver": {"backend": "bdf", "duration": 31.4, "rtol": 1e-8, "atol": 1e-10},
}


@pytest.mark.parametrize(
    ("backend", "transition_speed"),
    [("bdf", 1e-4), ("bdf", 1e-5), ("radau", 1e-3), ("lsoda", 1e-6)],
)
def test_a_stiff_method_solves_a_smoothed_stop_in_few_steps(
    backend: str, transition_speed: float
) -> None:
    """The limit is r_s F = 10 N m: v^2 = 25 - 20 x - x^2 ends at sqrt(125) - 10."""
    speed = {"effects.shaft_friction.transition_speed": transition_speed}
    done = fs.solve(SPRING, {"solver.backend": backend, **speed}, max_steps=3000, check=True)
    # It creeps on by v_t k x/(1.5 L_s) for 31 s, and stops with an error of the order of v_t.
    exact = 125.0**0.5 - 10.0
    angle = done.quantities["final_angle"].value
    assert angle == pytest.approx(exact, abs=4.0 * transition_speed)
    if (backend, transition_speed) == ("bdf", 1e-4):
        assert angle == pytest.approx(1.1800960, abs=2e-6)  # ten times its own error


@pytest.mark.parametrize("kind", ["pulley_return", "marble_machine", "shaft"])
def test_a_smoothed_law_without_a_method_is_told_of_one_that_works(kind: str, told: Told) -> None:
    sets = ("--set", LAW, "--set", f"{SPEED}1e-4", "--set", "solver.duration=0.5")
    _, said = told("solve", kind, *sets, "-o", "a.h5", code=2)
    (advice,) = {part for part in said.split("--set ") if part.startswith("solver.backend=")}
    assert advice.startswith("solver.backend=bdf)")
    told("solve", kind, *sets, "--set", "solver.backend=bdf", "-o", "a.h5", "--quiet")
    assert Path("a.h5").exists()


@pytest.mark.parametrize("backend", ["rkf45", "rk45", "dop853"])
def test_limits_of_explicit_methods_name_stiff_ones(backend: str) -> None:
    for limit in ({"max_steps": 20}, {"max_wall": 1e-9}):
        reason = fs.solve(SPRING, {"solver.backend": backend}, **limit).reason
        assert "take a stiff method, bdf, radau or lsoda (--set solver.backend=bdf)" in reason
        assert "loosen the tolerances" not in reason
    exact = {"effects.shaft_friction.law": "set-valued", "solver.backend": "rkf45"}
    data = fs.load(SPRING).to_dict()
    del data["effects"]["shaft_friction"]["transition_speed"]
    reason = fs.solve(data, exact, max_steps=20).reason
    assert "loosen the tolerances" in reason
    assert "stiff" not in reason
