"""Runs that are integrated by compiled code and observed together have the bits of runs alone."""

import random
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from frictionsim.errors import Chattering, Interrupted
from frictionsim.mechanisms.pulley import build
from frictionsim.scenario.loading import validate
from frictionsim.scenario.settings import Scenario
from frictionsim.simulation import many_runs
from frictionsim.simulation.many_runs import Unlike, joined, kernel_for, run_many
from frictionsim.simulation.single_dof import SingleDofSimulation
from frictionsim.solvers.compilation import Kernel
from tests.support.drawn_scenarios import gears, pulleys, shafts
from tests.support.many_runs import alone, content, interpret, varied
from tests.support.problems import CORD_RADIUS, LOAD, R_S, cases
from tests.support.scenarios import changed, pulley, shipped

SINE = {"sine": {"mean": LOAD, "amplitude": 1000.0, "frequency_hz": 1.0}}
RETURN = {"time": [0.0, 0.8, 1.6, 2.4], "value": [1832.6, 3113.75, 3113.75, 1832.6]}
COARSE = {"backend": "events", "duration": 3.0, "rtol": 1e-6}
GEAR = next(case["scenario"] for case in cases("epicyclic") if case["name"] == "decay_from_80")
SWING = 0.0508 * 1000.0 / (1.355 * 2.0 * pi)  # rad/s, amplitude of the speed under SINE
LIFT = LOAD * (CORD_RADIUS + R_S) / (CORD_RADIUS - R_S)  # N
HINGE = {"torque_static": 0.3, "torque_kinetic": 0.2}
STEP = {"from": LOAD, "to": 3e3, "start": 0.2, "stop": 0.9}
SLOW = pulley(  # to a stop, nearly to a stop, and faster again within a step
    drive__force={"sine": {**SINE["sine"], "phase_deg": 180.0}},
    effects={"shaft_friction": {"shaft_radius": 0.01, "mu_s": 0.0, "mu_k": 0.0}},
    solver={"duration": 1.0, "rtol": 0.1, "atol": 1.0},
)
EQUAL_LIMITS = pulley(
    effects__shaft_friction__mu_k=0.2, drive__force={**RETURN, "value": [LIFT] * 3 + [LIFT * 1.1]}
)
WITHOUT_FRICTION = pulley(effects__shaft_friction__mu_s=0.0, effects__shaft_friction__mu_k=0.0)
TO_THE_LAST_BIT = tuple(LIFT * (1.0 + k * 2e-16) for k in range(-8, 24))
FACTORS = (0.9, 0.99, 0.999, 1.0, 1.001, 1.01, 1.1)
HINGED = changed(
    GEAR, solver__duration=2.0, effects={"gravity": {"g": 9.81}, "hinge_friction": HINGE}
)
CRANK = shipped("shaft", solver__rtol=1e-7)
SWEEPS: list[tuple[dict[str, Any], str, tuple[float, ...]]] = [
    (pulley(), "mechanism.load", (0.0, 1000.0, LOAD, 2500.0, 3e3, 5e3)),  # some do not move
    (pulley(), "drive.force.value.1", (1832.7, 2000.0, 3113.75, 9000.0)),
    (pulley(), "drive.force.time.1", (0.1, 0.8, 3.0, 5.0)),
    (pulley(), "mechanism.inertia", (0.1, 1.355, 50.0)),
    (pulley(), "effects.shaft_friction.mu_s", (0.1, 0.2, 0.5, 2.5)),  # from mu_k on
    (
        pulley(drive__force=RETURN),
        "mechanism.initial_angular_velocity",
        (-20.0, -1e-9, 0.0, 1e-9, 3.0, 20.0),
    ),
    (
        pulley(drive__force=RETURN, solver__duration=8.0),
        "mechanism.load",
        (1900.0, LOAD, 2300.0, 2500.0),
    ),
    (pulley(drive__force=SINE), "drive.force.sine.amplitude", (100.0, 500.0, 1000.0, 4000.0)),
    (
        pulley(drive__direction="horizontal", drive__force=SINE),
        "effects.shaft_friction.shaft_radius",
        (0.001, 0.0254, 0.2, 0.5),
    ),
    (
        pulley(drive__force={"smooth_step": STEP}),
        "drive.force.smooth_step.stop",
        (0.3, 0.9, 2.9999, 4.0),
    ),
    (pulley(drive__force=2000.0), "drive.force", (1e3, LOAD, 2900.0, 4e3)),
    (WITHOUT_FRICTION, "drive.force.value.0", (1832.6, LOAD, 2300.0)),  # exactly at the limit
    (
        pulley(effects__viscous_damping=None, drive__force=SINE),
        "mechanism.cord_radius",
        (0.03, 0.0508, 0.1),
    ),
    (SLOW, "mechanism.initial_angular_velocity", tuple(2.0 * SWING * f for f in FACTORS)),
    (pulley(), "drive.force.value.0", TO_THE_LAST_BIT),
    (EQUAL_LIMITS, "drive.force.value.1", TO_THE_LAST_BIT),
    (pulley(drive__force=SINE), "solver.rtol", (1e-3, 1e-6, 1e-9)),
    (pulley(drive__force=RETURN), "solver.duration", (0.1, 0.8, 3.0, 6.0)),
    (HINGED, "mechanism.planet_mass", (0.1, 0.5, 1.0, 3.0)),
    (CRANK, "effects.shaft_friction.mu_k", (0.0, 0.1, 0.18, 0.25)),
    (CRANK, "forces.load.size", (350.0, 400.0, 420.0)),
]


@pytest.fixture(autouse=True)
def _interpreted(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    if request.node.get_closest_marker("slow") is None:
        interpret(monkeypatch)


def sweep(data: dict[str, Any], key: str, values: tuple[float, ...]) -> list[Scenario]:
    given = data.get("solver", {})
    shipped = given.get("rtol", 0.0) < 1e-6
    solver = {**COARSE, **given, **({"rtol": 1e-6} if shipped else {}), "backend": "events"}
    scenario = validate({**data, "solver": solver}, Path())
    scenario = scenario.replace({"output.interval": scenario.solver.duration})
    assert kernel_for(scenario) is not None
    return [scenario.replace({key: value}) for value in values]


def check_bits(data: dict[str, Any], key: str, values: tuple[float, ...]) -> None:
    scenarios = sweep(data, key, values)
    found = run_many(scenarios)
    assert None not in found
    for scenario, result in zip(scenarios, found, strict=True):
        expected = alone(scenario)
        assert content(result) == content(expected)
        if scenario.interval == scenario.solver.duration:
            assert result is not None
            assert expected is not None
            assert result.warnings == expected.warnings


def test_numbers_are_joined_and_the_rest_has_to_be_alike() -> None:
    numbers, word, count = joined([(1.0, "up", 2), (3.0, "up", 2)])
    assert (numbers.tolist(), word, count) == ([1.0, 3.0], "up", 2)
    for unlike in ((3.0, "down", 2), (3.0, "up", 3)):
        with pytest.raises(Unlike):
            joined([(1.0, "up", 2), unlike])


def test_runs_with_tables_that_differ_are_done_alone() -> None:
    """Their equations read the tables when the samples are observed."""
    sizes = sweep(CRANK, "forces.effort.size.value.2", (220.0, 230.0))
    assert run_many(sizes) == [None, None]
    assert None not in run_many(sizes[:1] * 2)


@pytest.mark.parametrize(("data", "key", "values"), SWEEPS)
def test_the_bits_are_those_of_the_run_alone(
    data: dict[str, Any], key: str, values: tuple[float, ...]
) -> None:
    check_bits(data, key, values)


@pytest.mark.slow
@pytest.mark.parametrize(("data", "key", "values"), SWEEPS)
def test_compiled_runs_have_the_bits_of_python(
    data: dict[str, Any], key: str, values: tuple[float, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Kernel, "is_loaded", False)  # for the runs alone
    check_bits(data, key, values)


@given(st.one_of(pulleys(), pulleys(), gears()), shafts(0.05), st.integers(0, 10**6))
def test_the_bits_of_drawn_runs_are_those_of_the_run_alone(
    data: Any, shaft: dict[str, float], seed: int
) -> None:
    if data["kind"] == "pulley":
        data = changed(data, effects__shaft_friction=shaft)
    settings = {"backend": "events", "duration": 1.0, "rtol": 1e-5, "max_steps": 2000}
    scenarios = varied({**data, "solver": settings}, random.Random(seed), 5)
    if not scenarios or kernel_for(scenarios[0]) is None:
        return
    for scenario, result in zip(scenarios, run_many(scenarios), strict=True):
        if result is not None:
            assert content(result) == content(alone(scenario))


def test_other_runs_and_their_order_do_not_matter(monkeypatch: pytest.MonkeyPatch) -> None:
    """Runs of unlike lengths, so that the others leave while a step is being retried."""
    data = pulley(drive__force={"sine": {**SINE["sine"], "frequency_hz": 5.0}})
    durations = np.linspace(0.1, 1.0, 37)
    scenarios = sweep(data, "solver.duration", tuple(durations.tolist()))
    amplitudes = np.linspace(4000.0, 400.0, 37).tolist()
    scenarios = [
        scenario.replace({"drive.force.sine.amplitude": amplitude})
        for scenario, amplitude in zip(scenarios, amplitudes, strict=True)
    ]
    expected = [content(result) for result in run_many(scenarios)]
    assert expected == [content(alone(scenario)) for scenario in scenarios]
    backwards = [content(result) for result in run_many(scenarios[::-1])]
    assert backwards[::-1] == expected
    assert [content(run_many([scenario])[0]) for scenario in scenarios[::12]] == expected[::12]
    monkeypatch.setattr(many_runs, "BATCH", 5)
    assert [content(result) for result in run_many(scenarios)] == expected


def test_runs_that_fail_are_given_back_and_the_others_are_not() -> None:
    data = pulley(drive__force=SINE, solver__max_steps=150)
    scenarios = sweep(data, "drive.force.sine.amplitude", (100.0, 500.0, 1000.0, 4000.0))
    fails = [alone(scenario) is None for scenario in scenarios]
    assert True in fails
    assert False in fails
    assert [result is None for result in run_many(scenarios)] == fails


def test_runs_that_chatter_are_given_back() -> None:
    """The force on the fine pulley changes its side every 5 ns."""
    shaft = {"shaft_radius": 1e-3, "mu_s": 0.1, "mu_k": 0.1}
    table = {"time": [5e-9 * k for k in range(300)], "value": [0.0, 2.0 * LOAD] * 150}
    data = pulley(mechanism__inertia=1e-3, effects__shaft_friction=shaft, drive__force=table)
    chatters, sticks = sweep(data, "mechanism.cord_radius", (0.0508, 1e-5))
    with pytest.raises(Chattering, match="100 times within"):
        SingleDofSimulation(chatters, build(chatters)).solve(lambda t: None)
    assert [result is None for result in run_many([chatters, sticks])] == [True, False]


def test_runs_that_exceed_the_numbers_are_given_back() -> None:
    base = pulley(
        mechanism__cord_radius=1e50, effects__viscous_damping__coefficient=1e50, solver=COARSE
    )
    scenarios = sweep(base, "mechanism.inertia", (1e-50, 1e49))
    assert alone(scenarios[0]) is None
    assert run_many(scenarios)[0] is None


def test_runs_of_another_form_are_given_back() -> None:
    still, moves = (
        validate(pulley(effects__viscous_damping=damping), Path())
        for damping in (None, {"coefficient": 0.2})
    )
    sparse = {"output.interval": 3.0}
    scenarios = [scenario.replace(sparse) for scenario in (still, moves, still)]
    assert [result is None for result in run_many(scenarios)] == [False, True, False]


@pytest.mark.parametrize("force", [RETURN, 4000.0])
def test_the_samples_at_events_may_be_left_out(force: Any) -> None:
    data = pulley(drive__force=force, output={"at_events": False})
    (scenario,) = sweep(data, "mechanism.load", (LOAD,))
    (result,) = run_many([scenario])
    assert result is not None
    assert result.time.tolist() == [0.0, 3.0]
    assert content(result) == content(alone(scenario))


def test_warnings_speak_of_the_interval_of_the_scenario() -> None:
    (still, moves) = sweep(pulley(drive__force=SINE), "drive.force.sine.amplitude", (1.0, 1000.0))
    first, second = run_many([still, moves.replace({"output.interval": 0.6})])
    assert first is not None
    assert second is not None
    assert first.warnings == (
        "nothing moves: the largest torque is 0.2293137036 % of the static limit",
    )
    assert second.warnings[0].startswith("output.interval = 0.6 s is longer than a tenth of the")


def test_they_can_be_interrupted() -> None:
    def on_run() -> None:
        raise Interrupted(2, 0.5)

    with pytest.raises(Interrupted, match="by SIGINT"):
        run_many(sweep(pulley(), "mechanism.load", (2000.0, 2100.0)), on_run)


@pytest.mark.parametrize(
    "data",
    [
        pulley(solver__backend="rkf45"),
        pulley(effects__shaft_friction=None),
        pulley(effects__shaft_friction__law="regularised", solver__backend="rkf45"),
        pulley(
            effects__hanging_masses={"car": 200.0, "counterweight": 100.0}, mechanism__load=None
        ),
    ],
)
def test_some_runs_go_alone(data: dict[str, Any]) -> None:
    assert kernel_for(validate(data, Path())) is None


def test_a_run_whose_load_jumps_past_the_limit_is_done_alone() -> None:
    """Just before the jump the contact is far from its limit: the audit looks at the load then."""
    times = [0.0, 1.0, float(np.nextafter(1.0, 2.0))]
    data = pulley(drive__force={"time": times, "value": [1832.6, 1832.6, 3113.75]})
    scenarios = sweep(data, "mechanism.load", (LOAD, 2100.0, 1000.0))
    first, second, slides = run_many(scenarios)
    assert (first, second) == (None, None)
    assert content(slides) == content(alone(scenarios[2]))
    for scenario in scenarios:
        result = alone(scenario)
        assert result is not None
        assert result.checks["release"].value == 0.0
