"""The worst over a turn of a body on a shaft, against a dense scan refined in many digits."""

from collections.abc import Iterator
from itertools import product
from math import degrees, inf, radians
from typing import Any

import mpmath
import numpy as np
import pytest
from mpmath import mp, mpf

import frictionsim as fs
from tests.support import shaft_balance, shaft_turn
from tests.support.cases import one_in, slow
from tests.support.scenarios import Scenario, shipped

TOLERANCE = 1e-12
SIDES = {"smallest": -1, "largest": 1}
DIRECTIONS = {"counter_clockwise": 1, "clockwise": -1}


@pytest.fixture(autouse=True)
def many_digits() -> Iterator[None]:
    with mp.workdps(50):
        yield


def label_of(data: Scenario) -> str:
    table, *rest = data["statics"]["unknown"].split(".")
    if table == "mechanism":
        return str(rest[0])
    if table == "effects":
        return "eccentric_" + str(rest[1])
    return rest[0] if rest[1] == "size" else "_".join(rest)


def value_of(data: Scenario, statics: Any, direction: str, side: str) -> tuple[Any, Any]:
    name = f"{label_of(data)}_{direction}_{side}"
    return statics[name].value, statics[f"{name}_angle"].value


def assert_no_root_is_missed(data: Scenario) -> None:
    statics, scans = fs.static(fs.load(data)), shaft_turn.scans(data)
    for direction, s in DIRECTIONS.items():
        for side, sign in SIDES.items():
            value, angle = value_of(data, statics, direction, side)
            best = scans[s].best(sign)
            if best is None or angle is None:
                assert value is angle is best is None
            elif value is None:  # a pole: a root of the scan near it is large
                around = abs(np.radians(scans[s].degrees) - angle) % (2.0 * np.pi) < 2e-3
                near = np.nanmax(abs(scans[s].values[:, around]))
                assert near > 20.0 * np.nanmedian(abs(scans[s].values))
            elif value == 0.0 and not shaft_turn.may_be_negative(data):  # a root passes zero
                # It may go with the square root of the angle, 1.6e-4 rad from scan to scan.
                around = abs(np.radians(scans[s].degrees) - angle) % (2.0 * np.pi) < 2e-3
                assert np.nanmin(scans[s].values[:, around]) < 0.1 * np.nanmax(scans[s].values)
                assert (side, best[0] < 0.1 * np.nanmax(scans[s].values)) == ("smallest", True)
            else:
                wanted, where = shaft_turn.refined(data, s, sign, *best)
                assert abs(value - wanted) <= TOLERANCE * abs(wanted)
                # Where two are as large, either angle is right.
                assert degrees(angle) == pytest.approx(float(where), abs=1e-6) or (
                    shaft_turn.refined(data, s, sign, value, degrees(angle))[0]
                    == pytest.approx(value, rel=TOLERANCE)
                )


@pytest.mark.parametrize("seed", one_in(4, range(14)))
def test_the_worst_over_a_turn_is_that_of_a_dense_scan(seed: int) -> None:
    assert_no_root_is_missed(shaft_turn.drawn(seed))


def gaps(notes: tuple[str, ...], words: str) -> list[tuple[float, float]]:
    """Return from which to which angles a note says that there is no root."""
    pairs = []
    for note in notes:
        if "makes the body about to move" in note and f"move {words} from" in note:
            begin, _, end = note.removesuffix(" deg").rpartition(" from ")[2].partition(" to ")
            pairs.append((float(begin), float(end)))
    return pairs


@pytest.mark.parametrize("seed", one_in(3, range(20, 28)))
def test_where_there_is_no_root_is_said(seed: int) -> None:
    data = shaft_turn.drawn(seed)
    data["statics"]["unknown"] = "forces.one.size"
    notes, scans = fs.static(fs.load(data)).notes, shaft_turn.scans(data)
    for s, words in ((1, "counter-clockwise"), (-1, "clockwise")):
        said = np.zeros(shaft_turn.SCANNED, dtype=bool)
        ends = np.zeros(shaft_turn.SCANNED, dtype=bool)
        for begin, end in gaps(notes, words):
            said |= (scans[s].degrees > begin) & (scans[s].degrees < end)
            for at in (begin, end):  # printed to six digits
                ends |= abs(scans[s].degrees - at) < 0.02
        assert np.all((said == scans[s].missing) | ends)


@pytest.mark.parametrize("seed", [20, 21])
def test_without_friction_one_force_balances_at_all_angles(seed: int) -> None:
    data = shaft_turn.drawn(seed)
    data["statics"]["unknown"] = "forces.one.size"
    del data["effects"]["shaft_friction"]
    statics = fs.static(fs.load(data))
    assert gaps(statics.notes, "counter-clockwise") == gaps(statics.notes, "clockwise") == []
    for side in SIDES:
        one, other = (value_of(data, statics, direction, side) for direction in DIRECTIONS)
        assert one == other != (None, None)


def test_a_force_has_no_bound_where_its_arm_is_the_friction_radius() -> None:
    """The load of a bell crank, at 0.1 m: cos q = r_s/0.1 m where it points to the axis."""
    data = shipped("shaft")
    data["statics"] = {"unknown": "forces.load.size"}
    statics = fs.static(fs.load(data))
    radius = statics["friction_radius_static"].value
    assert radius is not None
    pole = float(np.arccos(radius / 0.1))
    assert statics["load_clockwise_largest"].value is None
    assert abs(statics["load_clockwise_largest_angle"].value or inf) == pytest.approx(
        pole, rel=1e-9
    )


@pytest.mark.parametrize("longer", [0.0, 3e-13, -3e-13])
def test_two_poles_that_rounding_joins_leave_no_bound(longer: float) -> None:
    """A load at 0.06 m cos q from the axis, the friction radius: at 0 deg the poles are one.

    A = -(0.06 sin q)^2 is a tie within 1e-4 deg of it. A couple of 2 N m gives the roots.
    """
    point = [0.06 * (1.0 + longer), 0.0]
    data: Scenario = {
        "kind": "shaft",
        "mechanism": {"inertia": 1.0},
        "couples": [{"name": "motor", "size": 2.0}],
        "forces": [{"name": "load", "size": 8.0, "direction": [0.0, -1.0], "point": point}],
        "effects": {"shaft_friction": {"shaft_radius": 0.1, "mu_s": 0.75, "mu_k": 0.5}},
        "statics": {"unknown": "forces.load.size"},
    }
    statics = fs.static(fs.load(data))
    # The turn ends within the tie at 180 deg.
    for side, pole, off in (("smallest", 0.0, 1e-7), ("largest", 180.0, 1e-4)):
        assert statics[f"load_counter_clockwise_{side}"].value is None
        angle = statics[f"load_counter_clockwise_{side}_angle"].value
        assert abs(angle or 0.0) == pytest.approx(radians(pole), abs=radians(off))
    # A peak of 3e8 N that is as narrow as 0.03 deg has a bound: 2 N m over 0.06 m 1e-7.
    data["forces"][0]["point"] = [0.06 * (1.0 - 1e-7), 0.0]
    statics = fs.static(fs.load(data))
    highest = statics["load_counter_clockwise_largest"].value
    assert highest == pytest.approx(2.0 / (0.06 * 1e-7), rel=1e-6)


def test_an_extremum_at_the_end_of_the_turn_is_found() -> None:
    """A weight beside the axis, held by a couple: M = m g e cos q +- r_s m g, at 0 and 180 deg."""
    data: Scenario = {
        "kind": "shaft",
        "mechanism": {"inertia": 1.0},
        "couples": [{"name": "motor", "size": 0.0}],
        "effects": {
            "gravity": {"g": 10.0},
            "eccentric_mass": {"mass": 2.0, "radius": 0.5},
            "shaft_friction": {"shaft_radius": 0.1, "mu_s": 0.75, "mu_k": 0.5},
        },
        "statics": {"unknown": "couples.motor.size", "angle_deg": 1e-5},
    }
    statics = fs.static(fs.load(data))
    friction = float(mpf(0.1) * mpf("0.6") * 20)
    assert statics["motor_counter_clockwise_largest"].value == pytest.approx(
        10 + friction, rel=1e-15
    )
    # Values that tie, within 1e-12, are at the angle that is nearest to the middle of the turn.
    assert statics["motor_counter_clockwise_largest_angle"].value == pytest.approx(0.0, abs=1e-6)
    assert statics["motor_clockwise_smallest"].value == pytest.approx(-10 - friction, rel=1e-15)
    angle = statics["motor_clockwise_smallest_angle"].value
    assert abs(angle or 0.0) == pytest.approx(radians(180.0), abs=1e-6)
    data["statics"]["angle_deg"] = 180.00001
    statics = fs.static(fs.load(data))
    assert statics["motor_clockwise_largest"].value == pytest.approx(10 - friction, rel=1e-15)
    angle = statics["motor_clockwise_largest_angle"].value
    assert abs(angle or 0.0) % radians(360.0) == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("angle", [0.0, slow(30.0), 90.0000001, slow(200.0)])
@pytest.mark.parametrize("turning", ["point_turns", "direction_turns"])
def test_an_unknown_that_drops_out_at_an_angle_is_no_root_there(angle: float, turning: str) -> None:
    """Two forces of the arm 0.5 m cos q: (1 + x) 0.5 m cos q = 0; at +-90 deg any x will do."""
    turns = {"point_turns": False, "direction_turns": False} | {turning: True}
    up: Scenario = {"point": [0.5, 0.0], "direction": [0.0, 2.0]}
    data: Scenario = {
        "kind": "shaft",
        "mechanism": {"inertia": 1.0},
        "forces": [{"name": "pull", "size": 0.0} | up | turns, {"name": "load", "size": 1.0} | up],
        "statics": {"unknown": "forces.pull.size", "angle_deg": angle},
    }
    statics = fs.static(fs.load(data))
    for direction in DIRECTIONS:
        for side in SIDES:
            assert statics[f"pull_{direction}_{side}"].value == -1.0


def test_an_unknown_that_cannot_be_below_zero_has_no_such_extremes() -> None:
    """A spring and a weight on the axis: (r_s g x)^2 = (k q)^2 with a mass x, largest at the ends.

    The turn is from -90 to 270 deg, and not that of another turn.
    """
    data: Scenario = {
        "kind": "shaft",
        "mechanism": {"inertia": 1.0, "mass": 2.0},
        "effects": {
            "gravity": {"g": 10.0},
            "torsion_spring": {"stiffness": 3.0},
            "shaft_friction": {"shaft_radius": 0.1, "mu_s": 0.75, "mu_k": 0.5},
        },
        "statics": {"unknown": "mechanism.mass", "angle_deg": 90.0},
    }
    statics = fs.static(fs.load(data))
    assert statics["mass_clockwise"].value == pytest.approx(-statics["mass_clockwise_second"].value)
    for direction, end in (("counter_clockwise", -90.0), ("clockwise", 270.0)):
        largest = statics[f"mass_{direction}_largest"].value
        assert largest == pytest.approx(3.0 * radians(abs(end)) / (0.1 * 0.6 * 10.0), rel=1e-14)
        assert statics[f"mass_{direction}_largest_angle"].value == pytest.approx(radians(end))
        assert statics[f"mass_{direction}_smallest"].value == 0.0
        assert statics[f"mass_{direction}_smallest_angle"].value == pytest.approx(0.0, abs=1e-15)


def test_sizes_over_the_angle_and_springs_are_not_those_of_a_turn_before() -> None:
    """A spring of 2 N m/rad: its couple grows over the turn, half of which is before 90 deg."""
    data: Scenario = {
        "kind": "shaft",
        "mechanism": {"inertia": 1.0},
        "couples": [
            {"name": "motor", "size": 0.0},
            {"name": "cam", "size": {"angle_deg": [10.0, 20.0, 30.0], "value": [0.0, 50.0, 0.0]}},
        ],
        "effects": {"torsion_spring": {"stiffness": 2.0}},
        "statics": {"unknown": "couples.motor.size", "angle_deg": 90.0},
    }
    statics = fs.static(fs.load(data))
    # At the end, 270 deg, the spring; at the knot, 20 deg, the cam.
    assert statics["motor_clockwise_largest"].value == pytest.approx(
        2.0 * radians(270.0), rel=1e-15
    )
    assert statics["motor_clockwise_largest_angle"].value == pytest.approx(radians(270.0))
    cam = 2.0 * radians(20.0) - 50.0
    assert statics["motor_clockwise_smallest"].value == pytest.approx(cam, rel=1e-14)
    assert statics["motor_clockwise_smallest_angle"].value == pytest.approx(
        radians(20.0), rel=1e-15
    )


def angles_at_zero_moments(data: Scenario) -> list[Any]:
    """Return angles about which friction exceeds the moment without the unknown, in many digits."""
    without = shaft_balance.placed(data, mpf(0))
    grid = data["statics"]["angle_deg"] + np.linspace(-180.0, 180.0, 361)
    moments = shaft_turn.coefficients(data, grid)[0][0]
    angles = []
    for i in np.flatnonzero(moments[1:] * moments[:-1] < 0.0):
        zero = mpmath.findroot(
            lambda angle: shaft_balance.balance(without, angle)[0],
            (mpf(grid[i]), mpf(grid[i + 1])),
            solver="anderson",
            tol=mpf(10) ** -40,
        )
        _, across, up = shaft_balance.balance(without, zero)
        slope = shaft_balance.balance(without, zero + 1)[0]  # per deg
        width = shaft_balance.friction_radius(data) * mpmath.hypot(across, up) / slope
        angles += [zero + k * width for k in (-2, -1.001, -0.999, -0.5, 0, 0.5, 0.999, 1.001, 2)]
    return angles


@pytest.mark.parametrize("mu", [1e-6, slow(1e-9)])
@pytest.mark.parametrize(
    ("seed", "unknown"),
    [(1, "effects.gravity.g"), slow(4, "effects.gravity.g"), slow(1, "mechanism.mass"),
     (7, "mechanism.mass"), (1, "effects.eccentric_mass.radius")],
)  # fmt: skip
def test_little_friction_about_a_zero_moment_leaves_out_no_root(
    seed: int, unknown: str, mu: float
) -> None:
    """There, roots end or pass zero within 1e-6 deg."""
    data = shaft_turn.drawn(seed)
    data["mechanism"]["mass"] = 2.0
    data["effects"]["shaft_friction"]["mu_s"] = mu
    data["statics"]["unknown"] = unknown
    statics, angles = fs.static(fs.load(data)), angles_at_zero_moments(data)
    assert angles
    label = unknown.rpartition(".")[2].replace("radius", "eccentric_radius")
    for angle in angles:
        for value, sign in shaft_balance.roots(data, angle):
            for direction, s in DIRECTIONS.items():
                if value >= 0 and sign in (s, 0):
                    smallest, largest = (statics[f"{label}_{direction}_{x}"].value for x in SIDES)
                    assert smallest is not None
                    assert smallest <= value * (1 + mpf("1e-9"))
                    assert largest is None or largest >= value * (1 - mpf("1e-9"))


@pytest.mark.parametrize(
    ("seed", "mu"), [(26, 1e-11), (33, 1e-13), slow(26, 1e-13), slow(33, 1e-11)]
)
def test_friction_near_the_tie_leaves_out_no_root(seed: int, mu: float) -> None:
    """Roots of both directions are almost one; the scan has them to 1e-4 at least."""
    data = shaft_turn.drawn(seed)
    data["effects"]["shaft_friction"]["mu_s"] = mu
    data["statics"]["unknown"] = "effects.gravity.g"
    statics, scans = fs.static(fs.load(data)), shaft_turn.scans(data)
    for direction, s in DIRECTIONS.items():
        for side, sign in SIDES.items():
            value, best = statics[f"g_{direction}_{side}"].value, scans[s].best(sign)
            if value is None:
                assert statics[f"g_{direction}_{side}_angle"].value is not None  # without a bound
            else:
                assert best is not None
                assert sign * (best[0] - value) <= 1e-4 * max(abs(best[0]), abs(value))


PUSH: Scenario = {
    "kind": "shaft",
    "mechanism": {"inertia": 0.5, "mass": 3.0},
    "forces": [{"name": "push", "size": 300.0, "point": [0.1, 0.05], "direction": [-0.5, 1.0]}],
    "effects": {"gravity": {}, "shaft_friction": {"shaft_radius": 0.02, "mu_s": 0.25, "mu_k": 0.2}},
}


@pytest.mark.parametrize(
    ("name", "start"), one_in(3, product(["shaft_radius", "mu_s"], [0.0, 30.0, 80.0, 90.0]))
)
def test_friction_that_holds_vanishes_with_the_moment(name: str, start: float) -> None:
    """The moment is 300 N x 0.1118 m x cos q: both directions are beside +-90 deg."""
    key = f"effects.shaft_friction.{name}"
    statics = fs.static(fs.load(PUSH | {"statics": {"unknown": key, "angle_deg": start}}))
    for direction in DIRECTIONS:
        assert statics[f"{name}_{direction}_smallest"].value == 0.0
        angle = degrees(statics[f"{name}_{direction}_smallest_angle"].value or 0.0)
        assert angle == pytest.approx(90.0 if start else -90.0, abs=1e-12)  # the nearest
    if name == "shaft_radius":
        assert statics["shaft_radius_clockwise_largest"].value == pytest.approx(0.504731925319065)
        angle = statics["shaft_radius_counter_clockwise_largest_angle"].value
        assert repr(angle) in ("0.0", repr(radians(360.0)))


def test_a_limit_that_is_no_root_is_found() -> None:
    """A spring is free where the other moment is zero: k = m g e sin(q)/q approaches m g e."""
    data: Scenario = {
        "kind": "shaft",
        "mechanism": {"inertia": 1.0},
        "effects": {
            "gravity": {"g": 10.0},
            "eccentric_mass": {"mass": 2.0, "radius": 0.5, "azimuth_deg": 90.0},
            "torsion_spring": {"stiffness": 2.0},
        },
        "statics": {"unknown": "effects.torsion_spring.stiffness", "angle_deg": 30.0},
    }
    statics = fs.static(fs.load(data))
    assert statics["stiffness_clockwise_largest"].value == pytest.approx(10.0, rel=1e-15)
    assert repr(statics["stiffness_clockwise_largest_angle"].value) == "0.0"


def test_the_worst_is_between_the_end_stops() -> None:
    data = shipped("shaft", statics={"unknown": "forces.load.size"})
    data["effects"]["end_stops"] = {"lowest_angle_deg": -60.0, "highest_angle_deg": 40.0}
    statics = fs.static(fs.load(data))
    for direction in DIRECTIONS:
        for side in SIDES:
            angle = statics[f"load_{direction}_{side}_angle"].value
            assert angle is not None
            assert -60.0 - 1e-12 <= degrees(angle) <= 40.0 + 1e-12
