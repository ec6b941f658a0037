"""A body on a shaft in motion, against separate complex arithmetic: forces, cords, reaction."""

from typing import Any

import numpy as np
import pytest

from frictionsim.errors import InputError
from tests.support.motions import (
    Arrow,
    Body,
    Disc,
    Line,
    Motion,
    body,
    motion,
    number,
    point_of,
    record_of,
)
from tests.support.shaft_forces import (
    TIMES,
    acting,
    couples,
    drawn_motion,
    drawn_shaft,
    moment,
)

PLANE = np.array([1.0, 1j])


def arrows(animation: Motion) -> dict[str, tuple[Any, Any]]:
    """Return foot, m, and force, N, of each arrow over time, as complex numbers."""
    return {
        part.name: (part.foot @ PLANE, part.vector @ PLANE)
        for part in animation.parts
        if isinstance(part, Arrow)
    }


def torque_arcs(animation: Motion) -> dict[str, Line]:
    return {name: line for name, line in bands(animation).items() if line.size is not None}


def bands(animation: Motion) -> dict[str, Line]:
    return {part.name: part for part in animation.parts if isinstance(part, Line)}


def hub_of(animation: Motion) -> float:
    """Return the radius of the hub of the body, the smallest disc around its axis."""
    discs = [shape for shape in body(animation, "body").shapes if isinstance(shape, Disc)]
    return min(d.radius for d in discs if (d.x, d.y, d.role) == (0.0, 0.0, "moving"))


def of(data: Any, channels: Any) -> Motion:
    return motion(record_of("shaft", channels, data))


@pytest.fixture(scope="module", params=range(3))
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
    roles = {part.name: part.role for part in moved.parts if isinstance(part, Arrow)}
    assert {role for name, role in roles.items() if name.startswith("weight of")} <= {"load"}
    for name, (place, force) in wanted.items():
        away = vectors[name][0] - place
        if name == "cord":  # its arrow is further along it
            along = complex(*data["forces"][4]["direction"])
            away = away / along * abs(along)
            assert away.real.min() > 0.1 * np.abs(place).max()
            away = away - away.real.mean()
        assert away == pytest.approx(0.0 * TIMES, abs=1e-12), name
        assert vectors[name][1] == pytest.approx(force, abs=1e-9), name
    assert way + sum(force for _, force in vectors.values()) == pytest.approx(0j * TIMES, abs=1e-9)
    assert moment(foot, way) == pytest.approx(channels["friction_torque"])
    # The foot is on the perpendicular from the axis: its distance is the lever arm.
    assert (np.conj(foot) * way).real == pytest.approx(0.0 * TIMES, abs=1e-9)
    line = bands(moved)["lever arm of the reaction"]
    assert line.points[:, 1] @ PLANE == pytest.approx(foot)
    assert not line.points[:, 0].any()
    # The largest force has a length that the reach of the body gives.
    largest = max(np.abs(force).max() for force in (way, *(f for _, f in vectors.values())))
    reach = max(np.abs(place).max() for place, _ in wanted.values())
    assert 0.8 * reach < moved.scale * largest < 2.0 * reach


def test_a_cord_is_tangential_and_runs_with_the_body(drawn: Drawn) -> None:
    data, channels, moved = drawn
    radius, cord = data["forces"][4]["cord_radius"], bands(moved)["cord"]
    foot, end = (cord.points[:, k] @ PLANE for k in (0, 1))
    assert np.abs(foot) == pytest.approx(np.full(len(TIMES), abs(radius)))
    assert (np.conj(foot) * (end - foot)).real == pytest.approx(0.0 * TIMES, abs=1e-12)
    along = (end - foot) / np.abs(end - foot)
    assert moment(foot, along) == pytest.approx(np.full(len(TIMES), radius))
    # A point of the rim at the foot goes along the cord as its marks do.
    turned = channels["angle"] - channels["angle"][0]
    assert cord.travel == pytest.approx(radius * turned)


def test_arms_and_eccentric_mass_turn_with_the_body(drawn: Drawn) -> None:
    data, channels, moved = drawn
    wanted, shapes = acting(data, channels), body(moved, "body").shapes
    hub = hub_of(moved)
    pins = [s for s in shapes if isinstance(s, Disc) and s.role == "fixed" and not s.open]
    for i in (0, 7, 20):
        seen = [point_of(body(moved, "body"), i, pin.x, pin.y) for pin in pins]
        places = [wanted[name][0][i] for name in ("force-2", "force-3")]  # whose points turn
        for place in (place for place in places if abs(place) > hub):
            assert min(abs(place - pin) for pin in seen) < 1e-12
    masses = [s for s in shapes if isinstance(s, Disc) and s.role == "load"]
    assert len(masses) == ("eccentric_mass" in data["effects"])
    for mass in masses:
        place = point_of(body(moved, "body"), 9, mass.x, mass.y)
        assert place == pytest.approx(wanted["weight of the eccentric mass"][0][9])


def test_couples_are_arcs_on_one_scale_about_the_axis(drawn: Drawn) -> None:
    data, channels, _ = drawn
    data = data | {"couples": [*data["couples"], {"name": "brake", "size": -7.0}]}
    wanted = couples(data, channels)
    moved = of(data, channels)
    arcs = torque_arcs(moved)
    assert arcs.keys() == {"motor", "brake"}  # not the spring, which is drawn itself
    for name in wanted.keys() - arcs.keys():  # those of spring and damping
        assert number(moved, name) == pytest.approx(wanted[name]), name
    largest = max(np.abs(wanted[name]).max() for name in arcs)
    for name, line in arcs.items():
        bow = line.points[:, :25] @ PLANE  # then its head
        swept = np.angle(bow[:, 1:] / bow[:, :-1]).sum(axis=1)
        assert line.size == pytest.approx(wanted[name]), name
        assert swept == pytest.approx(0.75 * np.pi * wanted[name] / largest), name
    radii = [float(np.hypot(*line.points[0, 0])) for line in arcs.values()]
    assert abs(radii[0] - radii[1]) > 0.05 * max(radii)
    none = data | {"couples": [{"name": "motor", "size": 0.0}]}
    assert not torque_arcs(of(none, channels))


def test_a_scenario_of_another_version_is_refused_in_a_sentence() -> None:
    data = drawn_shaft(0) | {"unknown_table": {"a": 1}}
    with pytest.raises(InputError, match="result: its scenario is not valid: unknown_table: "):
        of(data, drawn_motion(0))


@pytest.mark.parametrize("has_friction", [True, False])
def test_forces_are_not_drawn_without_the_friction_of_a_dry_shaft(has_friction: bool) -> None:
    data, channels = drawn_shaft(0), drawn_motion(0)
    channels = {name: v for name, v in channels.items() if name != "friction_torque"}
    if not has_friction:
        effects = {name: v for name, v in data["effects"].items() if name != "shaft_friction"}
        data = data | {"effects": effects}
    assert bool(arrows(of(data, channels))) is not has_friction


@pytest.mark.parametrize(
    ("low", "high", "count"), [(-10.0, 60.0, 2), (None, 60.0, 1), (-300.0, 300.0, 0)]
)
def test_end_stops_are_beside_the_arm_that_is_against_them(
    low: float | None, high: float | None, count: int
) -> None:
    data = drawn_shaft(0)
    given = {"lowest_angle_deg": low, "highest_angle_deg": high}
    stops = {key: value for key, value in given.items() if value is not None}
    data["effects"] = data["effects"] | {"end_stops": stops}
    animation = of(data, drawn_motion(0))
    still = [part for part in animation.parts if isinstance(part, Body) and "stop" in part.name]
    lines = [shape for part in still for shape in part.shapes]
    assert len(lines) == count
    shapes = body(animation, "body").shapes
    pins = [complex(s.x, s.y) for s in shapes if isinstance(s, Disc) and s.role == "fixed"]
    longest = max(pins, key=abs)
    for line, degrees, side in zip(
        lines, [d for d in (low, high) if d is not None], [-1.0, 1.0][-count:], strict=False
    ):
        # In the coordinates of the arm that is against the stop.
        arm = longest / abs(longest) * np.exp(1j * np.radians(degrees))
        places = (line.points[:, 0] + 1j * line.points[:, 1]) / arm
        assert (side * places.imag).min() > 0.0
        assert 0.0 < places.real.min() < places.real.max() < abs(longest)
