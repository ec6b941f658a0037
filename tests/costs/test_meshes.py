"""Studies of meshes: models and numbers of bodies of a belt against the limit of fine meshes."""

import random
from pathlib import Path
from typing import Any

import pytest

import frictionsim as fs
from frictionsim.errors import SolverError
from frictionsim.mechanisms.belt_drive import study as mesh_study
from tests.costs.made import drawn_table, made_row
from tests.support.belt_kernels import assemble
from tests.support.belt_kernels import row as row_of
from tests.support.scenarios import SCENARIOS

BELT, PULLEY = str(SCENARIOS / "belt_drive.toml"), str(SCENARIOS / "pulley.toml")
QUANTITIES = {
    "driven_speed": "driven_speed",
    "slip": "slip_percent",
    "tension_tight": "tension_tight",
    "tension_slack": "tension_slack",
}
# Large pulleys, which few bodies can follow.
WIDE: dict[str, Any] = {
    "mechanism.pulleys.0.radius": 0.06,
    "mechanism.pulleys.1.radius": 0.06,
    "drive.driver.torque.time": [0.0, 0.002],  # soon at work
    "solver.duration": 0.01,
    "output.interval": 2e-4,
}
CHOSEN: dict[str, Any] = {
    "models": ["corrected", "polygon"],
    "backends": "moreau",
    "laws": "set-valued",
    "repeats": 1,
    "max_wall": 60.0,
}


# --- errors, by separate runs ------------------------------------------------


def quantities_of(model: str, bodies: int, overrides: dict[str, Any]) -> dict[str, float]:
    """Return the quantities of a separate run, with the keys of its mesh written out."""
    mesh = {"mechanism.belt.wrap": model, "mechanism.belt.bodies": bodies}
    # A study takes 500 samples or more.
    settings = {"solver.backend": "moreau", "output.interval": overrides["solver.duration"] / 500}
    result = fs.solve(BELT, overrides | mesh | settings)
    assert result.status == "done"
    return {name: float(result.quantities[source]) for name, source in QUANTITIES.items()}


def limit_of(model: str, most: int, overrides: dict[str, Any]) -> dict[str, float]:
    """Return the limit of twice and once the most bodies, at second order."""
    coarse, fine = (quantities_of(model, n, overrides) for n in (most, 2 * most))
    return {name: (4.0 * fine[name] - coarse[name]) / 3.0 for name in QUANTITIES}


@pytest.mark.slow
def test_errors_are_those_of_separate_runs() -> None:
    drawn = random.Random(1)
    own, other = drawn.sample([24, 30, 36], 2)
    overrides = WIDE | {
        "mechanism.belt.bodies": own,
        "mechanism.belt.pretension": drawn.uniform(300.0, 600.0),
        "effects.belt_friction.mu_s": 1.0,
        "effects.belt_friction.mu_k": drawn.uniform(0.5, 1.0),
    }
    told = fs.cost(BELT, overrides, bodies=[own, other], **CHOSEN).to_json()
    limit = limit_of("corrected", max(own, other), overrides)
    second = limit_of("polygon", max(own, other), overrides)
    for name in QUANTITIES:
        floor = abs(second[name] - limit[name]) / abs(limit[name])
        assert told["floor"][name]["relative"] == pytest.approx(floor, rel=1e-6)
    meshes = [(row["model"], row["bodies"]) for row in told["settings"]]
    assert set(meshes) == {(m, n) for m in ("corrected", "polygon") for n in (own, other)}
    assert len(meshes) == 6  # the scenario's own mesh has three steps
    for row, (model, bodies) in zip(told["settings"], meshes, strict=True):
        assert row["status"] == "done", row["reason"]
        values = quantities_of(model, bodies, overrides)
        longest = "solver.step" not in "".join(row["overrides"])
        for name in QUANTITIES:
            error = abs(values[name] - limit[name]) / abs(limit[name])
            found = row["errors"][name]["relative"]
            if longest:
                assert found == pytest.approx(error, rel=1e-6)
            else:  # its own step or a part of it: the same but for what the time step costs
                assert found == pytest.approx(error, rel=0.05, abs=1e-3)
        assert (row["time_error"] is not None) == ((model, bodies) == ("corrected", own))
        if row["time_error"] is not None:
            assert 0.0 < row["time_error"] < 0.1 * row["error"]


# --- what a mesh is --------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("own", "bodies"), [(150, (60, 150, 300, 600)), (600, (240, 600)), (60, (24, 60, 120, 240))]
)
def test_the_default_meshes_are_about_the_scenario_s(own: int, bodies: tuple[int, ...]) -> None:
    scenario: Any = fs.load(BELT, {"mechanism.belt.bodies": own})
    assert mesh_study.default_bodies(scenario) == bodies


def test_no_default_mesh_has_fewer_bodies_than_a_belt_may_have() -> None:
    radii = {f"mechanism.pulleys.{number}.radius": 0.25 for number in (0, 1)}
    scenario: Any = fs.load(BELT, {"mechanism.belt.bodies": 8, **radii})
    assert mesh_study.default_bodies(scenario) == (8, 16, 32)


@pytest.mark.parametrize("named", [None, 100])
def test_a_finer_mesh_has_as_stiff_a_contact(named: int | None) -> None:
    scenario: Any = fs.load(BELT, {"effects.contact.reference_bodies": named})
    total = 150 * contact_of(scenario)
    for bodies in (60, 300):
        mesh = mesh_study.mesh_of(scenario, "polygon", bodies)
        finer = fs.load(scenario.to_dict(), mesh.overrides)
        assert finer.mechanism.belt.bodies == bodies  # type: ignore[attr-defined]
        assert finer.mechanism.belt.wrap == "polygon"  # type: ignore[attr-defined]
        assert bodies * contact_of(finer) == pytest.approx(total, rel=1e-12)


def contact_of(scenario: Any) -> float:
    """Return the linear stiffness of the contact of a body."""
    stiffness: float = assemble(scenario).belt.pul[row_of.LINEAR]
    return stiffness


def test_the_limit_is_of_the_scenario_s_own_model() -> None:
    scenario: Any = fs.load(BELT, {"mechanism.belt.wrap": "polygon"})
    first, second = mesh_study.limits(scenario, 600)
    assert first.name == "moreau, set-valued, polygon, extrapolated from 600 and 1200 bodies"
    assert second.fine.mesh is not None
    assert second.fine.mesh.model == "corrected"


@pytest.mark.slow
def test_a_mesh_that_is_refused_is_a_row_with_the_reason() -> None:
    study = fs.cost(BELT, WIDE | {"mechanism.belt.bodies": 30}, bodies=[5, 24], **CHOSEN)
    told = study.to_json()
    refused = [row for row in told["settings"] if row["status"] == "failed"]
    assert len(refused) == 2
    assert "5 bodies of 0.281 m cannot follow the curve of 'driver'" in refused[0]["reason"]
    assert refused[0]["error"] is None
    assert f": {refused[0]['reason']}\n" in study.summary()
    assert told["time_references"] == []  # its own mesh is not compared
    study.plot()


# --- arguments and outputs -------------------------------------------------------------------


def test_meshes_that_are_too_fine_say_the_way_out() -> None:
    chosen = CHOSEN | {"models": "corrected", "max_wall": 1e-9}
    with pytest.raises(SolverError) as caught:
        fs.cost(BELT, WIDE | {"mechanism.belt.bodies": 30}, bodies=[24, 36], **chosen)
    said = str(caught.value)
    assert said.startswith("no mesh is fine enough to judge by: moreau, set-valued, corrected")
    assert said.endswith("compare fewer bodies or allow each run more wall time")


def test_lines_of_a_model_go_from_mesh_to_mesh_and_by_steps(tmp_path: Path) -> None:
    of = [("corrected", 60), ("corrected", 24), ("corrected", 60)]
    numbers = [(0.2, 0.1), (0.2, 1.0), (0.1, 9.0)]
    rows = [made_row("moreau", *pair, mesh=mesh) for pair, mesh in zip(numbers, of, strict=True)]
    over_time = drawn_table(tmp_path / "a.csv", rows).axes[0]
    drawn = [list(map(tuple, line.get_xydata())) for line in over_time.lines]
    # Of 24 and of 60 bodies, each with its longest step.
    assert [(1.0, 0.2), (0.1, 0.2)] in drawn
    assert [(0.1, 0.2), (9.0, 0.1)] in drawn  # of 60 bodies, by their steps


def test_a_model_that_needs_a_contact_is_refused_without_one() -> None:
    overrides = WIDE | {"effects.contact": None, "effects.bending": None}
    with pytest.raises(fs.InputError, match=r"'corrected' needs \[effects.contact\]"):
        fs.cost(BELT, overrides, bodies=[24], **CHOSEN)
