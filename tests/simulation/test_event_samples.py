"""Samples at events, and the channels immediately before and after each event."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

import frictionsim as fs
from frictionsim.results import Record
from tests.support.cases import one_in
from tests.support.problems import BREAKAWAY, CORD_RADIUS, LOAD, R_K, R_S, cases
from tests.support.scenarios import SCENARIOS, Scenario, changed, pulley, simulate, with_method

SINE = {"sine": {"mean": 2224.1, "amplitude": 1000.0, "frequency_hz": 1.0}}
PRESCRIBED = changed(
    next(case["scenario"] for case in cases("epicyclic") if case["name"] == "decay_from_80"),
    drive={"speed": {"sine": {"mean": 0.5, "amplitude": 3.0, "frequency_hz": 0.7}}},
    mechanism__initial_angular_velocity=None,
    solver={"duration": 3.0},
    output={"interval": 0.01},
)
MARBLES = next(
    case["scenario"] for case in cases("marble_machine") if case["name"] == "sine_both_ways"
)
CASES: dict[str, Scenario] = {
    "pulley": pulley(drive__force=SINE),
    "marble machine": MARBLES,
    "gear of given speed": PRESCRIBED,
    "no friction": changed(MARBLES, effects__shaft_friction=None),
}
SETTINGS = [
    *((name, "set-valued", backend) for name in CASES for backend in ("events", "rkf45")),
    ("pulley", "published", "rkf45"),
    *(("pulley", "regularised", backend) for backend in ("rkf45", "radau")),
]


def solved(name: str, law: str, backend: str, **changes: Any) -> Record:
    data = with_method(changed(CASES[name], **changes), law, backend)
    if law == "published":
        # With adaptive steps it would fail by chattering.
        data = changed(data, solver={"backend": backend, "step": 1e-3, "duration": 3.0})
    if backend == "radau":  # its many steps say nothing about samples
        data = changed(data, solver__rtol=1e-6, solver__duration=2.0)
    return simulate(data)


@pytest.mark.parametrize(("name", "law", "backend"), one_in(2, SETTINGS))
def test_the_time_axis_is_the_union_of_regular_samples_and_events(
    name: str, law: str, backend: str
) -> None:
    record = solved(name, law, backend)
    regular = solved(name, law, backend, output__at_events=False)
    assert record.transitions == regular.transitions != []
    events = {e.time for e in record.transitions}
    assert np.all(np.diff(record.time) > 0.0)
    assert set(record.time) == events | set(regular.time)
    # The choice of samples does not change the run: it stays bit-identical.
    elsewhere = np.isin(record.time, regular.time) & ~np.isin(record.time, list(events))
    kept = ~np.isin(regular.time, list(events))
    for channel, values in regular.channels.items():
        assert np.array_equal(record.channels[channel][elsewhere], values[kept]), channel
    assert record.statistics[:4] == regular.statistics[:4]
    sparse = solved(name, law, backend, output__interval=1.7)
    assert sparse.transitions == record.transitions
    assert (sparse.statistics.steps, sparse.statistics.rejected) == record.statistics[:2]
    for side, values in record.events.items():
        assert np.array_equal(values, sparse.events[side]), side


@pytest.mark.parametrize(("name", "law", "backend"), SETTINGS)
def test_a_sample_at_an_event_is_the_sticking_side_or_the_side_after(
    name: str, law: str, backend: str
) -> None:
    record = solved(name, law, backend)
    times = [e.time for e in record.transitions]
    sides = [name for name in record.events if name.endswith(("_before", "_after"))]
    channels = {side.rpartition("_")[0] for side in sides}
    energies = {name for name in record.channels if name.startswith("energy_")}
    assert channels == record.channels.keys() - energies - {"time", "angle", "mode"}
    for i, event in enumerate(record.transitions):
        if times.count(event.time) > 1:
            continue
        # eq 30 breaks away within the step that ends at the event and has moved since.
        sticks_before = event.mode_from == 0 and law != "published" and event.time > 0.0
        side = "before" if sticks_before else "after"
        at = np.searchsorted(record.time, event.time)
        for channel in channels:
            assert record.channels[channel][at] == record.events[f"{channel}_{side}"][i], channel
        if "mode" in record.channels and event.mode_from != event.mode_to:
            shown = event.mode_from if sticks_before else event.mode_to
            assert record.channels["mode"][at] == shown
        assert record.channels["angle"][at] == event.position


def test_breakaway_records_peak_and_jump_of_the_friction() -> None:
    record = fs.solve(SCENARIOS / "pulley_return.toml").record
    lift = LOAD * (CORD_RADIUS + R_S) / (CORD_RADIUS - R_S)
    peak = R_S * (lift + LOAD)  # the static limit, 24.57 N m
    i = int(np.argmin(record.channels["friction_torque"]))
    assert record.time[i] == pytest.approx(BREAKAWAY, abs=1e-12)
    assert record.channels["friction_torque"][i] == pytest.approx(-peak, rel=1e-12)
    assert record.events["friction_torque_before"][0] == pytest.approx(-peak, rel=1e-12)
    assert record.events["friction_torque_after"][0] == pytest.approx(
        -R_K * (lift + LOAD), rel=1e-12
    )
    # The acceleration jumps by the difference of the friction torques over the inertia.
    assert record.events["angular_acceleration_before"][0] == 0.0
    jump = (R_S - R_K) * (lift + LOAD) / 1.355
    assert record.events["angular_acceleration_after"][0] == pytest.approx(jump, rel=1e-12)


@pytest.mark.parametrize("backend", ["events", "rkf45"])
def test_a_jump_of_the_drive_separates_the_sides(backend: str) -> None:
    """Before the jump, the friction torque is within the limit for the force before it."""
    scenario = fs.load(SCENARIOS / "hard" / "jump_from_csv.toml", [], backend)
    record = fs.solve(scenario).record
    assert record.events["drive_force_before"][0] < 2000.0 < record.events["drive_force_after"][0]
    limit = R_S * record.events["shaft_reaction_before"]
    assert np.all(np.abs(record.events["friction_torque_before"]) <= limit)


@pytest.mark.parametrize("backend", ["events", "rkf45"])
def test_an_event_at_a_regular_sample_adds_no_sample(backend: str) -> None:
    """Beyond its limit at the start, the contact slides at once: there is no sticking side."""
    record = simulate(pulley(drive__force=3113.75, solver__backend=backend))
    (event,) = record.transitions
    assert event.time == 0.0
    assert (
        record.time.tolist()
        == simulate(
            pulley(drive__force=3113.75, solver__backend=backend, output__at_events=False)
        ).time.tolist()
    )
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
