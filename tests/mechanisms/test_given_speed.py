"""Pulley, lift and shaft of prescribed speed: closed forms, independent programs, refusals."""

from math import exp, hypot, pi
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from tests.support import shaft_forces
from tests.support.cases import one_in
from tests.support.given_speed import Lift, Speed
from tests.support.scenarios import Scenario, changed, pulley, shipped, simulate, sound

R_K = 0.0254 * 0.1 / hypot(1.0, 0.1)  # m, of the shipped pulley
R_S = 0.0254 * 0.2 / hypot(1.0, 0.2)


def drum(speed: Any, **changes: Any) -> Scenario:
    """Return the shipped pulley at a given speed."""
    return pulley(drive={"speed": speed}, **changes)


def drawn(number: int) -> Scenario:
    """Return a lift of given speed; with a cord that may slip if the number is odd."""
    rng = np.random.default_rng(number)

    def size(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    r, car, duration = size(0.05, 0.5), size(2.0, 800.0), 2.0
    counterweight, inertia = car * size(0.7, 1.4), car * r * r * size(0.01, 10.0)
    rate = 9.81 / r * (size(0.1, 0.8) if number % 2 else size(0.5, 2.0))  # of acceleration
    hz, phase = size(0.4, 2.0), float(rng.uniform(-180.0, 180.0))
    wave = {"sine": {"amplitude": rate / (2.0 * pi * hz), "frequency_hz": hz, "phase_deg": phase}}
    values = np.cumsum([0.0, *rng.uniform(-0.5, 0.5, 4) * rate]).tolist()
    points = {"time": [0.0, 0.5, 1.0, 1.5, 2.0], "value": values}
    step = {
        "smooth_step": {"from": float(rng.normal()), "to": 0.3 * rate, "start": 0.3, "stop": 1.2}
    }
    speed = [wave, points, step, [float(rng.normal()), wave, points]][number // 2 % 4]
    effects: Scenario = {
        "hanging_masses": {
            "car": car,
            "counterweight": counterweight,
            "restitution": float(rng.choice([0.0, 0.3])),
            "capture_speed": 0.1,  # so that flights stay longer than the grid is wide
        }
    }
    if number % 3:
        mu = float(rng.uniform(0.1, 0.3))
        effects["shaft_friction"] = {"shaft_radius": 0.3 * r, "mu_s": 1.3 * mu, "mu_k": mu}
    if number % 5:
        effects["viscous_damping"] = {"coefficient": 0.1 * inertia}
    if number % 2:
        effects["cord_friction"] = {"mu_s": 0.25, "mu_k": 0.2}
    return {
        "kind": "pulley",
        "mechanism": {"cord_radius": r, "inertia": inertia},
        "drive": {"speed": speed},
        "effects": effects,
        "solver": {"duration": duration, "rtol": 1e-12, "atol": 1e-14},
        "output": {"interval": 0.0199},
    }


CLOSE = 1e-9  # of what is largest; the run has a relative tolerance of 1e-12 a step


def compare(data: Scenario) -> list[str]:
    """Compare a run with the independent program; return the contacts that have events."""
    done, lift = sound(data), Lift(data)
    for name, events in lift.events.items():
        seen = [e for e in done.transitions if e.contact == name]
        modes = {"cord": lambda m: m}.get(name, lambda m: int(m == 4))
        assert [(modes(e.mode_from), modes(e.mode_to)) for e in seen] == [e[1:] for e in events]
        assert [e.time for e in seen] == pytest.approx([e[0] for e in events], abs=CLOSE)
    c, times = done.channels, done.time.tolist()
    near = [t for each in lift.events.values() for t, *_ in each] + lift.speed.knots
    turns = np.abs(c["angular_velocity"]) < 1e-9  # where the friction changes its sign
    kept = [i for i, t in enumerate(times) if min(abs(t - x) for x in near) > 1e-7 and not turns[i]]
    wanted = {
        "angle": [lift.speed(times[i])[0] for i in kept],
        "angular_velocity": [lift.speed(times[i])[1] for i in kept],
        "rope_tension_car": [lift.tensions(times[i])[0] for i in kept],
        "rope_tension_counterweight": [lift.tensions(times[i])[1] for i in kept],
        "car_position": [lift.car_at(times[i])[0] for i in kept],
        "car_velocity": [lift.car_at(times[i])[1] for i in kept],
        "drive_torque": [lift.drive_torque(times[i]) for i in kept],
    }
    for name, values in wanted.items():
        largest = max(map(abs, values))
        assert c[name][kept] == pytest.approx(np.array(values), abs=CLOSE * largest), name
    heat, work = lift.works()
    scale = max(abs(work), heat, abs(float(c["energy_kinetic"].max())), lift.lost)
    if "energy_friction" in c:
        assert c["energy_friction"][-1] == pytest.approx(heat + lift.heat, abs=CLOSE * scale)
    if "energy_impact" in c:
        assert c["energy_impact"][-1] == pytest.approx(lift.lost, abs=CLOSE * scale)
    if not lift.lost:
        assert c["energy_input"][-1] == pytest.approx(work, abs=CLOSE * scale)
    return [name for name, events in lift.events.items() if events]


# Of the first and every 25th, two have impacts of ropes, and two a cord.
@pytest.mark.parametrize("number", one_in(25, [(2 + 37 * n) % 100 for n in range(100)]))
def test_a_drawn_lift_has_the_events_of_the_independent_program(number: int) -> None:
    compare(drawn(number))


def test_a_drum_at_constant_speed_takes_load_friction_and_damping() -> None:
    done = sound(drum(3.0))
    torque = 2224.1 * 0.0508 + R_K * 2224.1 + 1.355 * 3.0
    assert done.channels["drive_torque"] == pytest.approx(torque, rel=1e-14)  # roundings
    assert done.channels["energy_input"][-1] == pytest.approx(9.0 * torque, rel=1e-12)
    assert done.channels["angle"] == pytest.approx(3.0 * done.time, rel=1e-12)


def test_a_drum_is_raised_held_and_reversed() -> None:
    speed = {"time": [0.0, 1.0, 2.0, 2.5, 3.0], "value": [0.0, 4.0, 0.0, 0.0, -2.0]}
    done = sound(drum(speed, effects__viscous_damping=None, output__interval=0.1))
    weight, friction = 2224.1 * 0.0508, R_K * 2224.1
    torque = np.interp(done.time, [0.5, 0.95, 1.05, 1.95, 2.0, 2.45, 2.55], [
        1.355 * 4.0 + friction, 1.355 * 4.0 + friction, -1.355 * 4.0 + friction,
        -1.355 * 4.0 + friction, 0.0, 0.0, -1.355 * 4.0 - friction,
    ])  # fmt: skip
    sure = np.min(np.abs(done.time[:, None] - np.array([1.0, 2.0, 2.5])), axis=1) > 1e-6
    assert done.channels["drive_torque"][sure] == pytest.approx((weight + torque)[sure], rel=1e-13)
    assert [(e.contact, e.mode_from, e.mode_to) for e in done.transitions] == [
        ("shaft", 1, 0),
        ("shaft", 0, -1),
    ]
    assert [e.time for e in done.transitions] == pytest.approx([2.0, 2.5], abs=1e-15)
    (warning,) = [text for text in done.warnings if "undetermined" in text]
    limit = f"{R_S * 2224.1:.4g} N m"
    assert warning.startswith("drive.speed is 0 at 2 s: ")
    assert warning.endswith(limit)


def test_the_cord_of_a_held_drum_slips_by_the_capstan_equation() -> None:
    """The car of 1600 kg is too heavy for the ropes on a sheave that a brake holds."""
    held: Scenario = {"drive": {"speed": 0.0}, "effects__hanging_masses__car": 1600.0}
    done = sound(shipped("lift", **held, effects__shaft_friction=None, solver__duration=2.0))
    m1, m2, ratio = 1623.0, 1023.0, exp(-0.116 * pi)
    tension = 2.0 * m1 * m2 * 9.81 / (m2 + ratio * m1)
    fall = 9.81 - tension / m1
    c = done.channels
    assert c["rope_tension_car"] == pytest.approx(tension, rel=1e-14)
    assert c["drive_torque"] == pytest.approx(0.265 * tension * (1.0 - ratio), rel=1e-13)
    assert c["car_position"] == pytest.approx(-0.5 * fall * done.time**2, rel=1e-11)
    assert np.all(c["angle"] == 0.0)
    assert np.all(c["energy_input"] == 0.0)
    assert [(e.contact, e.mode_to) for e in done.transitions] == [("cord", -1)]


def test_a_brake_that_acts_fast_makes_the_cord_slip_until_the_car_rests() -> None:
    """From 1 m/s to rest in 0.1 s: the car slides on at g less the traction, and then is held."""
    speed = {"time": [0.0, 1.0, 1.1], "value": [1.0 / 0.265, 1.0 / 0.265, 0.0]}
    done = sound(shipped("lift", drive={"speed": speed}, solver__duration=6.0))
    m1, m2, ratio = 783.0, 1023.0, exp(0.116 * pi)
    slowing = 9.81 - 2.0 * m2 * 9.81 / (m2 + ratio * m1)
    events = [(e.contact, e.mode_from, e.mode_to) for e in done.transitions]
    assert events == [("cord", 0, 1), ("shaft", 1, 0), ("cord", 1, 0)]
    times = [e.time for e in done.transitions]
    assert times == pytest.approx([1.0, 1.1, 1.0 + 1.0 / slowing], abs=1e-9)
    travel = 1.0 + 0.5 / slowing
    assert done.channels["car_position"][-1] == pytest.approx(travel, rel=1e-9)


def of_all_loads(data: Scenario, done: Any) -> Any:
    """Return the moment of all loads, and the load of the shaft."""
    c = {name: done.channels[name] for name in ("angle", "angular_velocity")}
    c |= {"angular_acceleration": done.channels["angular_acceleration"], "time": done.time}
    forces = list(shaft_forces.acting(data, c).values())
    total = sum(force for _, force in forces)
    return sum(shaft_forces.moment(*each) for each in forces) + sum(
        shaft_forces.couples(data, c).values()
    ), abs(total)


@pytest.mark.parametrize("number", one_in(9, range(100)))
def test_a_drawn_shaft_takes_what_newton_and_euler_say(
    number: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng = np.random.default_rng(2000 + number)
    wave = {"amplitude": float(rng.normal() * 3.0), "frequency_hz": float(rng.uniform(0.3, 1.5))}
    speeds = [
        {"sine": wave},
        {"time": [0.0, 0.7, 1.5, 2.0], "value": rng.normal(size=4).tolist()},
        [float(rng.normal()), {"sine": wave}, {"sine": {"amplitude": 1.0, "frequency_hz": 1.7}}],
        0.0,
    ]
    data = shaft_forces.drawn_shaft(number) | {"drive": {"speed": speeds[number % 4]}}
    data["solver"] |= {"rtol": 1e-11, "atol": 1e-13}
    data["output"] = {"at_events": False}
    done = sound(data)
    monkeypatch.setattr(shaft_forces, "TIMES", done.time)
    others, load = of_all_loads(data, done)
    c = done.channels
    w, a = c["angular_velocity"], c["angular_acceleration"]
    r_k = 0.02 * 0.2 / hypot(1.0, 0.2)
    friction = -np.sign(w) * r_k * load
    torque = 2.0 * a - others - friction
    largest = float(np.max(np.abs(torque)))
    sure = np.abs(w) > 1e-9 if number % 4 else slice(0)
    assert c["drive_torque"][sure] == pytest.approx(torque[sure], abs=1e-12 * largest)
    assert c["shaft_reaction"] == pytest.approx(load, rel=1e-12)
    given = Speed(speeds[number % 4], 2.0)
    assert c["angle"] == pytest.approx([given(t)[0] for t in done.time.tolist()], abs=1e-9)
    assert w == pytest.approx([given(t)[1] for t in done.time.tolist()], abs=1e-13)


REFUSED = [
    ({"drive.speed": 1.0}, "drive: expected one of force, torque and speed; found force and speed"),
    (
        {"drive.force": None, "drive.direction": "horizontal", "drive.speed": 1.0},
        "drive.direction: it is the direction of force, and the drive is a speed; remove this key",
    ),
    (
        {"drive": {"speed": 1.0}, "mechanism.initial_angular_velocity": 1.0},
        "mechanism.initial_angular_velocity: the drive prescribes the speed; remove this key",
    ),
    (
        {"drive": {"speed": {"time": [0.0, 1.0, 1.0], "value": [0.0, 1.0, 2.0]}}},
        "drive.speed.time: times must increase from point to point, but point 3 at 1.0 s follows"
        " one at 1.0 s",
    ),
]


@pytest.mark.parametrize(("changes", "message"), REFUSED)
def test_what_does_not_go_with_a_given_speed_is_refused(changes: Any, message: str) -> None:
    with pytest.raises(fs.ScenarioError) as error:
        fs.load(pulley(), changes)
    assert message in str(error.value)


def test_a_body_of_given_speed_has_no_end_stops() -> None:
    data = {"kind": "shaft", "mechanism": {"inertia": 1.0}, "drive": {"speed": 1.0}}
    data |= {"effects": {"end_stops": {"highest_angle_deg": 9.0}}, "solver": {"duration": 1.0}}
    with pytest.raises(fs.ScenarioError, match="a body of given speed does not stop at one"):
        fs.load(data)


@pytest.mark.parametrize("backend", ["events", "rkf45", "dop853"])
def test_every_method_takes_a_given_speed(backend: str) -> None:
    wave = {"sine": {"amplitude": 3.0, "frequency_hz": 0.7}}
    done = sound(drum(wave, solver__backend=backend))
    same = simulate(drum(wave))
    assert np.array_equal(done.channels["drive_torque"], same.channels["drive_torque"])


def test_a_resumed_lift_of_given_speed_has_the_same_bits(tmp_path: Any) -> None:
    speed = {"time": [0.0, 1.0, 1.1], "value": [4.0, 4.0, 0.0]}
    data = shipped("lift", drive={"speed": speed}, solver__duration=4.0)
    whole = fs.solve(fs.load(data))
    steps = {"solver__max_steps": 25}
    stopped = fs.solve(fs.load(changed(data, **steps)))
    assert stopped.status != "done"
    stopped.save(tmp_path / "part.h5")
    resumed = fs.resume(tmp_path / "part.h5", max_steps=100_000)
    for name, values in whole.record.channels.items():
        assert np.array_equal(values, resumed.record.channels[name]), name


@pytest.mark.parametrize("seed", range(12))
def test_a_reversal_has_its_direction_where_friction_has_corners(seed: int) -> None:
    """A step ends at each corner; the one before the reversal may be as short as a rounding."""
    rng = np.random.default_rng(seed)
    up, down = rng.uniform(0.5, 5.0, 2)
    speed = {"time": [0.0, 1.0, 2.0], "value": [0.0, up, -down]}
    curve = [
        {"speed": [0.01, 0.03], "value": [0.1, 0.05]},
        {"stribeck": {"mu_c": 0.05, "speed": 0.01, "exponent": 1.0}},
    ][seed % 2]
    changes = {"effects__shaft_friction__mu_k": curve, "solver__duration": 2.0}
    load = {"effects__shaft_friction__normal_load": 50.0} if seed % 3 else {}
    result = fs.solve(drum(speed, **changes, **load))
    (event,) = result.transitions
    assert event.time == pytest.approx(1.0 + up / (up + down), abs=1e-12)
    assert (event.mode_from, event.mode_to) == (1, -1)
    assert not any("undetermined" in warning for warning in result.warnings)


@pytest.mark.parametrize("law", ["regularised", "published"])
@pytest.mark.parametrize(
    ("scenario", "effect"), [("pulley", "shaft_friction"), ("epicyclic", "hinge_friction")]
)
def test_other_laws_are_refused(scenario: str, effect: str, law: str) -> None:
    given = {"drive": {"speed": 1.0}, f"effects.{effect}.law": law}
    with pytest.raises(fs.ScenarioError, match=f"{effect}.law: '{law}'"):
        fs.load(scenario, given)
