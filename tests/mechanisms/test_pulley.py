"""The pulley in motion: closed forms, references, agreement of the methods."""

import tomllib
from typing import Any

import numpy as np
import pytest

from frictionsim.results import Record
from tests.support.cases import one_in
from tests.support.problems import (
    BREAKAWAY,
    LOAD,
    RAMP,
    RETURN_FORCE,
    RETURN_OF_EQ_30,
    RETURN_STICK,
    assert_agrees,
    cases,
)
from tests.support.scenarios import SCENARIOS, Scenario, changed, pulley, simulate

EXACT_BACKENDS = ("events", "rkf45")
PUBLISHED = {"effects__shaft_friction__law": "published", "solver__backend": "rkf45"}


def ramp(backend: str = "events", **changes: Any) -> Scenario:
    return pulley(
        **{"solver__backend": backend, "solver__duration": 10.0, "solver__rtol": 1e-10} | changes
    )


def modes(run: Record) -> list[tuple[int, int]]:
    return [(e.mode_from, e.mode_to) for e in run.transitions]


@pytest.mark.parametrize("backend", EXACT_BACKENDS)
def test_ramp_follows_the_closed_form(backend: str) -> None:
    run = simulate(ramp(backend))
    assert run.transitions[0].time == pytest.approx(BREAKAWAY, abs=1e-12)  # a few roundings
    for time, angle, velocity, acceleration in RAMP:
        i = int(np.argmin(np.abs(run.time - time)))
        # rtol 1e-10 of an angle of up to 200 rad, in some hundred steps
        assert run.channels["angle"][i] == pytest.approx(angle, abs=1e-8)
        assert run.channels["angular_velocity"][i] == pytest.approx(velocity, abs=1e-9)
        assert run.channels["angular_acceleration"][i] == pytest.approx(acceleration, abs=1e-9)


def test_the_published_law_follows_a_ramp_on_which_the_pulley_never_comes_back_to_rest() -> None:
    run = simulate(ramp("rkf45", effects__shaft_friction__law="published", solver__rtol=1e-9))
    for time, *exact in RAMP:
        i = int(np.argmin(np.abs(run.time - time)))
        names = ("angle", "angular_velocity", "angular_acceleration")
        # An angle of 196 rad and a velocity of 23 rad/s at rtol 1e-9: measured 1e-9.
        assert [run.channels[name][i] for name in names] == pytest.approx(exact, abs=2e-9)


# Its steps are a thousandth of its time constant: they take ten seconds, those of rkf45 30.
TINY_INERTIA = "inertia_1e-6_ramp"
# Hundreds of cycles, or short steps; the drawn cases have the same transitions.
DEAR = {
    *("inertia_1e-4_sine", "sine_20Hz_400cycles", "sine_5Hz_300cycles"),
    "sine_10Hz_two_way_200cycles",
}


def references(marks: dict[str, pytest.MarkDecorator]) -> list[Any]:
    """Return the cases, those named with a mark."""
    return [
        pytest.param(case, id=case["name"], marks=marks.get(case["name"], ()))
        for case in cases("pulley")
    ]


@pytest.mark.parametrize(
    "case", one_in(7, references(dict.fromkeys((TINY_INERTIA, *DEAR), pytest.mark.slow)))
)
def test_events_agrees_with_the_reference(case: dict[str, Any]) -> None:
    data = case["scenario"]
    data["solver"] |= {"backend": "events", "rtol": 1e-10}
    run = simulate(data)
    assert run.status == "done"
    # What is asked of this backend at rtol 1e-10; most scenarios are a hundred times better.
    assert_agrees(run, run.transitions, case, time=1e-9)
    energies = [
        run.channels.get(name, np.zeros(1))[-1]
        for name in ("energy_input", "energy_friction", "energy_damping")
    ]
    # rtol of the largest; energies below a millijoule only to the absolute tolerance.
    largest = max(1e-3, *map(abs, case["energy"]))
    assert energies == pytest.approx(case["energy"], abs=1e-8 * largest)


@pytest.mark.parametrize(
    "case",
    one_in(
        12, references(dict.fromkeys(DEAR, pytest.mark.slow) | {TINY_INERTIA: pytest.mark.nightly})
    ),
)
def test_rkf45_agrees_with_the_reference_to_its_tolerance(case: dict[str, Any]) -> None:
    data = case["scenario"]
    data["solver"] |= {"backend": "rkf45", "rtol": 1e-8, "atol": 1e-11}
    run = simulate(data)
    assert len(run.transitions) == case["event_count"]
    angle = run.channels["angle"]
    # The local errors of some ten thousand steps at 1e-8 add up.
    close = 1e-5 * max(1.0, np.max(np.abs(angle)))
    for event, (_, *between, where) in zip(run.transitions, case["events"], strict=False):
        assert [event.mode_from, event.mode_to] == between
        assert event.position == pytest.approx(where, abs=close)
    assert angle[-1] == pytest.approx(case["final"][0], abs=close)


# What eq 30 gives as printed, for RK4 with steps of 1e-2, 1e-3 and 1e-4 s; another method of
# higher order has its steps elsewhere about the switch: 0.03 rad is an error of 1e-2 s in it.
@pytest.mark.parametrize(("step", "tolerance"), [(None, 1e-4), (1e-2, 0.1), (1e-3, 0.01)])
def test_published_law_runs_back_instead_of_sticking(step: float | None, tolerance: float) -> None:
    data = pulley(drive__force=RETURN_FORCE, **PUBLISHED, solver__duration=12.0, solver__step=step)
    run = simulate(data)
    assert run.channels["angle"][-1] == pytest.approx(RETURN_OF_EQ_30, abs=tolerance)
    assert run.channels["angular_velocity"][-1] == pytest.approx(-7.10352, abs=tolerance)
    assert run.transitions[1].position == pytest.approx(RETURN_STICK[1], abs=tolerance)


def test_published_law_reports_creeping() -> None:
    """With a horizontal force the velocity keeps its sign while the stages chatter."""
    data = tomllib.loads((SCENARIOS / "pulley_horizontal.toml").read_text())
    run = simulate(changed(data, **PUBLISHED))
    assert (run.status, run.exit_code) == ("failed", 1)
    assert "chattering at t = 5.174" in run.reason
    assert "made the solver creep 1000 times" in run.reason


def test_published_law_with_fixed_steps_chatters() -> None:
    data = pulley(
        drive__force={"time": [0.0, 0.8, 4.0, 4.8], "value": [1832.6, 3113.75, 3113.75, LOAD]},
        **PUBLISHED,
        solver__duration=7.0,
        solver__step=1e-3,
    )
    run = simulate(data)
    assert run.status == "done"
    assert len(run.transitions) > 500  # one or two a millisecond, for 1.2 s
    assert run.channels["angular_velocity"][-1] != 0.0


@pytest.mark.parametrize("backend", EXACT_BACKENDS)
def test_no_force_of_a_self_locking_shaft_breaks_away(backend: str) -> None:
    data = pulley(
        mechanism__cord_radius=0.004,
        drive__force={"time": [0.0, 1.0], "value": [0.0, 1e9]},
        solver__backend=backend,
    )
    assert simulate(data).transitions == []


def test_a_spinning_start_needs_no_breakaway() -> None:
    run = simulate(pulley(drive__force=LOAD, mechanism__initial_angular_velocity=-2.0))
    assert modes(run) == [(-1, 0)]
    assert run.channels["angle"][-1] < 0.0


def test_a_stop_within_one_long_step_is_found() -> None:
    """The velocity is a parabola that touches zero within one step."""

    def modes_and_times(**solver: Any) -> tuple[list[tuple[int, int]], list[float]]:
        run = simulate(
            pulley(
                mechanism__initial_angular_velocity=0.68,
                drive__force={"time": [0.0, 2.0], "value": [LOAD - 60.0, LOAD + 140.0]},
                effects__viscous_damping=None,
                effects__shaft_friction={"shaft_radius": 0.0254, "mu_s": 0.005, "mu_k": 0.0005},
                solver__duration=2.0,
                **solver,
            )
        )
        return modes(run), [e.time for e in run.transitions]

    fine = modes_and_times(solver__max_step=0.01)
    coarse = modes_and_times(solver__rtol=1e-2, solver__atol=1e-2)
    assert fine[0] == coarse[0] == [(1, 0), (0, 1)]
    assert coarse[1] == pytest.approx(fine[1], abs=1e-9)  # the method is exact on a parabola
