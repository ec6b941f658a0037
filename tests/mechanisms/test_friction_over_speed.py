"""Kinetic friction over the speed, of every kind of one coordinate and the lift."""

from math import exp, hypot, pi
from typing import Any

import jsonschema
import numpy as np
import pytest

import frictionsim as fs
from tests.support.friction_curves import curve
from tests.support.motions import motion
from tests.support.problems import cases
from tests.support.scenarios import Scenario, changed, shipped, simulate, sound, with_method
from tests.support.stick_slip_reference import cycles

# s, and a share of angles and speeds, at rtol 1e-11: of 250 drawn scenes the worst was 1.3e-10 s
# (an event of a body with a thousand times the inertia), and 5e-10 of an angle of 1 rad or more.
TIME, SHARE = 1e-9, 1e-9
CURVES: dict[str, Any] = {
    "points": {"speed": [0.0, 0.02, 0.2], "value": [1.0, 0.5, 0.8]},
    "stribeck": {"stribeck": {"mu_c": 0.4, "speed": 0.03, "exponent": 1.3}},
}
PLACES = [
    *((name, "shaft_friction", "mu_s", "mu_k")
      for name in ("pulley", "shaft", "marble_machine", "lift")),
    ("epicyclic", "hinge_friction", "torque_static", "torque_kinetic"),
    ("lift", "cord_friction", "mu_s", "mu_k"),
    ("epicyclic", "rolling_friction", "arm", "arm_kinetic"),
]  # fmt: skip
PULLEY, GEAR = PLACES[0], PLACES[4]


def with_curve(name: str, effect: str, static: str, kinetic: str, form: str) -> Scenario:
    """Return a shipped scenario with a curve that has static friction at rest."""
    data = shipped(name)
    size = data["effects"][effect][static]
    if form == "points":
        of = CURVES[form] | {"value": [size * x for x in CURVES[form]["value"]]}
    else:
        name_c = {"mu_k": "mu_c", "torque_kinetic": "torque_c", "arm_kinetic": "arm_c"}[kinetic]
        of = {"stribeck": {name_c: 0.4 * size, "speed": 0.03, "exponent": 1.3}}
    return changed(data, **{f"effects__{effect}__{kinetic}": of})


OFTEN = {"shaft_1", "shaft_5", "pulley_6", "pulley_7", "marble_machine_3", "epicyclic_0",
         "epicyclic_9", "lift_gripped_8", "lift_light_5"}  # fmt: skip


@pytest.mark.parametrize("case", [
    pytest.param(case, id=case["name"], marks=[] if case["name"] in OFTEN else pytest.mark.slow)
    for case in cases("speed")
])  # fmt: skip
def test_a_drawn_scene_moves_as_by_an_independent_program(case: dict[str, Any]) -> None:
    done = sound(case["scenario"])
    seen = [e for e in done.transitions if e.contact != "transfer"]
    modes = [(e.mode_from, e.mode_to) for e in seen]
    assert modes == [tuple(event[-3:-1]) for event in case["events"]]
    for event, wanted in zip(seen, case["events"], strict=True):
        assert event.time == pytest.approx(wanted[0], abs=TIME)
        assert event.position == pytest.approx(wanted[-1], rel=SHARE, abs=SHARE)
    angle, velocity = (done.channels[name][-1] for name in ("angle", "angular_velocity"))
    assert angle == pytest.approx(case["final"][0], rel=SHARE, abs=SHARE)
    assert velocity == pytest.approx(case["final"][1], rel=SHARE, abs=10.0 * SHARE)


@pytest.mark.parametrize(("name", "effect", "static", "kinetic"), PLACES)
def test_one_value_is_the_number_to_the_bit(
    name: str, effect: str, static: str, kinetic: str
) -> None:
    data = shipped(name, solver__duration=0.7)
    number = data["effects"][effect].get(kinetic, data["effects"][effect][static])
    forms = (number, {"speed": [0.0], "value": [number]}, {"speed": [1, 2], "value": [number] * 2})
    one, *others = (simulate(changed(data, **{f"effects__{effect}__{kinetic}": x})) for x in forms)
    for other in others:
        assert one.statistics.steps == other.statistics.steps
        for channel, expected in one.channels.items():
            assert np.array_equal(other.channels[channel], expected), channel


@pytest.mark.parametrize("place", PLACES)
def test_the_schema_for_editors_takes_all_forms(place: tuple[str, str, str, str]) -> None:
    for form in CURVES:
        data = with_curve(*place, form)
        schema = jsonschema.Draft202012Validator(fs.schema(data["kind"]))
        assert schema.is_valid(data)
        fs.load(data)
        data["effects"][place[1]][place[3]]["speeds"] = 1.0
        assert not schema.is_valid(data)


def test_a_couple_in_proportion_to_the_speed_is_viscous_damping() -> None:
    """J w' = -(c rho) (rho w), rho = r1/r2: the speed falls as exp(-c rho^2 t/J) and never ends."""
    slope, speed, data = 0.02, 8.0, shipped("epicyclic")
    hinge = {"torque_static": 1.0, "torque_kinetic": {"speed": [0, 99], "value": [0, 99 * slope]}}
    data = changed(
        data,
        effects={"hinge_friction": hinge},
        drive={"torque": 0.0},
        mechanism__initial_angular_velocity=speed,
        solver={"backend": "events", "duration": 10.0, "rtol": 1e-13, "atol": 1e-15},
    )
    done, ratio = sound(data), data["mechanism"]["sun_radius"] / data["mechanism"]["planet_radius"]
    decay = slope * ratio**2 / fs.static(data)["inertia"].value
    expected = speed * np.exp(-decay * done.time)
    # Some hundred steps of 1e-13.
    assert done.channels["angular_velocity"] == pytest.approx(expected, rel=1e-11)
    assert done.channels["angle"] - done.channels["angle"][0] == pytest.approx(
        (speed - expected) / decay, rel=1e-11, abs=1e-13
    )
    assert done.transitions == []


def test_the_block_of_the_scenario_sticks_and_slips_as_by_an_independent_program() -> None:
    data, radius, belt = shipped("stick_slip"), 0.05, 0.05

    def friction(speed: float) -> float:
        mu = 0.2 + 0.2 * exp(-((speed / 0.1) ** 1.5))
        return 9.81 * mu / hypot(1.0, mu)

    found, events = cycles(1.0, 100.0, belt, friction, 5), sound(data).transitions
    times = [t for cycle in found for t in (cycle.begin, cycle.end)]
    places = [x for cycle in found for x in (cycle.x_begin, cycle.x_end)]
    assert [e.time for e in events] == pytest.approx(times, abs=TIME)
    # The slip of the block is -x + V t, forward in the direction of the belt.
    slips = [radius * e.position + belt * e.time for e in events]
    assert slips == pytest.approx(places, abs=1e-9)


@pytest.mark.parametrize("form", CURVES)
def test_statics_take_the_value_at_the_speed_zero(form: str) -> None:
    data = with_curve(*PULLEY, form)
    statics = fs.static(data)
    # Both curves have static friction at rest.
    assert statics["friction_radius_kinetic"] == statics["friction_radius_static"]
    assert statics["force_to_keep_lifting"].value == statics["force_to_lift"].value
    first = {"speed": [0.5, 1.0], "value": [0.1, 0.3]}
    lower = changed(data, effects__shaft_friction__mu_k=first)
    number = changed(data, effects__shaft_friction__mu_k=0.1)
    assert fs.static(lower) == fs.static(number)


@pytest.mark.parametrize("form", CURVES)
def test_a_regularised_law_ends_on_the_curve(form: str) -> None:
    """Faster than 1.5 times the transition speed the limit is that of the speed."""
    data = with_method(with_curve(*PULLEY, form), "regularised", "rkf45")
    data = changed(data, effects__shaft_friction__transition_speed=1e-3, solver__duration=1.0)
    done, journal = simulate(data), data["effects"]["shaft_friction"]
    assert done.status == "done"
    radius, mu = journal["shaft_radius"], curve(journal["mu_k"], journal["mu_s"])
    fast = np.abs(done.channels["angular_velocity"]) > 1.5e-3
    speeds = done.channels["angular_velocity"][fast]
    factor = np.array([mu(radius * w) / hypot(1.0, mu(radius * w)) for w in speeds])
    limit = radius * factor * done.channels["shaft_reaction"][fast]
    assert np.abs(done.channels["friction_torque"][fast]) == pytest.approx(limit, rel=1e-12)
    assert fast.sum() > 20


@pytest.mark.parametrize("form", CURVES)
def test_the_method_without_located_events_finds_the_same_motion(form: str) -> None:
    data = changed(with_curve(*PULLEY, form), solver__duration=1.0)
    exact = simulate(changed(data, solver__rtol=1e-11))
    other = simulate(with_method(data, "set-valued", "rkf45"))
    assert [e.mode_to for e in other.transitions] == [e.mode_to for e in exact.transitions]
    assert other.channels["angle"][-1] == pytest.approx(exact.channels["angle"][-1], rel=1e-7)


def test_the_published_law_has_the_curve_in_the_place_of_r_k() -> None:
    data = with_method(with_curve(*PULLEY, "points"), "published", "rkf45")
    data = changed(data, drive__force=4000.0)
    exact = changed(with_method(data, "set-valued", "events"), solver__rtol=1e-11)
    # It slides in one direction, where eq 30 is the equation of motion.
    one, other = (simulate(each).channels["angle"][-1] for each in (data, exact))
    assert one == pytest.approx(other, rel=1e-8)


def test_the_torque_of_uniform_rotation_is_that_of_the_speed() -> None:
    data = changed(with_curve(*GEAR, "points"), drive={"speed": 1.5})
    data = changed(data, effects__rolling_friction=None)
    done, hinge = sound(data), data["effects"]["hinge_friction"]
    ratio = data["mechanism"]["sun_radius"] / data["mechanism"]["planet_radius"]
    couple = ratio * curve(hinge["torque_kinetic"], hinge["torque_static"])(1.5 * ratio)
    mean = done.quantities["uniform_torque_mean_at_final_speed"].value
    assert mean == pytest.approx(couple, rel=1e-14)
    assert done.quantities["uniform_torque_mean"].value == ratio * hinge["torque_static"]
    assert -done.channels["friction_torque"][1:] == pytest.approx(couple, rel=1e-13)


def test_a_picture_shows_the_kinetic_circle_of_its_instant() -> None:
    """The reaction touches it while the pulley slips: its radius is torque over reaction."""
    for place in PLACES[:2]:
        done = simulate(with_curve(*place, "points"))
        (circle,) = (p for p in motion(done).parts if p.name == "kinetic friction circle")
        radii = np.linalg.norm(circle.points, axis=-1)
        assert np.ptp(radii, axis=1).max() < 1e-12 * radii.max()
        slips = done.channels["mode"] != 0
        arm = np.abs(done.channels["friction_torque"] / done.channels["shaft_reaction"])
        assert radii[slips, 0] == pytest.approx(arm[slips], rel=1e-12)


def test_the_traction_of_a_cord_is_drawn_with_the_limit_of_its_slip() -> None:
    result = fs.solve(with_curve(*PLACES[5], "points"))
    cord = result.record
    mu = curve({"speed": [0.0, 0.02, 0.2], "value": [0.127, 0.0635, 0.1016]}, 0.127)
    (limit,) = (
        line for line in result.plot("traction").axes[0].lines
        if len(line.get_ydata()) == len(cord.time)
        and line.get_linestyle() != "-" and np.min(line.get_ydata()) > 1.0
    )  # fmt: skip
    radius = result.scenario.mechanism.cord_radius
    slip = cord.channels["car_velocity"] - radius * cord.channels["angular_velocity"]
    assert limit.get_ydata() == pytest.approx([exp(mu(v) * pi) for v in slip], rel=1e-12)
