"""Results of runs, sweeps, cost studies and fits: their verbs, datasets, files and copies."""

import inspect
import json
import pickle
import warnings
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import xarray
from matplotlib.figure import Figure

import frictionsim as fs
from frictionsim import errors
from frictionsim.results import Quantity
from tests.support.belt_scenarios import pair
from tests.support.html_elements import Elements
from tests.support.scenarios import SCENARIOS, pulley
from tests.support.sweep_files import LOAD, LOOSE, MU_S, PULLEY

RETURN = SCENARIOS / "pulley_return.toml"
SHORT = {"solver.duration": 0.5}
LOADS = {LOAD: [2000.0, 2100.0]}
WAY = "drive.direction"


def copied(value: Any) -> Any:
    """Return a value as another process receives it."""
    return pickle.loads(pickle.dumps(value))


def fitted(force: float) -> fs.Fit:
    return fs.fit("pulley", SHORT, quantities={"force_to_lift": force}, free={MU_S: (0.15, 0.4)})


@pytest.fixture(scope="module")
def study() -> fs.Study:
    return fs.cost("pulley", SHORT, backends="events", tolerances=1e-5, repeats=1)


@pytest.fixture(scope="module")
def belt() -> fs.Result:
    return fs.solve(pair(solver__backend="moreau", solver__rtol=None))


@pytest.fixture(scope="module")
def returned() -> fs.Result:
    return fs.solve(RETURN)


# --- the same verbs -------------------------------------------------------------------------


def test_each_is_checked_shown_drawn_and_saved_in_the_same_words(
    study: fs.Study, tmp_path: Path
) -> None:
    done = {
        ".h5": fs.solve("pulley", SHORT),
        ".hdf5": fs.sweep("pulley", LOADS, SHORT, workers=1),
        ".csv": study,
        ".toml": fitted(2700.0),
    }
    for suffix, result in done.items():
        assert (result.status, result.reason, result.exit_code) == ("done", "", 0)
        assert result.check() is result
        assert json.loads(json.dumps(result.to_json()))["status"] == "done"
        assert result.summary().splitlines()[0] in Elements(result._repr_html_()).text
        part = Figure(figsize=(14, 6), layout="constrained").subfigures(1, 2)[1]
        assert result.plot(figure=part) is part
        assert len(part.axes) == len(result.plot().axes) > 0
        for kind in (suffix, ".png"):
            assert result.save(tmp_path / f"a{kind}") == tmp_path / f"a{kind}"
        assert (tmp_path / "a.png").read_bytes()[1:4] == b"PNG"
        assert (tmp_path / f"a{suffix}").read_bytes()[1:4] != b"PNG"
        for name in ("a.txt", "a.partial.md"):
            with pytest.raises(fs.InputError, match=r"expected a name that ends in \..*or \.svg"):
                result.save(tmp_path / name)

    with pytest.raises(fs.ArgumentError, match="result: expected a path, got Study"):
        fs.plot(study)
    with pytest.raises(fs.ArgumentError, match="source: expected a path, got Fit"):
        fs.report(done[".toml"], "a.html")


@pytest.mark.parametrize("name", ["a.HDF5", "a", "run_0.3"])
def test_a_result_that_is_saved_as_hdf5_is_in_that_file(name: str, tmp_path: Path) -> None:
    made = [fs.solve("pulley", SHORT), fs.sweep("pulley", LOADS, SHORT, workers=1)]
    for result, read in zip(made, (fs.open, fs.open_sweep), strict=True):
        path = tmp_path / type(result).__name__ / name
        path.parent.mkdir()
        result.save(path.with_name("a.png"))
        assert result.path is None
        assert result.save(path) == result.path == path
        assert result.summary().endswith(f": {path}")
        assert read(path).to_json()["quantities"] == result.to_json()["quantities"]
        # A copy of what is in a file leaves it there.
        result.save(path.with_name("copy.h5"))
        assert result.path == path


def test_what_cannot_be_trusted_is_raised_with_the_exit_code_of_its_command() -> None:
    few = {**SHORT, "solver.max_steps": 2}
    for result, words in (
        (fs.solve("pulley", {**few, LOAD: 2000.0}), "run failed: limit of 2 steps reached"),
        (fs.sweep("pulley", LOADS, few, workers=1), "^2 of 2 runs failed"),
        (fitted(2500.0), "^out of reach: force_to_lift = 2500 N"),
    ):
        with pytest.raises(fs.SolverError, match=words) as raised:
            result.check()
        assert raised.value.exit_code == result.exit_code != 0


@pytest.mark.parametrize(
    ("statuses", "code"), [((1, 2, 3), 0), ((2, 2, 2), 1), ((2, 3, 2), 3), ((3, 3, 3), 3)]
)
def test_a_sweep_without_a_sound_run_has_another_exit_code(
    statuses: tuple[int, ...], code: int
) -> None:
    """Of a run 1 is done, 2 failed, 3 failed its audit."""
    swept = fs.sweep("pulley", {LOAD: [1.0, 2.0, 3.0]}, {"solver.duration": 0.01}, workers=1)
    table = swept.table._replace(status=np.array(statuses, dtype=np.int8))
    assert fs.Sweep(table, None).exit_code == code


def test_a_study_is_a_dataset_and_a_table(study: fs.Study) -> None:
    data = study.dataset
    assert dict(data.sizes) == {"row": len(study.to_json()["settings"])}
    assert set(data["law"].values) == {"set-valued"}
    assert data["wall_seconds"].attrs["units"] == "s"
    assert repr(study).endswith(f"'Pulley on a dry shaft': done, {data.sizes['row']} settings>")
    assert study.recommendations
    assert all(sentence in study.summary() for sentence in study.recommendations)


def test_html_is_escaped(returned: fs.Result) -> None:
    hostile = "<script>alert('x')</script> & \"quoted\" </td></table>"
    result = fs.solve(PULLEY, {"title": hostile})
    costs = fs.cost(result.scenario, laws="set-valued", backends="events", tolerances=1e-3)
    for html in (result._repr_html_(), costs._repr_html_()):
        assert "<script" not in html
        assert hostile in Elements(html).text
        assert Elements(html).faults == []
    shown = Elements(returned._repr_html_()).text
    assert all(name in shown for name in (*returned.quantities, "energy_balance", "rad/s"))


def test_repr_says_what_a_result_is(returned: fs.Result) -> None:
    n, m = returned.dataset.sizes["time"], returned.events.sizes["event"]
    said = f"<frictionsim.Result pulley '{returned.title}': done, {n} samples, {m} events>"
    assert repr(returned) == said
    failed = fs.solve(pulley(title=None), {"solver.max_steps": 10})
    assert repr(failed).startswith("<frictionsim.Result pulley: failed, ")


def test_non_finite_quantities_are_null_in_json(returned: fs.Result) -> None:
    quantities = {"a": Quantity(float("inf"), "N"), "b": Quantity(None, "s")}
    shown = fs.Result(returned.record._replace(quantities=quantities)).to_json()["quantities"]
    assert shown == {"a": {"value": None, "unit": "N"}, "b": {"value": None, "unit": "s"}}


def test_many_events_are_cut_in_the_summary_which_says_where_all_are() -> None:
    result = fs.solve(SCENARIOS / "hard" / "many_cycles.toml", {"solver.duration": 20.0})
    count = result.events.sizes["event"]
    assert f"events 19 to {count - 1} are in the JSON, and in Result.events" in result.summary()
    assert len(result.to_json()["events"]) == count > 20


# --- datasets -------------------------------------------------------------------------------


def assert_like_the_file(result: fs.Result, path: Path) -> None:
    """Compare datasets, values, types and attributes, with what xarray reads: a second way."""
    made, path = result.dataset, result.save(path)  # the run was not in a file before
    read, opened = xarray.load_dataset(path, engine="h5netcdf"), fs.open(path)
    for name in ("channels", "events", "quantities"):
        assert list(getattr(opened.record, name)) == list(getattr(result.record, name)), name
    for dataset in (made, opened.dataset):
        xarray.testing.assert_identical(dataset, read)
        for name, variable in read.variables.items():
            assert dataset[name].dtype == variable.dtype, name
    # The arrays of a checkpoint have dimensions, too, so that no reader needs to invent some.
    with (
        warnings.catch_warnings(action="error"),
        xarray.open_datatree(path, engine="h5netcdf") as tree,
    ):
        assert ("checkpoint" in tree.children) == (result.status == "failed")
        numbers = [float(tree["quantities"][name]) for name in result.quantities]
        wanted = [float(quantity) for quantity in result.quantities.values()]
        assert np.array_equal(numbers, wanted, equal_nan=True)
        assert tree["audit"]["check"].values.tolist() == list(result.audit)
        if not result.events.sizes["event"]:
            assert "events" not in tree
            return
        events = tree["events"].to_dataset(inherit=False)
        assert set(events.variables) == set(result.events.variables)
        for name in set(events.variables) - {"contact"}:
            ours = result.events[name]
            assert np.array_equal(ours, events[name]), name
            assert ours.dtype == events[name].dtype, name
            # `coordinates` is what makes xarray take the time of the events for their coordinate.
            for key in events[name].attrs.keys() - {"coordinates"}:
                assert np.array_equal(ours.attrs[key], events[name].attrs[key]), name
        named = np.array(events["contact"].attrs["flag_meanings"].split())
        assert named[events["contact"].values].tolist() == result.events["contact"].values.tolist()


@pytest.mark.parametrize(
    ("source", "options"),
    [("pulley_return", {}), ("epicyclic", {}), ("hard/decay", {}), ("pulley", {"max_steps": 40})],
)
def test_datasets_are_those_that_xarray_reads(source: str, options: Any, tmp_path: Path) -> None:
    assert_like_the_file(fs.solve(SCENARIOS / f"{source}.toml", **options), tmp_path / "a.h5")


AT_EVENTS = {"output.at_events": [True, False]}  # true and false are 1 and 0 there


@pytest.mark.parametrize(
    ("name", "vary", "options"),
    [
        ("pulley", {"solver.backend": ["events", "rkf45"], **AT_EVENTS}, {}),
        ("pulley", {MU_S: [0.2, 0.3], **AT_EVENTS}, {"zip": True}),
        ("pulley", {MU_S: "uniform(0.2, 0.3)"}, {"sample": 4, "indices": True}),
        ("belt_string", {"mechanism.belt.bodies": [60, 61]}, {}),
    ],
)
def test_the_dataset_of_a_sweep_is_that_of_its_file(
    name: str, vary: dict[str, Any], options: dict[str, Any], tmp_path: Path
) -> None:
    short = {"solver.duration": 1e-3 if name == "belt_string" else 0.1}
    swept = fs.sweep(SCENARIOS / f"{name}.toml", vary, short, workers=1, **options)
    path = swept.save(tmp_path / "a.h5")
    read = xarray.load_dataset(path, engine="h5netcdf")
    for dataset in (swept.dataset, fs.open_sweep(path).dataset):
        xarray.testing.assert_identical(dataset, read)
        for key, values in dataset.variables.items():
            if values.dtype.kind != "U":  # a text has its length in memory
                assert values.dtype == read[key].dtype, key


def test_a_sweep_is_read_as_its_dataset_and_a_part_of_it_is_drawn(tmp_path: Path) -> None:
    path = tmp_path / "s.h5"
    vary = {MU_S: [0.1, 0.2, 0.3], WAY: ["vertical", "horizontal"]}
    swept = fs.sweep(PULLEY, vary, LOOSE, output=path, workers=1)
    dataset, opened = swept.dataset, fs.open_sweep(path)
    assert (list(swept), len(swept), swept.attrs) == (list(dataset), len(dataset), dataset.attrs)
    assert "final_angle" in swept
    np.testing.assert_array_equal(swept.final_angle, dataset["final_angle"])
    assert opened.identical(swept)
    assert opened.equals(dataset)
    assert not opened.equals(swept.isel({MU_S: slice(2)}))
    assert pickle.loads(pickle.dumps(opened)).identical(swept)
    angles = dataset["final_angle"].values
    for source in (path, dataset):
        drawn = [line.get_ydata() for line in fs.plot(source, "final_angle").axes[0].lines]
        np.testing.assert_array_equal(drawn, angles.T)
    chosen = fs.plot(dataset, "final_angle, force_to_lift", at={WAY: "horizontal"})
    part = fs.plot(dataset.sel({WAY: "horizontal"}), "final_angle")
    for figure, count in ((chosen, 2), (part, 1)):
        assert len(figure.axes) == count
        np.testing.assert_array_equal(figure.axes[0].lines[0].get_ydata(), angles[:, 1])


def test_the_data_of_a_dataset_cannot_be_changed(returned: fs.Result) -> None:
    for data in (returned.dataset["angle"], returned.dataset["time"], returned.events["time"]):
        with pytest.raises(ValueError, match="read-only"):
            data.values[0] = 1.0
    returned.dataset.copy(deep=True)["angle"][0] = 1.0


def test_a_run_without_events_has_the_variables_of_events() -> None:
    still, moving = (fs.solve(PULLEY, {"drive.force": force}) for force in (2000.0, 3000.0))
    assert (still.events.sizes["event"], moving.events.sizes["event"]) == (0, 1)
    assert set(still.events.variables) == set(moving.events.variables)
    short = {"solver.duration": 1e-3, "output.channels": ["energy_input"]}
    belt = fs.solve(SCENARIOS / "belt_string.toml", short)
    assert {*belt.events.variables} == {"event", "time", "contact", "mode_from", "mode_to"}


def test_transitions_are_the_events_of_the_file_in_words(tmp_path: Path) -> None:
    result = fs.solve(RETURN, output=tmp_path / "a.h5")
    with h5py.File(tmp_path / "a.h5") as file:
        names = ("contact", "mode_from", "mode_to", "time", "angle")
        contacts, before, after, *numbers = [file["events"][name][...].tolist() for name in names]
        modes = dict(file["events/mode_to"].attrs)
        named = file["events/contact"].attrs["flag_meanings"].split()
    words = dict(zip(modes["flag_values"].tolist(), modes["flag_meanings"].split(), strict=True))
    expected = [
        (named[contact], (words[one], words[other]), *row)
        for contact, one, other, *row in zip(contacts, before, after, *numbers, strict=True)
    ]
    assert [(e.contact, e.words, e.time, e.position) for e in result.transitions] == expected
    assert len(expected) == 2


# --- files and copies -----------------------------------------------------------------------


def assert_same(actual: fs.Result, expected: fs.Result) -> None:
    """Compare all that a file holds."""
    for name in (
        *("status", "reason", "failure", "kind", "title", "effects", "exit_code"),
        *("quantities", "audit", "warnings"),
    ):
        assert getattr(actual, name) == getattr(expected, name), name
    for name in ("dataset", "events"):
        assert getattr(actual, name).identical(getattr(expected, name)), name
    assert actual.origin.overrides == expected.origin.overrides
    assert (actual.statistics or ())[:4] == (expected.statistics or (None,))[:4]
    assert actual.scenario.to_toml() == expected.scenario.to_toml()
    assert repr(actual) == repr(expected)


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
    assert reopened.save(tmp_path / "b.h5").read_bytes() == first.read_bytes()


def test_a_belt_is_read_and_copied_as_it_was(belt: fs.Result, tmp_path: Path) -> None:
    assert_like_the_file(belt, tmp_path / "a.h5")
    assert_same(fs.open(tmp_path / "a.h5"), belt)
    assert_same(copied(belt), belt)


def test_names_of_digits_stay_names(tmp_path: Path) -> None:
    data = pair(solver__duration=1e-3, output__interval=1e-3)
    names = {"driver": "1", "driven": "0"}
    for row in data["mechanism"]["pulleys"]:
        row["name"] = names[row["name"]]
    data["drive"] = {names[name]: table for name, table in data["drive"].items()}
    for each in (fs.solve(data, output=tmp_path / "a.h5"), fs.open(tmp_path / "a.h5")):
        assert each.dataset["pulley"].values.tolist() == ["1", "0"]


def test_results_can_be_copied(tmp_path: Path) -> None:
    def stop(t: float) -> None:
        if t > 1.0:
            raise errors.Interrupted(2, t)

    estimated = fs.solve(PULLEY, {"solver.rtol": 1e-5}, estimate_error=True)
    for result in (estimated, fs.solve(PULLEY, {"solver.max_steps": 100})):
        duplicate = copied(result)
        assert_same(duplicate, result)
        assert (duplicate.path, duplicate.errors) == (result.path, result.errors)
        assert duplicate.statistics == result.statistics
        pair_of = (duplicate.save(tmp_path / "copy.h5"), result.save(tmp_path / "result.h5"))
        assert pair_of[0].read_bytes() == pair_of[1].read_bytes()
    part = fs.solve(PULLEY, progress=stop)
    assert copied(part).exit_code == part.exit_code == 130
    resumed = fs.resume(copied(part)).save(tmp_path / "resumed.h5")
    assert resumed.read_bytes() == fs.solve(PULLEY).save(tmp_path / "whole.h5").read_bytes()


def test_a_copy_keeps_the_exit_code_of_an_estimate() -> None:
    """A signal stops the second run, of a result that is done."""
    last = 0.0

    def stop_second(t: float) -> None:
        nonlocal last
        if t < last:
            raise errors.Interrupted(2, t)
        last = t

    result = fs.solve(PULLEY, estimate_error=True, progress=stop_second)
    assert (result.status, result.errors, result.exit_code) == ("done", {}, 130)
    assert copied(result).exit_code == 130


def test_comparisons_and_studies_can_be_copied(returned: fs.Result, study: fs.Study) -> None:
    comparison = fs.compare(returned, fs.solve(RETURN, {LOAD: 2300.0}))
    assert not comparison.same
    assert copied(comparison) == comparison
    duplicate = copied(study)
    assert duplicate.summary() == study.summary()
    assert duplicate.dataset.identical(study.dataset)
    assert (duplicate.status, duplicate.exit_code) == (study.status, study.exit_code)


ARGUMENTS: dict[type, tuple[Any, ...]] = {
    errors.ScenarioError: (["a.toml:1: title: missing", "a.toml:2: x: unknown key 'x'"],),
    errors.ArgumentError: ("max_wall", "expected a number"),
    errors.Interrupted: (15, 0.25),
}


def test_errors_can_be_copied() -> None:
    kinds = [k for k in vars(errors).values() if inspect.isclass(k) and issubclass(k, Exception)]
    for kind in kinds:
        error = kind(*ARGUMENTS.get(kind, ("at t = 0.1 s: no, 'quoted'",)))
        error.add_note("of a worker")
        duplicate = copied(error)
        assert (type(duplicate), str(duplicate)) == (kind, str(error))
        assert duplicate.__dict__ == error.__dict__
        assert getattr(duplicate, "exit_code", None) == getattr(error, "exit_code", None)
