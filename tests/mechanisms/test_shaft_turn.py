"""The worst over a turn of a body on a shaft: what is said to be one is, and no root is beyond."""

from collections.abc import Iterator
from math import degrees, inf, radians
from typing import Any

import numpy as np
import pytest
from mpmath import mp, mpf

import frictionsim as fs
from tests.support import shaft_balance
from tests.support.cases import one_in
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


def extremes_of(data: Scenario, statics: Any) -> Iterator[tuple[int, int, Any, Any]]:
    """Yield direction, side, value and angle, deg, of the extremes."""
    for direction, s in DIRECTIONS.items():
        for side, sign in SIDES.items():
            name = f"{label_of(data)}_{direction}_{side}"
            angle = statics[f"{name}_angle"].value
            yield s, sign, statics[name].value, None if angle is None else degrees(angle)


def roots_at(data: Scenario, direction: int, angle: float) -> list[Any]:
    return [x for x, s in shaft_balance.roots(data, angle) if s in (direction, 0)]


@pytest.mark.parametrize("seed", one_in(4, range(14)))
def test_the_worst_over_a_turn_is_a_root_and_none_of_a_dense_scan_is_beyond(seed: int) -> None:
    data = shaft_balance.drawn_turn(seed)
    scans = shaft_balance.scans(data)
    for s, sign, value, angle in extremes_of(data, fs.static(fs.load(data))):
        best = scans[s].best(sign)
        if best is None or angle is None:
            assert value is angle is best is None
            continue
        turned = abs(np.radians(scans[s].degrees - angle)) % (2.0 * np.pi) < 2e-3
        beside, sizes = scans[s].values[:, turned], abs(scans[s].values)
        if value is None:  # a pole: a root of the scan near it is large
            assert np.nanmax(abs(beside)) > 20.0 * np.nanmedian(sizes)
        elif value == 0.0 and not shaft_balance.may_be_negative(data):  # a root passes zero
            # It may go with the square root of the angle, 1.6e-4 rad from scan to scan.
            assert sign < 0
            assert np.nanmin(beside) < 0.1 * np.nanmax(scans[s].values)
        else:
            found = roots_at(data, s, angle)
            # The angle is known to 1e-7 deg, where a root is level.
            assert min(abs(value - x) for x in found) <= TOLERANCE * abs(value)
            assert sign * (best[0] - value) <= TOLERANCE * abs(value)


def gaps(notes: tuple[str, ...], words: str) -> list[tuple[float, float]]:
    """Return from which to which angles a note says that there is no root."""
    pairs = []
    for note in notes:
        if "makes the body about to move" in note and f"move {words} from" in note:
            begin, _, end = note.removesuffix(" deg").rpartition(" from ")[2].partition(" to ")
            pairs.append((float(begin), float(end)))
    return pairs


@pytest.mark.parametrize("seed", [20, 23, 26])
def test_where_there_is_no_root_is_said(seed: int) -> None:
    data = shaft_balance.drawn_turn(seed)
    data["statics"]["unknown"] = "forces.one.size"
    notes, scans = fs.static(fs.load(data)).notes, shaft_balance.scans(data)
    for s, words in ((1, "counter-clockwise"), (-1, "clockwise")):
        said, ends = np.zeros((2, shaft_balance.SCANNED), dtype=bool)
        for begin, end in gaps(notes, words):
            said |= (scans[s].degrees > begin) & (scans[s].degrees < end)
            for at in (begin, end):  # printed to six digits
                ends |= abs(scans[s].degrees - at) < 0.02
        assert np.all((said == scans[s].missing) | ends)


def test_without_friction_one_force_balances_at_all_angles() -> None:
    data = shaft_balance.drawn_turn(20)
    data["statics"]["unknown"] = "forces.one.size"
    del data["effects"]["shaft_friction"]
    statics = fs.static(fs.load(data))
    assert gaps(statics.notes, "counter-clockwise") == gaps(statics.notes, "clockwise") == []
    one, two, *others = (extreme[2:] for extreme in extremes_of(data, statics))
    assert [one, two] == others != [(None, None)] * 2


def test_a_force_has_no_bound_where_its_arm_is_the_friction_radius() -> None:
    """The load of a bell crank, at 0.1 m: cos q = r_s/0.1 m where it points to the axis."""
    data = shipped("shaft")
    data["statics"] = {"unknown": "forces.load.size"}
    statics = fs.static(fs.load(data))
    radius = statics["friction_radius_static"].value
    assert radius is not None
    assert statics["load_clockwise_largest"].value is None
    angle = abs(statics["load_clockwise_largest_angle"].value or inf)
    assert angle == pytest.approx(float(np.arccos(radius / 0.1)), rel=1e-9)


JOURNAL = {"shaft_radius": 0.1, "mu_s": 0.75, "mu_k": 0.5}  # r_s = 0.06 m


def body(unknown: str, angle: float = 0.0, **tables: Any) -> Any:
    """Return the statics of a body, and their values by name."""
    data: Scenario = {"kind": "shaft", "mechanism": {"inertia": 1.0}, **tables}
    statics = fs.static(data | {"statics": {"unknown": unknown, "angle_deg": angle}})
    return {name: quantity.value for name, quantity in statics.items()}


@pytest.mark.parametrize("longer", [0.0, 3e-13, -3e-13])
def test_two_poles_that_rounding_joins_leave_no_bound(longer: float) -> None:
    """A load at 0.06 m cos q from the axis, the friction radius: at 0 deg the poles are one.

    A = -(0.06 sin q)^2 is a tie within 1e-4 deg of it. A couple of 2 N m gives the roots.
    """

    def values(arm: float) -> Any:
        load = {"name": "load", "size": 8.0, "direction": [0.0, -1.0], "point": [arm, 0.0]}
        couples = [{"name": "motor", "size": 2.0}]
        effects = {"shaft_friction": JOURNAL}
        return body("forces.load.size", forces=[load], couples=couples, effects=effects)

    of = values(0.06 * (1.0 + longer))
    # The turn ends within the tie at 180 deg.
    for side, pole, off in (("smallest", 0.0, 1e-7), ("largest", 180.0, 1e-4)):
        assert of[f"load_counter_clockwise_{side}"] is None
        angle = of[f"load_counter_clockwise_{side}_angle"]
        assert abs(angle) == pytest.approx(radians(pole), abs=radians(off))
    # A peak of 3e8 N that is as narrow as 0.03 deg has a bound: 2 N m over 0.06 m 1e-7.
    highest = values(0.06 * (1.0 - 1e-7))["load_counter_clockwise_largest"]
    assert highest == pytest.approx(2.0 / (0.06 * 1e-7), rel=1e-6)


@pytest.mark.parametrize("start", [1e-5, 180.00001])
def test_an_extremum_at_the_end_of_the_turn_is_found(start: float) -> None:
    """A weight beside the axis, held by a couple: M = m g e cos q +- r_s m g, at 0 and 180 deg."""
    effects = {"gravity": {"g": 10.0}, "eccentric_mass": {"mass": 2.0, "radius": 0.5}}
    couples = [{"name": "motor", "size": 0.0}]
    of = body("couples.motor.size", start, couples=couples,
              effects=effects | {"shaft_friction": JOURNAL})  # fmt: skip
    friction = float(mpf(0.1) * mpf("0.6") * 20)
    wanted = (
        ("counter_clockwise_largest", 10 + friction, 0.0),
        ("clockwise_largest", 10 - friction, 0.0),
        ("clockwise_smallest", -10 - friction, 180.0),
    )
    for name, value, angle in wanted:
        assert of[f"motor_{name}"] == pytest.approx(value, rel=1e-15)
        # Values that tie, within 1e-12, are at the angle nearest to the middle of the turn.
        off = abs(of[f"motor_{name}_angle"]) % (2.0 * np.pi) - radians(angle)
        assert off == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("angle", [0.0, 90.0000001])
@pytest.mark.parametrize("turning", ["point_turns", "direction_turns"])
def test_an_unknown_that_drops_out_at_an_angle_is_no_root_there(angle: float, turning: str) -> None:
    """Two forces of the arm 0.5 m cos q: (1 + x) 0.5 m cos q = 0; at +-90 deg any x will do."""
    turns = {"point_turns": False, "direction_turns": False} | {turning: True}
    up: Scenario = {"point": [0.5, 0.0], "direction": [0.0, 2.0]}
    forces = [{"name": "pull", "size": 0.0} | up | turns, {"name": "load", "size": 1.0} | up]
    of = body("forces.pull.size", angle, forces=forces)
    assert {of[f"pull_{way}_{side}"] for way in DIRECTIONS for side in SIDES} == {-1.0}


def test_an_unknown_that_cannot_be_below_zero_has_no_such_extremes() -> None:
    """A spring and a weight on the axis: (r_s g x)^2 = (k q)^2 with a mass x, largest at the ends.

    The turn is from -90 to 270 deg, and not that of another turn.
    """
    effects = {"gravity": {"g": 10.0}, "torsion_spring": {"stiffness": 3.0}}
    of = body("mechanism.mass", 90.0, mechanism={"inertia": 1.0, "mass": 2.0},
              effects=effects | {"shaft_friction": JOURNAL})  # fmt: skip
    assert of["mass_clockwise"] == pytest.approx(-of["mass_clockwise_second"])
    for direction, end in (("counter_clockwise", -90.0), ("clockwise", 270.0)):
        largest = 3.0 * radians(abs(end)) / (0.1 * 0.6 * 10.0)
        assert of[f"mass_{direction}_largest"] == pytest.approx(largest, rel=1e-14)
        assert of[f"mass_{direction}_largest_angle"] == pytest.approx(radians(end))
        assert of[f"mass_{direction}_smallest"] == 0.0
        assert of[f"mass_{direction}_smallest_angle"] == pytest.approx(0.0, abs=1e-15)


def test_sizes_over_the_angle_and_springs_are_not_those_of_a_turn_before() -> None:
    """A spring of 2 N m/rad: its couple grows over the turn, half of which is before 90 deg."""
    cam = {"angle_deg": [10.0, 20.0, 30.0], "value": [0.0, 50.0, 0.0]}
    couples = [{"name": "motor", "size": 0.0}, {"name": "cam", "size": cam}]
    of = body("couples.motor.size", 90.0, couples=couples,
              effects={"torsion_spring": {"stiffness": 2.0}})  # fmt: skip
    # At the end, 270 deg, the spring; at the knot, 20 deg, the cam.
    for side, angle, less in (("largest", 270.0, 0.0), ("smallest", 20.0, 50.0)):
        known = 2.0 * radians(angle) - less
        assert of[f"motor_clockwise_{side}"] == pytest.approx(known, rel=1e-14)
        assert of[f"motor_clockwise_{side}_angle"] == pytest.approx(radians(angle), rel=1e-15)


@pytest.mark.parametrize(("seed", "mu"), [(1, 1e-6), (26, 1e-11)])
def test_little_friction_leaves_out_no_root(seed: int, mu: float) -> None:
    """About a zero moment, roots end or pass zero within 1e-6 deg: the scan has them to 1e-4."""
    data = shaft_balance.drawn_turn(seed)
    data["effects"]["shaft_friction"]["mu_s"] = mu
    data["statics"]["unknown"] = "effects.gravity.g"
    statics, scans = fs.static(fs.load(data)), shaft_balance.scans(data)
    for direction, s in DIRECTIONS.items():
        for side, sign in SIDES.items():
            value, best = statics[f"g_{direction}_{side}"].value, scans[s].best(sign)
            if value is None:  # without a bound
                assert statics[f"g_{direction}_{side}_angle"].value is not None
            else:
                assert best is not None
                assert sign * (best[0] - value) <= 1e-4 * max(abs(best[0]), abs(value))


@pytest.mark.parametrize(("name", "start"), [("shaft_radius", 0.0), ("mu_s", 30.0), ("mu_s", 90.0)])
def test_friction_that_holds_vanishes_with_the_moment(name: str, start: float) -> None:
    """The moment is 300 N x 0.1118 m x cos q: both directions are beside +-90 deg."""
    push = {"name": "push", "size": 300.0, "point": [0.1, 0.05], "direction": [-0.5, 1.0]}
    journal = {"shaft_radius": 0.02, "mu_s": 0.25, "mu_k": 0.2}
    of = body(f"effects.shaft_friction.{name}", start, forces=[push],
              mechanism={"inertia": 0.5, "mass": 3.0},
              effects={"gravity": {}, "shaft_friction": journal})  # fmt: skip
    for direction in DIRECTIONS:
        assert of[f"{name}_{direction}_smallest"] == 0.0
        angle = degrees(of[f"{name}_{direction}_smallest_angle"])
        assert angle == pytest.approx(90.0 if start else -90.0, abs=1e-12)  # the nearest
    if name == "shaft_radius":
        assert of["shaft_radius_clockwise_largest"] == pytest.approx(0.504731925319065)
        assert repr(of["shaft_radius_counter_clockwise_largest_angle"]) == "0.0"


def test_a_limit_that_is_no_root_is_found() -> None:
    """A spring is free where the other moment is zero: k = m g e sin(q)/q approaches m g e."""
    eccentric = {"mass": 2.0, "radius": 0.5, "azimuth_deg": 90.0}
    effects = {"gravity": {"g": 10.0}, "eccentric_mass": eccentric}
    of = body("effects.torsion_spring.stiffness", 30.0,
              effects=effects | {"torsion_spring": {"stiffness": 2.0}})  # fmt: skip
    assert of["stiffness_clockwise_largest"] == pytest.approx(10.0, rel=1e-15)
    assert repr(of["stiffness_clockwise_largest_angle"]) == "0.0"


def test_the_worst_is_between_the_end_stops() -> None:
    data = shipped("shaft", statics={"unknown": "forces.load.size"})
    data["effects"]["end_stops"] = {"lowest_angle_deg": -60.0, "highest_angle_deg": 40.0}
    for _, _, _, angle in extremes_of(data, fs.static(fs.load(data))):
        assert -60.0 - 1e-12 <= angle <= 40.0 + 1e-12
