"""The impact of a slack rope, with the friction of the shaft in it, against sums of small pulls."""

from collections.abc import Iterator, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pytest

from frictionsim.mechanisms.pulley.masses import RopeLift
from frictionsim.mechanisms.pulley.schema import LiftParameters
from frictionsim.results import FORWARD, SLACK, STICK, TAUT
from frictionsim.scenario.kinetic_friction import OverSpeed
from tests.support.wheels import signal, solved

DRAWS, PULLS = 900, 3000
ROUNDING = 1e-12


class Case(NamedTuple):
    """An impact: parameters, side of the rope (0 car), state of the bodies before."""

    n: LiftParameters
    side: int
    other_taut: bool
    w: float
    v: tuple[float, float]
    e: float

    @property
    def masses(self) -> tuple[float, float]:
        """Of the rope that becomes taut and of the other."""
        return (self.n.m1, self.n.m2) if self.side == 0 else (self.n.m2, self.n.m1)

    @property
    def sign(self) -> int:
        return 1 - 2 * self.side


class After(NamedTuple):
    """Speeds after an impact, upwards; own is the body on the rope that becomes taut."""

    w: float
    own: float
    far: float
    rope_loss: float
    heat: float


def numbers(r: float, inertia: float, masses: tuple[float, float], r_s: float, r_k: float) -> Any:
    return LiftParameters(r, inertia, *masses, 9.81, 0.0, r_s, r_k, np.inf, np.inf, True)


def drawn() -> Iterator[Case]:
    """Return impacts with shafts of all sizes, up to thicker than the pulley, at any speed."""
    rng = np.random.default_rng(7)
    while True:
        r, inertia = rng.uniform(0.1, 0.5), np.exp(rng.uniform(-3.0, 3.0))
        m1, m2 = np.exp(rng.uniform(-1.0, 5.0, 2))
        r_s = r * rng.uniform(0.0, 1.5)
        r_k = r_s * rng.choice([1.0, rng.uniform(0.3, 1.0)])
        if inertia + max(m1, m2) * r * (r - r_k) < 0.1 * inertia:
            continue  # refused by the validation
        w = rng.choice([0.0, rng.uniform(-1.0, 4.0), rng.uniform(-4.0, 1.0)])
        side, taut = int(rng.integers(2)), bool(rng.integers(2))
        sign, closing = 1 - 2 * side, rng.uniform(0.1, 2.0)
        own = sign * r * w - closing
        far = -sign * r * w + (0.0 if taut else rng.uniform(0.0, 2.0))
        v = (own, far) if side == 0 else (far, own)
        n = numbers(*map(float, (r, inertia)), (float(m1), float(m2)), float(r_s), float(r_k))
        e = float(rng.choice([0.0, rng.uniform(0.0, 0.99)]))
        yield Case(n, side, taut, float(w), (float(v[0]), float(v[1])), e)


@cache
def cases() -> list[Case]:
    source = drawn()
    return [next(source) for _ in range(DRAWS)]


def struck(
    n: LiftParameters,
    has_shaft: bool,
    contact: int,
    v: Sequence[float],
    modes: Sequence[int],
    e: float,
) -> tuple[list[float], list[float]]:
    """Return the velocities after an impact, and the heats of the contacts."""
    system = RopeLift(
        n,
        signal(0.0),
        (0.0, 0.0),
        False,
        OverSpeed(lambda w: n.r_k, n.r_k) if has_shaft else None,
        restitution=e,
        capture_speed=0.0,
        largest_force=0.0,
    )
    y = [0.0, 0.0, 0.0, *v, *[0.0 for _ in system.energies]]
    after = system.impact(contact, y, list(modes))
    heats = dict(zip(system.energies, after[6:], strict=True))
    of_ropes = [0.0, 0.0]
    of_ropes[contact - has_shaft] = heats["energy_impact"]
    return after[3:6], [*([heats["energy_friction"]] if has_shaft else []), *of_ropes]


def impact_of(case: Case) -> After:
    """Return the state after an impact by the mechanism."""
    n, r = case.n, case.n.r
    gaps = [case.w, case.v[0] - r * case.w, case.v[1] + r * case.w]
    ropes = [SLACK, TAUT] if case.side == 0 else [TAUT, SLACK]
    if not case.other_taut:
        ropes = [SLACK, SLACK]
    else:
        gaps[2 - case.side] = 0.0
    modes = (int(np.sign(case.w)), *ropes)
    velocity, heats = struck(n, True, 1 + case.side, gaps, modes, case.e)
    w = velocity[0]
    v = (velocity[1] + r * w, velocity[2] - r * w)
    own, far = v[case.side], v[1 - case.side]
    return After(w, own, far, heats[1 + case.side], heats[0])


@cache
def impacts() -> list[After]:
    return [impact_of(case) for case in cases()]


def kinetic(case: Case, w: float, own: float, far: float) -> float:
    m, other = case.masses
    return 0.5 * (case.n.inertia * w * w + m * own * own + other * far * far)


def before(case: Case) -> tuple[float, float, float]:
    return case.w, case.v[case.side], case.v[1 - case.side]


def effects_of_pulls(case: Case, direction: int, other_pulls: bool) -> Any:
    """Return changes of w, own, far and the other rope's pull, of a pull of 1 N s.

    direction is that of the shaft's motion, 0 where it stands still.
    """
    n, (m, other), sign = case.n, case.masses, case.sign
    # unknown: w, own, far, the other rope's impulse, the impulse of the torque of friction
    matrix, right = np.zeros((5, 5)), np.zeros(5)
    matrix[0], right[0] = [n.inertia, 0, 0, -sign * n.r, -1], -sign * n.r
    matrix[1, 1], right[1] = m, 1.0
    matrix[2, 2:4] = other, -1.0
    matrix[3] = [sign * n.r, 0, 1, 0, 0] if other_pulls else [0, 0, 0, 1, 0]
    if direction == 0:
        matrix[4, 0] = 1.0
    else:
        matrix[4, 3:], right[4] = (direction * n.r_k, 1.0), -direction * n.r_k
    changes = np.linalg.solve(matrix, right)[:4]
    return changes * (np.abs(changes) > ROUNDING * np.max(np.abs(changes)))


def table(case: Case) -> Any:
    """Return the effects of pulls by the direction of the shaft (0, 1, -1) and other_pulls."""
    rows = [[effects_of_pulls(case, s, pulls) for pulls in (False, True)] for s in (0, 1, -1)]
    return np.array(rows)


@cache
def summed() -> Any:
    """Return the states after the impacts, (cases, 5), by adding one small pull after another."""
    all_cases = cases()
    effects = np.array([table(case) for case in all_cases])
    every = np.arange(len(all_cases))
    state = np.array([before(case) for case in all_cases])
    r = np.array([case.n.r for case in all_cases])
    r_k = np.array([case.n.r_k for case in all_cases])
    locks = np.array([case.n.r_s >= case.n.r for case in all_cases])
    sign = np.array([case.sign for case in all_cases])
    pulls = np.array([case.other_taut for case in all_cases])
    e = np.array([case.e for case in all_cases])
    # A pull changes the rate of the gap by this, m/s.
    part = np.abs(state[:, 1] - sign * r * state[:, 0]) / PULLS
    held, taken, heat = np.zeros((3, len(all_cases)))
    opening, done = np.zeros((2, len(all_cases)), dtype=bool)
    for _ in range(4 * PULLS):
        w = state[:, 0]
        direction = np.where(w != 0.0, np.sign(w), np.where(locks, 0, -sign)).astype(int)
        change = effects[every, direction, pulls.astype(int)]
        pulls &= change[:, 3] >= -ROUNDING
        change = effects[every, direction, pulls.astype(int)]
        step = np.where(done, 0.0, part / (change[:, 1] - sign * r * change[:, 0]))
        after = state + change[:, :3] * step[:, np.newaxis]
        after[(w * after[:, 0] < 0.0), 0] = 0.0
        middle = 0.5 * (state + after)
        held -= (middle[:, 1] - sign * r * middle[:, 0]) * step
        heat += r_k * np.abs(middle[:, 0]) * (1.0 + change[:, 3]) * step
        state = after
        turned = ~opening & (state[:, 1] - sign * r * state[:, 0] >= 0.0)
        taken[turned] = held[turned]
        opening |= turned
        done |= opening & (held <= (1.0 - e * e) * taken)
        if np.all(done):
            break
    assert np.all(done)
    return np.column_stack([state, (1.0 - e * e) * taken, heat])


def kind_of(case: Case, after: After) -> str:
    """Return the motion of the shaft in an impact; positive is against the pull of the rope."""
    w, then = case.sign * case.w, case.sign * after.w
    if w == 0.0:
        return "stays" if then == 0.0 else "starts"
    if then == 0.0:
        return "locks"
    return "goes on" if w * then > 0.0 else "turns"


def test_the_draws_have_every_form_of_an_impact() -> None:
    seen = {
        (kind_of(case, after), case.side, case.other_taut, case.e > 0.0)
        for case, after in zip(cases(), impacts(), strict=True)
    }
    assert len(seen) == 5 * 2 * 2 * 2
    slackens = [
        case
        for case, after in zip(cases(), impacts(), strict=True)
        if case.other_taut and after.far + case.sign * case.n.r * after.w > 1e-9
    ]
    assert {case.side for case in slackens} == {0, 1}
    assert all(case.n.r_k > case.n.r and case.sign * case.w < 0.0 for case in slackens)


def test_an_impact_is_the_sum_of_small_pulls() -> None:
    for case, after, expected in zip(cases(), impacts(), summed(), strict=True):
        size = kinetic(case, *before(case))
        speed = abs(case.v[case.side] - case.sign * case.n.r * case.w)
        assert after.own == pytest.approx(expected[1], abs=1e-3 * speed), case
        rim = case.n.r * (abs(case.w) + abs(after.w)) + speed
        assert case.n.r * after.w == pytest.approx(case.n.r * expected[0], abs=1e-3 * rim), case
        assert after.far == pytest.approx(expected[2], abs=1e-3 * rim), case
        assert after[3:] == pytest.approx(expected[3:], abs=1e-3 * size), case


def test_the_energy_of_an_impact_is_in_its_losses() -> None:
    for case, after in zip(cases(), impacts(), strict=True):
        size = kinetic(case, *before(case))
        lost = size - kinetic(case, *after[:3])
        assert after.rope_loss + after.heat == pytest.approx(lost, abs=1e-12 * size), case
        assert after.rope_loss >= 0.0 <= after.heat


def test_friction_is_that_of_the_reaction_where_the_shaft_keeps_its_direction() -> None:
    """Elsewhere it is less, and within the static limit where the shaft locks."""
    for case, after in zip(cases(), impacts(), strict=True):
        n, (m, other), w = case.n, case.masses, case.sign * case.w
        pull = m * (after.own - case.v[case.side])
        far = other * (after.far - case.v[1 - case.side]) if case.other_taut else 0.0
        torque = n.inertia * (case.sign * after.w - w) - n.r * (far - pull)
        size = n.r * (pull + far)
        kind = kind_of(case, after)
        assert pull > 0.0
        assert far >= -1e-12 * size
        if kind == "goes on":
            sign = 1 if w > 0.0 else -1
            assert torque == pytest.approx(-sign * n.r_k * (pull + far), abs=1e-11 * size)
            rate = after.own - case.sign * n.r * after.w
            first = case.v[case.side] - case.sign * n.r * case.w
            assert rate == pytest.approx(-case.e * first, abs=1e-12 * (abs(first) + n.r * abs(w)))
        elif kind == "starts":
            assert torque == pytest.approx(n.r_k * (pull + far), abs=1e-11 * size)
        else:
            assert abs(torque) <= max(n.r_s, n.r_k) * (pull + far) + 1e-11 * size


def test_a_shaft_that_locks_stays_at_rest_with_the_other_body() -> None:
    for r_s, moves in ((0.3, False), (np.nextafter(0.3, 0.0), True)):
        n = numbers(0.3, 1.0, (20.0, 30.0), float(r_s), 0.2)
        case = Case(n, 0, True, 0.0, (-1.0, 0.0), 0.5)
        after = impact_of(case)
        assert (after.w != 0.0, after.far != 0.0) == (moves, moves)
        if not moves:
            assert after == After(0.0, 0.5, 0.0, pytest.approx(0.75 * 10.0), 0.0)


def test_the_speed_decides_about_the_direction_and_not_the_mode_before() -> None:
    n = numbers(0.3, 1.0, (20.0, 30.0), 0.1, 0.1)
    one, other = (
        struck(n, True, 1, [0.0, -1.0, 0.0], (mode, SLACK, TAUT), 0.0) for mode in (STICK, FORWARD)
    )
    assert one == other


@pytest.mark.parametrize(("m2", "e"), [(2.0, 0.0), (5.0, 0.0), (5.0, 0.5)])
def test_two_ropes_that_become_taut_at_one_time_share_their_energy(m2: float, e: float) -> None:
    """Both bodies fall by the same gap onto a pulley at rest; the sum of all energies stays.

    Without restitution both ropes stay taut: the moment of momentum gives the common motion.
    """
    r, inertia, m1, g, gap = 0.3, 0.5, 2.0, 9.81, 0.1
    n = numbers(r, inertia, (m1, m2), 0.0, 0.0)
    lift = RopeLift(
        n, signal(0.0), (0.0, 0.0), restitution=e, capture_speed=0.0, largest_force=100.0
    )
    lift.start[1:3] = [gap, gap]
    lift._at_start = lift.stored(lift.start)
    falls = (2.0 * gap / g) ** 0.5
    solver = solved(lift, falls * (1.0 + 1e-9))
    events = [(c.contact, c.time) for c in solver.recording.transitions if c.time > 0.0]
    assert [name for name, _ in events] == ["car_rope", "counterweight_rope"]
    assert events[0][1] == events[1][1] == pytest.approx(falls, rel=1e-12)
    _, gap_1, gap_2, w, rate_1, rate_2, *_, heat = solver.state.y
    fallen = 0.5 * (m1 + m2) * (g * falls) ** 2
    v1, v2 = r * w + rate_1, rate_2 - r * w
    kinetic = 0.5 * (inertia * w * w + m1 * v1 * v1 + m2 * v2 * v2)
    assert kinetic + heat == pytest.approx(fallen, rel=1e-7)  # what gravity adds in 1e-9 of a fall
    assert min(gap_1, gap_2, rate_1, rate_2) >= -1e-9
    assert w * inertia + r * (m1 * v1 - m2 * v2) == pytest.approx(
        r * (m2 - m1) * g * falls, rel=1e-7, abs=1e-9
    )
    if e == 0.0:
        common = r * (m2 - m1) * g * falls / (inertia + (m1 + m2) * r * r)
        assert w == pytest.approx(common, rel=1e-7, abs=1e-9)
