"""What every lift must obey: energy, momentum, symmetry, limits that are met exactly."""

import tomllib
from functools import cache
from math import exp, hypot, pi
from typing import Any

import numpy as np
import pytest

from frictionsim.mechanisms import pulley
from frictionsim.scenario.validation import validate
from frictionsim.simulation.simulate import RunResult
from tests.support.drawn_lifts import FAMILIES, Scenario, numbers
from tests.support.lift_records import CONTACTS, SLACK, changes
from tests.support.scenarios import SCENARIOS, changed, simulate

LIFT: Scenario = tomllib.loads((SCENARIOS / "lift.toml").read_text())
SIDES = ("angular_velocity", "car_velocity", "counterweight_velocity")
LOSSES = ("friction", "damping", "cord_friction", "impact")


@cache
def lift() -> RunResult:
    return simulate(LIFT)


def masses(data: Scenario) -> tuple[float, float]:
    hanging = data["effects"]["hanging_masses"]
    half = hanging.get("rope", 0.0) / 2
    return hanging["car"] + half, hanging["counterweight"] + half


def clear(done: RunResult, distance: float) -> Any:
    """Return which samples are farther than so many seconds from events and knots of the drive."""
    (signal,) = done.scenario.drive.model_dump(exclude_none=True, exclude={"direction"}).values()
    cuts = np.array([0.0, *(e.time for e in done.transitions), *signal.get("time", [])])
    return np.min(np.abs(done.time[:, np.newaxis] - cuts), axis=1) > distance


DRAWN = [("thrown", 3), ("thrown", 14), ("pushed", 13), ("gripped", 7), ("gripped", 13)]


@pytest.mark.parametrize(("family", "seed"), DRAWN)
def test_energy_is_conserved_at_every_sample(family: str, seed: int) -> None:
    done = simulate(changed(FAMILIES[family](seed), output__interval=0.02))
    energy = {
        name.removeprefix("energy_"): channel
        for name, channel in done.channels.items()
        if name.startswith("energy_")
    }
    lost = np.sum([energy[name] for name in LOSSES if name in energy], axis=0)
    balance = energy["input"] - lost - energy["kinetic"] - energy["potential"]
    size = max(float(np.max(np.abs(channel))) for channel in energy.values())
    assert np.max(np.abs(balance - balance[0])) < 1e-9 * size
    for name in LOSSES:
        if name in energy:
            assert np.all(np.diff(energy[name]) >= 0.0), name


@pytest.mark.parametrize(("family", "seed"), [("thrown", 3), ("thrown", 14), ("pushed", 13)])
def test_kinetic_energy_is_that_of_three_bodies(family: str, seed: int) -> None:
    """Velocities are read from the channels, those of the counterweight from its position."""
    data = changed(FAMILIES[family](seed), output__interval=0.001)
    done, (m1, m2) = simulate(data), masses(data)
    channels = done.channels
    velocity = np.gradient(channels["counterweight_position"], done.time)
    expected = 0.5 * (
        data["mechanism"]["inertia"] * channels["angular_velocity"] ** 2
        + m1 * channels["car_velocity"] ** 2
        + m2 * velocity**2
    )
    size = float(np.max(expected))
    smooth = clear(done, 0.002)
    smooth[0] = smooth[-1] = False
    found = channels["energy_kinetic"][smooth]
    assert found == pytest.approx(expected[smooth], abs=1e-4 * size)


def shocks(done: RunResult) -> list[int]:
    """Return the numbers of the events at which the car's rope is taken up, and no other one."""
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
        {name: done.sides[f"{name}_{side}"] for name in done.channels if name in SIDES}
        for side in ("before", "after")
    )
    numbers_of_shocks = shocks(done)
    assert len(numbers_of_shocks) >= 1
    for i in numbers_of_shocks:
        jump = {name: after[name][i] - before[name][i] for name in before}
        pull = m1 * jump["car_velocity"]
        far = 0.0  # a slack rope has no part in it
        if done.sides["slack_before"][i] == 1:
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


@pytest.mark.parametrize(("family", "seed"), [("taut", 7), ("thrown", 7), ("gripped", 7)])
def test_exchanging_car_and_counterweight_mirrors_the_motion(family: str, seed: int) -> None:
    data = changed(FAMILIES[family](seed), mechanism__initial_angle_deg=0.0)
    mirrored = changed(data)
    hanging = mirrored["effects"]["hanging_masses"]
    hanging["car"], hanging["counterweight"] = hanging["counterweight"], hanging["car"]
    speed = data["mechanism"].get("initial_angular_velocity", 0.0)
    mirrored["mechanism"]["initial_angular_velocity"] = -speed
    mirrored["drive"]["torque"] = opposite(data["drive"]["torque"])
    one, other = simulate(data), simulate(mirrored)
    assert changes(one, "shaft")
    exchanged = {"car rope": "counterweight rope", "counterweight rope": "car rope"}
    for contact in CONTACTS:
        sign = 1 if "rope" in contact else -1
        found = changes(other, exchanged.get(contact, contact))
        assert [(sign * a, sign * b) for _, a, b, _ in found] == [
            (a, b) for _, a, b, _ in changes(one, contact)
        ]
        assert [t for t, *_ in found] == pytest.approx(
            [t for t, *_ in changes(one, contact)], abs=1e-9
        )
    size = float(np.max(np.abs(one.channels["angle"])))
    assert other.channels["angle"] == pytest.approx(-one.channels["angle"], abs=1e-9 * size)
    assert other.channels["counterweight_position"] == pytest.approx(
        one.channels["car_position"], abs=1e-9 * size
    )


def opposite(signal: Any) -> Any:
    """Return a signal times -1."""
    if "time" in signal:
        return signal | {"value": [-value for value in signal["value"]]}
    ((form, values),) = signal.items()
    turned = ("mean", "amplitude", "from", "to")
    return {form: {k: -v if k in turned else v for k, v in values.items()}}


def test_tensions_are_those_that_accelerate_the_car() -> None:
    """The acceleration is a difference of velocities, which is exact for a parabola."""
    done, (m1, m2) = lift(), masses(LIFT)
    velocity, time = done.channels["car_velocity"], done.time
    smooth = clear(done, 0.021)
    smooth[0] = smooth[-1] = False
    before, after = np.roll(smooth, -1), np.roll(smooth, 1)
    inner = smooth & before & after
    rate = np.zeros_like(velocity)
    rate[1:-1] = (velocity[2:] - velocity[:-2]) / (time[2:] - time[:-2])
    assert np.count_nonzero(inner) > 400
    assert np.ptp(rate[inner]) > 0.9  # m/s^2
    for name, mass, sign in (("car", m1, 1.0), ("counterweight", m2, -1.0)):
        tension = done.channels[f"rope_tension_{name}"][inner]
        assert tension == pytest.approx(mass * (9.81 + sign * rate[inner]), rel=1e-7), name


def test_slipping_ropes_have_the_ratio_of_eytelwein() -> None:
    done = lift()
    ratio = done.channels["rope_tension_counterweight"] / done.channels["rope_tension_car"]
    mode = done.channels["cord_mode"]
    assert set(np.unique(mode)) == {0, 1}
    assert ratio[mode == 1] == pytest.approx(exp(0.116 * pi), rel=1e-14)
    assert np.max(ratio[mode == 0]) <= exp(0.127 * pi) * (1 + 1e-12)
    assert np.max(ratio[mode == 0]) > 0.97 * exp(0.127 * pi)
    # Both bodies move as if there were no pulley.
    slip, r = done.channels["cord_slip"], LIFT["mechanism"]["cord_radius"]
    expected = done.channels["car_position"] - r * done.channels["angle"]
    assert slip == pytest.approx(expected, abs=1e-9)
    assert slip[-1] > 0.5


def test_a_cord_that_sticks_does_not_creep_by_a_bit() -> None:
    done, r = lift(), LIFT["mechanism"]["cord_radius"]
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


def test_statics_are_the_limits_at_rest() -> None:
    data = FAMILIES["taut"](16)
    for drive, size in zip(("force", "torque"), limits(data), strict=True):
        scenario = validate(changed(data, drive={drive: 0.9 * size}), SCENARIOS)
        assert pulley.statics(scenario)[f"{drive}_to_lift"].value == pytest.approx(size, rel=1e-12)


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


def test_a_sliding_shaft_has_the_torque_of_its_reaction() -> None:
    done, shaft = lift(), LIFT["effects"]["shaft_friction"]
    r_k = shaft["shaft_radius"] * shaft["mu_k"] / hypot(1.0, shaft["mu_k"])
    channels, mode = done.channels, done.channels["mode"]
    tensions = channels["rope_tension_car"] + channels["rope_tension_counterweight"]
    assert channels["shaft_reaction"] == pytest.approx(tensions, rel=1e-14)
    sliding = mode != 0
    expected = -mode[sliding] * r_k * tensions[sliding]
    assert channels["friction_torque"][sliding] == pytest.approx(expected, rel=1e-13)
