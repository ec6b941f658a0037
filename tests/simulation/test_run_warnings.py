"""Warnings of runs whose results may mislead.

Each rule is evaluated here from the scenario and the recorded channels alone.
"""

import random
from math import pi
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.results import Record
from tests.support.problems import CORD_RADIUS, LOAD, R_S, cases
from tests.support.scenarios import SCENARIOS, Scenario, changed, pulley, shipped, simulate

SHORTER = "is longer than a tenth of the period of"
STICK_SLIP = "of the shortest time between two changes of a contact"
TURN = "is longer than a tenth of a turn"


def warnings_with(source: Any, words: str) -> list[str]:
    warnings = source if isinstance(source, list) else source.warnings
    return [warning for warning in warnings if words in warning]


def number_after(warning: str, words: str) -> float:
    return float(warning.partition(words)[2].split()[0].rstrip(",:;"))


def too_long_intervals(data: Scenario) -> list[str]:
    return warnings_with(fs.load(data, folder=SCENARIOS).warnings(), SHORTER)


# --- samples --------------------------------------------------------------------------------------


def table(*points: tuple[float, float]) -> dict[str, list[float]]:
    return {"time": [t for t, _ in points], "value": [2000.0 + v for _, v in points]}


@pytest.mark.parametrize(
    ("force", "period"),
    [
        ({"sine": {"mean": 2300.0, "amplitude": 300.0, "frequency_hz": 7.0}}, 1.0 / 7.0),
        (2300.0, None),
        (table((0.3, 0.0), (1.0, 500.0), (3.0, 600.0)), None),
        # A pulse, from the turn before it to the one behind it; twice the time between two turns.
        (table((0.5, 0.0), (1.0, 500.0), (1.5, 0.0)), 1.0),
        (table((0.0, 0.0), (1.0, 500.0), (1.4, 100.0), (2.5, 600.0)), 0.8),
        # Plateaus turn in their middles, at 1.25 s and 2.1 s; it falls and rises from 1.5 to 2.7 s.
        (
            table((0.5, 0.0), (1.0, 1.0), (1.5, 1.0), (2.0, 0.0), (2.2, 0.0), (2.7, 1.0)),
            1.2,
        ),
    ],
)
def test_warns_of_an_interval_too_long_for_the_signal(force: Any, period: float | None) -> None:
    data = pulley(drive__force=force, solver__duration=4.0, output__interval=4.0)
    warnings = too_long_intervals(data)
    assert bool(warnings) is (period is not None)
    if period is None:
        return
    assert number_after(warnings[0], "drive.force, ") == pytest.approx(period, rel=1e-5)
    better = number_after(warnings[0], "; give ")
    assert 0.09 * period < better <= 0.1 * period * (1.0 + 1e-9)
    for interval, count in ((0.11 * period, 1), (better, 0)):
        assert len(too_long_intervals(changed(data, output__interval=interval))) == count


@pytest.mark.parametrize(("seed", "backend"), [(0, "events"), (5, "events"), (1, "rkf45")])
def test_warns_of_an_interval_too_long_for_stick_slip(seed: int, backend: str) -> None:
    rng = random.Random(seed)
    hz = 10.0 ** rng.uniform(-0.3, 1.0)
    force = {"sine": {"mean": LOAD, "amplitude": rng.uniform(300.0, 900.0), "frequency_hz": hz}}
    data = pulley(drive__force=force, solver={"backend": backend, "duration": 4.0, "rtol": 1e-8})
    times = np.unique([e.time for e in simulate(data).transitions if e.mode_from != e.mode_to])
    gaps = np.diff(times)
    shortest = gaps[gaps > 1e-14].min()
    for share, due in ((0.09, False), (0.2, True)):
        record = simulate(changed(data, output__interval=share * shortest))
        warnings = warnings_with(record, STICK_SLIP)
        assert bool(warnings) is due
        if due:
            assert number_after(warnings[0], "contact, ") == pytest.approx(shortest, rel=1e-5)


def test_regularised_friction_gets_no_stick_slip_warning() -> None:
    data = pulley(
        drive__force={"sine": {"mean": LOAD, "amplitude": 900.0, "frequency_hz": 2.0}},
        effects__shaft_friction__law="regularised",
        solver={"backend": "radau", "duration": 1.0, "rtol": 1e-6},
    )
    record = simulate(data)
    assert len(record.transitions) > 4
    assert not warnings_with(record, STICK_SLIP)


def test_the_corners_of_a_given_speed_are_no_changes_of_stick_and_slip() -> None:
    record = simulate(
        {
            "kind": "pulley",
            "mechanism": {"cord_radius": 0.25, "inertia": 10.0},
            "drive": {"speed": {"time": [0, 1, 1.000001], "value": [0, 10, 0]}},
            "effects": {
                "hanging_masses": {"car": 800.0, "counterweight": 1000.0},
                "cord_friction": {"mu_s": 0.12, "mu_k": 0.12, "wrap_deg": 180.0},
            },
            "solver": {"duration": 5.0},
        }
    )
    assert {e.contact for e in record.transitions if e.mode_from != e.mode_to} == {"cord", "drive"}
    assert not warnings_with(record, STICK_SLIP)


WEIGHT = {"name": "w", "size": 10.0, "direction": [0.0, -1.0]}
ECCENTRIC = {"mass": 1.0, "radius": 0.05, "azimuth_deg": 30.0}
CONSTANT = {"name": "c", "size": -0.1}
OVER_ANGLE = {"angle_deg": [0.0, 90.0], "value": [0.1, -0.1]}
COAST = {
    "kind": "shaft",
    "mechanism": {"inertia": 0.02, "mass": 5.0, "initial_angular_velocity": 40.0},
    "effects": {"gravity": {}, "shaft_friction": {"shaft_radius": 0.02, "mu_s": 0.2, "mu_k": 0.15}},
    "solver": {"duration": 2.0, "rtol": 1e-6},
}


@pytest.mark.parametrize(
    ("change", "due"),
    [
        ({}, False),
        ({"effects__eccentric_mass": ECCENTRIC}, True),
        ({"effects__eccentric_mass": {"mass": 0.0, "radius": 0.05}}, False),
        ({"effects": {"eccentric_mass": ECCENTRIC}, "couples": [CONSTANT]}, True),
        ({"forces": [{**WEIGHT, "point": [0.05, 0.0]}]}, True),
        ({"forces": [{**WEIGHT, "point": [0.05, 0.0], "point_turns": False}]}, False),
        ({"forces": [{**WEIGHT, "point": [0.0, 0.0], "direction_turns": True}]}, True),
        ({"forces": [{**WEIGHT, "cord_radius": 0.05}]}, False),
        ({"couples": [{"name": "c", "size": OVER_ANGLE}]}, True),
        ({"couples": [{"name": "c", "size": {"time": [0.0, 1.0], "value": [0.0, 0.1]}}]}, False),
    ],
)
def test_warns_of_an_interval_too_long_for_loads_that_turn(
    change: dict[str, Any], due: bool
) -> None:
    data = changed(COAST, output__interval=0.02, **change)
    record = simulate(data)
    warnings = warnings_with(record, TURN)
    assert bool(warnings) is due
    if not due:
        return
    turn = 2.0 * pi / np.max(np.abs(record.channels["angular_velocity"]))
    assert warnings == [
        f"output.interval = 0.02 s {TURN}, which takes {turn:.3g} s at the largest speed: the"
        " samples do not resolve what depends on the angle; give 0.015 s or less"
    ]
    assert not warnings_with(simulate(changed(data, output__interval=0.015)), TURN)


GEAR = {
    "kind": "epicyclic",
    "mechanism": {"sun_radius": 0.12, "planet_radius": 0.03, "crank_mass": 0.5, "planet_mass": 0.3},
    "solver": {"duration": 5.0},
}


def turning(kind: str, speed: float) -> Scenario:
    """Return a mechanism that turns at a speed, of a belt the larger of its two pulleys."""
    if kind == "gear":
        return changed(GEAR, drive={"speed": speed})
    if kind == "machine":
        start = {"mechanism__initial_angular_velocity": speed}
        return shipped("marble_machine", solver__duration=0.5, **start)
    pulleys = [
        {"name": "a", "center": [0.0, 0.0], "radius": 0.05, "inertia": 1e-3},
        {"name": "b", "center": [0.4, 0.0], "radius": 0.02, "inertia": 1e-3},
    ]
    belt = {"bodies": 30, "mass_per_length": 0.1, "axial_rigidity": 1e4, "pretension": 300.0}
    return {
        "kind": "belt_drive",
        "mechanism": {"belt": belt, "pulleys": pulleys},
        "drive": {"a": {"speed": speed}},
        "effects": {
            "belt_friction": {"mu_s": 0.3, "mu_k": 0.3},
            "axial_damping": {"coefficient": 5.0},
        },
        "solver": {"duration": 0.1, "backend": "moreau"},
    }


# The smaller pulley turns faster, and overshoots by a third at the start.
@pytest.mark.parametrize(
    ("kind", "speed", "ratio"),
    [("gear", -40.0, 1.0), ("gear", 0.5, 1.0), ("machine", 60.0, 1.0), ("belt", -200.0, 2.5)],
)
def test_more_than_a_tenth_of_a_turn_between_samples_is_warned_of(
    kind: str, speed: float, ratio: float
) -> None:
    tenth = 0.1 * 2.0 * pi / abs(ratio * speed)
    for share, count in ((1.1, 1), (0.6, 0)):
        record = simulate(changed(turning(kind, speed), output__interval=share * tenth))
        assert len(warnings_with(record, TURN)) == count


def test_what_stays_within_a_tenth_of_a_turn_is_resolved() -> None:
    for speed, count in ((0.12, 0), (0.13, 1)):
        record = simulate(changed(turning("gear", speed), output__interval=5.0))
        assert len(warnings_with(record, TURN)) == count


# --- nothing moves --------------------------------------------------------------------------------


def test_the_ratio_to_the_static_limit_includes_peaks_between_samples() -> None:
    force = {"sine": {"mean": 2450.0, "amplitude": 257.7, "frequency_hz": 1.0}}
    record = simulate(pulley(drive__force=force, output__interval=1.0, output__at_events=False))
    (warning,) = warnings_with(record, "nothing moves")
    ratio = 100.0 * (2450.0 + 257.7 - LOAD) * CORD_RADIUS / (R_S * (2450.0 + 257.7 + LOAD))
    assert number_after(warning, "torque is ") == pytest.approx(ratio, rel=5e-6)  # six digits


# --- the marble machine and the gear --------------------------------------------------------------

MACHINE = changed(
    next(c["scenario"] for c in cases("marble_machine") if c["name"] == "constant_lift"),
    effects__shaft_friction={"shaft_radius": 0.003, "mu_s": 0.5, "mu_k": 0.4},
    effects__viscous_damping={"coefficient": 2e-4},
    solver={"duration": 1.5, "rtol": 1e-7},
    output={"interval": 0.01},
)


def needed(data: Scenario) -> float:
    """Return the torque that lifts in every position of the gear, N m."""
    return float(fs.static(data)["torque_to_lift_worst"].value or 0.0)


def machine(share: float, start: float = 0.0, **changes: Any) -> tuple[Record, float]:
    """Return the run of a machine with a share of the least torque that lifts, and this torque."""
    data = changed(MACHINE, mechanism__initial_angular_velocity=start, **changes)
    least = needed(data)
    return simulate(changed(data, drive={"torque": share * least})), least


@pytest.mark.parametrize(("share", "start"), [(0.9, 2.0), (0.999, 0.0), (1.001, 0.0), (1.3, 3.0)])
def test_warns_of_a_torque_that_does_not_lift_everywhere(share: float, start: float) -> None:
    record, least = machine(share, start)
    weak = warnings_with(record, "not above")
    assert bool(weak) is (share <= 1.0)
    if weak:
        assert number_after(weak[0], "is ") == pytest.approx(share * least, rel=1e-4)
        assert number_after(weak[0], "above the ") == pytest.approx(least, rel=1e-5)


def test_warns_of_marbles_that_are_carried_back() -> None:
    smooth = {"effects__shaft_friction__mu_s": 0.05, "effects__shaft_friction__mu_k": 0.05}
    record, _ = machine(0.3, 3.0, **smooth)
    (back,) = warnings_with(record, "ran back")
    angle, pitch = record.channels["angle"], 2.0 * pi / MACHINE["mechanism"]["slots"]
    assert number_after(back, "N m: it carried ") == np.floor(angle[0] / pitch) - np.floor(
        angle[-1] / pitch
    )


def test_warns_of_a_machine_that_stalls() -> None:
    record, _ = machine(0.85, 2.0)
    (still,) = warnings_with(record, "stands still")
    rests = [e.time for e in record.transitions if e.mode_to == 0 and e.mode_from != 0]
    assert record.channels["mode"][-1] == 0
    assert number_after(still, "still from ") == pytest.approx(rests[-1], rel=1e-5)


def test_warns_if_a_machine_does_not_move() -> None:
    """Half a pitch from a transfer, where the load is largest, at 99.9 % of the torque to lift."""
    half = {"mechanism__initial_angle_deg": 180.0 / MACHINE["mechanism"]["slots"]}
    record, _ = machine(0.999, **half)
    (warning,) = warnings_with(record, "nothing moves")
    radius = 0.003 * 0.5 / (1.0 + 0.25) ** 0.5
    held = np.abs(record.channels["friction_torque"]) / (radius * record.channels["shaft_reaction"])
    assert number_after(warning, "torque is ") == pytest.approx(
        100.0 * held.max(), rel=5e-6
    )  # six digits
    assert not warnings_with(record, "stands still")


@pytest.mark.parametrize(("last", "expected"), [(0.0, False), (0.0025, True)])
def test_a_machine_without_torque_does_not_stall(last: float, expected: bool) -> None:
    """On a rough shaft, where the marbles cannot turn it back."""
    data = changed(
        MACHINE,
        drive={"torque": {"time": [0.3, 0.4], "value": [0.01, last]}},
        effects__shaft_friction={"shaft_radius": 0.012, "mu_s": 0.9, "mu_k": 0.8},
        solver__duration=3.0,
    )
    record = simulate(data)
    assert record.channels["angle"][-1] > record.channels["angle"][0]
    assert record.channels["mode"][-1] == 0
    assert bool(warnings_with(record, "stands still")) is expected


@pytest.mark.parametrize("torque", [-4.0, 1.5])
@pytest.mark.parametrize("start", [-90.0, 60.0])
def test_warns_of_a_crank_that_runs_against_its_torque(torque: float, start: float) -> None:
    data = shipped(
        "epicyclic",
        drive={"torque": torque},
        mechanism__initial_angle_deg=start,
        mechanism__initial_angular_velocity=None,
        solver={"duration": 0.5},
    )
    record = simulate(data)
    angle = record.channels["angle"]
    back = warnings_with(record, "the crank ran back")
    assert bool(back) is bool(torque * (angle[-1] - angle[0]) < 0.0)
    if back:
        way = number_after(back[0], "back by ")
        assert way == pytest.approx(abs(angle[-1] - angle[0]), rel=1e-5)
