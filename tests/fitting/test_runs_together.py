"""Runs of a fit that are made together have the bits of runs alone; searches side by side end."""

import threading
from itertools import product
from time import monotonic, sleep
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import frictionsim as fs
from frictionsim.errors import Interrupted
from frictionsim.fitting.data import FitOptions, measured
from frictionsim.fitting.problem import FitProblem, free_keys
from frictionsim.fitting.search import MAX_THREADS, Search, minima
from tests.fitting.measurements import LOAD, MU_K, MU_S, pulley, series
from tests.support.cases import one_in, slow
from tests.support.drawn_scenarios import pulleys
from tests.support.examples import examples
from tests.support.many_runs import together

INERTIA = "mechanism.inertia"
FREE = {MU_S: (0.05, 0.4), MU_K: (0.02, 0.3)}
CHANNELS = (
    *("angle", "angular_velocity", "angular_acceleration", "drive_force", "shaft_reaction"),
    *("energy_input", "energy_kinetic", "energy_potential"),
)
OF_FRICTION = ("friction_torque", "energy_friction")


def noisy_pulley() -> fs.Scenario:
    """Return the scenario of a fit to noisy data; bits are the same at any tolerance."""
    return pulley(rtol=1e-6)


def noisy_fit() -> dict[str, Any]:
    """Return the options of a fit to noisy data."""
    data = series(noisy_pulley().replace({MU_S: 0.231, MU_K: 0.123}), angular_velocity=0.1)
    return {"data": data, "channels": "angular_velocity", "free": FREE, "bootstrap": 3}


@pytest.fixture(scope="module")
def alone() -> dict[str, Any]:
    """The fit to noisy data, of runs alone."""
    return fs.fit(noisy_pulley(), **noisy_fit()).to_json()


def problem_of(
    scenario: fs.Scenario, free: dict[str, tuple[float, float]], **options: Any
) -> FitProblem:
    """Return the problem of a fit."""
    chosen = FitOptions.of(**options)
    keys = free_keys(free, scenario)
    return FitProblem(scenario, keys, measured(chosen, scenario), lambda runs: None)


def alone_and_together(monkeypatch: pytest.MonkeyPatch, problem: FitProblem, places: Any) -> int:
    """Compare models together with those alone; return the number of those made together."""
    alone = [problem._evaluate(problem.values(x)) for x in places]
    evaluated: list[dict[str, float]] = []
    evaluate = FitProblem._evaluate

    def counted(self: FitProblem, values: dict[str, float]) -> Any:
        evaluated.append(values)
        return evaluate(self, values)

    together(monkeypatch)
    monkeypatch.setattr(FitProblem, "_evaluate", counted)
    problem.expect(len(places))
    for one, other in zip(alone, problem.models(places), strict=True):
        assert (one.reason, one.doubt) == (other.reason, other.doubt)
        assert dict(one.warnings) == dict(other.warnings)
        assert (one.values is None) == (other.values is None)
        if one.values is not None and other.values is not None:
            assert one.values.tobytes() == other.values.tobytes()
    return len(places) - len(evaluated)


@examples(8)
@given(data=st.data())
def test_channels_have_the_bits_of_runs_alone(data: st.DataObject) -> None:
    scenario = fs.load({**data.draw(pulleys()), "solver": {"duration": 2.0, "rtol": 1e-7}})
    times = sorted(data.draw(st.sets(st.floats(1e-3, 2.0) | st.just(0.0), min_size=1, max_size=6)))
    names = [*CHANNELS, *(OF_FRICTION if scenario.effects.shaft_friction else ())]
    columns = {"time": np.array(times), **dict.fromkeys(names, np.zeros(len(times)))}
    inertia = scenario.mechanism.inertia
    free = {INERTIA: (0.5 * inertia, 2.0 * inertia)}
    problem = problem_of(scenario, free, data=columns, channels=names)
    places = data.draw(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=4, unique=True))
    with pytest.MonkeyPatch.context() as monkeypatch:
        alone_and_together(monkeypatch, problem, np.array(places)[:, None])


def test_those_that_fail_or_have_an_event_at_a_sample_are_made_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scenario = pulley()
    (event,) = fs.solve(scenario, {MU_S: 0.25}).events["time"].to_numpy()
    names = ("angular_acceleration", "energy_input")
    data = {"time": [0.1, event, 1.0], **dict.fromkeys(names, np.zeros(3))}
    problem = problem_of(scenario, {MU_S: (0.05, 0.45)}, data=data, channels=names)
    values = (0.25, 0.06, 0.2, 0.3)  # the second is less than the kinetic coefficient
    places = [np.array([key.scaled(value)]) for key in problem.keys for value in values]
    assert alone_and_together(monkeypatch, problem, places) == 2
    first, second, *_ = problem.models(places)
    assert "mu_k" in second.reason
    after = fs.solve(scenario, {MU_S: 0.25}).events["angular_acceleration_after"].to_numpy()
    assert first.values is not None
    assert first.values[1] == pytest.approx(after[0], rel=1e-9)


def test_quantities_of_a_table_have_the_bits_of_runs_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = problem_of(
        pulley(),
        {MU_S: (0.13, 0.4), MU_K: (0.02, 0.12)},
        data={"W": [1900.0, 2000.0, 2100.0], "t": [500.0, 600.0, 700.0], "a": [1.0, 2.0, 3.0]},
        quantities={"breakaway_time": "t", "final_angle": "a"},
        units={"breakaway_time": "ms", "final_angle": "deg"},
        over={LOAD: "W"},
    )
    places = list(np.random.default_rng(2).random((20, 2)))
    assert alone_and_together(monkeypatch, problem, places) == 20 - sum(
        problem.model(x).values is None for x in places
    )


def test_a_fit_of_runs_together_is_that_of_runs_alone(
    alone: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    options = noisy_fit()
    together(monkeypatch)
    assert fs.fit(noisy_pulley(), **options).to_json() == alone


@pytest.mark.parametrize("searches", [3, slow(MAX_THREADS + 3)])
def test_searches_side_by_side_end_where_they_do_alone(
    monkeypatch: pytest.MonkeyPatch, searches: int
) -> None:
    data = series(pulley(), angular_velocity=0.1)
    problem = problem_of(pulley(), {MU_S: (0.13, 0.4)}, data=data, channels="angular_velocity")
    starts = list(np.linspace(0.1, 0.9, searches)[:, None])
    task = Search(problem, np.ones(problem.data.size))
    together(monkeypatch)
    problem.expect(1)
    ends = minima(problem, ((task, start) for start in starts), searches)
    for number in (0, 1, -1):
        alone = task.minimum(starts[number])
        assert (ends[number].x.tobytes(), ends[number].cost) == (alone.x.tobytes(), alone.cost)


@pytest.mark.parametrize(
    ("runs", "error"),
    one_in(5, product([1, 40, 60, 90], [Interrupted(2, 0.0), KeyboardInterrupt(), ValueError()])),
)
def test_what_ends_the_runs_ends_all_searches(
    monkeypatch: pytest.MonkeyPatch, runs: int, error: BaseException
) -> None:
    def interrupt(done: int) -> None:
        if done >= runs:
            raise error

    together(monkeypatch)
    threads, options = threading.active_count(), noisy_fit()
    with pytest.raises(type(error)):
        fs.fit(noisy_pulley(), **options, progress=interrupt)
    assert threading.active_count() == threads


def test_an_interruption_while_threads_start_ends_them(monkeypatch: pytest.MonkeyPatch) -> None:
    together(monkeypatch)
    threads, options, start = threading.active_count(), noisy_fit(), threading.Thread.start

    def interrupted(thread: threading.Thread) -> None:
        start(thread)
        if threading.active_count() == threads + 2:
            raise KeyboardInterrupt

    monkeypatch.setattr(threading.Thread, "start", interrupted)
    with pytest.raises(KeyboardInterrupt):
        fs.fit(noisy_pulley(), **options)
    deadline = monotonic() + 60.0
    while threading.active_count() > threads:
        assert monotonic() < deadline
        sleep(0.01)


def test_a_search_that_fails_ends_the_others(monkeypatch: pytest.MonkeyPatch) -> None:
    def fails(self: Search, x: Any) -> Any:
        raise RuntimeError("no derivatives")

    together(monkeypatch)
    monkeypatch.setattr(Search, "jacobian", fails)
    threads, options = threading.active_count(), noisy_fit()
    with pytest.raises(RuntimeError, match="no derivatives"):
        fs.fit(noisy_pulley(), **options)
    assert threading.active_count() == threads


@pytest.mark.parametrize("threads", [0, slow(1), slow(3)])
def test_where_the_system_has_few_threads_a_fit_has_the_same_result(
    alone: dict[str, Any], monkeypatch: pytest.MonkeyPatch, threads: int
) -> None:
    together(monkeypatch)
    options = noisy_fit()
    start, started = threading.Thread.start, list[threading.Thread]()

    def limited(thread: threading.Thread) -> None:
        if sum(one.is_alive() for one in started) >= threads:
            raise RuntimeError("can't start new thread")
        start(thread)
        started.append(thread)

    monkeypatch.setattr(threading.Thread, "start", limited)
    assert fs.fit(noisy_pulley(), **options).to_json() == alone
    assert bool(started) == bool(threads)


def test_an_unknown_channel_is_named_where_many_runs_are_expected(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    together(monkeypatch)
    data = {"time": [0.1, 0.2, 0.3], "x": np.zeros(3)}
    with pytest.raises(fs.ArgumentError, match="this scenario has no channel 'drive_torque'"):
        fs.fit(pulley(), data=data, channels={"drive_torque": "x"}, free=FREE)
    with pytest.raises(fs.ArgumentError, match="unknown quantity 'breakaway_tim'"):
        fs.fit(pulley(), quantities={"breakaway_tim": 0.5}, free={MU_S: (0.13, 0.4)})
