"""The pulley with hanging masses against an independent program, and what every lift must obey.

`lift_reference` has the motion in closed form with 50 digits; `lift_energies` shows that it obeys
Newton, Euler, Coulomb and Eytelwein. Impacts are summed from small pulls in `test_rope_impact`.
"""

import tomllib
from functools import cache
from math import hypot
from typing import Any

import numpy as np
import pytest

from frictionsim.results import Record
from tests.support.cases import one_in
from tests.support.drawn_lifts import FAMILIES, Scenario, numbers
from tests.support.lift_energies import energies, largest_violation
from tests.support.lift_reference import Solution, solve
from tests.support.lifts import CONTACTS, SLACK, changes
from tests.support.scenarios import SCENARIOS, changed, simulate

# Draws in which something happens. In `pushed` 16 a rope is slack for 13 ms and by 0.5 mm/s. In
# `loose` shaft and cord could each be the one to slip: the one does whose limit is exceeded.
SEEDS = {
    "taut": (1, 2, 4, 5, 7, 9, 10, 13, 15, 16, 18, 19),
    "thrown": (1, 2, 3, 4, 5, 6, 8, 9, 10, 13, 14, 15, 18, 19, 22),
    "pushed": (2, 4, 5, 7, 10, 13, 16, 17, 19),
    "gripped": (1, 3, 4, 5, 7, 9, 10, 13, 16, 18, 19, 22),
    "massless": (0, 1, 2, 5, 10),
    "light": (1, 2, 3, 4, 5, 9),
    "heavy": (1, 2, 10),
    "loose": (201, 433, 637, 715),
    "jammed": (3, 10, 13),
}
DRAWN = [(family, seed) for family, seeds in SEEDS.items() for seed in seeds]
# Those that are compared every time: some of each family, and such as have every transition.
OFTEN = sorted({*DRAWN[1::3], ("gripped", 5), ("gripped", 10), ("jammed", 3), ("jammed", 13),
                ("light", 2), ("loose", 637), ("pushed", 5), ("thrown", 5)})  # fmt: skip
ALL = [pytest.param(*d, marks=[] if d in OFTEN else pytest.mark.slow) for d in DRAWN]
TIME, ANGLE = 1e-9, 1e-8  # s and rad, at rtol 1e-11


@cache
def reference(family: str, seed: int) -> Solution:
    return solve(FAMILIES[family](seed))


@cache
def outcome(family: str, seed: int) -> Record:
    return simulate(FAMILIES[family](seed))


@pytest.mark.slow
def test_the_draws_have_every_transition() -> None:
    """No contact without each of its changes, no drive signal and no law of impact left out."""
    seen = {
        (contact, before, after)
        for drawn in OFTEN
        for _, contact, before, after, _ in reference(*drawn).events
    }
    shaft = {("shaft", a, b) for a in (-1, 0, 1) for b in (-1, 0, 1) if a != b}
    cord = {("cord", a, b) for a in (-1, 0, 1) for b in (-1, 0, 1) if 0 in (a, b) and a != b}
    ropes = {(f"{side} rope", a, 1 - a) for side in ("car", "counterweight") for a in (0, 1)}
    assert seen >= shaft | cord | ropes
    modes = {piece.modes for drawn in OFTEN for piece in reference(*drawn).pieces}
    assert {(m.shaft, m.cord) for m in modes if m.taut == (True, True)} == {
        (shaft, cord) for shaft in (-1, 0, 1) for cord in (-1, 0, 1)
    }
    assert {m.taut for m in modes} == {(a, b) for a in (True, False) for b in (True, False)}
    assert sum(len(reference(*drawn).events) for drawn in OFTEN) > 100


@pytest.mark.parametrize(("family", "seed"), one_in(6, OFTEN))
def test_the_reference_obeys_the_laws(family: str, seed: int) -> None:
    violations = largest_violation(reference(family, seed))
    assert max(violations.values()) < 1e-22


@pytest.mark.parametrize(("family", "seed"), ALL)
def test_events_of_a_drawn_lift_are_those_of_the_reference(family: str, seed: int) -> None:
    done, exact = outcome(family, seed), reference(family, seed)
    assert (done.status, done.reason) == ("done", "")
    for contact in CONTACTS:
        expected, actual = exact.of(contact), changes(done, contact)
        assert [change[1:3] for change in actual] == [change[1:3] for change in expected]
        for (time, *_, angle), (at, *_, where) in zip(actual, expected, strict=True):
            assert time == pytest.approx(at, abs=TIME)
            assert angle == pytest.approx(where, abs=ANGLE)


@pytest.mark.parametrize(("family", "seed"), ALL)
def test_samples_of_a_drawn_lift_are_those_of_the_reference(family: str, seed: int) -> None:
    done, exact = outcome(family, seed), reference(family, seed)
    r = float(exact.lift.r)
    weight = float((exact.lift.m1 + exact.lift.m2) * exact.lift.g)
    events = np.array([0.0, *(float(piece.end) for piece in exact.pieces)])
    for i, t in enumerate(done.time):
        if np.min(np.abs(events - t)) < 1e-6:  # either side of a change
            continue
        piece, u = exact.at(t)
        w = float(piece.w(u))
        speed = max(1.0, abs(w))
        near = {"angle": (piece.angle, ANGLE), "angular_velocity": (piece.w, ANGLE * speed)}
        near |= {
            "car_position": (piece.x1, ANGLE * r),
            "car_velocity": (piece.v1, ANGLE * r * speed),
        }
        near["counterweight_position"] = piece.x2, ANGLE * r
        near["counterweight_velocity"] = piece.v2, ANGLE * r * speed
        near["rope_tension_car"] = piece.t1, 1e-7 * weight
        near["rope_tension_counterweight"] = piece.t2, 1e-7 * weight
        for name, (curve, tolerance) in near.items():
            assert done.channels[name][i] == pytest.approx(float(curve(u)), abs=tolerance), name


@pytest.mark.parametrize(("family", "seed"), ALL)
def test_energies_of_a_drawn_lift_are_those_of_the_reference(family: str, seed: int) -> None:
    done, exact = outcome(family, seed), energies(reference(family, seed))
    size = max(map(abs, exact.values()), default=0.0)
    for name, expected in exact.items():
        energy: Any = done.channels.get(name, [0.0])
        # Potential energy counts from the angle zero.
        first = energy[0] if name == "energy_potential" else 0.0
        assert energy[-1] - first == pytest.approx(expected, abs=1e-8 * size), name


@pytest.mark.parametrize(
    ("family", "seed"),
    one_in(2, [("taut", 7), ("thrown", 3), ("pushed", 13), ("gripped", 13), ("loose", 433)]),
)
def test_quantities_of_a_drawn_lift_are_those_of_the_reference(family: str, seed: int) -> None:
    done = simulate(changed(FAMILIES[family](seed), output__interval=0.001, solver__rtol=1e-8))
    exact, tension, acceleration, slip = reference(family, seed), {}, 0.0, 0.0
    for piece in exact.pieces:
        u = np.linspace(0.0, float(piece.end - piece.start), 400)
        for name, curve in (("car", piece.t1), ("counterweight", piece.t2)):
            seen = tension.setdefault(name, [])
            seen += [float(np.max(curve.floats(u))), float(np.min(curve.floats(u)))]
        acceleration = max(acceleration, float(np.max(np.abs(piece.v1.slope().floats(u)))))
        turned = float(exact.lift.r) * (piece.angle.floats(u) - float(exact.first_angle))
        slip = max(slip, float(np.max(np.abs(piece.x1.floats(u) - turned))))
    last = exact.pieces[-1]
    expected = {
        f"rope_tension_{name}_{which.__name__}": which(values)
        for name, values in tension.items()
        for which in (max, min)
    }
    expected |= {"car_acceleration_max": acceleration}
    expected |= {"car_travel": float(last.x1(last.end - last.start))}
    if family in ("gripped", "loose"):
        first = min((t for t, before, *_ in exact.of("cord") if before == 0), default=None)
        expected |= {"cord_slip_max": slip, "cord_slip_time": first}
    else:
        slack = [*exact.of("car rope"), *exact.of("counterweight rope")]
        expected["slack_time"] = min((t for t, _, after, _ in slack if after == 1), default=None)
    weight = float((exact.lift.m1 + exact.lift.m2) * exact.lift.g)
    for name, value in expected.items():
        # At a knot of the drive, between two samples, tension and acceleration may be higher.
        size = weight if "tension" in name else 9.81 if "acceleration" in name else 1e-3
        assert done.quantities[name].value == pytest.approx(value, abs=2e-4 * size), name


# --- what every lift must obey

LIFT: Scenario = tomllib.loads((SCENARIOS / "lift.toml").read_text(encoding="utf-8"))
SIDES = ("angular_velocity", "car_velocity", "counterweight_velocity")


def masses(data: Scenario) -> tuple[float, float]:
    hanging = data["effects"]["hanging_masses"]
    half = hanging.get("rope", 0.0) / 2
    return hanging["car"] + half, hanging["counterweight"] + half


def shocks(done: Record) -> list[int]:
    """Return the numbers of the events at which only the car's rope becomes taut."""
    return [
        i
        for i, event in enumerate(done.transitions)
        if (event.contact, event.mode_from) == ("car_rope", SLACK)
    ]


@pytest.mark.parametrize("seed", [8, 14, 22])
def test_a_shock_obeys_euler_with_the_friction_of_its_own_reaction(seed: int) -> None:
    """I dw = r (J2 - J1) - s r_k (J1 + J2), of the impulses of both ropes on their bodies."""
    data = FAMILIES["thrown"](seed)
    done, (m1, m2), r = simulate(data), masses(data), data["mechanism"]["cord_radius"]
    e, shaft = data["effects"]["hanging_masses"]["restitution"], data["effects"]["shaft_friction"]
    r_k = shaft["shaft_radius"] * shaft["mu_k"] / hypot(1.0, shaft["mu_k"])
    before, after = (
        {name: done.events[f"{name}_{side}"] for name in done.channels if name in SIDES}
        for side in ("before", "after")
    )
    numbers_of_shocks = shocks(done)
    assert len(numbers_of_shocks) >= 1
    for i in numbers_of_shocks:
        jump = {name: after[name][i] - before[name][i] for name in before}
        pull = m1 * jump["car_velocity"]
        far = 0.0  # a slack rope has no part in it
        if done.events["slack_before"][i] == 1:
            far = m2 * jump["counterweight_velocity"]
        else:
            assert jump["counterweight_velocity"] == pytest.approx(0.0, abs=1e-12)
        friction = data["mechanism"]["inertia"] * jump["angular_velocity"] - r * (far - pull)
        limit = r_k * (pull + far)
        w, then = before["angular_velocity"][i], after["angular_velocity"][i]
        rate, end = (
            state["car_velocity"][i] - r * state["angular_velocity"][i] for state in (before, after)
        )
        if w <= 0.0:  # in the direction of the pull
            assert friction == pytest.approx(limit, rel=1e-8)
        elif then >= 0.0:
            assert friction == pytest.approx(-limit, rel=1e-8)
        else:
            assert abs(friction) < limit
        slow = -rate < data["effects"]["hanging_masses"]["capture_speed"]
        if slow or w <= 0.0 or then >= 0.0:
            size = abs(before["car_velocity"][i]) + abs(rate)
            assert end == pytest.approx(0.0 if slow else -e * rate, abs=1e-10 * size)
        else:
            assert 0.0 <= end <= -e * rate


def test_a_cord_that_sticks_does_not_creep_by_a_bit() -> None:
    done, r = simulate(LIFT), LIFT["mechanism"]["cord_radius"]
    (start, *_), (stop, *_) = changes(done, "cord")
    before, after = done.time < start, done.time > stop
    assert np.unique(done.channels["cord_slip"][before]).tolist() == [0.0]
    assert np.unique(done.channels["cord_slip"][after]).size == 1
    assert np.array_equal(
        done.channels["car_velocity"][before], r * done.channels["angular_velocity"][before]
    )
    resting = (done.channels["mode"] == 0) & (done.channels["cord_mode"] == 0) & (done.time > 10.0)
    assert np.count_nonzero(resting) > 20
    for name in ("angle", "angular_velocity", "car_position", "counterweight_position"):
        assert np.unique(done.channels[name][resting]).size == 1, name


def limits(data: Scenario) -> tuple[float, float]:
    """Return the force and the torque of impending motion with the car upwards, at rest."""
    first, second, r, r_s = numbers(data)
    # (P + W2 - W1) r = r_s (P + W1 + W2), and tau = (W1 - W2) r + r_s (W1 + W2)
    force = (first * (r + r_s) - second * (r - r_s)) / (r - r_s)
    return force, (first - second) * r + r_s * (first + second)


@pytest.mark.parametrize(("factor", "moves"), [(1.0, False), (1 - 1e-9, False), (1 + 1e-9, True)])
@pytest.mark.parametrize("drive", ["force", "torque"])
def test_breakaway_with_hanging_masses_is_sharp(drive: str, factor: float, moves: bool) -> None:
    data = changed(FAMILIES["taut"](16), solver__duration=1.0)
    value = limits(data)[("force", "torque").index(drive)]
    data["drive"] = {drive: {"time": [0.0, 0.5], "value": [0.9 * value, factor * value]}}
    done = simulate(data)
    assert [change[1:3] for change in changes(done, "shaft")] == ([(0, 1)] if moves else [])
    assert bool(np.ptp(done.channels["angle"])) is moves


def test_breakaway_is_where_static_friction_ends() -> None:
    """The time does not depend on inertia, kinetic friction and damping."""
    data = changed(FAMILIES["taut"](16), solver__duration=0.8, mechanism__inertia=3.0)
    shaft = data["effects"]["shaft_friction"]
    force, _ = limits(data)
    data["drive"] = {"force": {"time": [0.0, 1.0], "value": [0.8 * force, 1.2 * force]}}
    for inertia, share in ((1e-3, 1.0), (1e3, 0.3)):
        shaft["mu_k"] = share * shaft["mu_s"]
        data["mechanism"]["inertia"] = inertia
        (first, *_) = changes(simulate(data), "shaft")
        assert first[:3] == (pytest.approx(0.5, abs=1e-11), 0, 1)
