"""`solve --estimate-error`: the estimate is close to the error."""

import json
import re
from collections.abc import Callable
from typing import Any

import pytest

import frictionsim as fs
from tests.support.scenarios import pulley, simulate

EXACT = simulate(pulley(solver__rtol=1e-13, solver__atol=1e-15)).quantities


@pytest.mark.parametrize(
    ("name", "law", "solver"),
    [
        ("final_angle", "set-valued", {"backend": "events", "rtol": 1e-5, "atol": 1e-8}),
        ("energy_friction", "set-valued", {"backend": "rkf45", "rtol": 1e-6, "atol": 1e-9}),
        ("breakaway_time", "regularised", {"backend": "lsoda", "rtol": 1e-6, "atol": 1e-9}),
        ("final_angle", "regularised", {"backend": "rkf45", "rtol": 1e-6}),
        ("breakaway_time", "published", {"backend": "rkf45", "step": 1e-3}),
    ],
)
def test_the_estimate_is_near_the_error(name: str, law: str, solver: dict[str, Any]) -> None:
    data = pulley(
        **{f"solver__{key}": value for key, value in solver.items()},
        effects__shaft_friction__law=law,
        effects__shaft_friction__transition_speed=1e-2
        if name == "final_angle" and law == "regularised"
        else None,
    )
    run = fs.solve(data, estimate_error=True)
    error = abs((run.quantities[name].value or 0.0) - (EXACT[name].value or 0.0))
    error_estimate = run.errors[name]
    # Where a switch falls within a step decides on a factor of two; a second run that is not
    # much more exact, as with a speed that goes in by its power 2/3, hides a fifth of the error.
    assert 0.4 * error < (error_estimate or 0.0) < 4.0 * error


@pytest.mark.parametrize("interval", [0.03, 0.04, 0.05])
def test_the_error_of_an_extreme_has_that_of_the_samples(interval: float) -> None:
    """The gear is turned evenly, so that the exact peak is the one of uniform speed."""
    data = {"output.interval": interval, "mechanism.initial_angle_deg": -90.0}
    run = fs.solve("epicyclic_dwell", data, estimate_error=True)
    peak, exact = (
        run.quantities["drive_torque_peak"].value,
        run.quantities["uniform_torque_max"].value,
    )
    error = run.errors["drive_torque_peak"]
    assert None not in (peak, exact, error)
    assert abs(peak - exact) > 1e-5
    # Where its samples come no nearer, four times as many leave a third of the error unseen.
    assert 0.5 * abs(peak - exact) < error < 1.1 * abs(peak - exact)


def test_errors_are_shown_beside_each_quantity(told: Callable[..., tuple[str, str]]) -> None:
    shown, _ = told("solve", "pulley", "--estimate-error")
    head, row = shown.splitlines()[2], shown.splitlines()[8]
    assert head.split() == ["quantity", "value", "error", "unit"]
    assert row.split()[0] == "final_angle"
    assert 1e-12 < float(row.split()[2]) < 1e-8
    run = "rtol 1e-10, atol 1e-13, output.interval 0.0025 s"
    assert f"error: the difference to a run with {run}\n" in shown
    said = json.loads(told("solve", "pulley", "--estimate-error", "--json")[0])
    assert 1e-12 < said["quantities"]["final_angle"]["error"] < 1e-8
    assert said["quantities"]["last_rest_time"]["error"] is None
    assert said["error_estimate"].startswith("error: the difference")


def test_the_estimate_works_for_other_kinds_without_a_mesh() -> None:
    done = fs.solve("epicyclic", estimate_error=True)
    assert done.exit_code == 0
    assert done.errors.keys() == done.quantities.keys()
    assert done.other_mesh == {}
    assert "on_other_mesh" not in done.to_json()["quantities"]["final_angle"]


def test_a_belt_halves_its_automatic_step() -> None:
    short = {"solver.duration": 2e-4}
    fixed = fs.solve("belt_drive", {**short, "solver.backend": "moreau"}, estimate_error=True)
    found = re.search(r"a run with step ([^ ,;]*)", fixed.error_estimate)
    assert found, fixed.error_estimate
    assert 1e-6 < float(found[1]) < 1.8e-6  # 3.5e-6 s is the longest stable one
    adaptive = fs.solve("belt_drive", {**short, "solver.backend": "rkf45"}, estimate_error=True)
    assert "a run with rtol 2e-7" in adaptive.error_estimate


STRING = {"solver.duration": 2e-3, "solver.backend": "moreau", "output.interval": 1e-4}


def test_a_belt_is_solved_on_twice_as_many_bodies_as_well() -> None:
    data = STRING | {"solver.step": 5e-6}
    result = fs.solve("belt_string", data, estimate_error=True)
    half = {"solver.step": 2.5e-6, "mechanism.belt.bodies": 120}
    fine = fs.solve("belt_string", {**data, **half})
    assert result.other_mesh == {name: q.value for name, q in fine.quantities.items()}
    assert "the mesh is not included: '120 bodies' has the value of that" in result.error_estimate
    shown = result.summary().splitlines()
    head = next(line for line in shown if line.startswith("quantity"))
    assert head.split() == ["quantity", "value", "error", "120", "bodies", "unit"]
    row = next(line.split() for line in shown if line.startswith("energy_kinetic"))
    exact = fine.quantities["energy_kinetic"].value or 0.0
    value = result.quantities["energy_kinetic"].value or 0.0
    assert 0.0 < abs(exact - float(row[3])) < abs(exact - value)  # as many digits as differ
    told = result.to_json()["quantities"]
    assert told["energy_kinetic"]["on_other_mesh"] == exact


def test_after_a_long_run_the_mesh_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("frictionsim.costs.error_estimate.MAX_SECONDS", 0.0)
    result = fs.solve("belt_string", STRING, estimate_error=True)
    assert result.other_mesh == {}
    assert "mesh is not included, 'frictionsim cost'" in result.error_estimate
    assert result.errors.keys() == result.quantities.keys()


def test_a_failed_second_run_keeps_the_first(told: Callable[..., tuple[str, str]]) -> None:
    """It takes more than the 150 steps that are enough for the first."""
    out, err = told("solve", "pulley", "--estimate-error", "--set", "solver.max_steps=150")
    assert "quantity                      value  unit\n" in out
    assert err.startswith(
        "frictionsim: warning: no error estimate: run with rtol 1e-10, atol 1e-13,"
        " output.interval 0.0025 s failed: limit"
    )
