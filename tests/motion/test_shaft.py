"""A body on a shaft in motion, against separate complex arithmetic: forces, cords, reaction."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.display import ROLES
from frictionsim.errors import InputError
from frictionsim.motion.parts import (
    FORCE_ROLES,
    Arrow,
    Band,
    Disc,
    Motion,
    line_of,
    moment_of,
    state_word,
)
from frictionsim.motion.shaft import (
    circle_window,
    scenario_in,
    shapes_of,
    sizes_of,
    spring_line,
    stops_of,
)
from tests.support.motions import body, motion, point_of, record_of
from tests.support.scenarios import shipped
from tests.support.shaft_forces import (
    TIMES,
    acting,
    couples,
    drawn_motion,
    drawn_shaft,
    mirrored,
    mirrored_motion,
    moment,
    rotated,
)

CORD = 0.7  # of the reach, from where a cord leaves the body to its arrow


def arrows(animation: Motion) -> dict[str, tuple[Any, Any]]:
    """Return tail and way of each arrow of a force over time, as complex numbers."""
    turns = torque_arcs(animation)
    return {
        part.name: (part.x + 1j * part.y, part.dx + 1j * part.dy)
        for part in animation.parts
        if isinstance(part, Arrow) and part.name not in turns
    }


def torque_arcs(animation: Motion) -> dict[str, Any]:
    """Return the arcs of the couples over time, (frames, points), as complex numbers."""
    pairs = zip(animation.parts, animation.parts[1:], strict=False)
    return {
        head.name: line.x + 1j * line.y
        for line, head in pairs
        if isinstance(line, Band) and line.role in FORCE_ROLES and isinstance(head, Arrow)
    }


def bands(animation: Motion) -> dict[str, Band]:
    return {part.name: part for part in animation.parts if isinstance(part, Band)}


def of(data: Any, channels: Any) -> Motion:
    return motion(record_of("shaft", channels, data))


@pytest.fixture(scope="module", params=range(6))
def drawn(request: Any) -> tuple[Any, Any, Motion]:
    """A drawn scenario, channels that no solver made, and what they show."""
    data, channels = drawn_shaft(request.param), drawn_motion(request.param)
    return data, channels, of(data, channels)


Drawn = tuple[Any, Any, Motion]


def test_forces_act_where_they_do_on_one_scale_and_the_reaction_balances_them(drawn: Drawn) -> None:
    data, channels, moved = drawn
    vectors, wanted = arrows(moved), acting(data, channels)
    foot, way = vectors.pop("reaction of the shaft")
    assert vectors.keys() == wanted.keys()
    reach = sizes_of(scenario_in(record_of("shaft", channels, data))).reach
    scale = float(np.abs(vectors["weight of the body"][1][0])) / (8.0 * 9.81)
    for name, (place, force) in wanted.items():
        tail = place
        if name == "cord":
            along = complex(*data["forces"][4]["direction"])
            tail = place + CORD * reach * along / abs(along)
        assert vectors[name][0] == pytest.approx(tail, abs=1e-12), name
        assert vectors[name][1] == pytest.approx(scale * force, abs=1e-12), name
    assert way + sum(force for _, force in vectors.values()) == pytest.approx(0j * TIMES, abs=1e-12)
    assert moment(foot, way) / scale == pytest.approx(channels["friction_torque"])
    # The foot is on the perpendicular from the axis: its distance is the lever arm.
    assert (np.conj(foot) * way).real == pytest.approx(0.0 * TIMES, abs=1e-12)
    line = bands(moved)["lever arm of the reaction"]
    assert line.x[:, 1] + 1j * line.y[:, 1] == pytest.approx(foot)
    assert not line.x[:, 0].any()
    assert not line.y[:, 0].any()


def test_a_mirrored_or_rotated_scenario_is_drawn_mirrored_or_rotated(drawn: Drawn) -> None:
    data, channels, moved = drawn
    turn = np.exp(1j * np.radians(73.0))
    seen = arrows(of(mirrored(data), mirrored_motion(channels)))
    for name, pair in arrows(moved).items():
        for one, other in zip(pair, seen[name], strict=True):
            assert other == pytest.approx(-np.conj(one), abs=1e-12), name
    forces, seen = (arrows(of(rotated(data, degrees), channels)) for degrees in (0.0, 73.0))
    for name, pair in forces.items():
        for one, other in zip(pair, seen[name], strict=True):
            assert other == pytest.approx(turn * one, abs=1e-12), name


def test_a_cord_is_tangential_and_runs_with_the_body(drawn: Drawn) -> None:
    data, channels, moved = drawn
    radius, cord = data["forces"][4]["cord_radius"], bands(moved)["cord"]
    foot, end = (cord.x[:, k] + 1j * cord.y[:, k] for k in (0, 1))
    assert np.abs(foot) == pytest.approx(np.full(len(TIMES), abs(radius)))
    assert (np.conj(foot) * (end - foot)).real == pytest.approx(0.0 * TIMES, abs=1e-12)
    along = (end - foot) / np.abs(end - foot)
    assert moment(foot, along) == pytest.approx(np.full(len(TIMES), radius))
    # A point of the rim at the foot goes along the cord as its marks do.
    turned = channels["angle"] - channels["angle"][0]
    assert cord.travel == pytest.approx(radius * turned)


def test_forces_and_couples_that_are_given_have_a_colour_each(drawn: Drawn) -> None:
    data, _, moved = drawn
    given = [each["name"] for each in (*data["forces"], *data.get("couples", ()))]
    roles = {part.name: part.role for part in moved.parts if isinstance(part, Arrow)}
    shown = [name for name in given if name in roles]
    assert len({ROLES[roles[name]] for name in shown}) == min(len(shown), len(FORCE_ROLES))


def test_arms_and_eccentric_mass_turn_with_the_body(drawn: Drawn) -> None:
    data, channels, moved = drawn
    wanted, shapes = acting(data, channels), body(moved, "body").shapes
    hub = sizes_of(scenario_in(record_of("shaft", channels, data))).hub
    pins = [s for s in shapes if isinstance(s, Disc) and s.role == "fixed" and not s.open]
    for i in (0, 7, 20):
        seen = [point_of(moved, "body", TIMES[i], pin.x, pin.y) for pin in pins]
        places = [wanted[name][0][i] for name in ("force-2", "force-3")]  # whose points turn
        for place in (place for place in places if abs(place) > hub):
            assert min(abs(place - pin) for pin in seen) < 1e-12
    masses = [s for s in shapes if isinstance(s, Disc) and s.role == "load"]
    assert len(masses) == ("eccentric_mass" in data["effects"])
    for mass in masses:
        place = point_of(moved, "body", TIMES[9], mass.x, mass.y)
        assert place == pytest.approx(wanted["weight of the eccentric mass"][0][9])


def test_sizes_that_change_stand_beside_the_drawing(drawn: Drawn) -> None:
    data, channels, moved = drawn
    wanted = {f["name"]: f["size"] for f in data["forces"]}
    shown = {r.name: r.value for r in moved.readouts}
    given = couples(data, channels)
    for name in shown.keys() & given.keys():
        assert shown[name] == pytest.approx(given[name], abs=1e-12)
    varying = {name for name, size in wanted.items() if isinstance(size, dict)}
    assert varying <= shown.keys()
    assert not (wanted.keys() - varying) & shown.keys()


def test_couples_are_arcs_on_one_scale_about_the_axis(drawn: Drawn) -> None:
    data, channels, _ = drawn
    data = data | {"couples": [*data["couples"], {"name": "brake", "size": -7.0}]}
    wanted = couples(data, channels)
    arcs = torque_arcs(of(data, channels))
    assert arcs.keys() == {"motor", "brake"}  # not the spring, which is drawn itself
    largest = max(np.abs(wanted[name]).max() for name in arcs)
    for name, line in arcs.items():
        swept = np.angle(line[:, 1:] / line[:, :-1]).sum(axis=1)
        assert swept == pytest.approx(0.75 * np.pi * wanted[name] / largest), name
    radii = [float(np.abs(line[0, 0])) for line in arcs.values()]
    assert abs(radii[0] - radii[1]) > 0.05 * max(radii)
    none = data | {"couples": [{"name": "motor", "size": 0.0}]}
    assert not torque_arcs(of(none, channels))


def test_a_solved_run_shows_its_channels_and_states() -> None:
    changes = {"solver__rtol": 1e-6, "solver__duration": 1.2}
    record = fs.solve(shipped("shaft", **changes)).record
    animation = motion(record)
    foot, way = arrows(animation)["reaction of the shaft"]
    circles = [
        body(animation, f"{name} friction circle").shapes[0] for name in ("static", "kinetic")
    ]
    r_s, r_k = (circle.radius for circle in circles if isinstance(circle, Disc))
    arm = np.abs(foot)
    assert arm[animation.state == 0].max() <= r_s * (1.0 + 1e-6)
    assert arm[animation.state != 0] == pytest.approx(r_k, rel=1e-6)
    reaction = record.channels["reaction_x"] + 1j * record.channels["reaction_y"]
    for i in range(0, len(reaction), 30):
        at = moment_of(animation.time, record.channels["time"][i]).frame
        assert np.angle(way[at] / reaction[i]) == pytest.approx(0.0, abs=1e-9)
    words = {state_word(animation, moment_of(animation.time, t)) for t in (0.1, 1.0)}
    assert words == {"sticks", "slips forward"}


def test_friction_circles_are_enlarged_and_true_to_scale() -> None:
    record = record_of("shaft", drawn_motion(1), drawn_shaft(1))
    animation = motion(record)
    sizes = {}
    for name in ("static friction circle", "kinetic friction circle", "shaft"):
        shape = body(animation, name).shapes[0]
        sizes[name] = shape.radius
    assert sizes == {
        "static friction circle": pytest.approx(0.02 * np.sin(np.arctan(0.3))),
        "kinetic friction circle": pytest.approx(0.02 * np.sin(np.arctan(0.2))),
        "shaft": 0.02,
    }
    (detail,) = animation.details
    assert detail.name == "friction circles of the shaft, enlarged"
    half = circle_window(scenario_in(record))
    assert detail.bounds == (-half, half, -half, half)
    assert half == pytest.approx(3.0 * sizes["static friction circle"])


def test_without_friction_there_is_no_detail_and_the_reaction_goes_through_the_axis() -> None:
    data, channels = drawn_shaft(0), drawn_motion(0)
    del data["effects"]["shaft_friction"], channels["friction_torque"]
    animation = of(data, channels)
    assert animation.details == ()
    foot, _ = arrows(animation)["reaction of the shaft"]
    assert not foot.any()
    assert "lever arm of the reaction" not in bands(animation)


def test_without_the_channels_of_a_force_the_body_moves_alone() -> None:
    data, channels = drawn_shaft(1), drawn_motion(1)
    del channels["angular_acceleration"]
    animation = of(data, channels)
    assert not arrows(animation)
    assert body(animation, "body").angle == pytest.approx(channels["angle"])


def test_a_scenario_of_another_version_is_refused_in_a_sentence() -> None:
    data = drawn_shaft(0) | {"unknown_table": {"a": 1}}
    with pytest.raises(InputError, match=r"the scenario in it is not valid.*unknown_table"):
        of(data, drawn_motion(0))


def test_many_forces_have_the_largest_drawn() -> None:
    data = drawn_shaft(0)
    data["forces"] = [
        {"name": f"f{i}", "size": float(i + 1), "point": [0.1, 0.0], "direction": [1.0, i]}
        for i in range(60)
    ]
    names = arrows(of(data, drawn_motion(0))).keys()
    assert {"f59", "f40"} < names
    assert "f3" not in names
    assert len(names) == 25


def scenario_of_shaft(**changes: Any) -> Any:
    return scenario_in(record_of("shaft", {"time": TIMES}, drawn_shaft(0) | changes))


def test_a_bell_crank_has_two_arms_and_a_drum_is_a_wheel() -> None:
    crank = scenario_in(record_of("shaft", {"time": TIMES}, shipped("shaft")))
    sizes = sizes_of(crank)
    assert (sizes.reach, sizes.rim, len(sizes.arms)) == (0.2, 0.0, 2)
    drum = scenario_in(record_of("shaft", {"time": TIMES}, shipped("hoist_drum")))
    assert (sizes_of(drum).rim, sizes_of(drum).arms) == (0.15, ())
    outer = shapes_of(drum)[0]
    assert outer.radius == 0.15
    # So is a body of couples alone, around its shaft.
    assert sizes_of(scenario_of_shaft(forces=[])).rim == pytest.approx(0.1)


def test_a_spring_of_few_turns_winds_from_the_hub_to_a_fixed_end() -> None:
    channels = drawn_motion(1)
    data = drawn_shaft(1)
    animation = of(data, channels)
    spring = bands(animation)["torsion spring"]
    start, end = (spring.x[:, k] + 1j * spring.y[:, k] for k in (0, -1))
    assert np.ptp(end.real) < 1e-12
    assert np.ptp(end.imag) < 1e-12
    hub = sizes_of(scenario_in(record_of("shaft", channels, data))).hub
    assert start == pytest.approx(hub * np.exp(1j * channels["angle"]))
    line = line_of(spring, moment_of(animation.time, TIMES[3]))
    assert np.hypot(*np.diff(line, axis=0).T).max() < hub  # no coil is cut short
    # One of many turns is left out.
    scenario_with = scenario_of_shaft(effects={"torsion_spring": {"stiffness": 1.0}})
    assert spring_line(scenario_with, np.array([0.0, 1.0])) is not None
    assert spring_line(scenario_with, np.array([0.0, 60.0])) is None


@pytest.mark.parametrize(
    ("low", "high", "count"), [(-10.0, 60.0, 2), (None, 60.0, 1), (-300.0, 300.0, 0)]
)
def test_end_stops_are_beside_the_arm_that_is_against_them(
    low: float | None, high: float | None, count: int
) -> None:
    scenario = scenario_of_shaft()
    stops = SimpleNamespace(lowest_angle_deg=low, highest_angle_deg=high)
    effects = SimpleNamespace(**dict(scenario.effects) | {"end_stops": stops})
    stopped = scenario.model_copy(update={"effects": effects})
    lines = stops_of(stopped)
    assert len(lines) == count
    arms = sizes_of(stopped).arms
    x, y = max(arms, key=lambda arm: float(np.hypot(*arm)))
    for line, degrees, side in zip(
        lines, [d for d in (low, high) if d is not None], [-1.0, 1.0][-count:], strict=False
    ):
        # In the coordinates of the arm that is against the stop.
        arm = complex(x, y) / abs(complex(x, y)) * np.exp(1j * np.radians(degrees))
        places = (line.points[:, 0] + 1j * line.points[:, 1]) / arm
        assert (side * places.imag).min() > 0.0
        assert 0.0 < places.real.min() < places.real.max() < abs(complex(x, y))


def test_names_of_the_drawing_are_no_names_of_forces() -> None:
    data = drawn_shaft(0)
    data["forces"][0]["name"] = "weight"
    names = [part.name for part in of(data, drawn_motion(0)).parts if isinstance(part, Arrow)]
    assert len(names) == len(set(names))
