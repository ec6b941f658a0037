"""Mistakes in scenarios of kind `shaft`: each gives one sentence, with place and way out."""

from typing import Any

import pytest

from frictionsim.mechanisms.shaft.statics import statics
from frictionsim.scenario.model_validation import ValidationFailure
from frictionsim.scenario.validation import validate
from tests.support.scenarios import Scenario, changed, simulate
from tests.support.shaft_scenes import scene, sine


def force(**keys: Any) -> dict[str, Any]:
    table = {"size": 10.0, "direction": [0.0, -1.0], "point": [0.1, 0.0], **keys}
    return {key: value for key, value in table.items() if value is not None}


def fault(data: Scenario) -> str:
    """Return the fault of a scenario, which must be the only one."""
    with pytest.raises(ValidationFailure) as found:
        validate(data, None)
    (line,) = found.value.lines()
    return line


def of_force(**keys: Any) -> str:
    return fault(scene([force(**keys)], []))


NO_FORCE = (
    "scenario: no force acts on the body: give [[forces]], [[couples]], a mass with"
    " [effects.gravity], or [effects.torsion_spring]"
)
FORMS = (
    '{time = [...], value = [...]}, {sine = {...}}, {smooth_step = {...}}, {csv = "file.csv"},'
    " {speed = [...], value = [...]} or {angle_deg = [...], value = [...]}"
)


@pytest.mark.parametrize("data", [scene([], []), changed(scene([], []), forces=None, couples=None)])
def test_no_force_at_all(data: Scenario) -> None:
    assert fault(data) == NO_FORCE


def test_a_weight_without_mass_is_no_force() -> None:
    assert fault(scene([], [], effects={"gravity": {"g": 9.81}})) == NO_FORCE
    weighs = scene([], [], effects={"gravity": {"g": 9.81}}, mechanism={"mass": 1.0})
    assert validate(weighs, None)


@pytest.mark.parametrize("x", [0.0, 1e-320])
def test_a_direction_of_length_zero(x: float) -> None:
    assert of_force(direction=[x, 0.0]) == (
        f"forces.f0.direction: expected a direction, found one of length {x:.3g}, which points"
        " nowhere; give x and y, as in [0.0, -1.0]"
    )
    assert validate(scene([force(direction=[0.0, -1e-40])], []), None)


@pytest.mark.parametrize(
    ("direction", "message"),
    [
        ([float("nan"), 1.0], ".0: expected a finite number, got nan"),
        ([1.0, float("inf")], ".1: expected a finite number, got inf"),
        ([1e60, 0.0], ": 1e+60 is too large; the magnitude must not exceed 1e+50"),
        ([1.0], ".1: missing; expected a number"),
        ([1.0, 0.0, 0.0], ": expected at most 2 numbers, got a list of 3"),
        ("down", ": expected a list of numbers in brackets, got 'down'"),
    ],
)
def test_a_direction_that_is_none(direction: Any, message: str) -> None:
    assert of_force(direction=direction) == "forces.f0.direction" + message


@pytest.mark.parametrize(
    ("given", "found"), [({"cord_radius": 0.1}, "both"), ({"point": None}, "neither")]
)
def test_a_force_has_a_point_or_is_a_cord(given: dict[str, Any], found: str) -> None:
    assert of_force(**given) == (
        f"forces.f0: expected either point or cord_radius, found {found}; give one of them"
    )


def test_a_cord_does_not_turn() -> None:
    cord = {"point": None, "cord_radius": 0.1}
    assert of_force(**cord, direction_turns=True) == (
        "forces.f0.direction_turns: a cord leaves the body in a fixed direction; give point, or"
        " remove this key"
    )


LOCKS = (
    "effects.shaft_friction.shaft_radius: 0.02 m with mu_s = 0.75 gives a friction radius of"
    " 0.012 m, not below the arm of the only force, {arm} m: the body locks, whatever the"
    " force; make the shaft thinner or the arm longer"
)
ROUGH = {"effects__shaft_friction__mu_s": 0.75}  # r_s = 0.6 r


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
    data = changed(scene([force(**keys)], []), **ROUGH)
    data["forces"][0] = {key: x for key, x in data["forces"][0].items() if x is not None}
    assert fault(data) == LOCKS.format(arm=arm)
    # With the least less friction it moves, though it still acts within the shaft.
    mu = arm / (0.02**2 - arm**2) ** 0.5
    data["effects"]["shaft_friction"]["mu_s"] = mu * (1.0 - 1e-9)
    found = validate(data, None)
    assert abs(statics(found)["breakaway_direction"].value) == 1.0
    assert found.warnings()[0] == (
        f"shaft_radius = 0.02 m is not below the largest arm of the forces, {arm} m; the friction"
        f" radius is {arm} m"
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
    ],
)  # fmt: skip
def test_a_thick_shaft_is_right_if_anything_else_moves_the_body(change: dict[str, Any]) -> None:
    """Or if it is meant to rest: a force through the axis has no arm at all."""
    assert validate(changed(scene([force(point=[0.01, 0.0])], []), **ROUGH, **change), None)


def test_a_name_is_given_once() -> None:
    data = scene([force(), force()], [1.0])
    data["couples"][0]["name"] = "f1"
    assert fault(data) == (
        "couples.0.name: there is a force or couple 'f1' already; give another name"
    )


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("a b", "expected letters, digits, '_' and '-' without spaces, got 'a b'"),
        ("", "expected text of at least one character, got ''"),
        (7, "expected text in quotes, got 7"),
    ],
)
def test_a_name_that_cannot_be_addressed(name: Any, expected: str) -> None:
    data = changed(scene([], [1.0]), couples=[{"name": name, "size": 1.0}])
    assert fault(data) == f"couples.0.name: {expected}"


@pytest.mark.parametrize(
    ("size", "message"),
    [
        ({"angle_deg": [0.0, 1.0], "value": [1.0]},
         ".value: 1 values for 2 angles; give one for each"),
        ({"angle_deg": [1.0, 0.0], "value": [1.0, 2.0]},
         ".angle_deg: angles must increase from point to point, but point 2 at 0.0 deg follows one"
         " at 1.0 deg"),
        ({"angle_deg": [0.0, float("inf")], "value": [1.0, 2.0]},
         ".angle_deg.1: expected a finite number in deg, got inf"),
        ({"angle_deg": [0.0], "speed": [0.0], "value": [1.0]},
         ".speed: unknown key 'speed'; known: angle_deg, value"),
        ({"angle_deg": [0.0], "time": [0.0], "value": [1.0]},
         ".time: unknown key 'time'; known: angle_deg, value"),
        ({"speed": [0.0], "time": [0.0], "value": [1.0]},
         ".time: unknown key 'time'; known: speed, value"),
        ({}, f": expected a number, {FORMS}, got an empty table"),
        ("x", f": expected a number in N, or {FORMS}, got 'x'"),
        (True, f": expected a number in N, or {FORMS}, got true"),
        (float("nan"), ": expected a finite number in N, got nan"),
        (1e300, ": 1e+300 is too large; the magnitude must not exceed 1e+50"),
    ],
)  # fmt: skip
def test_a_size_that_is_none(size: Any, message: str) -> None:
    assert of_force(size=size) == "forces.f0.size" + message


@pytest.mark.parametrize("form", ["time", "speed", "angle_deg"])
def test_a_table_without_values(form: str) -> None:
    assert of_force(size={form: [0.0, 1.0]}) == (
        "forces.f0.size.value: missing; expected a list of numbers in brackets"
    )


def test_a_force_is_called_by_its_number_where_its_name_does_not_tell_which() -> None:
    data = scene([force(), force(), force(size="x")], [])
    data["forces"][0] |= {"name": "f1", "size": "x"}
    data["forces"][1]["size"] = "x"
    with pytest.raises(ValidationFailure) as found:
        validate(data, None)
    keys = [line.partition(":")[0] for line in found.value.lines()]
    assert keys == ["forces.0.size", "forces.1.size", "forces.f2.size"]


@pytest.mark.parametrize("size", [1e-306, 1e-310, 1e-320, 5e-324])
@pytest.mark.parametrize("friction", [True, False])
def test_a_size_of_which_no_digits_are_left_is_none(size: float, friction: bool) -> None:
    """A number below the smallest normal one has few digits, and its products fewer."""
    for one in (size, {"time": [0.0, 1.0], "value": [0.0, size]}):
        data = changed(scene([force(size=one)], []), solver__rtol=1e-6)
        if not friction:
            del data["effects"]["shaft_friction"]
        result = simulate(data)
        assert result.status == "done"
        assert abs(result.channels["angle"][-1]) < 1e-300


def test_at_most_a_thousand_forces() -> None:
    found = fault(scene([force()] * 1001, []))
    assert found == "forces: expected at most 1000 tables, got a list of 1001"


def test_an_eccentric_mass_within_the_friction_circle() -> None:
    data = scene([force()], [])
    data["effects"]["eccentric_mass"] = {"mass": 1e6, "radius": 1e-3}
    data["effects"]["shaft_friction"] = {"shaft_radius": 0.09, "mu_s": 0.75, "mu_k": 0.75}
    assert fault(data) == (
        "effects.eccentric_mass: mass x radius x kinetic friction radius = 54 kg m^2 is not below"
        " the moment of inertia, 1.05 kg m^2: sliding has no unique acceleration; increase"
        " mechanism.inertia"
    )
    # Static friction has no part in sliding: 1000 kg m x 0.09 m x 1e-3 is below.
    data["effects"]["shaft_friction"]["mu_k"] = 1e-3
    assert validate(data, None)


@pytest.mark.parametrize(
    ("unknown", "keys"),
    [
        ("effects.shaft_friction.shaft_radius", {}),
        ("effects.shaft_friction.mu_s", {}),
        ("forces.f0.distance", {}),
        ("forces.f0.cord_radius", {"point": None, "cord_radius": -0.01}),
    ],
)
def test_a_radius_that_is_unknown_does_not_lock(unknown: str, keys: dict[str, Any]) -> None:
    data = changed(scene([force(**({"point": [0.01, 0.0]} | keys))], []), **ROUGH)
    data["forces"][0] = {key: x for key, x in data["forces"][0].items() if x is not None}
    assert fault(data).endswith("make the shaft thinner or the arm longer")
    data["statics"] = {"unknown": unknown}
    assert validate(data, None)
    data["statics"] = {"unknown": "forces.f0.size"}
    assert fault(data).endswith("make the shaft thinner or the arm longer")


def test_two_thousand_loads_are_summed() -> None:
    """The sum is a loop: a sum of functions of two would be nested too deep to be called."""
    data = scene([force(size=sine(0.1, 0.01, 1.0))] * 1000, [sine(0.1, 0.01, 1.0)] * 1000)
    for table in ("forces", "couples"):
        data[table] = [{**part, "name": f"{table}{i}"} for i, part in enumerate(data[table])]
    few = scene([force(size=sine(100.0, 10.0, 1.0))], [sine(100.0, 10.0, 1.0)])
    short = {"solver": {"duration": 1e-3, "rtol": 1e-6}, "output": {"interval": 5e-4}}
    many, one = simulate(data | short), simulate(few | short)
    assert many.channels["angle"][-1] != 0.0
    assert many.channels["angle"] == pytest.approx(one.channels["angle"], rel=1e-9)


def test_a_body_that_rests_says_how_near_it_came_to_moving() -> None:
    """Also where the samples, one in ten periods, are all where the torque is zero."""
    data = scene([force(point=[0.0, 0.0], size=100.0)], [sine(0.0, 0.5, 10.0)])
    done = simulate(changed(data, output__interval=1.0))
    assert done.warnings[-1] == (
        "nothing moves: the largest torque is 67.31456009 % of the static limit"
    )
