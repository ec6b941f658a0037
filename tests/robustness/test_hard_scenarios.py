"""The scenarios of `scenarios/hard` on shafts, against references and closed forms."""

import tomllib
from collections.abc import Callable
from functools import lru_cache
from math import asin, cos, pi, radians, sin, sqrt
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.results import Record
from tests.support.problems import R_K, cases
from tests.support.scenarios import SCENARIOS, simulate, sound_file
from tests.support.shaft_reference import solution

HARD = SCENARIOS / "hard"
# The same scenario in tests/data, with known transitions and final state.
KNOWN = {
    "return": "return",
    "equal_coefficients": "sine_2Hz_two_way_mu_equal",
    "no_static_friction": "frictionless_mu0_sine",
    "tiny_inertia": "inertia_1e-6_ramp",
    "huge_inertia": "inertia_1e4_sine",
    "jump": "near_jump_down_reversal_1e-6",
    "load_through_zero": "hor_W0_sine",
    "motor_runs_back": "motor_inertia_run_back",
    "motor_stalls": "stall_in_the_cell",
    "decay": "decay_from_80",
}


@pytest.fixture(params=["events", pytest.param("rkf45", marks=pytest.mark.slow)])
def backend(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@lru_cache(maxsize=64)
def outcome(name: str, backend: str, *overrides: str) -> Record:
    """Run a hard scenario, which must pass its audit; its result is shared."""
    return sound_file(HARD / f"{name}.toml", overrides, backend)


def modes(of: Record) -> list[tuple[int, int]]:
    """Return the changes of mode, without transfers of marbles."""
    return [(e.mode_from, e.mode_to) for e in of.transitions if e.mode_from != e.mode_to]


def reference(name: str) -> dict[str, Any]:
    kinds = ("pulley", "marble_machine", "epicyclic")
    return next(case for kind in kinds for case in cases(kind) if case["name"] == name)


def test_every_hard_scenario_has_a_test() -> None:
    others = {"breakaway_limit", "jump_from_csv", "many_cycles", "long_stick"}
    others |= {"bouncing_body", "stop_load_through_zero"}
    others |= {"shaft_short_peak", "shaft_vanishing_load", "shaft_tie"}
    found = {path.stem for path in HARD.glob("*.toml")}
    assert {n for n in found if not n.startswith(("belt", "lift"))} == KNOWN.keys() | others


@pytest.mark.parametrize(
    "name",
    # The stiff one takes a million steps; it is also tested in test_pulley.py.
    [pytest.param(n, marks=pytest.mark.nightly if n == "tiny_inertia" else ()) for n in KNOWN],
)
def test_a_hard_scenario_gives_the_reference(name: str, backend: str) -> None:
    case, done = reference(KNOWN[name]), outcome(name, backend)
    assert len(modes(done)) == case["event_count"]
    changes = [e for e in done.transitions if e.mode_from != e.mode_to]
    # `events` locates stops to the tolerance; `rkf45` steps over a stop and detects it later.
    time, angle = (1e-9, 1e-8) if backend == "events" else (1e-6, 1e-5)
    for change, (at, *between, where) in zip(changes, case["events"], strict=False):
        assert [change.mode_from, change.mode_to] == between
        assert change.time == pytest.approx(at, abs=time)
        assert change.position == pytest.approx(where, abs=angle)
    # The delays of all stops add up.
    last = [done.channels["angle"][-1], done.channels["angular_velocity"][-1]]
    assert last == pytest.approx(case["final"], abs=10.0 * angle)


def test_the_motor_yields_at_the_closed_form_time(backend: str) -> None:
    done = outcome("motor_runs_back", backend)
    # The torque of five marbles from the bottom, minus the friction that still holds them, equals
    # that of the pinion: k T = M_L - r_s |reaction|, squared a quadratic in T.
    weight, load = (0.128 + 5 * 0.007) * 9.81, 0.007 * 9.81 * 0.0573425
    load *= sin(radians(72.0)) / sin(radians(18.0))
    radius = 0.003 * 0.5 / sqrt(1.25)
    tooth = 1.0 / (0.017993 * cos(radians(20.0)))  # N on the tooth for each N m on the pinion
    down = -tooth * sin(radians(102.60069032243837 + 90.0 + 20.0))
    a = 4.0**2 - (radius * tooth) ** 2
    b = 4.0 * load + radius**2 * weight * down
    c = load**2 - (radius * weight) ** 2
    torque = (b - sqrt(b * b - a * c)) / a
    expected = 0.5 + 0.5 * (0.003 - torque) / (0.003 - 0.0008)
    assert f"after {expected:.11f} s" in (HARD / "motor_runs_back.toml").read_text()
    start, *transfers = done.transitions
    # Both methods locate a breakaway to the roundoff of the torques.
    assert start.time == pytest.approx(expected, abs=1e-11)
    assert (done.channels["angular_velocity"][done.time > expected + 1e-6] < 0.0).all()
    assert [event.contact for event in transfers] == ["transfer"] * 24


# By scenario a key of its load, and this when it is a share of the one at its limit.
AT_THE_LIMIT: dict[str, tuple[str, Callable[[float], Any]]] = {
    "breakaway_limit": ("drive.force", lambda share: 2707.703079618707 * share),
    "shaft_tie": (
        "couples.push.size.value",
        lambda share: [0.0, 1.2 * share, 1.2 * share, 0.3, 1.2 * share],
    ),
    # A peak of a nanosecond.
    "shaft_short_peak": ("couples.push.size.value", lambda share: [0.0, 1.2 * share - 0.2, 0.0]),
}


@pytest.mark.parametrize("name", AT_THE_LIMIT)
@pytest.mark.parametrize("more", [-1e-9, 1e-9])
def test_breakaway_is_sharp_to_one_part_in_a_billion(more: float, name: str, backend: str) -> None:
    key, load = AT_THE_LIMIT[name]
    done = outcome(name, backend, f"{key}={load(1.0 + more)!r}")
    assert bool(np.any(done.channels["angle"])) is (more > 0.0)
    assert modes(done)[:1] == ([(0, 1)] if more > 0.0 else [])
    if more < 0.0:
        return
    first = done.transitions[0].time
    if name == "breakaway_limit":
        final = [done.channels[channel][-1] for channel in ("angle", "angular_velocity")]
        assert final == pytest.approx(reference("tie_lift_1e-9_outside")["final"], abs=1e-7)
    elif name == "shaft_tie":
        assert first == pytest.approx(0.3, abs=1e-8)
    else:  # 1.2e-9 N m below the peak, where the torque rises by 1.65 N m/s
        assert first == pytest.approx(0.605 - 1.2e-9 / (load(1.0 + more)[1] / 0.605), abs=1e-12)
        assert done.transitions[-1].mode_to == 0


@pytest.mark.parametrize("direction", [[1.0, 3.0], [-7.0, 2.0]])
def test_a_tie_holds_as_well_if_large_forces_nearly_balance(direction: list[float]) -> None:
    """Their difference, 100 N, is known to 1e-8 N, and the limit no better."""
    assert outcome("shaft_tie", "events").transitions == []
    through = {"point": [0.0, 0.0]}
    data = tomllib.loads((HARD / "shaft_tie.toml").read_text())
    data["forces"] = [
        {"name": "one", "size": 1e8, "direction": direction, **through},
        {"name": "other", "size": 1e8 - 100.0, "direction": [-x for x in direction], **through},
    ]
    assert simulate(data).transitions == []


def test_a_jump_between_adjacent_floats_is_a_jump(backend: str) -> None:
    done = outcome("jump_from_csv", backend)
    (breakaway,) = done.transitions
    assert breakaway.time in (1.0, 1.0000000000000002)
    # From rest under constant torques: I dw/dt = A - b w, b/I = 1/s.
    first = ((3113.75 - 2224.1) * 0.0508 - R_K * (3113.75 + 2224.1)) / 1.355
    t = done.time - 1.0
    expected = np.where(t > 0.0, first * (t - 1.0 + np.exp(-t)), 0.0)
    assert done.channels["angle"] == pytest.approx(expected, abs=1e-8)


def test_a_bouncing_body_comes_to_rest_at_the_closed_form_time() -> None:
    done = outcome("bouncing_body", "events")
    friction = 0.01 * 0.15 / sqrt(1.0 + 0.15**2) * (20.0 + 2.0 * 9.81)  # r_k R
    up, down = (20.0 * 0.05 + friction) / 0.05, (20.0 * 0.05 - friction) / 0.05
    time = sqrt(pi / down)  # a fall of pi/2
    speed, expected = down * time, [0.0, time]
    while speed >= 1e-3:
        speed *= 0.7
        expected += [time + speed / up, time + speed / up + speed / sqrt(up * down)]
        time, speed = expected[-1], speed * sqrt(down / up)
    assert len(expected) == 46  # 23 impacts, 22 rebounds
    assert modes(done) == [(0, -1), *[(-1, 1), (1, -1)] * 22, (-1, 0)]
    assert [e.contact for e in done.transitions] == ["shaft", "stop"] * 23
    assert [e.time for e in done.transitions] == pytest.approx(expected, abs=1e-9)
    resting = done.time >= done.transitions[-1].time
    assert resting.sum() > 200
    assert not np.any(done.channels["angle"][resting])
    assert np.unique(done.channels["stop_torque"][resting]).tolist() == [20.0 * 0.05]
    assert not np.any(done.channels["friction_torque"][resting])


def test_a_body_leaves_its_stop_when_the_load_passes_through_zero() -> None:
    done = outcome("stop_load_through_zero", "events")
    # Torque, load and friction have one sine as a factor: q'' = -c cos(w t).
    omega = 0.5 * pi
    c = 50.0 * (0.1 - 0.02 * 0.2 / sqrt(1.0 + 0.2**2)) / 2.0
    begin, end = 0.0, 2.0  # s since it left; q = c (x - sin(w x)/w)/w
    for _ in range(100):
        x = 0.5 * (begin + end)
        far = c * (x - sin(omega * x) / omega) / omega > 2.0 * pi / 3.0
        begin, end = (begin, x) if far else (x, end)
    expected = [t + d for t in range(1, 21, 2) for d in (0.0, end)][:-1]
    assert [e.time for e in done.transitions] == pytest.approx(expected, abs=1e-9)
    assert modes(done) == ([(0, -1), (-1, 0), (0, 1), (1, 0)] * 5)[:-1]
    assert {abs(leaving.position) for leaving in done.transitions[::2]} == {radians(60.0)}


@pytest.mark.slow
def test_hundreds_of_stick_slip_cycles_are_equal(backend: str) -> None:
    # Sampled once per period, all samples of the force are equal, and a warning is expected.
    cycles = 1000 if backend == "events" else 300
    options = [f"solver.duration={0.1 * cycles}", "output.interval=0.1", "output.at_events=false"]
    done = outcome("many_cycles", backend, *options)
    assert np.ptp(done.channels["drive_force"]) < 1e-6
    assert not np.any(done.channels["angular_velocity"])
    longer = "output.interval = 0.1 s is longer than a tenth of the"
    assert [warning.partition(":")[0] for warning in done.warnings] == [
        f"{longer} period of drive.force, 0.1 s",
        f"{longer} shortest time between two changes of a contact, 0.0213745 s",
    ]
    assert modes(done) == [(0, 1), (1, 0)] * cycles
    times = np.array([e.time for e in done.transitions]).reshape(cycles, 2)
    periods = 0.1 * np.arange(float(cycles))
    first = asin((2707.703079618707 - 2450.0) / 450.0) / (2.0 * pi * 10.0)
    assert times[:, 0] - periods == pytest.approx(np.full(cycles, first), abs=1e-12)
    # A stop is detected with a delay that the tolerance of the position allows.
    late = 1e-9 if backend == "events" else 1e-6
    assert np.ptp(times[:, 1] - periods) < late
    angles = np.array([e.position for e in done.transitions[1::2]])
    assert angles == pytest.approx(angles[0] * np.arange(1, cycles + 1), rel=1e-7)


def test_a_load_that_vanishes_as_the_body_slides(backend: str) -> None:
    expected = solution(tomllib.loads((HARD / "shaft_vanishing_load.toml").read_text()))
    done = outcome("shaft_vanishing_load", backend)
    assert done.transitions == [] == expected["events"]
    final = [done.channels[name][-1] for name in ("angle", "angular_velocity")]
    # It is 1e-8 rad if a step goes across the corners.
    assert final == pytest.approx(expected["final"], abs=1e-9)
    assert done.channels["shaft_reaction"].min() < 0.05 * done.channels["shaft_reaction"].max()


def test_a_long_sticking_phase_has_no_motion(backend: str) -> None:
    done = outcome("long_stick", backend)
    assert done.transitions == []
    assert done.time[-1] == 1e6
    for name in ("angle", "angular_velocity", "energy_input", "energy_friction"):
        assert not np.any(done.channels[name])
    (warning,) = done.warnings
    percent = float(warning.removeprefix("nothing moves: the largest torque is ").split()[0])
    assert 0.0 < 1.0 - percent / 100.0 < 1e-8


# Expected warnings; all other scenarios must have none.
EXPECTED_WARNINGS = {
    "breakaway_limit": ["nothing moves"],
    "long_stick": ["nothing moves"],
    "lift_moment_of_slack": ["goes slack"],
    "lift_slack_rope": ["goes slack"],
    "shaft_tie": ["nothing moves"],
    "load_through_zero": ["cannot push"],
    "motor_stalls": ["not above", "stands still"],
    "motor_runs_back": ["not above", "ran back"],
    "no_static_friction": ["no effect, zero throughout"],
    "huge_inertia": ["that of a disc of 7.75e+06 kg"],
}


@pytest.mark.parametrize(
    "path",
    [
        path
        for path in (*sorted(SCENARIOS.glob("*.toml")), *sorted(HARD.glob("*.toml")))
        if not path.stem.startswith("belt")
        and path.stem not in ("many_cycles", "tiny_inertia")  # long runs
    ],
    ids=lambda path: path.stem,
)
def test_scenarios_as_shipped_keep_their_energy_and_warn_as_expected(path: Path) -> None:
    hard = path.parent == HARD
    done = outcome(path.stem, "events") if hard else fs.solve(path).record
    assert done.checks["energy_balance"].value < 1e-9  # as docs/accuracy.md says
    expected = EXPECTED_WARNINGS.get(path.stem, [])
    for warning, words in zip(done.warnings, expected, strict=True):
        assert words in warning
