"""`Result`: datasets, files, notebooks, copies; the same of a run and of its file."""

import copy
import inspect
import pickle
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray

import frictionsim as fs
from frictionsim import errors
from tests.support.belt_scenarios import pair
from tests.support.html_elements import Elements
from tests.support.scenarios import SCENARIOS, pulley

PULLEY, RETURN = (SCENARIOS / f"{name}.toml" for name in ("pulley", "pulley_return"))


@pytest.fixture(scope="module")
def belt() -> fs.Result:
    return fs.solve(pair(solver__backend="moreau", solver__rtol=None))


@pytest.fixture(scope="module")
def returned() -> fs.Result:
    return fs.solve(RETURN)


# --- datasets -------------------------------------------------------------------------------


def test_a_dataset_has_units_names_and_meanings(returned: fs.Result) -> None:
    data = returned.dataset
    assert dict(data.sizes) == {"time": data.sizes["time"]}
    assert data["time"].attrs == {"units": "s", "long_name": "time"}
    assert data["angular_velocity"].attrs["units"] == "rad/s"
    assert data["angular_velocity"].attrs["long_name"]
    assert data["angular_velocity"].dtype == np.float64
    assert data["mode"].dtype == np.int8
    meanings = data["mode"].attrs["flag_meanings"].split()
    assert dict(zip(data["mode"].attrs["flag_values"], meanings, strict=True))[0] == "stick"
    assert data.attrs["kind"] == "pulley"
    assert data.attrs["title"] == returned.title
    assert float(data["angle"].sel(time=3.0, method="nearest")) > 0.0


def assert_like_the_file(result: fs.Result, path: Path) -> None:
    """Compare datasets, values, types and attributes, with what xarray reads: a second way."""
    made, path = result.dataset, result.save(path)  # the run was not in a file before
    read = xarray.load_dataset(path, engine="h5netcdf")
    for dataset in (made, fs.open(path).dataset):
        xarray.testing.assert_identical(dataset, read)
        for name, variable in read.variables.items():
            assert dataset[name].dtype == variable.dtype, name
            for key, value in variable.attrs.items():
                assert type(dataset[name].attrs[key]) is type(value), (name, key)
    with xarray.open_datatree(path, engine="h5netcdf") as tree:
        if not result.events.sizes["event"]:
            assert "events" not in tree
            return
        events = tree["events"].to_dataset(inherit=False)
        assert set(events.variables) == set(result.events.variables)
        for name in set(events.variables) - {"contact"}:
            assert np.array_equal(result.events[name], events[name]), name
            assert result.events[name].dtype == events[name].dtype, name
            assert_attributes(result.events[name].attrs, events[name].attrs)
        named = np.array(events["contact"].attrs["flag_meanings"].split())
        assert named[events["contact"].values].tolist() == result.events["contact"].values.tolist()


def assert_attributes(attributes: dict[Any, Any], expected: dict[Any, Any]) -> None:
    # `coordinates` is what makes xarray take the time of the events for their coordinate.
    assert attributes.keys() == expected.keys() - {"coordinates"}
    for name, value in attributes.items():
        assert np.array_equal(value, expected[name]), name


@pytest.mark.parametrize("source", ["pulley_return", "epicyclic", "hard/decay"])
def test_datasets_are_those_that_xarray_reads(source: str, tmp_path: Path) -> None:
    assert_like_the_file(fs.solve(SCENARIOS / f"{source}.toml"), tmp_path / "a.h5")


def test_the_dataset_of_an_unfinished_run_is_that_of_its_file(tmp_path: Path) -> None:
    assert_like_the_file(fs.solve(PULLEY, max_steps=40), tmp_path / "a.h5")


@pytest.mark.parametrize("sample", [None, 4])
def test_the_dataset_of_a_sweep_is_that_of_its_file(sample: int | None, tmp_path: Path) -> None:
    """One has text for a key, and the others Sobol indices."""
    varied = {"effects.shaft_friction.mu_s": "uniform(0.2, 0.3)", "mechanism.load": "uniform(1, 2)"}
    grid = {"effects.shaft_friction.mu_s": [0.2, 0.3], "solver.backend": ["events", "rkf45"]}
    options = {"workers": 1, "sample": sample, "indices": bool(sample)}
    swept = fs.sweep(PULLEY, varied if sample else grid, {"solver.duration": 0.1}, **options)
    path = swept.save(tmp_path / "a.h5")
    read = xarray.load_dataset(path, engine="h5netcdf")
    for dataset in (swept.dataset, fs.open_sweep(path).dataset):
        xarray.testing.assert_identical(dataset, read)
        assert [v.dtype for v in dataset.values()] == [read[name].dtype for name in dataset]


def test_the_data_of_a_dataset_cannot_be_changed() -> None:
    result = fs.solve(PULLEY)
    for data in (result.dataset["angle"], result.dataset["time"], result.events["time"]):
        with pytest.raises(ValueError, match="read-only"):
            data.values[0] = 1.0
    copied = result.dataset.copy(deep=True)
    copied["angle"][0] = 1.0
    assert float(result.dataset["angle"][0]) == 0.0


# --- files ----------------------------------------------------------------------------------


def assert_same(actual: fs.Result, expected: fs.Result) -> None:
    """Compare all that a file holds."""
    for name in (
        *("status", "reason", "failure", "kind", "title", "effects", "exit_code"),
        *("quantities", "audit", "warnings"),
    ):
        assert getattr(actual, name) == getattr(expected, name), name
    for name in ("dataset", "events"):
        assert getattr(actual, name).identical(getattr(expected, name)), name
    types = [{k: v.dtype for k, v in r.record.events.items()} for r in (actual, expected)]
    assert types[0] == types[1]
    assert actual.origin.overrides == expected.origin.overrides
    assert (actual.statistics or ())[:4] == (expected.statistics or (None,))[:4]
    assert actual.scenario.to_toml() == expected.scenario.to_toml()
    assert repr(actual) == repr(expected)
    without = ("output", "scenario", "solver")
    assert {k: v for k, v in actual.to_json().items() if k not in without} == {
        k: v for k, v in expected.to_json().items() if k not in without
    }


@pytest.mark.parametrize(
    "overrides",
    [{}, {"solver.max_steps": 10}, {"output.channels": ["angle"]}, {"drive.force": 1900.0}],
    ids=["done", "failed", "some channels", "no events"],
)
def test_a_saved_result_is_read_as_it_was(overrides: dict[str, Any], tmp_path: Path) -> None:
    result = fs.solve(PULLEY, overrides)
    first = result.save(tmp_path / "a.h5")
    assert first.name == ("a.h5" if result.status == "done" else "a.partial.h5")
    reopened = fs.open(first)
    assert (reopened.path, result.path) == (first, first)
    assert_same(reopened, result)
    second = reopened.save(tmp_path / "b.h5")
    assert_same(fs.open(second), result)
    assert first.read_bytes() == second.read_bytes()


def test_a_belt_is_read_and_copied_as_it_was(belt: fs.Result, tmp_path: Path) -> None:
    assert_like_the_file(belt, tmp_path / "a.h5")
    assert_same(fs.open(tmp_path / "a.h5"), belt)
    for copied in COPIES.values():
        assert_same(copied(belt), belt)


# --- notebooks ------------------------------------------------------------------------------


NOTEBOOK_TAGS = {"div", "style", "p", "table", "caption", "thead", "tbody", "tr", "th", "td"}
HOSTILE = "<script>alert('x')</script> & \"quoted\" </td></table>"


def test_a_notebook_shows_the_summary(returned: fs.Result) -> None:
    shown = Elements(returned._repr_html_())
    assert (shown.faults, set(shown.tags)) == ([], NOTEBOOK_TAGS)
    for name, quantity in returned.quantities.items():
        assert name in shown.text
        assert quantity.unit in shown.text
    assert "breakaway_time" in shown.text
    assert "energy_balance" in shown.text


def test_html_is_escaped() -> None:
    result = fs.solve(PULLEY, {"title": HOSTILE})
    html = result._repr_html_()
    assert "<script" not in html
    shown = Elements(html)
    assert (shown.faults, set(shown.tags)) == ([], NOTEBOOK_TAGS)
    assert HOSTILE in shown.text
    study = fs.cost(result.scenario, laws="set-valued", backends="events", tolerances=1e-3)
    html = study._repr_html_()
    assert "<script" not in html
    assert HOSTILE in Elements(html).text


def test_repr_says_what_a_result_is(returned: fs.Result) -> None:
    n, m = returned.dataset.sizes["time"], returned.events.sizes["event"]
    said = f"<frictionsim.Result pulley '{returned.title}': done, {n} samples, {m} events>"
    assert repr(returned) == said
    failed = fs.solve(pulley(title=None), {"solver.max_steps": 10})
    assert repr(failed).startswith("<frictionsim.Result pulley: failed, ")


# --- copies ---------------------------------------------------------------------------------

COPIES: dict[str, Callable[[Any], Any]] = {
    "pickle": lambda value: pickle.loads(pickle.dumps(value)),
    "deepcopy": copy.deepcopy,
}


@pytest.mark.parametrize("name", COPIES)
def test_results_can_be_copied(name: str, tmp_path: Path) -> None:
    copied = COPIES[name]
    estimated = fs.solve(PULLEY, {"solver.rtol": 1e-5}, estimate_error=True)
    for result in (
        estimated,
        fs.solve(PULLEY, {"solver.max_steps": 100}),
        fs.open(estimated.save(tmp_path / "a.h5")),
    ):
        duplicate = copied(result)
        assert_same(duplicate, result)
        assert (duplicate.path, duplicate.errors) == (result.path, result.errors)
        assert duplicate.statistics == result.statistics
        duplicate.save(tmp_path / "copy.h5")
        result.save(tmp_path / "result.h5")
        assert (tmp_path / "copy.h5").read_bytes() == (tmp_path / "result.h5").read_bytes()
    part = fs.solve(PULLEY, progress=_stop)
    assert copied(part).exit_code == part.exit_code == 130
    fs.resume(copied(part)).save(tmp_path / "resumed.h5")
    fs.solve(PULLEY).save(tmp_path / "whole.h5")
    assert (tmp_path / "resumed.h5").read_bytes() == (tmp_path / "whole.h5").read_bytes()


@pytest.mark.parametrize("name", COPIES)
def test_a_copy_keeps_the_exit_code_of_an_estimate(name: str) -> None:
    """A signal stops the second run, of a result that is done."""
    last = 0.0

    def stop_second(t: float) -> None:
        nonlocal last
        if t < last:
            raise errors.Interrupted(2, t)
        last = t

    result = fs.solve(PULLEY, estimate_error=True, progress=stop_second)
    assert (result.status, result.errors, result.exit_code) == ("done", {}, 130)
    assert COPIES[name](result).exit_code == 130


def _stop(t: float) -> None:
    if t > 1.0:
        raise errors.Interrupted(2, t)


@pytest.mark.parametrize("name", COPIES)
def test_comparisons_and_studies_can_be_copied(name: str) -> None:
    copied = COPIES[name]
    comparison = fs.compare(fs.solve(PULLEY), fs.solve(PULLEY, {"mechanism.load": 2300.0}))
    assert not comparison.same
    assert copied(comparison) == comparison
    study = fs.cost(PULLEY, backends="events", laws="set-valued", tolerances=1e-3, repeats=1)
    duplicate = copied(study)
    assert duplicate.summary() == study.summary()
    assert duplicate.dataset.identical(study.dataset)
    assert (duplicate.status, duplicate.exit_code) == (study.status, study.exit_code)


ARGUMENTS: dict[type, tuple[Any, ...]] = {
    errors.ScenarioError: (["a.toml:1: title: missing", "a.toml:2: x: unknown key 'x'"],),
    errors.ArgumentError: ("max_wall", "expected a number"),
    errors.Interrupted: (15, 0.25),
}
ERRORS = [kind for kind in vars(errors).values() if inspect.isclass(kind)]


@pytest.mark.parametrize("kind", [kind for kind in ERRORS if issubclass(kind, Exception)])
def test_errors_can_be_copied(kind: type[Exception]) -> None:
    error = kind(*ARGUMENTS.get(kind, ("at t = 0.1 s: no, 'quoted'",)))
    error.add_note("of a worker")
    for copied in COPIES.values():
        duplicate = copied(error)
        assert type(duplicate) is kind
        assert str(duplicate) == str(error)
        assert duplicate.__dict__ == error.__dict__
        assert getattr(duplicate, "exit_code", None) == getattr(error, "exit_code", None)


def test_names_of_digits_stay_names(tmp_path: Path) -> None:
    data = pair(solver__duration=1e-3, output__interval=1e-3)
    names = {"driver": "1", "driven": "0"}
    for row in data["mechanism"]["pulleys"]:
        row["name"] = names[row["name"]]
    data["drive"] = {names[name]: table for name, table in data["drive"].items()}
    result = fs.solve(data, output=tmp_path / "a.h5")
    for each in (result, fs.open(tmp_path / "a.h5")):
        assert each.dataset["pulley"].values.tolist() == ["1", "0"]
    with h5py.File(tmp_path / "a.h5") as file:
        assert file["pulley"].asstr()[...].tolist() == ["1", "0"]


def test_a_run_without_events_has_the_variables_of_events() -> None:
    still, moving = (fs.solve(PULLEY, {"drive.force": force}) for force in (2000.0, 3000.0))
    assert (still.events.sizes["event"], moving.events.sizes["event"]) == (0, 1)
    assert set(still.events.variables) == set(moving.events.variables)


def test_transitions_have_the_words_of_the_file(tmp_path: Path) -> None:
    result = fs.solve(SCENARIOS / "pulley_return.toml", output=tmp_path / "a.h5")
    with h5py.File(tmp_path / "a.h5") as file:
        modes = file["events/mode_to"]
        meanings = modes.attrs["flag_meanings"].split()
        words = dict(zip(modes.attrs["flag_values"].tolist(), meanings, strict=True))
        expected = [words[number] for number in modes[...].tolist()]
        times = file["events/time"][...].tolist()
    assert [event.words[1] for event in result.transitions] == expected
    assert [event.time for event in result.transitions] == times
    assert {event.contact for event in result.transitions} == {"shaft"}
