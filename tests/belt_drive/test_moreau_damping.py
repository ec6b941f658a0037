"""Damping of the section, stiffer than the waves: solved for together with friction."""

from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pytest

from tests.support.belt_kernels import (
    ALPHA,
    BACKWARD_LIMIT,
    FORWARD_LIMIT,
    FRICTION,
    NX,
    NY,
    RADIUS,
    SLIP,
    STICK_BIAS,
    STICKING,
    BeltModel,
    StiffDamping,
    assemble,
    contact_forces,
    find_contact_candidates,
    joint_forces,
    kinematics_of,
    solve_damping_and_friction,
    stiff_damping,
)
from tests.support.belt_reference import Belt, corners, gap, gap_rate
from tests.support.belt_scenarios import (
    GENTLY,
    MUCH_FRICTION,
    NO_FRICTION,
    RISING,
    SHORT,
    Array,
    Stepped,
    distance,
    halved,
    kick,
    orders,
    pair,
    reference,
    scenario_of,
    shipped,
    stepped,
)
from tests.support.scenarios import Scenario, simulate

# b/l a joint is 480 N s/m: 4 b/m decays in 1e-5 s, in a tenth of the period of a wave.
SECTION = {"coefficient": 20.0, "basis": "section"}


# --- the impulses of one step --------------------------------------------------------------------


class Strike(NamedTuple):
    """A step's end before dampers and friction, and who sticks."""

    model: BeltModel
    belt: Belt
    before: Array  # (6, width), positions and old velocities
    after: Array  # the same with the new velocities, dampers and friction left out
    speeds: Array  # new, friction left out
    kappa: Array  # wrap factor of each body
    damping: StiffDamping


STEP = 1e-4
COEFFICIENT = 500.0


def strike(share_stuck: float, seed: int, wrap: str = "corrected") -> Strike:
    """Return a random step in which a share of the bodies stick and the others slide."""
    scenario = scenario_of(pair(mechanism__belt__wrap=wrap))
    a = assemble(scenario)
    random = np.random.default_rng(seed)
    width, n = a.system.layout.width, a.system.chain.bodies
    before = kinematics_of(a.state, a.system.layout).copy()
    before[:3, :n] += np.array([[1e-4], [1e-4], [1e-2]]) * random.standard_normal((3, n))
    before[3:, :n] = np.array([[0.1], [0.1], [3.0]]) * random.standard_normal((3, n))
    after = before.copy()
    after[3:, :n] += 0.1 * before[3:, ::-1][:, -n:]
    effects, contacts = a.system.effects, a.system.contacts
    joint_forces(a.system.chain, effects.axial_damping, before, a.system.workspace)
    find_contact_candidates(a.system, before)
    contact_forces(before, contacts, effects.contact)
    speeds = np.array([3.0, -2.0])
    a.system.pulleys.table[ALPHA] = speeds
    table, count = a.system.contacts.table, a.system.contacts.offsets[-1]
    body = a.system.contacts.body[:count].astype(int)
    body = np.minimum(body, n - 1)  # what fills a block up may stand behind the last body
    belt = reference(scenario, a.system.chain.length)
    kappa = np.array([corners(belt, i, before[2, :n], before[5, :n])[0] for i in range(n)])
    for row, motion, sign in ((SLIP, before, 1.0), (STICK_BIAS, after, -1.0)):
        along = motion[4, body] * table[NX, :count] - motion[3, body] * table[NY, :count]
        table[row, :count] = sign * kappa[body] * along
    filled = table[RADIUS, :count] > 0.0
    table[STICKING, :count] = (random.random(n) < share_stuck)[body] & filled
    # Beyond what holds them, and too little to stop them: the guess who sticks is right.
    for limit in (FORWARD_LIMIT, BACKWARD_LIMIT):
        table[limit, :count] = np.where(table[STICKING, :count] > 0.0, 1e9, 1e-9 * filled)
    damping = stiff_damping(COEFFICIENT, width, 2)
    return Strike(a, belt, before, after, speeds, kappa, damping)


def rates_of_stretch(s: Strike) -> Array:
    """Return the matrix (n, 3 n) that makes the rates at which joints stretch of velocities."""
    n = s.belt.n
    position, phi = s.before[:2, :n].T, s.before[2, :n]
    rates = np.zeros((n, 3 * n))
    for k in range(n):
        d = gap(s.belt, k, position, phi)
        for column in {row * n + i for i in (k, (k - 1) % n) for row in range(3)}:
            unit = np.zeros(3 * n)
            unit[column] = 1.0
            moved = gap_rate(s.belt, k, phi, unit[: 2 * n].reshape(2, n).T, unit[2 * n :])
            rates[k, column] = moved @ d / np.hypot(*d)
    return rates


def contacts_of(s: Strike) -> list[tuple[int, int, int]]:
    """Return index, body and pulley of each contact."""
    contacts = s.model.system.contacts
    return [
        (k, int(contacts.body[k]), j)
        for j in range(2)
        for k in range(contacts.offsets[j], contacts.offsets[j + 1])
        if contacts.table[RADIUS, k] > 0.0
    ]


def dense(s: Strike) -> tuple[Array, Array, Array]:
    """Return new velocities (3 n), speeds and damper's mean rates, of one system for all."""
    n, table = s.belt.n, s.model.system.contacts.table
    mass = np.repeat([s.belt.m, s.belt.m, s.belt.inertia], n)
    rates = rates_of_stretch(s)
    old, free = s.before[3:, :n].ravel(), s.after[3:, :n].ravel()
    contacts = contacts_of(s)
    along = np.zeros((len(contacts), 3 * n + 2))  # makes slips, rim less body, of velocities
    for row, (k, i, j) in enumerate(contacts):
        along[row, [i, n + i]] = s.kappa[i] * np.array([table[NY, k], -table[NX, k]])
        along[row, 3 * n + j] = s.belt.radii[j]
    stuck = np.array([table[STICKING, k] > 0.0 for k, _, _ in contacts])
    matrix = np.diag([*mass, *s.belt.inertias])
    matrix[: 3 * n, : 3 * n] += 0.5 * STEP * COEFFICIENT * rates.T @ rates
    right = np.array([*mass * free, *s.belt.inertias * s.speeds])
    right[: 3 * n] -= 0.5 * STEP * COEFFICIENT * rates.T @ rates @ old
    held = along[stuck]
    zeros = np.zeros((len(held), len(held)))
    solution = np.linalg.solve(
        np.block([[matrix, held.T], [held, zeros]]), np.append(right, np.zeros(len(held)))
    )
    new = solution[: 3 * n]
    return new, solution[3 * n : 3 * n + 2], 0.5 * rates @ (old + new)


@pytest.mark.usefixtures("uncompiled")
@pytest.mark.parametrize("share_stuck", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("wrap", ["corrected", "polygon"])
def test_one_step_is_that_of_a_dense_system(wrap: str, share_stuck: float, seed: int) -> None:
    s = strike(share_stuck, seed, wrap)
    a, n = s.model, s.belt.n
    expected, speeds, mean_rates = dense(s)
    after = s.after.copy()
    heat = solve_damping_and_friction(STEP, s.before, after, s.damping, a.system)
    for k, i, _ in contacts_of(s):
        impulse = s.kappa[i] * a.system.contacts.table[FRICTION, k] / a.system.chain.mass
        after[3, i] -= impulse * a.system.contacts.table[NY, k]
        after[4, i] += impulse * a.system.contacts.table[NX, k]
    velocities = after[3:, :n].ravel()
    # Rounding times the condition of the system, some 1e3; and what slides is braked by its limit,
    # 1e-9 N s, which turns bodies of 3e-6 kg m^2 and levers of 0.02 m by 1e-6 rad/s and more.
    close = 1e-12 if share_stuck == 1.0 else 1e-6
    assert np.max(np.abs(velocities - expected)) <= close * np.max(np.abs(expected))
    assert a.system.pulleys.table[ALPHA] == pytest.approx(speeds, rel=close)
    assert heat == pytest.approx(STEP * COEFFICIENT * np.sum(mean_rates**2), rel=close)


# --- whole runs ----------------------------------------------------------------------------------


def share_solved(end: Stepped) -> float:
    """Return in what share of the steps dampers were solved for."""
    steps, _, _, solved = end.stepper.checkpoint_arrays()["counts"]
    return float(solved / steps)


def damped(**changes: object) -> Scenario:
    return pair(effects__axial_damping=SECTION, **changes)


SMOOTH = {
    "without friction": (damped(effects__belt_friction=NO_FRICTION), kick(GENTLY)),
    "sticking": (damped(effects__belt_friction=MUCH_FRICTION, drive__driver__torque=RISING), None),
}


@pytest.mark.parametrize("name", SMOOTH)
def test_the_implicit_solution_is_of_second_order(name: str) -> None:
    data, disturb = SMOOTH[name]
    data = {**data, "solver": {"backend": "moreau", "duration": SHORT}}
    steps = halved(6.4e-5, 4)
    ends = [stepped({**data, "solver": {**data["solver"], "step": h}}, disturb) for h in steps]
    assert all(share_solved(end) == 1.0 for end in ends)
    errors = [distance(*two) for two in pairwise(ends)]
    # The longest step is where the waves are hardly resolved.
    assert [np.log2(a / b) for a, b in pairwise(errors)] == pytest.approx([2.0, 2.0], abs=0.35)
    exact = stepped({**data, "solver": {"duration": SHORT, "rtol": 1e-8}}, disturb)
    # A third of the last difference is left of an error of second order.
    assert distance(ends[-1], exact) == pytest.approx(errors[-1] / 3.0, rel=0.1)


@pytest.mark.usefixtures("uncompiled")
def test_without_the_effect_it_is_as_without_friction() -> None:
    solver = {"backend": "moreau", "duration": 5e-4, "step": 6.4e-5}
    ends = [
        stepped({**damped(effects__belt_friction=friction), "solver": solver}, kick(GENTLY))
        for friction in (None, NO_FRICTION)
    ]
    assert all(share_solved(end) == 1.0 for end in ends)
    width = ends[0].model.system.layout.width
    state, expected = (end.state[: 6 * width] for end in ends)
    np.testing.assert_allclose(state, expected, rtol=1e-12, atol=1e-12)


def test_through_switches_it_is_of_first_order_at_least() -> None:
    data = {**damped(), "solver": {"backend": "moreau", "duration": SHORT}}
    slopes = orders(data, halved(6.4e-5, 4), "step", kick(0.2))
    assert np.mean(slopes) >= 0.9


def published(backend: str) -> Scenario:
    """Return the drive with damping of the section, of which explicit steps would decay by 40."""
    return shipped(
        "belt_drive",
        effects__axial_damping__basis="section",
        solver={"backend": backend, "duration": 0.01, "rtol": 1e-4},
        output={"interval": 5e-3},
    )


def test_the_tension_has_the_share_of_implicit_dampers() -> None:
    runs = (simulate(published(backend)) for backend in ("moreau", "rkf45"))
    # The belt is being stretched: its springs have 565.6 N of 565.7 N. The two are 1e-5 apart.
    tensions, expected = (done.channels["tension"][-1, :6] for done in runs)
    assert tensions == pytest.approx(expected, rel=2e-5)


def test_it_is_stable_at_the_default_step_and_its_energies_add_up() -> None:
    """With dampers a thousand times as stiff, for many steps."""
    done = simulate(
        damped(
            effects__axial_damping__coefficient=2e4, solver__backend="moreau", solver__duration=0.1
        )
    )
    assert done.status == "done"
    assert np.max(done.channels["tension"]) < 500.0
    assert np.max(np.abs(done.channels["pulley_speed"])) < 50.0
    assert done.checks["energy_balance"].ok
