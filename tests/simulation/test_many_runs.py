"""Runs that are integrated by compiled code and observed together have the bits of runs alone."""

import random
from math import inf, nan, pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from frictionsim.errors import InputError, Interrupted
from frictionsim.parameter_study.single_run import outcomes_together
from frictionsim.results import STICK, Transition
from frictionsim.scenario.loading import validate
from frictionsim.scenario.settings import Scenario
from frictionsim.simulation import combinations
from frictionsim.simulation import many_runs as observation
from frictionsim.simulation.audit import drift, stick_drift
from frictionsim.simulation.combinations import Combinations
from frictionsim.simulation.monitor import monitor_of
from frictionsim.solvers import many_runs
from frictionsim.solvers.compilation import Kernel
from frictionsim.solvers.mechanism import Trajectory
from frictionsim.solvers.one_contact_state import EVENT_COLUMNS
from tests.support.drawn_scenarios import pulleys, shafts
from tests.support.examples import examples
from tests.support.many_runs import block_alone, block_together, content, together, varied
from tests.support.problems import CORD_RADIUS, LOAD, R_S
from tests.support.scenarios import changed, pulley

SINE = {"sine": {"mean": LOAD, "amplitude": 1000.0, "frequency_hz": 1.0}}
RETURN = {"time": [0.0, 0.8, 1.6, 2.4], "value": [1832.6, 3113.75, 3113.75, 1832.6]}
COARSE = {"backend": "events", "duration": 3.0, "rtol": 1e-6}
SWING = 0.0508 * 1000.0 / (1.355 * 2.0 * pi)  # rad/s, amplitude of the speed under SINE
LIFT = LOAD * (CORD_RADIUS + R_S) / (CORD_RADIUS - R_S)  # N
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
    (pulley(), "mechanism.load", (2000, 2100.0, 2200)),  # whole numbers, too
    (pulley(), "mechanism.cord_radius", (4.9, 5.0, 5.1, 0.01)),  # some are not plausible
    (pulley(), "mechanism.load", (-1.0, 0.0, nan, inf, 1e-60, 1e60, 2000.0)),
    (pulley(), "effects.shaft_friction.mu_k", (0.1, 0.2, 0.3, -0.1)),  # one is above mu_s
    (pulley(), "drive.force.time.1", (-0.1, 0.0, 0.5)),  # one is before the point before it
    (pulley(drive__force=RETURN), "drive.force.value.0", (-100.0, 1832.6)),  # a cord that pushes
    (pulley(), "solver.rtol", (1e-15, 1e-6, 1.0)),
    (pulley(), "solver.max_steps", (10, 1000)),
    (pulley(drive__force=SINE), "drive.force.sine.frequency_hz", (0.5, 1.0, 30.0)),
    (pulley(drive__force=None, drive__torque=120.0), "drive.torque", (100.0, 113.0, 150.0)),
]


@pytest.fixture(autouse=True)
def _together(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    compiled = Kernel.compiled
    together(monkeypatch)
    monkeypatch.setattr(combinations, "MIN_TOGETHER", 1)
    if request.node.get_closest_marker("slow") is not None:
        monkeypatch.setattr(Kernel, "compiled", compiled)


def scenario_of(data: dict[str, Any]) -> Scenario:
    given = data.get("solver", {})
    shipped = given.get("rtol", 0.0) < 1e-6
    solver = {**COARSE, **given, **({"rtol": 1e-6} if shipped else {}), "backend": "events"}
    return validate({**data, "solver": solver}, Path())


def number_together(scenario: Scenario, vary: dict[str, Any]) -> int:
    values = list(zip(*vary.values(), strict=True))
    of_sweep = Combinations(scenario, list(vary), len(values))
    return sum(len(runs) for runs, _ in outcomes_together(of_sweep, values))


def check_bits(data: dict[str, Any], vary: dict[str, Any]) -> None:
    scenario = scenario_of(data)
    assert content(block_together(scenario, vary)) == content(block_alone(scenario, vary))


@pytest.mark.parametrize(("data", "key", "values"), SWEEPS)
def test_the_bits_are_those_of_the_run_alone(
    data: dict[str, Any], key: str, values: tuple[float, ...]
) -> None:
    check_bits(data, {key: values})


@pytest.mark.slow
@pytest.mark.parametrize(("data", "key", "values"), SWEEPS)
def test_compiled_runs_have_the_bits_of_python(
    data: dict[str, Any], key: str, values: tuple[float, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Kernel, "is_loaded", False)  # for the runs alone
    check_bits(data, {key: values})


@examples(12)
@given(pulleys(), shafts(0.05), st.integers(0, 10**6))
def test_the_outcomes_of_drawn_runs_are_those_of_the_run_alone(
    data: Any, shaft: dict[str, float], seed: int
) -> None:
    """Also of combinations that are not valid, or that a warning is about."""
    settings = {"backend": "events", "duration": 1.0, "rtol": 1e-5, "max_steps": 2000}
    data = changed(data, effects__shaft_friction=shaft, solver=settings)
    vary = varied({**data, "solver": {"duration": 1.0, "rtol": 1e-5}}, random.Random(seed), 6)
    check_bits(data, vary)


@given(pulleys(), shafts(0.05), st.integers(0, 10**6))
def test_the_first_combination_that_is_not_valid_is_named(
    data: Any, shaft: dict[str, float], seed: int
) -> None:
    data = changed(data, effects__shaft_friction=shaft, solver={"backend": "events"})
    vary = varied(data, random.Random(seed), 6)
    values = list(zip(*vary.values(), strict=True))
    of_sweep = Combinations(validate(data, Path()), list(vary), len(values))

    def fault_of(check: Any) -> str:
        try:
            check()
        except InputError as error:
            return str(error)
        return ""

    one_by_one = fault_of(lambda: [of_sweep.scenario(row) for row in values])
    assert fault_of(lambda: of_sweep.check(values)) == one_by_one


def test_runs_of_several_buffers_and_calls_have_the_same_bits(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    data = pulley(drive__force={"sine": {**SINE["sine"], "frequency_hz": 5.0}})
    vary = {
        "solver.duration": np.linspace(0.1, 1.0, 17).tolist(),
        "drive.force.sine.amplitude": np.linspace(4000.0, 400.0, 17).tolist(),
    }
    scenario = scenario_of(data)
    assert number_together(scenario, vary) == 17
    expected = content(block_together(scenario, vary))
    assert expected == content(block_alone(scenario, vary))
    monkeypatch.setattr(many_runs, "SAMPLES", 3)
    monkeypatch.setattr(many_runs, "EVENTS_OF_A_CALL", 1)
    monkeypatch.setattr(many_runs, "STEPS_OF_A_CALL", 7.0)
    assert content(block_together(scenario, vary)) == expected


def test_a_buffer_filled_by_an_event_at_the_end_has_no_room_for_one_at_the_next_start(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The first run breaks away as the force jumps at its end, the second at once."""
    times = [0.0, float(np.nextafter(1.0, 0.0)), 1.0]
    force = {"time": times, "value": [1832.6, 1832.6, 3113.75]}
    data = pulley(drive__force=force, solver={"backend": "events", "duration": 1.0, "rtol": 1e-6})
    scenario, vary = scenario_of(data), {"mechanism.load": [LOAD, 1000.0]}
    monkeypatch.setattr(many_runs, "EVENTS_OF_A_CALL", 1)
    assert content(block_together(scenario, vary)) == content(block_alone(scenario, vary))


@pytest.mark.parametrize(
    ("data", "vary", "fewest"),
    [
        (pulley(), {"mechanism.load": [1900.0, LOAD, 2300.0]}, 3),
        (pulley(), {"mechanism.load": [5000.0, LOAD, 6000.0]}, 3),  # two rest
        (pulley(), {"effects.shaft_friction.shaft_radius": [0.02, 0.06]}, 2),  # one is thick
        # Some fail; the force jumps, so that the contact leaves stick far from its limit.
        (
            pulley(drive__force=SINE, solver__max_steps=150),
            {"drive.force.sine.amplitude": [100.0, 500.0, 1000.0, 4000.0]},
            1,
        ),
        (
            pulley(
                drive__force={
                    "time": [0.0, 1.0, float(np.nextafter(1.0, 2.0))],
                    "value": [1832.6, 1832.6, 3113.75],
                }
            ),
            {"mechanism.load": [LOAD, 2100.0, 1000.0]},
            1,
        ),
    ],
)
def test_runs_go_together_where_nothing_is_wrong(
    data: dict[str, Any], vary: dict[str, Any], fewest: int
) -> None:
    scenario = scenario_of(data)
    assert number_together(scenario, vary) == fewest
    assert content(block_together(scenario, vary)) == content(block_alone(scenario, vary))


@pytest.mark.parametrize(
    ("name", "replacement"),
    [
        ("allowed_residual", lambda rtol: 0.0),
        ("ROUNDING", -1.0),
        ("driving_power", lambda trajectory, atol: np.ones(trajectory.time.shape[1])),
    ],
)
def test_runs_that_do_not_pass_the_audit_are_run_alone(
    name: str, replacement: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(observation, name, replacement)
    assert number_together(scenario_of(pulley()), {"mechanism.load": [1900.0, 2300.0]}) == 0


@given(st.integers(0, 10**6))
def test_the_drift_of_many_runs_is_found_as_of_each(seed: int) -> None:
    rng, runs, n = np.random.default_rng(seed), 5, 6
    time = np.sort(rng.integers(0, 9, (n, runs)), axis=0).astype(float)
    mode, position = rng.integers(0, 2, (2, n, runs)).astype(float)
    of_events, at = rng.integers(0, runs, 8), rng.integers(0, 9, 8).astype(float)
    mode_to = rng.integers(0, 2, 8)
    rows = np.zeros((8, EVENT_COLUMNS + 2))  # of samples that have a time only
    rows[:, 1], rows[:, 3], rows[:, -1] = at, mode_to, at
    slips = observation._Events(rows, of_events).slips_before(
        time.T.ravel(), np.repeat(np.arange(runs), n)
    )
    nothing: Any = np.zeros((n, runs))
    drifts = drift(position, mode == STICK, slips.reshape(runs, n).T)
    for run in range(runs):
        mine = of_events == run
        events = [
            Transition(t, "shaft", 0, int(to))
            for t, to in zip(at[mine], mode_to[mine], strict=True)
        ]
        events.sort(key=lambda event: event.time)
        columns = (time, nothing, position, nothing, nothing, nothing, mode)
        alone = Trajectory(*[column[:, run] for column in columns], {}, {}, events)  # type: ignore[call-arg]
        assert drifts[run] == stick_drift(alone)


def test_runs_that_chatter_are_run_alone() -> None:
    """The force on the fine pulley changes its side every 5 ns."""
    shaft = {"shaft_radius": 1e-3, "mu_s": 0.1, "mu_k": 0.1}
    table = {"time": [5e-9 * k for k in range(300)], "value": [0.0, 2.0 * LOAD] * 150}
    data = pulley(mechanism__inertia=1e-3, effects__shaft_friction=shaft, drive__force=table)
    block = block_together(scenario_of(data), {"mechanism.cord_radius": [0.0508, 1e-5]})
    assert block.texts["failure"] == {7: "chattering"}


def test_runs_that_exceed_the_numbers_are_run_alone() -> None:
    data = pulley(
        mechanism__cord_radius=1e50, effects__viscous_damping__coefficient=1e50, solver=COARSE
    )
    block = block_together(scenario_of(data), {"mechanism.inertia": [1e-50, 1e49]})
    assert block.texts["failure"][7] == "step_underflow"


def test_they_can_be_interrupted() -> None:
    def on_step(t: float) -> None:
        raise Interrupted(2, 0.5)

    of_sweep = Combinations(scenario_of(pulley()), ["mechanism.load"], 2)
    with pytest.raises(Interrupted, match="by SIGINT"):
        outcomes_together(of_sweep, [(2000.0,), (2100.0,)], monitor_of(on_step))


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
    assert Combinations(validate(data, Path()), ["solver.duration"], 9).form([1.0]) is None


def test_values_may_be_of_an_effect_that_the_scenario_leaves_out() -> None:
    scenario = scenario_of(pulley(effects__viscous_damping=None))
    vary = {"effects.viscous_damping.coefficient": [1.0, 2.0]}
    assert number_together(scenario, vary) == 2
    assert content(block_together(scenario, vary)) == content(block_alone(scenario, vary))
