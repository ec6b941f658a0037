"""static, cost, compare, plot, new, schema, kinds and scenarios from Python."""

import csv
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import jsonschema
import numpy as np
import pytest
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

import frictionsim as fs
from frictionsim.errors import ArgumentError
from frictionsim.scenario.kinds import KINDS
from tests.support.scenarios import SCENARIOS, pulley

pytestmark = pytest.mark.quick

PULLEY = SCENARIOS / "pulley.toml"
MU_S = "effects.shaft_friction.mu_s"


@pytest.fixture(scope="module")
def result() -> fs.Result:
    return fs.solve(PULLEY)


# --- static ---------------------------------------------------------------------------------


def test_static_gives_the_forces_of_impending_motion(cli: Callable[..., Any]) -> None:
    found = fs.static(PULLEY)
    assert found["force_to_lift"].unit == "N"
    assert found["force_to_lift"].value == pytest.approx(2707.70308)
    assert fs.static(pulley()) == fs.static(fs.load(PULLEY)) == found
    less = fs.static(PULLEY, {MU_S: 0.1, "effects.shaft_friction.mu_k": 0.1})["force_to_lift"].value
    assert less == pytest.approx(2456.993085547742)  # of the recipe in a shell
    assert fs.static(fs.load(PULLEY), [f"{MU_S}=0.2"]) == found


@pytest.mark.parametrize("kind", ["marble_machine", "epicyclic", "belt_drive"])
def test_static_of_each_kind(kind: str) -> None:
    found = fs.static(SCENARIOS / f"{kind}.toml")
    assert found
    assert all(isinstance(quantity, fs.Quantity) for quantity in found.values())


# --- compare --------------------------------------------------------------------------------


def test_compare_takes_results_and_paths(result: fs.Result, tmp_path: Path) -> None:
    path = result.save(tmp_path / "a.h5")
    for pair in ((result, path), (path, result), (str(path), path), (result, result)):
        comparison = fs.compare(*pair)
        assert comparison.same
        assert all(row.ok for row in comparison.rows)
    other = fs.solve(PULLEY, {"mechanism.load": 2230.0})
    comparison = fs.compare(other, path)
    assert not comparison.same
    worst = comparison.rows[0]
    assert not worst.ok
    assert worst.difference is not None
    assert worst.allowed is not None
    assert worst.difference > worst.allowed
    assert fs.compare(other, path, rtol=1e9).rows != comparison.rows


def test_compare_leaves_out_one_name_or_several(result: fs.Result) -> None:
    every = {row.name for row in fs.compare(result, result).rows}
    one = {row.name for row in fs.compare(result, result, ignore="energy_*").rows}
    several = {row.name for row in fs.compare(result, result, ignore=["energy_*", "mode"]).rows}
    assert every - one == {name for name in every if name.startswith("energy_")} != set()
    assert one - several == {"mode"}


def test_compare_refuses_what_cannot_be_compared(result: fs.Result) -> None:
    calls: dict[str, dict[str, Any]] = {
        "rtol: expected a number of at least 0, got -1": {"rtol": -1.0},
        "atol: expected a number of at least 0, got nan": {"atol": float("nan")},
        "time_atol: expected a number of at least 0, got '1'": {"time_atol": "1"},
        "ignore: unknown channel 'angel' (did you mean 'angle'?)": {"ignore": "angel"},
        "ignore: expected names, got 3": {"ignore": [3]},
        "ignore: nothing is left to compare": {"ignore": "*"},
    }
    for expected, given in calls.items():
        with pytest.raises(ArgumentError) as caught:
            fs.compare(result, result, **given)
        assert str(caught.value) == expected
    gear = fs.solve(SCENARIOS / "epicyclic.toml", {"output.interval": 0.1})
    with pytest.raises(fs.InputError) as wrong:
        fs.compare(gear, result)
    assert str(wrong.value) == (
        "cannot compare: the result is of kind 'epicyclic', the golden result of 'pulley'"
    )


# --- plot -----------------------------------------------------------------------------------


def test_plot_returns_a_figure(result: fs.Result, tmp_path: Path) -> None:
    path = result.save(tmp_path / "a.h5")
    before = plt.get_fignums()
    for source in (result, path, str(path)):
        figure = fs.plot(source)
        assert isinstance(figure, Figure)
        assert len(figure.axes) >= 3
    assert plt.get_fignums() == before
    figure.savefig(tmp_path / "a.png")
    assert (tmp_path / "a.png").stat().st_size > 10_000


def test_plot_takes_the_place_of_axes(result: fs.Result) -> None:
    figure, axes = plt.subplots(2, 2, figsize=(16, 12), layout="constrained")
    try:
        for ax in axes.flat:
            assert fs.plot(result, view="response", ax=ax) is figure
        assert len(figure.subfigs) == 4
        assert figure.axes
        assert not set(axes.flat) & set(figure.axes)
    finally:
        plt.close(figure)


def test_plot_refuses_a_view_that_there_is_not(result: fs.Result) -> None:
    with pytest.raises(fs.InputError) as caught:
        fs.plot(result, view="torque")
    assert str(caught.value) == "unknown view 'torque' of kind 'pulley'; known: response, traction"
    with pytest.raises(fs.InputError, match="ax: expected matplotlib Axes, got int"):
        fs.plot(result, ax=3)  # type: ignore[arg-type]
    with pytest.raises(fs.InputError, match="the view 'response' shows no single body"):
        fs.plot(result, body=3)


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
    assert dict(data.sizes) == {"row": len(study.data.rows)}
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
    assert all(sentence in summary for sentence in study.recommendations)
    assert study.to_json()["status"] == "done"
    assert "<table>" in study._repr_html_()


def test_a_study_is_saved_and_drawn(study: fs.Study, tmp_path: Path) -> None:
    assert study.save(tmp_path / "a.csv") == tmp_path / "a.csv"
    with (tmp_path / "a.csv").open() as file:
        rows = list(csv.reader(file))
    assert len(rows) == 1 + study.dataset.sizes["row"]
    study.save(str(tmp_path / "a.h5"))
    with h5py.File(tmp_path / "a.h5") as file:
        assert np.array_equal(file["cost/error"], study.dataset["error"], equal_nan=True)
    with pytest.raises(fs.InputError) as caught:
        study.save(tmp_path / "a.txt")
    assert str(caught.value) == (
        f"{tmp_path / 'a.txt'}: expected a name that ends in .h5, .hdf5, .nc or .csv"
    )
    with pytest.raises(fs.OutputError, match="there is no folder"):
        study.save(tmp_path / "none" / "a.h5")
    figure, axes = plt.subplots(1, 2, figsize=(16, 6), layout="constrained")
    try:
        assert study.plot(ax=axes[1]) is figure
    finally:
        plt.close(figure)
    study.plot().savefig(tmp_path / "a.png")


def test_single_names_and_numbers_are_enough() -> None:
    told: list[str] = []
    study = fs.cost(
        pulley(),
        laws="set-valued",
        backends="events",
        tolerances=1e-3,
        repeats=1,
        progress=told.append,
    )
    assert told
    assert study.dataset["setting"].values.tolist() == ["rtol 1e-3"]


COST: dict[str, tuple[dict[str, Any], str]] = {
    "law": (
        {"laws": ["set-value"]},
        "laws: unknown friction law 'set-value' (did you mean 'set-valued'?)",
    ),
    "backend": (
        {"backends": "moreau"},
        "backends: unknown backend 'moreau'; known: events, rkf45, rk45, dop853, radau, bdf, lsoda",
    ),
    "names": ({"backends": [3]}, "backends: expected names, got 3"),
    "tolerance": (
        {"tolerances": [1e-3, 2.0]},
        "tolerances: expected numbers from 1e-12 to 0.1, got '0.001,2.0'",
    ),
    "no tolerance": ({"tolerances": []}, "tolerances: expected numbers from 1e-12 to 0.1, got ''"),
    "text": (
        {"tolerances": ["fine"]},
        "tolerances: expected numbers from 1e-12 to 0.1, got 'fine'",
    ),
    "repeats": ({"repeats": 0}, "repeats: expected a number of at least 1, got 0"),
    "half": ({"repeats": 1.5}, "repeats: expected a number of at least 1, got 1.5"),
    "time": ({"max_wall": 0.0}, "max_wall: expected a number above 0 s, got 0"),
    "progress": (
        {"progress": True},
        "progress: expected a function of the name of a setting, got True",
    ),
    "no limit": ({"max_wall": float("inf")}, "max_wall: expected a number above 0 s, got inf"),
}


@pytest.mark.parametrize("name", COST)
def test_wrong_arguments_of_a_study_are_refused(name: str) -> None:
    given, expected = COST[name]
    with pytest.raises(ArgumentError) as caught:
        fs.cost(PULLEY, **given)
    assert str(caught.value) == expected


# --- new, schema, kinds, scenarios ----------------------------------------------------------


def test_each_kind_has_a_scenario_to_start_from() -> None:
    assert fs.kinds() == tuple(KINDS)
    for kind in fs.kinds():
        scenario = fs.loads(fs.new(kind))
        assert scenario.kind == kind
        schema = fs.schema(kind)
        jsonschema.validate(tomllib.loads(fs.new(kind)), schema)


def test_shipped_scenarios_have_names() -> None:
    found = fs.scenarios()
    assert found["pulley"] == PULLEY
    assert fs.load(found["hard/jump"]).kind == "pulley"
    text = fs.new("belt_verification")
    assert "#:schema" not in text
    assert fs.loads(text) == fs.load(found["belt_verification"])


def test_the_schema_of_all_kinds_takes_each() -> None:
    schema = fs.schema()
    for name in ("pulley", "epicyclic"):
        jsonschema.validate(tomllib.loads((SCENARIOS / f"{name}.toml").read_text()), schema)


@pytest.mark.parametrize(("kind", "near"), [("puley", "pulley"), ("epicyclc", "epicyclic")])
def test_unknown_kinds_are_refused_with_a_near_one(kind: str, near: str) -> None:
    for call, what in ((fs.new, "kind or shipped scenario"), (fs.schema, "kind")):
        with pytest.raises(fs.InputError) as caught:
            call(kind)
        assert str(caught.value) == f"unknown {what} '{kind}' (did you mean '{near}'?)"


def test_kinds_of_another_type_are_refused() -> None:
    wrong: Any = 3
    with pytest.raises(fs.InputError, match="unknown kind or shipped scenario '3'; known: "):
        fs.new(wrong)
    with pytest.raises(fs.InputError, match="unknown kind '3'; known: "):
        fs.schema(wrong)
