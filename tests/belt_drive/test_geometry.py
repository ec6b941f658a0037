"""The line of the ideal belt against elementary geometry, and what it refuses."""

import re
from math import asin, atan2, degrees, hypot, pi, sqrt, tau

import numpy as np
import pytest

from frictionsim.mechanisms.belt_drive.geometry import PathError, Pulley, belt_path

pytestmark = pytest.mark.quick

R, D = 0.08125, 0.253
EXACT = 1e-14  # a few roundings of lengths and angles of the order of one

EQUAL = [Pulley("drive", (0.0, 0.0), R), Pulley("driven", (D, 0.0), R)]
UNEQUAL = [Pulley("small", (0.1, -0.2), 0.03), Pulley("large", (0.4, 0.2), 0.09)]
ROLLER = [
    Pulley("a", (0.0, 0.0), 0.1),
    Pulley("b", (1.0, 0.0), 0.1),
    Pulley("roller", (0.5, 0.08), 0.05, "outside"),
]
TRIANGLE = [
    Pulley("a", (0.0, 0.0), 0.1),
    Pulley("b", (1.0, 0.1), 0.2),
    Pulley("c", (0.3, 0.8), 0.15),
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
def test_the_line_is_continuous_and_has_its_tangent(drive: list[Pulley]) -> None:
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
def test_arcs_lie_on_their_pulleys(drive: list[Pulley]) -> None:
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


TWO = ROLLER[:2]
MISSED = (
    r"the belt does not touch pulley idler: it would have to turn by .* degrees round it\."
    " Leave it out, move it towards the belt, or change its side"
)
SHORT = asin((0.1 - 0.05) / hypot(0.5, 0.04)) - atan2(0.04, 0.5)

# Pulleys, the index of the one to blame, and what is said.
REFUSED: dict[str, tuple[list[Pulley], int, str]] = {
    "one pulley": (EQUAL[:1], 0, "a belt needs at least two pulleys, not 1"),
    "an overlap": (
        [*ROLLER, Pulley("idler", (1.12, 0.0), 0.05)],
        3,
        r"pulleys b and idler overlap by 0\.03 m: their centres are 0\.12 m apart,"
        r" their radii add up to 0\.15 m",
    ),
    "missed by the radius": ([*TWO, Pulley("idler", (0.25, 0.02), 0.01)], 2, MISSED),
    "missed outside": ([*TWO, Pulley("idler", (0.5, 0.2), 0.05, "outside")], 2, MISSED),
    "how far it would turn": (
        [*TWO, Pulley("idler", (0.5, 0.04), 0.05)],
        2,
        MISSED.replace(".*", re.escape(f"{degrees(tau - 2 * SHORT):.4g}")),
    ),
    "far inside, by the sum of the turns": (
        [*TWO, Pulley("c", (0.5, 2.0), 0.1), Pulley("idler", (0.5, 0.05), 0.01)],
        3,
        MISSED,
    ),
    "an arc of zero": (
        [*TWO, Pulley("roller", (0.5, 0.15), 0.05, "outside")],
        2,
        "the belt touches pulley roller in one point only, its arc is zero:"
        " leave it out or move it towards the belt",
    ),
    "a span through a pulley": (
        [*TWO, Pulley("c", (0.5, 0.1), 0.3)],
        2,
        r"the span from a to b runs through pulley c, 0\.1 m deep:"
        r" is the order of the list wrong\?",
    ),
    "a crossed belt": (
        [EQUAL[0], EQUAL[1]._replace(side="outside")],
        1,
        "the belt would cross itself: with pulley driven outside it turns by 0 degrees in all,"
        " not by 360, as if one outside does not touch it; move that towards the belt, leave it"
        " out, or change its side",
    ),
    "spans that cross": (
        [*TWO, Pulley("roller", (0.5, -0.3), 0.05, "outside"), Pulley("c", (0.5, 1.0), 0.1)],
        1,
        r"the span from a to b crosses the one from b to roller: is the order of the list wrong\?",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_no_belt_can_go_round_is_refused(name: str) -> None:
    pulleys, culprit, message = REFUSED[name]
    with pytest.raises(PathError, match=f"^{message}$") as caught:
        belt_path(pulleys)
    assert caught.value.pulley == culprit
