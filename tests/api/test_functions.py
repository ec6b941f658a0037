"""static, cost, compare, plot, new, schema, kinds and scenarios from Python."""

import re
from collections.abc import Callable
from inspect import isfunction, signature
from math import isfinite
from pathlib import Path

import numpy as np
import pytest

import frictionsim as fs
from tests.support.scenarios import SCENARIOS, pulley

PULLEY = SCENARIOS / "pulley.toml"
MU_S = "effects.shaft_friction.mu_s"


@pytest.fixture(scope="module")
def result() -> fs.Result:
    return fs.solve(PULLEY)


# --- options --------------------------------------------------------------------------------

# What only one of them has. An option has another name where a shell needs it: --set is overrides,
# --from and --to are window; a notebook needs no --json, a shell no axes to draw in.
EVERYWHERE = {"help", "json", "quiet", "verbose", "set", "backend"}
OF_COMMANDS: dict[str, set[str]] = {
    "solve": set(),
    "resume": {"dask", "workers"},  # of a sweep, which is resume_sweep
    "fit": {"channel", "quantity", "unit", "plot", "output", "no_clobber"},
    "cost": {"csv", "plot", "no_clobber"},
    "sweep": {"csv"},
    "compare": set(),
    "plot": {"from", "to", "no_title", "animate", "fps", "speed", "output", "no_clobber"}
    | {"channel", "unit"},
}
OF_FUNCTIONS: dict[str, set[str]] = {
    "solve": {"check"},
    "resume": {"check"},
    "fit": {"channels", "quantities", "units"},
    "cost": set(),
    "sweep": set(),
    "compare": {"golden"},
    "plot": {"window", "title", "figure", "measured", "units"},
}


@pytest.mark.parametrize("command", OF_COMMANDS)
def test_a_function_and_its_command_have_the_same_options(
    command: str, told: Callable[..., tuple[str, str]]
) -> None:
    help_text = told(command, "--help")[0].partition("\nOptions:\n")[2]
    entries = re.split(r"\n  (?=-)", help_text)
    options = {
        match[1].replace("-", "_"): " ".join(entry.split())
        for entry in entries
        if (match := re.match(r" *(?:-\w, )?--([\w-]+)", entry))
    }
    parameters = dict(signature(getattr(fs, command)).parameters)
    needed = {"scenario", "result", "overrides", "progress"} | OF_FUNCTIONS[command]
    assert options.keys() - EVERYWHERE - OF_COMMANDS[command] == parameters.keys() - needed
    for name in options.keys() & parameters.keys():
        shown, default = re.search(r"\[([\w.-]+)\]$", options[name]), parameters[name].default
        if shown and isinstance(default, int | float | str):
            assert type(default)(shown[1]) == default, name


def test_the_sweeps_of_a_file_and_of_a_study_are_done_alike() -> None:
    sweep, resumed = (signature(f).parameters for f in (fs.sweep, fs.resume_sweep))
    shared = resumed.keys() & sweep.keys()
    assert shared >= {"workers", "dask", "progress"}
    assert all(resumed[name].default == sweep[name].default for name in shared)


# --- static ---------------------------------------------------------------------------------


def test_static_gives_the_forces_of_impending_motion() -> None:
    quantities = fs.static(PULLEY)
    assert quantities["force_to_lift"].unit == "N"
    assert quantities["force_to_lift"].value == pytest.approx(2707.70308)
    assert fs.static(pulley()) == fs.static(fs.load(PULLEY)) == quantities
    less = fs.static(PULLEY, {MU_S: 0.1, "effects.shaft_friction.mu_k": 0.1})["force_to_lift"].value
    assert less == pytest.approx(2456.993085547742)  # of the recipe in a shell
    assert fs.static(fs.load(PULLEY), [f"{MU_S}=0.2"]) == quantities


@pytest.mark.parametrize("kind", ["marble_machine", "epicyclic", "belt_drive"])
def test_static_of_each_kind(kind: str) -> None:
    quantities = fs.static(SCENARIOS / f"{kind}.toml")
    assert quantities
    assert all(isfinite(quantity.value) for quantity in quantities.values()), quantities


# --- compare --------------------------------------------------------------------------------


def test_compare_takes_results_and_paths(result: fs.Result, tmp_path: Path) -> None:
    path = result.save(tmp_path / "a.h5")
    for pair in ((result, path), (path, result), (str(path), path), (result, result)):
        comparison = fs.compare(*pair)
        assert comparison.same
        assert all(row.ok for row in comparison.rows)
    other = fs.solve(PULLEY, {"mechanism.load": 2230.0})
    assert not fs.compare(other, path).same
    assert fs.compare(other, path, rtol=1e9).rows != fs.compare(other, path).rows


def test_compare_leaves_out_one_name_or_several(result: fs.Result) -> None:
    every = {row.name for row in fs.compare(result, result).rows}
    one = {row.name for row in fs.compare(result, result, ignore="energy_*").rows}
    several = {row.name for row in fs.compare(result, result, ignore=["energy_*", "mode"]).rows}
    energies = {name for name in every if name.removeprefix("quantities/").startswith("energy_")}
    assert every - one == energies != set()
    assert one - several == {"mode"}


# --- plot -----------------------------------------------------------------------------------


# --- cost -----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def study() -> fs.Study:
    return fs.cost(
        PULLEY,
        laws=["set-valued", "regularised"],
        backends=["events", "rkf45"],
        tolerances=[1e-4, 1e-6],
        repeats=1,
    )


def test_a_study_is_a_dataset_and_a_table(study: fs.Study) -> None:
    assert (study.status, study.reason, study.exit_code) == ("done", "", 0)
    data = study.dataset
    assert dict(data.sizes) == {"row": len(study.to_json()["settings"])}
    assert set(data["law"].values) == {"set-valued", "regularised"}
    assert set(data["backend"].values) == {"events", "rkf45"}
    assert data["wall_seconds"].attrs["units"] == "s"
    assert data["error"].dtype == np.float64
    events = data.where(data["backend"] == "events", drop=True)
    assert events["error"].values[0] > events["error"].values[-1] > 0.0
    assert repr(study) == (
        f"<frictionsim.Study pulley 'Pulley on a dry shaft': done, {data.sizes['row']} settings>"
    )
    summary = study.summary()
    assert "error against run time (done)" in summary
    assert study.recommendations
    assert all(sentence in summary for sentence in study.recommendations)
    assert study.to_json()["status"] == "done"
    assert "<table" in study._repr_html_()


def test_single_names_and_numbers_are_enough() -> None:
    told: list[str] = []
    names = {"laws": "set-valued", "backends": "events"}
    study = fs.cost(pulley(), **names, tolerances=1e-3, repeats=1, progress=told.append)
    assert told
    assert study.dataset["setting"].values.tolist() == ["rtol 1e-3"]


# --- new, schema, kinds, scenarios ----------------------------------------------------------


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


@pytest.mark.parametrize("name", [n for n in fs.__all__ if isfunction(getattr(fs, n))])
def test_no_function_ignores_an_unknown_keyword(name: str) -> None:
    function = getattr(fs, name)
    named = signature(function).parameters.values()
    needed = [p.name for p in named if p.default is p.empty and p.kind is not p.VAR_KEYWORD]
    with pytest.raises((TypeError, fs.InputError), match="'wrokers'"):
        function(**dict.fromkeys(needed), wrokers=1)
