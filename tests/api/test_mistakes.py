"""What a user of the functions may get wrong, or may expect of them."""

from concurrent.futures import ThreadPoolExecutor
from inspect import isfunction, signature
from pathlib import Path

import numpy as np
import pytest

import frictionsim as fs
from tests.support.scenarios import SCENARIOS

pytestmark = pytest.mark.quick

PULLEY = SCENARIOS / "pulley.toml"


def test_an_effect_is_taken_out_by_none() -> None:
    mapping = fs.load(PULLEY, {"effects.viscous_damping": None})
    text = fs.load(PULLEY, ["effects.viscous_damping=none"])
    assert mapping.effect_names == text.effect_names == ("shaft_friction",)
    assert mapping.origin == text.origin
    assert mapping.origin.command.endswith("--set effects.viscous_damping=none")
    # A key that is not there may be taken out as well.
    assert fs.load(PULLEY, {"solver.max_step": None}) == fs.load(PULLEY)


def test_threads_write_results_at_once(tmp_path: Path) -> None:
    whole = tmp_path / "whole.h5"
    fs.solve(PULLEY, output=whole)
    files = [tmp_path / f"{number}.h5" for number in range(24)]
    with ThreadPoolExecutor(4) as pool:
        results = list(pool.map(lambda file: fs.solve(PULLEY, output=file), files))
    assert {result.status for result in results} == {"done"}
    assert {file.read_bytes() for file in files} == {whole.read_bytes()}


def test_quantities_are_numbers_with_a_unit() -> None:
    quantities = fs.static(PULLEY)
    lift, radius = quantities["force_to_lift"], quantities["friction_radius_static"]
    assert float(lift) == lift.value
    assert f"{lift:.1f}" == "2707.7 N"
    assert np.isnan(float(fs.Quantity(None, "s")))
    for operation in (
        lambda: lift * 2,
        lambda: 2 * lift,
        lambda: lift + radius,
        lambda: lift < radius,
        lambda: sorted([lift, radius]),
    ):
        with pytest.raises(TypeError, match=r"calculate with quantity\.value"):
            operation()


def test_a_run_without_events_has_the_variables_of_events() -> None:
    still, moving = (fs.solve(PULLEY, {"drive.force": force}) for force in (2000.0, 3000.0))
    assert (still.events.sizes["event"], moving.events.sizes["event"]) == (0, 1)
    assert set(still.events.variables) == set(moving.events.variables)


@pytest.mark.parametrize("name", [n for n in fs.__all__ if isfunction(getattr(fs, n))])
def test_no_function_ignores_an_unknown_keyword(name: str) -> None:
    function = getattr(fs, name)
    named = signature(function).parameters.values()
    needed = [p.name for p in named if p.default is p.empty and p.kind is not p.VAR_KEYWORD]
    with pytest.raises((TypeError, fs.InputError), match="'wrokers'"):
        function(**dict.fromkeys(needed), wrokers=1)


def test_a_shipped_scenario_with_a_csv_file_stands_alone(tmp_path: Path) -> None:
    scenario = fs.loads(fs.new("hard/jump_from_csv"))
    shipped = fs.load(SCENARIOS / "hard" / "jump_from_csv.toml")
    assert (scenario.drive, scenario.effects) == (shipped.drive, shipped.effects)
