"""Marble machine and epicyclic gear in motion, against formulas of their own."""

from math import pi, radians
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from tests.support.motions import (
    Arrow,
    Body,
    arrow,
    body,
    lines,
    motion,
    number,
    point_of,
    record_of,
)
from tests.support.scenarios import shipped
from tests.support.second_way import friction_radius

TIMES = np.linspace(0.0, 2.0, 41)


def drawn_angles(rng: Any) -> Any:
    """Return angles that swing, run on or run back."""
    start, speed, swing = rng.uniform(-3.0, 3.0), rng.uniform(-9.0, 9.0), rng.uniform(0.0, 4.0)
    return start + speed * TIMES + swing * np.sin(3.0 * TIMES)


@pytest.mark.parametrize("drawn", range(2))
def test_slots_carry_marbles_on_the_rising_half(drawn: int) -> None:
    rng = np.random.default_rng(drawn)
    slots, radius = int(2 * rng.integers(2, 12)), rng.uniform(0.02, 0.5)
    data = shipped(
        "marble_machine",
        mechanism__slots=slots,
        mechanism__marble_circle_radius=radius,
        mechanism__gear_ratio=float(rng.uniform(2.0, 6.0)),
        mechanism__mesh_azimuth_deg=float(rng.uniform(-180.0, 180.0)),
    )
    angle = drawn_angles(rng)
    animation = motion(record_of("marble_machine", {"time": TIMES, "angle": angle}, data))
    marbles = [part for part in animation.parts if isinstance(part, Body) and len(part.shapes) == 1]
    marbles = [part for part in marbles if part.visible is not None]
    pitch = 2.0 * pi / slots
    for i in range(len(TIMES)):
        carried = [part for part in marbles if part.visible[i]]
        seen = [point_of(part, i, part.shapes[0].x, part.shapes[0].y) for part in carried]
        turns = angle[i] % pitch + pitch * np.arange(slots // 2)
        wanted = -1j * radius * np.exp(1j * turns)
        assert sorted(seen, key=lambda z: z.imag) == pytest.approx(wanted)
    # The pinion turns the other way, so that both rims have one speed where they touch.
    ratio = data["mechanism"]["gear_ratio"]
    azimuth = radians(data["mechanism"]["mesh_azimuth_deg"])
    distance = (ratio + 1.0) * data["mechanism"]["pinion_radius"]
    pinion = body(animation, "pinion")
    assert point_of(pinion, 9, 0.0, 0.0) == pytest.approx(distance * np.exp(1j * azimuth))
    assert np.diff(pinion.angle) == pytest.approx(-ratio * np.diff(angle))


def test_a_marble_changes_hands_at_its_transfer() -> None:
    record = fs.solve(shipped("marble_machine", solver__rtol=1e-6)).record
    animation = motion(record)
    transfers = [e for e in record.transitions if e.contact == "transfer"]
    assert len(transfers) > 6
    delivered = number(animation, "marbles delivered")
    for frame, time in enumerate(animation.time):
        assert delivered[frame] == sum(e.mode_to for e in transfers if e.time <= time)


@pytest.mark.parametrize("inside", [False, True])
@pytest.mark.parametrize("drawn", range(2))
def test_the_planet_rolls_and_the_tracer_point_is_on_its_path(drawn: int, inside: bool) -> None:
    rng = np.random.default_rng(drawn)
    sun, planet = rng.uniform(0.01, 0.5, 2)
    planet = min(planet, 0.9 * sun) if inside else planet
    radius, degrees = rng.uniform(0.0, 2.0) * planet, rng.uniform(-180.0, 180.0)
    data = shipped(
        "epicyclic",
        mechanism__sun_radius=sun,
        mechanism__planet_radius=planet,
        mechanism__mesh="internal" if inside else "external",
        effects__tracer_point__radius=radius,
        effects__tracer_point__angle_deg=degrees,
    )
    angle, length = drawn_angles(rng), sun - planet if inside else sun + planet
    turns = -length / planet if inside else length / planet
    animation = motion(record_of("epicyclic", {"time": TIMES, "angle": angle}, data))
    (path,) = lines(animation, "path of the tracer point")
    traced = path.points[0] @ np.array([1.0, 1j])
    tracer, dot = body(animation, "tracer point"), body(animation, "tracer point").shapes[0]
    for i in (0, 9, 23, 40):
        turn = radians(degrees) + turns * angle[i]
        wanted = length * np.exp(1j * angle[i]) + radius * np.exp(1j * turn)
        assert point_of(tracer, i, dot.x, dot.y) == pytest.approx(wanted, abs=1e-9)
        hub = point_of(body(animation, "planet"), i, 0.0, 0.0)
        assert hub == pytest.approx(length * np.exp(1j * angle[i]))
    phi = np.linspace(angle.min(), angle.max(), len(traced))
    known = length * np.exp(1j * phi) + radius * np.exp(1j * (radians(degrees) + turns * phi))
    assert traced == pytest.approx(known, abs=1e-12)
    finest = 0.0501 / max(1.0, abs(turns)), np.ptp(angle) / 2990
    assert np.ptp(angle) / (len(traced) - 1) <= max(finest)
    left, right, bottom, top = animation.bounds
    inner = 1.05 * sun if inside else 0.0  # of the ring, drawn a little wider
    assert min(-left, right, -bottom, top) >= max(length + radius, length + planet, inner)


@pytest.mark.parametrize("mesh", ["external", "internal"])
@pytest.mark.parametrize("load", ["weight", "radial", "published", "over speed"])
def test_the_forces_of_fig_2_are_those_of_the_motion(mesh: str, load: str) -> None:
    planet, length = 0.05, 0.17 if mesh == "external" else 0.07
    published = load == "published"
    couples, arms = ([0.2, 0.1], [0.004, 0.001]) if load == "over speed" else ([0.15], [0.004])
    over = {}
    if load == "over speed":
        over = {
            "effects.hinge_friction.torque_kinetic": {"speed": [0.0, 30.0], "value": couples},
            "effects.rolling_friction.arm_kinetic": {"speed": [0.0, 20.0], "value": arms},
        }
    done = fs.solve(
        "epicyclic",
        {
            "mechanism.mesh": mesh,
            "mechanism.planet_radius": planet,
            "mechanism.formulation": "published" if published else "consistent",
            "effects.rolling_friction.normal_load": load if load == "radial" else "weight",
            "effects.rolling_friction.arm": 0.004,
            "drive.torque": {"sine": {"mean": 0.0, "amplitude": 4.0, "frequency_hz": 0.7}},
            **over,
        },
    ).record
    animation, channels = motion(done), done.channels
    at = np.searchsorted(done.time, animation.time, side="right") - 1
    phi, omega, torque = (
        channels[name][at] for name in ("angle", "angular_velocity", "friction_torque")
    )
    radial = np.stack([np.cos(phi), np.sin(phi)], axis=-1)
    for name, mass, share in (("crank", 0.8, 0.5), ("planet", 1.2, 1.0)):
        weight = arrow(animation, f"weight of the {name}")
        assert weight.vector == pytest.approx(np.array([[0.0, -9.81 * mass]] * len(at)))
        assert weight.foot == pytest.approx(share * length * radial)
    # With the weight, it holds the centre of the planet radially, or gives it its acceleration.
    held = arrow(animation, "force of the mesh on the planet")
    inwards = 1.2 * length * omega**2 if load == "radial" else 0.0
    along = np.sum(held.vector * radial, axis=1)
    assert along - 1.2 * 9.81 * np.sin(phi) == pytest.approx(-inwards, abs=1e-12)
    assert held.foot == pytest.approx(0.12 * radial)
    assert np.linalg.norm(held.vector, axis=1) == pytest.approx(channels["normal_load"][at])
    # The powers of hinge and mesh are that of the friction torque.
    (hinge,) = lines(animation, "couple of the hinge on the planet")
    turns = (length if mesh == "external" else -length) / planet
    of_hinge = hinge.size * (turns if published else turns - 1.0)
    arm = np.interp(np.abs(turns * omega), [0.0, 20.0][: len(arms)], arms)
    mesh_torque = arm * (np.abs(turns) * (along if published else np.abs(along)))
    slips = np.abs(omega) > 1e-9
    sign = 1.0 if published else np.sign(omega)
    assert (of_hinge - sign * mesh_torque)[slips] == pytest.approx(torque[slips], abs=1e-12)
    couple = np.interp(np.abs((turns - 1.0) * omega), [0.0, 30.0][: len(couples)], couples)
    assert np.abs(hinge.size)[slips] == pytest.approx(couple[slips], rel=1e-9)
    assert np.all(np.abs(hinge.size) <= 0.2 * (1.0 + 1e-9))
    # The arc is about the hinge, and goes the way that the couple turns.
    spokes = (hinge.points[:, :25] - length * radial[:, None]) @ np.array([1.0, 1j])
    assert np.abs(spokes) == pytest.approx(0.6 * planet)
    assert np.array_equal(np.sign(np.angle(spokes[:, 1] / spokes[:, 0])), np.sign(hinge.size))
    (drive,) = lines(animation, "torque of the drive")
    assert np.array_equal(drive.size, channels["drive_torque"][at])


@pytest.mark.parametrize("drawn", range(2))
def test_the_forces_on_gear_and_pinion_are_in_balance(drawn: int) -> None:
    """Figs 4 and 11 of the paper: sums and moments of what the arrows show, at all frames."""
    rng = np.random.default_rng(drawn)
    data: Any = shipped(
        "marble_machine",
        mechanism__mesh_azimuth_deg=float(rng.uniform(-180.0, 180.0)),
        mechanism__pressure_angle_deg=float(rng.uniform(0.0, 30.0)),
        mechanism__initial_angle_deg=float(rng.uniform(-90.0, 90.0)),
        solver__duration=0.6,
    )
    record = fs.solve(data).record
    animation, machine = motion(record), data["mechanism"]
    of = {name: values[-1:] for name, values in record.channels.items()} if drawn % 2 else {}
    animation = motion(record, len(record.time) - 1) if of else animation
    of = of or record.channels
    assert len(animation.time) == len(of["time"])  # each sample is a frame
    arrows = [part for part in animation.parts if isinstance(part, Arrow)]
    marbles = [part for part in arrows if part.name == "weight of a marble"]
    assert len(marbles) == machine["slots"] // 2
    along, along_pinion = (a for a in arrows if a.name == "force of the teeth, tangential")
    inward, inward_pinion = (a for a in arrows if a.name == "force of the teeth, radial")
    lever, others = arrow(animation, "reaction of the shaft"), [along, inward, *marbles]
    others.append(arrow(animation, "weight of the gear"))
    total = sum(each.vector for each in others)
    assert total + lever.vector == pytest.approx(np.zeros_like(total), abs=1e-14)
    resultant = arrow(animation, "resultant of the other forces")
    assert resultant.vector == pytest.approx(total, abs=1e-14)
    assert resultant.foot == pytest.approx(lever.foot)
    assert np.linalg.norm(lever.vector, axis=1) == pytest.approx(of["shaft_reaction"], rel=1e-12)
    # About the axis: the weights of marbles, the force of the teeth, the friction.
    inertia = machine["gear_inertia"]
    inertia += len(marbles) * machine["marble_mass"] * machine["marble_circle_radius"] ** 2
    moment = sum(moment_about(each, 0.0) for each in [*others, lever])
    assert moment == pytest.approx(inertia * of["angular_acceleration"], abs=1e-15)
    # The pinion turns the other way; motor and pinion have an inertia.
    pinion = [along_pinion, inward_pinion]
    bearing = [arrow(animation, f"reaction of the pinion's shaft, {way}") for way in WAYS]
    both = sum(each.vector for each in [*pinion, *bearing])
    assert both == pytest.approx(np.zeros_like(both), abs=1e-14)
    moment = sum(moment_about(each, bearing[0].foot) for each in pinion)
    (arc,) = lines(animation, "drive of the pinion")
    ratio, inertia = machine["gear_ratio"], data["effects"]["motor_inertia"]["inertia"]
    turned = arc.size - moment
    assert turned == pytest.approx(inertia * ratio * of["angular_acceleration"], abs=1e-14)
    # In slip the reaction touches the circle of kinetic friction.
    slips = of["mode"] != 0
    distance = np.linalg.norm(lever.foot, axis=1)[slips]
    assert distance == pytest.approx(friction_radius(0.003, 0.4), rel=1e-9)


WAYS = ("tangential", "radial")


def moment_about(arrow: Arrow, place: Any) -> Any:
    """Return the moment of a force, N m."""
    (x, y), (across, up) = (arrow.foot - place).T, arrow.vector.T
    return x * up - y * across
