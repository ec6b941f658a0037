"""The rates of a belt drive against a program of the same equations that shares nothing."""

from itertools import pairwise
from math import inf
from typing import Any

import numpy as np
import pytest

from frictionsim.solvers.friction_curve import friction_curve
from tests.support.belt_kernels import (
    BeltModel,
    assemble,
    compiled,
    find_contacts,
    kernels,
    rates,
    row,
)
from tests.support.belt_reference import (
    NO_PULLEY,
    Accelerations,
    accelerations,
    corners,
    potential,
)
from tests.support.belt_scenarios import (
    Array,
    every_effect,
    kinematics,
    names_of,
    pair,
    reference,
    scenario_of,
    slope,
    terms_of,
)
from tests.support.scenarios import Scenario, changed, scenario_run, simulate
from tests.support.second_way import signal

# `test_compiled` has the compiled kernels.
uncompiled = pytest.mark.usefixtures("uncompiled")

# Of the largest of its kind. Coordinates of 0.3 m are rounded by 1e-16 m, which a joint of 4e5 N/m
# turns into 1e-10 N of some 100 N; sums in another order add a few of these.
CLOSE = 1e-11
# The slip of 1e-2 m/s is rounded by the speed of the rim, and an exact stick divides it by tau.
CLOSE_STUCK = 1e-10

STEP = 2e-5  # s, which the creep law asks for


def disturbed(model: BeltModel, seed: int) -> Array:
    """Return a state near the rest position: contacts open and closed, bodies stuck and sliding."""
    random = np.random.default_rng(seed)
    state, width = model.state.copy(), model.belt.width
    n, m = model.belt.n, model.belt.pul.shape[1]
    for k, size in enumerate((2e-4, 2e-4, 5e-3, 6e-3, 6e-3, 1.0)):
        state[k * width : k * width + n] += size * random.standard_normal(n)
    free = len(model.belt.free)
    state[6 * width : 6 * width + m] = random.uniform(-9.0, 9.0, m)
    state[6 * width + m : 6 * width + m + free] = 0.05 * random.standard_normal(free)
    return state


def coefficients(
    scenario: Any, body_length: float, near: Array, held: Array, slip: Array
) -> tuple[Array, Array]:
    """Return mu of each body for T > 0 and for T < 0: of the pulley it is near, of the patch.

    At rest where it is held; sliding, only the friction that brakes its slip.
    """
    law, patch = scenario.effects.belt_friction, scenario.effects.patch
    forward, backward = np.zeros(len(near)), np.zeros(len(near))
    for i, j in enumerate(near):
        at = law.pulleys.get(names_of(scenario)[j], law)
        if patch is not None and patch.start <= (i + 0.5) * body_length < patch.end:
            at = patch
        if held[i] or at.mu_s == at.mu_k:
            forward[i] = backward[i] = at.mu_s
        elif slip[i] > 0.0:
            forward[i] = at.mu_k
        else:
            backward[i] = at.mu_k
    return forward, backward


class Both:
    """The rates at one state, of the kernels and of the reference."""

    def __init__(self, data: Scenario, seed: int) -> None:
        self.scenario = scenario_of(data)
        self.model = a = assemble(self.scenario)
        self.t = 0.025 * (seed + 1) + 1e-5  # the prescribed speed is near zero
        self.state = disturbed(a, seed)
        self.rate = np.full_like(self.state, np.nan)
        self._deal(seed)
        rates(self.t, STEP, self.state, self.rate, a.belt)
        self.expected = self._reference()

    def _deal(self, seed: int) -> None:
        """Have every third body stick before, and others somewhat later."""
        a = self.model
        n = a.belt.n
        a.belt.pul[row.SPEED] = self._kinematics()[7]
        find_contacts(a.belt, self.state)
        self.held = (np.arange(n) + seed) % 3 == 0
        a.belt.con[row.STICKING, :, :n] = self.held
        kernels.update_modes(a.belt)

    def _reference(self) -> Accelerations:
        length, inv_tau = self.model.belt.length, self.model.belt.inv_tau
        belt = reference(self.scenario, length, 1.0 / inv_tau if inv_tau else 1e-5)
        parts = self._kinematics()
        away = np.hypot(
            parts[0][:, None] - belt.centres[:, 0], parts[1][:, None] - belt.centres[:, 1]
        )
        near = np.argmin(away - belt.radii, axis=1)
        law = self.scenario.effects.belt_friction
        x, y = parts[0] - belt.centres[near, 0], parts[1] - belt.centres[near, 1]
        kappa = np.array([corners(belt, i, parts[2], parts[5])[0] for i in range(belt.n)])
        along = kappa * (parts[4] * x - parts[3] * y) / np.hypot(x, y)
        slip = belt.radii[near] * parts[7][near] - along
        mu = coefficients(self.scenario, length, near, self.held, slip) if law else 0.0
        return accelerations(belt, self.t, *parts, mu=mu, h=STEP)

    def _kinematics(self) -> list[Array]:
        """Return the motion at the state, with the speeds that are prescribed."""
        parts = kinematics(self.state, self.model)
        drive, t = self.scenario.to_dict()["drive"], np.array(self.t)
        for j, name in enumerate(names_of(self.scenario)):
            if "speed" in drive.get(name, {}):
                parts[7][j] = sum(float(signal(term, t)) for term in terms_of(drive[name]["speed"]))
        return parts

    def of_bodies(self, which: int) -> Array:
        """Return a row of the contacts by body, 0 without contact."""
        con = self.model.belt.con[:, :, : self.model.belt.n]
        values: Array = np.sum(np.where(con[row.NORMAL] > 0.0, con[which], 0.0), axis=0)
        return values

    def motion_rates(self) -> Array:
        width, n = self.model.belt.width, self.model.belt.n
        return self.rate[: 6 * width].reshape(6, width)[:, :n]

    def ledger(self) -> Array:
        energies = self.model.belt.energies
        return self.rate[energies : energies + 3]


def assert_close(actual: Any, expected: Any, close: float) -> None:
    np.testing.assert_allclose(actual, expected, rtol=0, atol=close * np.max(np.abs(expected)))


def assert_same(both: Both, close: float) -> None:
    e, a = both.expected, both.model
    motion, parts = both.motion_rates(), kinematics(both.state, a)
    assert np.array_equal(motion[:3], parts[3:6])
    assert np.array_equal(kinematics(both.rate, a)[6], both._kinematics()[7])
    force = np.array([e.ax, e.ay])
    assert_close(motion[3:5], force, close)
    assert_close(motion[5], e.aphi, close)
    assert_close(a.belt.pul[row.ALPHA], e.alpha, close)
    assert_close(a.belt.pul[row.TORQUE], e.torque, close)
    pull = np.hypot(a.belt.work[row.FX], a.belt.work[row.FY])[: len(e.tension)]
    assert_close(pull, e.tension, close)
    assert_close(both.of_bodies(row.NORMAL), e.N, close)
    assert_close(both.of_bodies(row.FRICTION), e.T, close)
    assert_close(both.of_bodies(row.SLIP) * (e.pulley != NO_PULLEY), e.slip * (e.N > 0.0), close)
    p = e.powers
    lost = [p.input, p.friction, p.joint + p.bending + p.contact]
    assert_close(both.ledger(), lost, close)


@uncompiled
@pytest.mark.parametrize("seed", [0, 3])
@pytest.mark.parametrize("wrap", ["corrected", "polygon"])
def test_all_effects_together(wrap: str, seed: int) -> None:
    both = Both(every_effect(mechanism__belt__wrap=wrap), seed)
    stuck = both.of_bodies(row.STICKING)[both.expected.N > 0.0]
    assert 0.0 < np.mean(stuck) < 0.9
    assert np.sum((both.expected.p == 0.0) & (both.model.rest.pulley >= 0)) > 0
    assert len(set(both.expected.pulley)) == 4
    assert_same(both, CLOSE_STUCK)


@uncompiled
def test_signals_that_add() -> None:
    step = {"smooth_step": {"from": 0.3, "to": -0.2, "start": 0.0, "stop": 0.1}}
    drives = {
        "driver": {"speed": [{"sine": {"amplitude": 8.0, "frequency_hz": 20.0}}, step, 0.1]},
        "roller": {"torque": [step, {"sine": {"amplitude": 0.2, "frequency_hz": 50.0}}]},
        "driven": {"torque": [{"speed": [-20.0, 20.0], "value": [5.0, -5.0]}, step, step]},
    }
    assert_same(Both(every_effect(drive=drives), 1), CLOSE_STUCK)


# The roller's contact is its own in all, the driven pulley's in its linear stiffness.
OWN = {"roller": {"c1": 4e7, "c2": 5e5, "damping": 60.0, "p_max": 3e-4}, "driven": {"c2": 3e5}}


@uncompiled
def test_contact_that_differs_by_pulley() -> None:
    both = Both(every_effect(effects__contact__pulleys=OWN), 2)
    assert len(set(both.expected.pulley)) == 4
    assert_same(both, CLOSE_STUCK)


@uncompiled
def test_the_energy_has_the_depth_of_each_contact_and_the_weight() -> None:
    times = {"solver__duration": 4e-3, "output__interval": 1e-3}
    data = every_effect(effects__contact__pulleys=OWN, **times)
    done = simulate(changed(data, solver__backend="moreau"))
    assert done.checks["energy_balance"].ok
    belt = reference(scenario_run(done), assemble(scenario_run(done)).belt.length)
    c = done.channels
    energies = [potential(belt, c["x"][i], c["y"][i], c["angle"][i]) for i in (0, -1)]
    stored = c["energy_potential"]
    assert stored[-1] - stored[0] == pytest.approx(energies[1] - energies[0], rel=1e-6)


@uncompiled
def test_damping_at_one_pulley_alone() -> None:
    own = {"driven": {"damping": 30.0}}
    both = Both(pair(effects__contact__damping=0.0, effects__contact__pulleys=own), 1)
    assert both.expected.powers.contact > 0.0
    assert_same(both, CLOSE_STUCK)


WITHOUT = ["axial_damping", "bending", "belt_friction", "contact__damping"]


@uncompiled
@pytest.mark.parametrize("effect", WITHOUT)
def test_without_an_effect(effect: str) -> None:
    both = Both(pair(**{f"effects__{effect}": None}), 1)
    assert_same(both, CLOSE_STUCK)


@uncompiled
def test_free_pulleys() -> None:
    assert_same(Both(pair(), 0), CLOSE_STUCK)


LAWS = {
    "regularised": {"law": "regularised", "transition_speed": 6e-3},
    "creep": {"law": "creep", "transition_speed": 6e-3, "maximum_creep": 1e-6},
}


@uncompiled
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("seed", [0, 2])
def test_laws_of_the_slip(law: str, seed: int) -> None:
    friction = {"mu_s": 0.6, "mu_k": 0.4, **LAWS[law]}
    both = Both(pair(effects__belt_friction=friction), seed)
    size = np.abs(both.expected.slip[both.expected.N > 0.0])
    # Bodies on each branch of the law: below the transition, up to 1.5 of it, and beyond.
    assert all(np.any((a <= size) & (size < b)) for a, b in pairwise((0.0, 6e-3, 9e-3, inf)))
    assert_same(both, CLOSE)


@uncompiled
@pytest.mark.parametrize("time", [None, STEP, 0.3 * STEP])
def test_creep_depends_on_the_step_where_it_has_no_time(time: float | None) -> None:
    """In eq 13 the creep is the way slipped in the step of the integration, or in that time."""
    friction = {"mu_s": 0.6, "mu_k": 0.4, **LAWS["creep"], "elementary_time": time}
    both = Both(pair(effects__belt_friction={k: v for k, v in friction.items() if v}), 0)
    once = both.of_bodies(row.FRICTION)
    rates(both.t, 0.5 * STEP, both.state, both.rate, both.model.belt)
    halved = both.of_bodies(row.FRICTION)
    slow = (np.abs(both.expected.slip) < 6e-3) & (both.expected.N > 0.0)
    assert np.array_equal(halved[~slow], once[~slow])
    if time is None:
        assert np.all(np.abs(halved[slow]) < np.abs(once[slow]))
    else:
        assert np.array_equal(halved, once)
        # The reference has the step.
        assert np.allclose(once, both.expected.T, rtol=1e-9) == (time == STEP)


@pytest.mark.parametrize("limits", [(0.6, 0.4), (3.0, 0.0)])
def test_the_friction_curve_is_that_of_other_mechanisms(limits: tuple[float, float]) -> None:
    x = np.concatenate([np.linspace(0.0, 2.0, 401), [0.999999999, 1.000000001, 1e6]])
    curve = compiled(kernels.friction_curve)
    off = [curve(float(at), *limits) - friction_curve(float(at), *limits) for at in x]
    # The compiler may fuse a product with a sum: half a unit of each of some four operations.
    assert np.max(np.abs(off)) <= 4 * np.spacing(limits[0])


def test_sine_and_cosine_up_to_many_turns() -> None:
    random = np.random.default_rng(0)
    turns = np.arange(-1600, 1600) * np.pi
    near = [turns, turns + 1e-9, turns / 2 - 1e-9, turns / 4]
    angle = np.concatenate([random.uniform(-1e4, 1e4, 100_000), *near, np.linspace(-7, 7, 50_001)])
    count = len(angle)
    rows, joints = np.zeros((6, count + 1)), kernels.Joints(*np.zeros((8, count + 1)))
    rows[2, :count] = angle
    compiled(kernels.turn)(count, kernels.Bodies(*rows), joints)
    cos, sin = joints.cos[:count], joints.sin[:count]
    # Rounding of the series, which grows fourfold in two doublings; half a unit in the last place
    # of the angle for the turns that are taken off, where no fused operation keeps it, and 0.35
    # of one for the rounding of 2 pi, 2.4e-16, in each of them; and a little for their product.
    limit = 1.5e-15 + 1.1 * np.spacing(np.abs(angle))
    assert np.all(np.abs(cos - np.cos(angle)) <= limit)
    assert np.all(np.abs(sin - np.sin(angle)) <= limit)
    assert np.all(np.abs(cos * cos + sin * sin - 1.0) <= 4e-15)


SIGNALS = {
    "number": 3.0,
    "points": {"time": [0.1, 0.2, 0.5], "value": [1.0, -2.0, 4.0]},
    "one point": {"time": [0.1], "value": [1.5]},
    "smooth step": {"smooth_step": {"from": 1.0, "to": -3.0, "start": 0.2, "stop": 0.4}},
    "sine": {"sine": {"mean": 1.0, "amplitude": 1.0, "frequency_hz": 3.0, "phase_deg": 40.0}},
}


def test_signals_are_those_of_the_scenario() -> None:
    """Those of one pulley, which add, are rows in the order of their list."""
    tables = list(SIGNALS.values())
    belt = assemble(scenario_of(pair(drive={"driver": {"torque": tables}}))).belt
    signal_and_slope = compiled(kernels.signal)
    for k, table in enumerate(tables):
        for t in np.linspace(0.0, 0.6, 61) + 1e-9:
            # A slope of 30/s times the roundings of a time, and of cubic coefficients of 500.
            value, derivative = signal_and_slope(k, t, belt)
            assert value == pytest.approx(float(signal(table, np.array(t))), abs=1e-13)
            assert derivative == pytest.approx(slope(table, t), abs=1e-11)
