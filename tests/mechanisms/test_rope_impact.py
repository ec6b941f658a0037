"""The impact of a slack rope, with the friction of the shaft in it, against sums of small pulls."""

from math import copysign, nextafter
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.mechanisms.pulley.masses import RopeLift
from frictionsim.mechanisms.pulley.rope_impact import shock
from tests.support.lifts import lift
from tests.support.wheels import solved

PULLS = 2000


class Case(NamedTuple):
    """An impact of the masses `own` and `other`, the latter 0 where its rope is slack."""

    n: Any
    own: float
    other: float
    w: float
    rate: float
    e: float


def drawn(count: int) -> list[Case]:
    """Return impacts with shafts of all sizes, up to thicker than the pulley, at any speed."""
    rng, cases = np.random.default_rng(7), list[Case]()
    while len(cases) < count:
        r, inertia = rng.uniform(0.1, 0.5), np.exp(rng.uniform(-3.0, 3.0))
        own, other = np.exp(rng.uniform(-1.0, 5.0, 2))
        r_s = r * rng.uniform(0.0, 1.5)
        r_k = r_s * rng.choice([1.0, rng.uniform(0.3, 1.0)])
        if inertia + max(own, other) * r * (r - r_k) < 0.1 * inertia:
            continue  # refused by the validation
        w = rng.choice([0.0, rng.uniform(-1.0, 4.0), rng.uniform(-4.0, 1.0)])
        n = SimpleNamespace(r=r, inertia=inertia, r_s=r_s, r_k=r_k)
        e = rng.choice([0.0, rng.uniform(0.0, 0.99)])
        closing = -rng.uniform(0.1, 2.0)
        cases.append(Case(n, own, other * rng.integers(2), w, closing, e))
    return cases


def effect_of_pull(case: Case, direction: int, other: float) -> tuple[float, float]:
    """Return dw and the impulse of the other rope, of a pull of 1 N s; 0 is a shaft that locks."""
    n = case.n
    if direction == 0:
        return 0.0, 0.0
    r_f = direction * n.r_k
    # I dw = (J' - 1) r - s r_k (1 + J'),  m' r dw = -J'
    matrix = [[n.inertia, r_f - n.r], [other * n.r, 1.0]]
    dw, pull = np.linalg.solve(matrix, [-n.r - r_f, 0.0]).tolist()
    return dw, pull


def summed(case: Case) -> tuple[float, float, float, float]:
    """Return w, the rate of the gap and both losses after an impact, by one pull after another."""
    n, own, other, w, rate, e = case
    held = heat = 0.0
    left, part, known = None, -rate / PULLS, dict[tuple[int, float], tuple[float, float]]()
    while left is None or held > left:
        s = 0 if w == 0.0 and n.r_s >= n.r else int(copysign(1.0, w if w else -1.0))
        if (s, other) not in known:
            known[s, other] = effect_of_pull(case, s, other)
        dw, pull = known[s, other]
        if pull < 0.0:
            other = 0.0
            continue
        step = part / (1.0 / own - n.r * dw)
        w_new = w + dw * step
        w_new = 0.0 if w * w_new < 0.0 else w_new
        held -= (rate + 0.5 * part) * step
        heat += n.r_k * abs(0.5 * (w + w_new)) * (1.0 + pull) * step
        w, rate = w_new, rate + part
        if left is None and rate >= 0.0:
            taken, left = held, (1.0 - e * e) * held
    return w, rate, (1.0 - e * e) * taken, heat


def kinetic(case: Case, w: float, rate: float) -> float:
    n, own, other = case[:3]
    rim = n.r * w
    return 0.5 * (n.inertia * w * w + own * (rate + rim) ** 2 + other * rim**2)


def test_an_impact_is_the_sum_of_small_pulls_and_keeps_the_energy() -> None:
    kinds = set()
    for case in drawn(60):
        end, (w, rate, rope, heat) = shock(*case), summed(case)
        size, rim = kinetic(case, case.w, case.rate), case.n.r * abs(case.w) - case.rate
        assert case.n.r * end.w == pytest.approx(case.n.r * w, abs=2e-3 * rim), case
        assert end.rate == pytest.approx(rate, abs=2e-3 * rim), case
        lost = (1.0 - case.e**2) * end.absorbed
        assert (lost, end.heat) == pytest.approx((rope, heat), abs=2e-3 * size), case
        if end.other == case.other:
            left = size - kinetic(case, end.w, end.rate)
            assert lost + end.heat == pytest.approx(left, abs=1e-12 * size), case
        if case.e == 0.0:
            assert end.rate == 0.0
        kinds.add((np.sign(case.w), np.sign(end.w), end.other == case.other))
    # From rest and both directions: goes on, turns, locks, stays, starts; falls slack.
    assert {(w, then) for w, then, _ in kinds} >= {(1, 1), (1, -1), (1, 0), (0, 0), (0, -1)}
    assert (-1, -1, False) in kinds


def test_a_shaft_as_thick_as_the_pulley_locks() -> None:
    for r_s, moves in ((0.3, False), (nextafter(0.3, 0.0), True)):
        n: Any = SimpleNamespace(r=0.3, inertia=1.0, r_s=r_s, r_k=0.2)
        end = shock(n, 20.0, 30.0, 0.0, -1.0, 0.5)
        assert (end.w != 0.0) == moves
        if not moves:
            assert end[1:] == (0.5, 30.0, pytest.approx(10.0), 0.0)


@pytest.mark.parametrize("e", [0.0, 0.5])
def test_two_ropes_that_become_taut_at_one_time_share_their_energy(e: float) -> None:
    """Both bodies fall by the same gap onto a pulley at rest; the sum of all energies stays.

    Without restitution both ropes stay taut: the moment of momentum gives the common motion.
    """
    r, inertia, m1, m2, g, gap = 0.3, 0.5, 2.0, 5.0, 9.81, 0.1
    masses = {"car": m1, "counterweight": m2, "restitution": e, "capture_speed": 1e-9}
    data = lift(mechanism={"cord_radius": r, "inertia": inertia}, effects__hanging_masses=masses)
    scenario: Any = fs.load(data)
    system = RopeLift(scenario)
    system.start[1:3] = [gap, gap]
    system._at_start = system.stored(system.start)
    falls = (2.0 * gap / g) ** 0.5
    solver = solved(system, falls * (1.0 + 1e-9))
    events = [(c.contact, c.time) for c in solver.recording.transitions if c.time > 0.0]
    assert [name for name, _ in events] == ["car_rope", "counterweight_rope"]
    assert events[0][1] == events[1][1] == pytest.approx(falls, rel=1e-12)
    _, gap_1, gap_2, w, rate_1, rate_2, *_, heat = solver.state.y
    v1, v2 = r * w + rate_1, rate_2 - r * w
    kinetic = 0.5 * (inertia * w * w + m1 * v1 * v1 + m2 * v2 * v2)
    # What gravity adds in 1e-9 of a fall.
    assert kinetic + heat == pytest.approx(0.5 * (m1 + m2) * (g * falls) ** 2, rel=1e-7)
    assert min(gap_1, gap_2, rate_1, rate_2) >= -1e-9
    momentum = r * (m2 - m1) * g * falls
    assert w * inertia + r * (m1 * v1 - m2 * v2) == pytest.approx(momentum, rel=1e-7, abs=1e-9)
    if e == 0.0:
        assert w == pytest.approx(momentum / (inertia + (m1 + m2) * r * r), rel=1e-7)
