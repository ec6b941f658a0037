"""Kind `shaft` against an independent program, and against itself in other units and directions."""

from math import radians
from typing import Any

import pytest

from tests.support.cases import one_in, slow
from tests.support.problems import cases
from tests.support.scenarios import Scenario, changed, simulate, sound, with_method
from tests.support.shaft_reference import solution
from tests.support.shaft_scenarios import in_units, ramp, shaft_scenario, sine, turned

TIME, ANGLE = 1e-9, 1e-8  # s, rad, at rtol 1e-11
CASES = {case["name"]: case for case in cases("shaft")}
THROUGH_THE_AXIS = {"point": [0.0, 0.0]}


def seen(data: Scenario) -> tuple[list[tuple[float, int, int, float]], list[float]]:
    """Return the transitions and the final state of a run that passes its audit."""
    done = sound(data)
    final = [float(done.channels[name][-1]) for name in ("angle", "angular_velocity")]
    return [(e.time, e.mode_from, e.mode_to, e.position) for e in done.transitions], final


def assert_same(
    actual: Any, expected: Any, time: float = TIME, angle: float = ANGLE, size: float = 1.0
) -> None:
    """Compare transitions and final states; `size` is that of the velocity."""
    (events, final), (wanted, wanted_final) = actual, expected
    assert [list(e[1:3]) for e in events] == [list(e[1:3]) for e in wanted]
    for one, other in zip(events, wanted, strict=True):
        assert one[0] == pytest.approx(other[0], abs=time)
        assert one[3] == pytest.approx(other[3], abs=angle)
    assert final[0] == pytest.approx(wanted_final[0], abs=angle)
    assert final[1] == pytest.approx(wanted_final[1], rel=angle, abs=10.0 * angle * size)


@pytest.mark.parametrize("name", one_in(7, CASES))  # of each of the ten kinds one or two
def test_a_drawn_scenario_gives_the_reference(name: str) -> None:
    case = CASES[name]
    assert case["event_count"] == len(case["events"])
    assert_same(seen(case["scenario"]), (case["events"], case["final"]))


# Twenty times and more what another processor leaves of DOP853 at 1e-13: 2e-14 s, and 3e-13 rad or
# 2e-12 rad in each radian turned.
OTHER_PROCESSOR = 5e-11  # rad, and of the angle turned


@pytest.mark.parametrize("name", [name for i, name in enumerate(CASES) if i in (0, 12, 14, 16)])
def test_the_stored_motions_are_those_of_the_independent_program(name: str) -> None:
    case = CASES[name]
    reference = solution(case["scenario"])
    stored = case["events"], case["final"]
    angle = OTHER_PROCESSOR * max(1.0, abs(case["final"][0]))
    assert_same((reference["events"], reference["final"]), stored, time=1e-12, angle=angle)


LINEAR = {
    "a ramp of torque, up and down": shaft_scenario(
        [{"size": 100.0, "direction": [0.0, -1.0], **THROUGH_THE_AXIS}],
        [ramp(0.0, 0.0, 0.4, 2.0, 0.7, -1.0, 1.0, 0.0)],
    ),
    "a load that reverses twice": shaft_scenario(
        [{"size": ramp(0.0, -20.0, 0.5, 30.0, 1.0, -60.0), "direction": [0.6, -0.8],
          "cord_radius": 0.03}],
        [0.1], effects={"viscous_damping": {"coefficient": 0.2}},
    ),
    "a resultant that vanishes while it rests": shaft_scenario(
        [{"size": 100.0, "direction": [0.6, 0.8], **THROUGH_THE_AXIS},
         {"size": ramp(0.0, 0.0, 1.0, 200.0), "direction": [-0.6, -0.8], **THROUGH_THE_AXIS}],
        [0.3], mechanism={"initial_angular_velocity": -3.0},
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", LINEAR)
def test_loads_linear_in_time_give_the_reference(name: str) -> None:
    reference = solution(LINEAR[name])
    assert reference["events"]
    expected = reference["events"], reference["final"]
    assert_same(seen(LINEAR[name]), expected, time=1e-11, angle=1e-11)


CHOSEN = ["any_loads_10", "load_through_zero_51", "resultant_vanishes_12", "tables_16"]


@pytest.mark.parametrize("name", one_in(2, CHOSEN))
def test_rkf45_gives_the_reference_to_its_accuracy(name: str) -> None:
    case = CASES[name]
    events_and_end = seen(with_method(case["scenario"], "set-valued", "rkf45"))
    assert_same(events_and_end, (case["events"], case["final"]), time=1e-6, angle=1e-5)


@pytest.mark.parametrize(
    ("name", "backend"),
    [
        ("any_loads_10", "rkf45"),
        ("load_through_zero_51", "lsoda"),
        *(slow("any_loads_10", "lsoda"), slow("load_through_zero_51", "rkf45")),
    ],
)
def test_the_regularised_law_approaches_the_reference(name: str, backend: str) -> None:
    case = CASES[name]
    errors = []
    for speed in (1e-2, 1e-3):
        data = with_method(case["scenario"], "regularised", backend)
        data["effects"]["shaft_friction"]["transition_speed"] = speed
        done = simulate(changed(data, solver__rtol=1e-8))
        assert done.status == "done"
        errors.append(abs(float(done.channels["angle"][-1]) - case["final"][0]))
    assert errors[1] < 0.2 * errors[0]
    assert errors[1] < 1e-3


def test_the_published_law_agrees_while_it_slides_one_way() -> None:
    """Eq 30 differs where the body comes to rest, and not before."""
    data = shaft_scenario(
        [{"size": 100.0, "direction": [0.0, -1.0], "cord_radius": 0.1}],
        [sine(1.0, 0.5, 3.0)], mechanism={"mass": 2.0}, effects={"gravity": {"g": 9.81}},
    )  # fmt: skip
    law = simulate(with_method(data, "published", "rkf45"))
    done = simulate(data)
    assert law.status == "done"
    assert law.channels["angle"][-1] == pytest.approx(done.channels["angle"][-1], abs=1e-9)


VIEWED = ["any_loads_0", "equal_coefficients_14", "tables_16", "many_turns_8", "narrow_peak_15"]


@pytest.mark.parametrize("name", one_in(3, VIEWED))
def test_the_unit_of_mass_and_length_does_not_matter(name: str) -> None:
    """Powers of two change no digit: with the same unit of energy, every step is the same."""
    data = CASES[name]["scenario"]
    actual = seen(data)
    assert seen(in_units(data, 2.0**20, 2.0**-10, 1.0)) == actual
    assert_same(seen(in_units(data, 1e6, 1e2, 1.0)), actual, 1e-10, 1e-9)


@pytest.mark.parametrize(("name", "unit"), [(VIEWED[0], 1e3), (VIEWED[2], 1e-3)])
def test_the_unit_of_time_does_not_matter(name: str, unit: float) -> None:
    data = CASES[name]["scenario"]
    (events, final), actual = seen(data), seen(in_units(data, 1.0, 1.0, unit))
    expected = [(t * unit, *rest) for t, *rest in events], [final[0], final[1] / unit]
    assert_same(actual, expected, 1e-9 * unit, 1e-8, size=1.0 / unit)


@pytest.mark.parametrize("name", one_in(3, VIEWED))
def test_the_directions_of_the_picture_do_not_matter(name: str) -> None:
    data = changed(CASES[name]["scenario"], effects__gravity=None)
    assert_same(seen(turned(data, 73.0)), seen(data), 1e-11, 1e-10)


@pytest.mark.parametrize("start", [15.0, -20.0])
@pytest.mark.parametrize("velocity", [2.0, -2.0])
def test_a_corner_over_angle_is_passed_both_ways_and_started_on(
    start: float, velocity: float
) -> None:
    over_angle = {"angle_deg": [-20.0, 15.0], "value": [30.0, -30.0]}
    data = shaft_scenario(
        [{"size": over_angle, "direction": [0.0, 1.0], "point": [0.1, 0.0]},
         {"size": 20.0, "direction": [1.0, 0.0], **THROUGH_THE_AXIS}],
        [], mechanism={"initial_angle_deg": start, "initial_angular_velocity": velocity},
    )  # fmt: skip
    reference = solution(data)
    assert len(reference["events"]) > 1
    assert_same(seen(data), (reference["events"], reference["final"]))
    angles = [q for *_, q in reference["events"]]
    assert min(angles) < radians(-20.0) or max(angles) > radians(15.0)
