"""The line of the ideal belt against elementary geometry; refusals are in `tests/messages`."""

from math import asin, atan2, hypot, pi, sqrt, tau

import numpy as np
import pytest

from tests.support.belt_kernels import PulleyCircle, belt_path

R, D = 0.08125, 0.253
EXACT = 1e-14  # a few roundings of lengths and angles of the order of one

EQUAL = [PulleyCircle("drive", (0.0, 0.0), R), PulleyCircle("driven", (D, 0.0), R)]
UNEQUAL = [PulleyCircle("small", (0.1, -0.2), 0.03), PulleyCircle("large", (0.4, 0.2), 0.09)]
ROLLER = [
    PulleyCircle("a", (0.0, 0.0), 0.1),
    PulleyCircle("b", (1.0, 0.0), 0.1),
    PulleyCircle("roller", (0.5, 0.08), 0.05, "outside"),
]
TRIANGLE = [
    PulleyCircle("a", (0.0, 0.0), 0.1),
    PulleyCircle("b", (1.0, 0.1), 0.2),
    PulleyCircle("c", (0.3, 0.8), 0.15),
]
CLOCKWISE = [TRIANGLE[0], TRIANGLE[2], TRIANGLE[1]]
DRIVES = {
    "equal": EQUAL,
    "unequal": UNEQUAL,
    "roller": ROLLER,
    "triangle": TRIANGLE,
    "clockwise": CLOCKWISE,
}


def test_two_equal_pulleys() -> None:
    path = belt_path(EQUAL)
    assert path.length == pytest.approx(2 * D + tau * R, abs=EXACT)
    assert [arc.wrap_angle for arc in path.arcs] == pytest.approx([pi, pi], abs=EXACT)
    assert path.spans[0].start == pytest.approx((0.0, -R), abs=EXACT)
    assert path.spans[0].end == pytest.approx((D, -R), abs=EXACT)
    assert path.spans[1].start == pytest.approx((D, R), abs=EXACT)
    assert path.breakpoints == pytest.approx(np.cumsum([0.0, D, pi * R, D, pi * R]), abs=EXACT)


def test_two_unequal_pulleys() -> None:
    small, large = UNEQUAL
    d = hypot(0.3, 0.4)
    lean = asin((large.radius - small.radius) / d)
    path = belt_path(UNEQUAL)
    assert path.arcs[0].wrap_angle == pytest.approx(pi - 2 * lean, abs=EXACT)
    assert path.arcs[1].wrap_angle == pytest.approx(pi + 2 * lean, abs=EXACT)
    straight = 2 * sqrt(d * d - (large.radius - small.radius) ** 2)
    curved = small.radius * (pi - 2 * lean) + large.radius * (pi + 2 * lean)
    assert path.length == pytest.approx(straight + curved, abs=EXACT)


def test_a_roller_on_the_back_is_wrapped_the_other_way() -> None:
    a, _, roller = ROLLER
    half, height = roller.center
    reach = a.radius + roller.radius
    lean = asin(reach / hypot(half, height)) - atan2(height, half)
    path = belt_path(ROLLER)
    sweeps = [pi + lean, pi + lean, -2 * lean]
    assert [arc.wrap_angle for arc in path.arcs] == pytest.approx(sweeps, abs=EXACT)
    straight = 1.0 + 2 * sqrt(half**2 + height**2 - reach**2)
    curved = 2 * a.radius * (pi + lean) + roller.radius * 2 * lean
    assert path.length == pytest.approx(straight + curved, abs=EXACT)


def test_the_order_of_the_pulleys_gives_the_sense() -> None:
    forward, backward = belt_path(TRIANGLE), belt_path(CLOCKWISE)
    assert (forward.total_turning, backward.total_turning) == (tau, -tau)
    assert forward.length == pytest.approx(backward.length, abs=EXACT)
    assert belt_path(EQUAL[::-1]).total_turning == tau  # an area of zero


@pytest.mark.parametrize("drive", DRIVES.values(), ids=DRIVES)
def test_the_line_is_continuous_and_has_its_tangent(drive: list[PulleyCircle]) -> None:
    path = belt_path(drive)
    s = np.linspace(0.0, path.length, 4001)[:-1]
    line = path.at(s)
    tangent = np.column_stack([np.cos(line.angle), np.sin(line.angle)])
    ahead = path.at(s[:-1] + 1e-6).position
    # A step of 1e-6 m strays from the tangent by 1e-12/(2 R); a corner or a jump would not.
    assert ahead == pytest.approx(line.position[:-1] + 1e-6 * tangent[:-1], abs=2e-11)
    assert line.position[0] == pytest.approx(path.spans[0].start, abs=EXACT)
    end = path.at(np.array([path.length * (1 - 1e-15)]))
    assert end.position[0] == pytest.approx(path.spans[0].start, abs=EXACT)
    assert end.angle[0] - line.angle[0] == pytest.approx(path.total_turning, abs=2e-13)  # 1e-15 L/R


@pytest.mark.parametrize("drive", DRIVES.values(), ids=DRIVES)
def test_arcs_lie_on_their_pulleys(drive: list[PulleyCircle]) -> None:
    path = belt_path(drive)
    line = path.at(np.linspace(0.0, path.length, 1001)[:-1])
    for i, (pulley, arc) in enumerate(zip(drive, path.arcs, strict=True)):
        offset = line.position[line.pulley == i] - pulley.center
        assert np.hypot(*offset.T) == pytest.approx(pulley.radius, abs=EXACT)
        swept = np.arctan2(offset[:, 1], offset[:, 0]) - arc.start
        swept = np.mod(swept * np.sign(arc.wrap_angle) + 1e-9, tau)
        assert np.all(swept <= abs(arc.wrap_angle) + 2e-9)
        far = line.position[line.pulley == -1] - pulley.center
        assert np.all(np.hypot(*far.T) > pulley.radius - EXACT)
