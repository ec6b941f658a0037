"""Functions and their commands; static, compare and cost from Python; quantities."""

import re
from collections.abc import Callable
from inspect import signature
from pathlib import Path

import numpy as np
import pytest

import frictionsim as fs
from tests.support.scenarios import SCENARIOS, pulley

PULLEY = SCENARIOS / "pulley.toml"
MU_S = "effects.shaft_friction.mu_s"

# What a command and its function have alone: an option has another name where a shell needs it, a
# notebook needs no --json, a shell no figure to draw in.
EVERYWHERE = {"help", "json", "quiet", "verbose", "set", "backend"}
ALONE: dict[str, tuple[set[str], set[str]]] = {
    "solve": (set(), {"check"}),
    "resume": ({"dask", "workers"}, {"check"}),  # of a sweep, which is resume_sweep
    "fit": (
        {"channel", "quantity", "unit", "plot", "output", "no_clobber"},
        {"channels", "quantities", "units"},
    ),
    "cost": ({"csv", "plot", "no_clobber"}, set()),
    "sweep": ({"csv"}, set()),
    "compare": (set(), {"golden"}),
    "plot": (
        {"from", "to", "no_title", "animate", "fps", "speed", "output", "no_clobber"}
        | {"channel", "unit"},
        {"window", "title", "figure", "measured", "units"},
    ),
}


@pytest.mark.parametrize("command", ALONE)
def test_a_function_and_its_command_have_the_same_options(
    command: str, told: Callable[..., tuple[str, str]]
) -> None:
    of_command, of_function = ALONE[command]
    help_text = told(command, "--help")[0].partition("\nOptions:\n")[2]
    options = {
        match[1].replace("-", "_"): " ".join(entry.split())
        for entry in re.split(r"\n  (?=-)", help_text)
        if (match := re.match(r" *(?:-\w, )?--([\w-]+)", entry))
    }
    parameters = signature(getattr(fs, command)).parameters
    needed = {"scenario", "result", "overrides", "progress"} | of_function
    assert options.keys() - EVERYWHERE - of_command == parameters.keys() - needed
    for name in options.keys() & parameters.keys():
        shown, default = re.search(r"\[([\w.-]+)\]$", options[name]), parameters[name].default
        if shown and isinstance(default, int | float | str):
            assert type(default)(shown[1]) == default, name


def test_the_sweeps_of_a_file_and_of_a_study_are_done_alike() -> None:
    sweep, resumed = (signature(f).parameters for f in (fs.sweep, fs.resume_sweep))
    shared = resumed.keys() & sweep.keys()
    assert shared >= {"workers", "dask", "progress"}
    assert all(resumed[name].default == sweep[name].default for name in shared)


def test_compare_takes_results_and_paths_and_leaves_names_out(tmp_path: Path) -> None:
    result = fs.solve(PULLEY)
    path = result.save(tmp_path / "a.h5")
    for pair in ((result, path), (str(path), path), (result, result)):
        assert fs.compare(*pair).same
    other = fs.solve(PULLEY, {"mechanism.load": 2230.0})
    assert not fs.compare(other, path).same
    every, one, several = (
        {row.name for row in fs.compare(result, result, ignore=ignored).rows}
        for ignored in ((), "energy_*", ["energy_*", "mode"])
    )
    assert {n for n in every if n.removeprefix("quantities/").startswith("energy_")} == every - one
    assert one - several == {"mode"}


def test_single_names_and_numbers_are_enough_for_a_study() -> None:
    told: list[str] = []
    names = {"laws": "set-valued", "backends": "events"}
    study = fs.cost(pulley(), **names, tolerances=1e-3, repeats=1, progress=told.append)
    assert told
    assert study.dataset["setting"].values.tolist() == ["rtol 1e-3"]


def test_quantities_are_numbers_with_a_unit() -> None:
    quantities = fs.static(PULLEY)
    lift, radius = quantities["force_to_lift"], quantities["friction_radius_static"]
    assert (float(lift), f"{lift:.1f}") == (lift.value, "2707.7 N")
    assert np.isnan(float(fs.Quantity(None, "s")))
    for operation in (lambda: lift * 2, lambda: lift + radius, lambda: sorted([lift, radius])):
        with pytest.raises(TypeError, match=r"calculate with quantity\.value"):
            operation()
