"""Bodies on a shaft: what locks them, long rests, loads near zero and narrow tables."""

from math import atan, degrees, exp, hypot, log, log1p, pi, radians, sin, sqrt
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.results import failures
from tests.support.scenarios import Scenario, changed, simulate
from tests.support.shaft_scenarios import shaft_scenario

# --- what locks a body


def force(**keys: Any) -> dict[str, Any]:
    table = {"size": 10.0, "direction": [0.0, -1.0], "point": [0.1, 0.0], **keys}
    return {key: value for key, value in table.items() if value is not None}


def rough(**keys: Any) -> Scenario:
    """Return a body under a force on a shaft whose friction radius is 0.6 of its radius."""
    return changed(shaft_scenario([force(**keys)], []), effects__shaft_friction__mu_s=0.75)


def fault(data: Scenario) -> str:
    """Return the fault of a scenario, which must be the only one."""
    with pytest.raises(fs.ScenarioError) as failure:
        fs.load(data)
    (line,) = failure.value.faults
    return line.removeprefix("scenario: ")


@pytest.mark.parametrize(
    ("keys", "arm"),
    [
        ({"point": [0.0, 0.012], "direction": [-1.0, 0.0]}, 0.012),
        ({"point": None, "cord_radius": -0.01}, 0.01),
        ({"point": [0.5, 0.01], "direction": [-1.0, 0.0], "direction_turns": True}, 0.01),
    ],
)
def test_a_force_within_the_friction_circle_locks_the_body(
    keys: dict[str, Any], arm: float
) -> None:
    data = rough(**keys)
    assert f"friction radius of 0.012 m, not below the arm of the only force, {arm} m" in fault(
        data
    )
    # With the least less friction it moves, though it still acts within the shaft.
    mu = arm / (0.02**2 - arm**2) ** 0.5
    data["effects"]["shaft_friction"]["mu_s"] = mu * (1.0 - 1e-9)
    assert abs(fs.static(data)["breakaway_direction"].value) == 1.0
    data["solver"]["duration"] = 1e-3
    assert simulate(data).warnings[0] == (
        "effects.shaft_friction.shaft_radius = 0.02 m is not below the largest arm of the forces,"
        f" {arm} m; the friction radius is {arm} m"
    )


@pytest.mark.parametrize(
    "change",
    [
        {"effects__torsion_spring": {"stiffness": 1.0}},
        {"mechanism__initial_angular_velocity": 2.0},
        {"couples": [{"name": "motor", "size": 1.0}]},
        {"forces": [{"name": "bearing", **force(point=[0.0, 0.0])}]},
        {"forces": [{"name": n, **force(point=[x, 0.0], direction=[0.0, x])}
                    for n, x in (("one", 0.01), ("two", -0.01))]},
        {"statics": {"unknown": "effects.shaft_friction.shaft_radius"}},
        {"statics": {"unknown": "effects.shaft_friction.mu_s"}},
        {"statics": {"unknown": "forces.f0.distance"}},
    ],
)  # fmt: skip
def test_a_thick_shaft_is_right_if_the_body_may_move(change: dict[str, Any]) -> None:
    """Or is meant to rest: a force through the axis has no arm at all."""
    assert fs.load(changed(rough(point=[0.01, 0.0]), **change))


def test_a_size_that_is_unknown_locks_and_a_radius_does_not() -> None:
    data = rough(point=None, cord_radius=-0.01)
    assert fs.load(data | {"statics": {"unknown": "forces.f0.cord_radius"}})
    data["statics"] = {"unknown": "forces.f0.size"}
    assert fault(data).endswith("make the shaft thinner or the arm longer")


# --- sums and sizes


@pytest.mark.parametrize(("size", "friction"), [(1e-310, True), (5e-324, False)])
def test_a_size_of_which_no_digits_are_left_is_none(size: float, friction: bool) -> None:
    """A number below the smallest normal one has few digits, and its products fewer."""
    for one in (size, {"time": [0.0, 1.0], "value": [0.0, size]}):
        data = changed(shaft_scenario([force(size=one)], []), solver__rtol=1e-6)
        if not friction:
            del data["effects"]["shaft_friction"]
        result = simulate(data)
        assert result.status == "done"
        assert abs(result.channels["angle"][-1]) < 1e-300


# --- rest


def loaded(couple: Any, forces: list[Scenario], **solver: Any) -> Scenario:
    """Return a body on a dry shaft; a pinned load of 100 N gives a static limit of 1.2 N m."""
    pinned = {"name": "load", "size": 100.0, "direction": [0.0, -1.0], "point": [0.0, 0.0]}
    return {
        "kind": "shaft",
        "mechanism": {"inertia": 0.05},
        "forces": [pinned, *forces],
        "couples": [{"name": "drive", "size": couple}],
        "effects": {"shaft_friction": {"shaft_radius": 0.02, "mu_s": 0.75, "mu_k": 0.5}},
        "solver": {"duration": 1.0, **solver},
        "output": {"interval": 0.5},
    }


@pytest.mark.parametrize("backend", ["events", "rkf45"])
def test_a_rest_costs_no_more_with_many_periods(backend: str) -> None:
    """Five thousand periods, each up to 99 % of the limit, of which none can move it."""
    wave = {"sine": {"amplitude": 1.19, "frequency_hz": 1000.0, "phase_deg": 50.0}}
    data = loaded(wave, [], duration=5.0, backend=backend)
    data["output"]["interval"] = 2.5
    record = simulate(data)
    assert record.status == "done"
    assert record.transitions == []
    assert record.statistics is not None
    assert record.statistics.rhs_evaluations < 100


# --- a load that passes zero, or close to it, on a shaft with an eccentric mass

R_K = 0.02 * sin(atan(0.5))


def test_a_rotor_that_nothing_but_its_eccentric_mass_loads_coasts_down() -> None:
    """Without gravity, I w' = -r_k R with R^2 = (m e w')^2 + (m e w^2)^2: w' = -beta w^2."""
    mass, radius, start, duration = 3.0, 0.1, 30.0, 20.0
    p, inertia = mass * radius, 0.5 + mass * radius**2
    friction = {"shaft_radius": 0.02, "mu_s": 0.75, "mu_k": 0.5}
    data = {
        "kind": "shaft",
        "mechanism": {"inertia": 0.5, "initial_angular_velocity": start},
        "effects": {
            "eccentric_mass": {"mass": mass, "radius": radius},
            "shaft_friction": friction,
        },
        "solver": {"duration": duration, "rtol": 1e-11},
        "output": {"interval": 0.01},
    }
    run = simulate(data)
    beta = R_K * p / (inertia**2 - (R_K * p) ** 2) ** 0.5
    final = {name: float(run.channels[name][-1]) for name in ("angle", "angular_velocity")}
    assert final["angular_velocity"] == pytest.approx(start / (1 + beta * start * duration), 1e-10)
    assert final["angle"] == pytest.approx(log1p(beta * start * duration) / beta, rel=1e-10)
    speed, rate = run.channels["angular_velocity"], run.channels["angular_acceleration"]
    assert run.channels["shaft_reaction"] == pytest.approx(p * np.hypot(speed**2, rate), rel=1e-12)
    # Its static limit has no load: the check of the law goes by the kinetic one.
    assert failures(run.checks) == ""


PRESSED = {"shaft_radius": 0.02, "mu_s": 0.75, "mu_k": 0.75, "normal_load": 100.0}


@pytest.mark.parametrize(
    ("effects", "angle", "speed"),
    [
        ({"viscous_damping": {"coefficient": 0.0}}, 16.0, 8.0),
        (
            {"viscous_damping": {"coefficient": 0.3}},
            8.0 * 0.5 / 0.3 * (1.0 - exp(-1.2)),
            8.0 * exp(-1.2),
        ),
        # Of a friction radius of 12 mm, 1.2 N m; it brakes to 3.2 rad/s.
        ({"shaft_friction": PRESSED}, 11.2, 3.2),
        ({"shaft_friction": {**PRESSED, "normal_load": 250.0}}, 0.5 * 0.5 * 64.0 / 3.0, 0.0),
        # Back with half of the speed from 8 rad at 1 s.
        ({"end_stops": {"highest_angle_deg": degrees(8.0), "restitution": 0.5}}, 4.0, -4.0),
    ],
)
def test_a_body_that_one_effect_brakes_needs_no_force(
    effects: dict[str, Any], angle: float, speed: float
) -> None:
    """Of 0.5 kg m^2 at 8 rad/s, after 2 s."""
    data = {
        "kind": "shaft",
        "mechanism": {"inertia": 0.5, "initial_angular_velocity": 8.0},
        "effects": effects,
        "solver": {"duration": 2.0, "rtol": 1e-11},
    }
    channels = simulate(data).channels
    assert channels["angle"][-1] == pytest.approx(angle, rel=1e-10)
    assert channels["angular_velocity"][-1] == pytest.approx(speed, rel=1e-10)


def test_steps_end_where_a_force_through_the_axis_passes_zero() -> None:
    inertia, amplitude, hz, turns = 0.02, 60.0, 3.0, 9
    axial = force(size={"sine": {"amplitude": amplitude, "frequency_hz": hz}}, point=[0.0, 0.0])
    data = {
        "kind": "shaft",
        "mechanism": {"inertia": inertia, "initial_angular_velocity": 40.0},
        "forces": [{"name": "axial", **axial}],
        "effects": {"shaft_friction": {"shaft_radius": 0.02, "mu_s": 0.3, "mu_k": 0.25}},
        "solver": {"duration": turns / hz, "rtol": 1e-8, "atol": 1e-11},
    }
    # I dw/dt = -r_k |P|: a half wave of T takes 2 r_k P/(I Omega) from the speed.
    radius, halves, half = 0.02 * 0.25 / hypot(1.0, 0.25), 2 * turns, 0.5 / hz
    lost = radius * amplitude / (inertia * 2.0 * pi * hz)
    angle = halves * half * 40.0 - lost * half * halves**2
    # 5e-9 here; stepping over the corners of |P| makes it 5e-7.
    assert simulate(data).channels["angle"][-1] == pytest.approx(angle, rel=5e-8)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_steps_end_at_both_corners_of_a_couple_over_angle(way: float) -> None:
    """A couple that grows from -3 to 3 N m within a radian of 0, and stays so, has a potential."""
    inertia, start, speed, corner = 0.5, -3.0 * way, 8.0 * way, degrees(1.0)
    data = {
        "kind": "shaft",
        "mechanism": {
            "inertia": inertia,
            "initial_angle_deg": degrees(start),
            "initial_angular_velocity": speed,
        },
        "couples": [{"name": "c", "size": {"angle_deg": [-corner, corner], "value": [-3.0, 3.0]}}],
        "solver": {"duration": 1.2, "rtol": 1e-6, "atol": 1e-12},
    }
    channels = simulate(data).channels

    def energy(q: float, w: float) -> float:
        return 0.5 * inertia * w**2 - 3.0 * (abs(q) - 0.5 if abs(q) > 1.0 else 0.5 * q**2)

    end = channels["angle"][-1], channels["angular_velocity"][-1]
    assert end[0] * way > 1.0  # beyond both corners
    # 4e-9 here; stepping over one of the corners makes it 7e-6.
    assert energy(*end) == pytest.approx(energy(start, speed), rel=5e-8)


def test_a_load_that_passes_close_to_zero() -> None:
    """The force through the axis of a body that coasts changes its sign, the load nearly.

    The angle is of steps of DOP853 at 1e-12 that end close to the reversals of the force.
    """
    wave = {"amplitude": 100.0, "frequency_hz": 7.0, "phase_deg": 50.0}
    load = {"name": "load", "size": {"sine": wave}, "direction": [0.0, -1.0], "point": [0.0, 0.0]}
    data = {
        "kind": "shaft",
        "mechanism": {"inertia": 0.05, "initial_angular_velocity": 20.0},
        "forces": [load],
        "effects": {
            "shaft_friction": {"shaft_radius": 0.02, "mu_s": 0.75, "mu_k": 0.5},
            "eccentric_mass": {"mass": 1e-3, "radius": 1e-3},
        },
        "solver": {"duration": 1.0, "rtol": 1e-11},
    }
    angle = simulate(data).channels["angle"][-1]
    assert angle == pytest.approx(14.225228621686, abs=5e-10, rel=0.0)


# --- tables over speed and angle whose features are narrower than a step

NOTCH, DRIVE, DEPTH = 5.0, 10.0, 9.0


def body(size: Any, backend: str, rtol: float, **effects: Any) -> Scenario:
    return {
        "kind": "shaft",
        "mechanism": {"inertia": 1.0, "mass": 10.0},
        "couples": [{"name": "drive", "size": DRIVE}, {"name": "notch", "size": size}],
        "effects": {"gravity": {}, **effects},
        "solver": {"backend": backend, "duration": 1.0, "rtol": rtol},
    }


@pytest.mark.parametrize(
    ("width", "mu_k", "rtol", "backend"),
    [
        (0.4, None, 1e-6, "events"),
        (1e-2, 0.2, 1e-11, "rkf45"),
        (1e-4, None, 1e-11, "events"),
        (1e-6, 0.2, 1e-6, "rkf45"),
    ],
)
def test_a_narrow_notch_over_the_speed_is_not_passed_over(
    width: float, mu_k: float | None, rtol: float, backend: str
) -> None:
    """A - 9 N m at 5 rad/s, A far from it: the passage of both flanks takes 2 d ln(A/(A - 9))/9."""
    size = {"speed": [NOTCH - width, NOTCH, NOTCH + width], "value": [0.0, -DEPTH, 0.0]}
    torque, effects = DRIVE, {}
    if mu_k is not None:
        effects["shaft_friction"] = {"shaft_radius": 0.02, "mu_s": 0.25, "mu_k": mu_k}
        torque -= 0.02 * mu_k / hypot(1.0, mu_k) * 98.1
    run = simulate(body(size, backend, rtol, **effects))
    assert failures(run.checks) == ""
    passed = (NOTCH - width) / torque + 2.0 * width * log(torque / (torque - DEPTH)) / DEPTH
    speed = run.quantities["final_angular_velocity"].value
    # Each flank has an error of some tolerances of a speed of 5 rad/s.
    exact = NOTCH + width + torque * (1.0 - passed)
    assert speed == pytest.approx(exact, abs=1e3 * rtol * NOTCH + 1e-13)


@pytest.mark.parametrize(
    ("width", "rtol", "backend"),
    [(40.0, 1e-11, "rkf45"), (1.0, 1e-6, "events"), (0.1, 1e-6, "rkf45"), (1e-3, 1e-11, "events")],
)
def test_a_narrow_detent_over_the_angle_is_not_passed_over(
    width: float, rtol: float, backend: str
) -> None:
    """It takes the energy of its triangle, and the way of the drive is that of the angle."""
    depth = min(500.0, 0.8 * DRIVE * (90.0 - width) / width)  # the body passes it
    size = {"angle_deg": [90.0 - width, 90.0, 90.0 + width], "value": [0.0, -depth, 0.0]}
    data = body(size, backend, rtol)
    data["solver"]["duration"] = 1.5 * sqrt(2.0 * pi / DRIVE)
    run = simulate(data)
    assert failures(run.checks) == ""
    angle, speed = (float(run.channels[name][-1]) for name in ("angle", "angular_velocity"))
    assert angle > radians(90.0 + width)
    energy = DRIVE * angle - depth * radians(width)
    assert 0.5 * speed**2 == pytest.approx(energy, rel=1e3 * rtol + 1e-13)
