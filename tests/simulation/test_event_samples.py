"""Events are samples: the time axis is the union of regular samples and events, with both sides."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

import frictionsim as fs
from frictionsim.results import STICK, Record
from tests.support.lifts import CORD, lift, ramp
from tests.support.problems import BREAKAWAY, CORD_RADIUS, LOAD, R_K, R_S, cases
from tests.support.scenarios import SCENARIOS, Scenario, changed, pulley, simulate, with_method

SINE = {"sine": {"mean": 2224.1, "amplitude": 1000.0, "frequency_hz": 1.0}}
MARBLES = next(
    case["scenario"] for case in cases("marble_machine") if case["name"] == "sine_both_ways"
)
PUBLISHED = with_method(pulley(drive__force=SINE), "published", "rkf45")
CASES: dict[str, Scenario] = {
    "pulley": pulley(drive__force=SINE),
    "pulley rkf45": pulley(drive__force=SINE, solver__backend="rkf45"),
    # With adaptive steps it would fail by chattering.
    "published": changed(PUBLISHED, solver={"backend": "rkf45", "step": 2e-3, "duration": 1.5}),
    "regularised": with_method(
        pulley(drive__force=SINE, solver__rtol=1e-6, solver__duration=2.0), "regularised", "radau"
    ),
    "marble machine rkf45": changed(MARBLES, solver__backend="rkf45"),
    "no friction": changed(MARBLES, effects__shaft_friction=None),
    "gear of given speed": changed(
        next(case["scenario"] for case in cases("epicyclic") if case["name"] == "decay_from_80"),
        drive={"speed": {"sine": {"mean": 0.5, "amplitude": 3.0, "frequency_hz": 0.7}}},
        mechanism__initial_angular_velocity=None,
        solver={"duration": 3.0},
        output={"interval": 0.01},
    ),
    "slipping cord": lift(
        drive__torque=ramp((0.0, 70.0), (0.3, 400.0), (0.6, 400.0), (0.65, -900.0), (1.0, -900.0)),
        effects__shaft_friction={"shaft_radius": 0.05, "mu_s": 0.3, "mu_k": 0.2},
        effects__cord_friction=CORD,
        effects__hanging_masses__restitution=0.3,
        solver={"duration": 1.2, "rtol": 1e-8, "atol": 1e-11},
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_the_time_axis_is_the_union_of_regular_samples_and_events(name: str) -> None:
    record = simulate(CASES[name])
    regular = simulate(changed(CASES[name], output__at_events=False))
    assert record.transitions == regular.transitions != []
    events = {e.time for e in record.transitions}
    assert np.all(np.diff(record.time) > 0.0)
    assert set(record.time) == events | set(regular.time)
    # The choice of samples does not change the run: it stays bit-identical.
    elsewhere, kept = (~np.isin(of.time, list(events)) for of in (record, regular))
    for channel, values in regular.channels.items():
        assert np.array_equal(record.channels[channel][elsewhere], values[kept]), channel
    for side, values in record.events.items():
        assert np.array_equal(values, regular.events[side]), side


@pytest.mark.parametrize("name", CASES)
def test_a_sample_at_an_event_is_the_sticking_side_or_the_side_after(name: str) -> None:
    record = simulate(CASES[name])
    times = [e.time for e in record.transitions]
    sides = [name for name in record.events if name.endswith(("_before", "_after"))]
    channels = {side.rpartition("_")[0] for side in sides}
    energies = {name for name in record.channels if name.startswith("energy_")}
    assert channels == record.channels.keys() - energies - {"time", "angle", "mode"}
    for i, event in enumerate(record.transitions):
        if times.count(event.time) > 1:
            continue
        # eq 30 breaks away within the step that ends at the event and has moved since.
        sticks_before = event.mode_from == STICK and name != "published" and event.time > 0.0
        side = "before" if sticks_before else "after"
        at = np.searchsorted(record.time, event.time)
        for channel in channels:
            assert record.channels[channel][at] == record.events[f"{channel}_{side}"][i], channel
        mode = {"shaft": "mode", "cord": "cord_mode"}.get(event.contact, "")
        if mode in record.channels:
            shown = event.mode_from if sticks_before else event.mode_to
            assert record.channels[mode][at] == shown
        assert record.channels["angle"][at] == event.position


def test_events_at_one_time_have_one_state_on_each_side() -> None:
    stop = ramp((0.0, 70.0), (0.3, 400.0), (0.6, 400.0), (0.65, -900.0), (1.0, -900.0), (1.1, 70.0))
    slack = changed(CASES["slipping cord"], effects__cord_friction=None, drive__torque=stop)
    result = simulate(changed(slack, solver__duration=2.0))
    together = [i for i, (a, b) in enumerate(pairwise(result.transitions)) if a.time == b.time]
    assert together
    for i in together:
        for side in ("before", "after"):
            values = result.events[f"angular_velocity_{side}"]
            assert values[i] == values[i + 1]


def test_breakaway_records_peak_and_jump_of_the_friction() -> None:
    record = fs.solve(SCENARIOS / "pulley_return.toml").record
    lift = LOAD * (CORD_RADIUS + R_S) / (CORD_RADIUS - R_S)
    peak = R_S * (lift + LOAD)  # the static limit, 24.57 N m
    i = int(np.argmin(record.channels["friction_torque"]))
    assert record.time[i] == pytest.approx(BREAKAWAY, abs=1e-12)
    first = {name: values[0] for name, values in record.events.items()}
    assert record.channels["friction_torque"][i] == pytest.approx(-peak, rel=1e-12)
    assert first["friction_torque_before"] == pytest.approx(-peak, rel=1e-12)
    assert first["friction_torque_after"] == pytest.approx(-R_K * (lift + LOAD), rel=1e-12)
    # The acceleration jumps by the difference of the friction torques over the inertia.
    assert first["angular_acceleration_before"] == 0.0
    jump = (R_S - R_K) * (lift + LOAD) / 1.355
    assert first["angular_acceleration_after"] == pytest.approx(jump, rel=1e-12)


@pytest.mark.parametrize("backend", ["events", "rkf45"])
def test_a_jump_of_the_drive_separates_the_sides(backend: str) -> None:
    """Before the jump, the friction torque is within the limit for the force before it."""
    events = fs.solve(fs.load(SCENARIOS / "hard" / "jump_from_csv.toml", [], backend)).record.events
    assert events["drive_force_before"][0] < 2000.0 < events["drive_force_after"][0]
    limit = R_S * events["shaft_reaction_before"]
    assert np.all(np.abs(events["friction_torque_before"]) <= limit)


@pytest.mark.parametrize("backend", ["events", "rkf45"])
def test_an_event_at_a_regular_sample_adds_no_sample(backend: str) -> None:
    """Beyond its limit at the start, the contact slides at once: there is no sticking side."""

    def run(**changes: Any) -> Record:
        return simulate(pulley(drive__force=3113.75, solver__backend=backend, **changes))

    record = run()
    (event,) = record.transitions
    assert event.time == 0.0
    assert record.time.tolist() == run(output__at_events=False).time.tolist()
    assert record.channels["mode"][0] == 1
    for side in ("before", "after"):
        assert record.events[f"friction_torque_{side}"][0] == record.channels["friction_torque"][0]


def test_sides_are_recorded_for_the_output_channels_only(tmp_path: Path) -> None:
    record = simulate(pulley(output__channels=["friction_torque", "angle", "energy_input"]))
    path = tmp_path / "a.h5"
    events = fs.open(fs.Result(record).save(path)).record.events
    sides = {"friction_torque_before", "friction_torque_after"}
    assert events.keys() == {"time", "contact", "mode_from", "mode_to", "angle"} | sides
    with h5py.File(path) as file:
        before = file["events/friction_torque_before"].attrs
        assert before["units"] == "N m"
        assert before["long_name"].endswith("on the pulley, immediately before the event")
