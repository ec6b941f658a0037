"""What nothing moves, and friction that never acts, are told by `check` as by a run."""

import json
import random
from collections.abc import Callable
from math import sqrt
from typing import Any

import pytest

import frictionsim as fs
from tests.support.lifts import SHAFT, lift, solved

BALANCED, NONE = "nothing moves: the applied torques are in balance", "no torque is applied"
UNPRESSED = "has no effect, zero throughout: give a coefficient above 0, and a load that presses"
FRICTION = {"shaft_radius": 0.02, "mu_s": 0.3, "mu_k": 0.2}
RISING = {"time": [0.0, 1.0], "value": [0.0, 80.0]}
NO_MU = {"effects.shaft_friction.mu_s": 0.0, "effects.shaft_friction.mu_k": 0.0}


def force(name: str, x: float, size: Any = 50.0) -> dict[str, Any]:
    return {"name": name, "size": size, "point": [x, 0.0], "direction": [0.0, -1.0]}


def shaft(mass: float = 0.0, **tables: Any) -> dict[str, Any]:
    effects = {"shaft_friction": FRICTION, **tables.pop("effects", {})}
    mechanism = {"inertia": 0.1, "mass": mass}
    data = {"kind": "shaft", "mechanism": mechanism, "effects": effects, **tables}
    return data | {"solver": {"duration": 0.5}}


def couples(*sizes: Any) -> list[dict[str, Any]]:
    return [{"name": f"c{i}", "size": size} for i, size in enumerate(sizes)]


def halves(torque: float) -> str:
    return f"{BALANCED}, {torque:.4g} N m against {torque:.4g} N m: their sum is zero"


LEVER = [force("left", -0.2), force("right", 0.2)]
CASES: dict[str, tuple[Any, dict[str, Any], str]] = {
    "weights on a cord": ("pulley", {"drive.force": 2224.1}, halves(2224.1 * 0.0508)),
    "horizontal": (
        *("pulley_horizontal", {"drive.force": 2224.1, "mechanism.load": 2224.1}),
        halves(2224.1 * 0.0508),
    ),
    "lever": (shaft(forces=LEVER), {}, halves(50.0 * 0.2)),
    "over time, at the end": (
        shaft(forces=[force("left", -0.2, RISING), force("right", 0.2, RISING)]),
        {},
        halves(40.0 * 0.2),
    ),
    "couples": (shaft(couples=couples(3.0, -3.0)), {}, halves(3.0)),
    "no load": (shaft(forces=[force("none", 0.2, 0.0)]), {}, NONE),
    "through the axis": (shaft(forces=[force("clamp", 0.0)]), {}, NONE),
    "weight on the axis": (shaft(3.0, effects={"gravity": {}}), {}, NONE),
    "coefficients of zero": ("pulley", NO_MU, UNPRESSED),
    "nothing hangs": ("pulley", {"drive": {"torque": 3.0}, "mechanism.load": 0.0}, UNPRESSED),
    "couples alone": (shaft(couples=couples(3.0)), {}, UNPRESSED),
    "mass without gravity": (shaft(40.0, couples=couples(3.0)), {}, UNPRESSED),
    "gear": ("marble_machine", NO_MU, UNPRESSED),
    "two frictions": (
        "epicyclic",
        {
            "effects.hinge_friction": {"torque_static": 0.0, "torque_kinetic": 0.0},
            "effects.rolling_friction": {"arm": 0.0},
        },
        "effects.hinge_friction and effects.rolling_friction have no effect, zero throughout",
    ),
}


@pytest.mark.parametrize("name", CASES)
def test_check_and_a_run_tell_alike_what_will_not_move_or_act(
    name: str, told: Callable[..., tuple[str, str]]
) -> None:
    source, overrides, words = CASES[name]
    scenario = fs.load(source, overrides)
    with open("case.toml", "w") as file:
        file.write(scenario.to_toml())
    (report,) = json.loads(told("check", "case.toml", "--json")[0])["scenarios"]
    assert sum(words in text for text in report["warnings"]) == 1
    assert {*report["warnings"]} == {*fs.solve(scenario).warnings}


def test_friction_that_acts_at_some_angle_time_or_speed_has_an_effect() -> None:
    spun = shaft(effects={"eccentric_mass": {"mass": 0.5, "radius": 0.1}})
    spun["mechanism"]["initial_angular_velocity"] = 3.0
    pulse = {"time": [0.1, 0.2, 0.3], "value": [0.0, 50.0, 0.0]}
    rolling = {"effects": {"gravity": {}, "rolling_friction": {"arm": 1e-4}}}
    for source, overrides in (
        (spun, {}),
        (shaft(forces=[force("pulse", 0.2, pulse)]), {}),
        ("epicyclic", {**rolling, "mechanism.initial_angle_deg": 0.0, "solver.duration": 0.5}),
    ):
        assert not any("no effect" in text for text in fs.solve(source, overrides).warnings)


def test_drawn_bodies_are_at_rest_if_and_only_if_nothing_is_said_to_move() -> None:
    """Two forces of which one changes, near the limit: it may break away at any time, or never."""
    rng, moved = random.Random(9), 0
    for _ in range(12):
        swing = {"mean": 30.0, "amplitude": rng.uniform(0.0, 12.0), "frequency_hz": 3.0}
        forces = [force("left", -0.1, {"sine": swing}), force("right", 0.1, rng.uniform(25, 35))]
        data = shaft(forces=forces, effects={"shaft_friction": {**FRICTION, "mu_s": 0.5}})
        data["solver"] = {"duration": rng.uniform(0.1, 0.3), "rtol": 1e-6, "atol": 1e-9}
        result = fs.solve(data)
        rests = not result.dataset["angular_velocity"].any()
        assert any("nothing moves" in text for text in result.warnings) is bool(rests)
        moved += not rests
    assert 2 < moved < 12


@pytest.mark.parametrize(
    ("amplitude", "second", "duration", "largest"),
    [
        (1.7, (50.0, 90.0), 8.0, 1.7 * sqrt(2.0)),
        (1.49, (5.01, 180.0), 60.0, 2.98),  # a beat, largest at 50 s, where it would break away
        (1.50001, (5.01, 180.0), 60.0, None),
        (1.4, (5.01, 180.0), 6000.0, None),  # of too many extrema nothing is said
    ],
)
def test_a_body_that_two_sines_leave_at_rest(
    amplitude: float,
    second: tuple[float, float],
    duration: float,
    largest: float | None,
    told: Callable[..., tuple[str, str]],
) -> None:
    """The static limit is 3 N m: a friction radius of 0.3 m under 10 N."""
    hz, phase = second
    first = 50.0 if hz == 50.0 else 5.0
    sines = [
        {"sine": {"amplitude": amplitude, "frequency_hz": f, "phase_deg": deg}}
        for f, deg in ((first, 0.0), (hz, phase))
    ]
    journal = {"shaft_radius": 0.5, "mu_s": 0.75, "mu_k": 0.75, "normal_load": 10.0}
    held = shaft(couples=couples(*sines), effects={"shaft_friction": journal})
    with open("held.toml", "w") as file:
        file.write(fs.load(held, {"solver.duration": duration}).to_toml())
    said = told("check", "held.toml")[1].splitlines()
    percents = [float(text.split("torque is ")[1].split()[0]) for text in said if "moves" in text]
    # A wave of the beat is that of the carrier, 1e-6 less than the beat at its largest.
    assert percents == ([] if largest is None else [pytest.approx(largest / 0.03, rel=2e-6)])


@pytest.mark.parametrize(("torque", "moves"), [(50.0, False), (220.0, True)])
def test_a_lift_moves_although_its_cord_never_slips(torque: float, moves: bool) -> None:
    """Balanced by 49 N m, its shaft holds 25 N m; the cord of that friction holds much more."""
    data = lift(
        drive__torque=torque,
        effects__shaft_friction=SHAFT,
        effects__cord_friction={"mu_s": 2.0, "mu_k": 2.0},
        solver__duration=0.1,
    )
    done = solved(data)
    assert [e.contact for e in done.transitions] == (["shaft"] if moves else [])
    assert ("nothing moves: all contacts hold" not in done.warnings) is moves


def test_a_smoothed_law_holds_nothing() -> None:
    smoothed = {"effects.shaft_friction.law": "regularised", "solver.backend": "rkf45"}
    for force_on_cord, rests in ((2300.0, False), (2224.1, True)):
        keys = {**smoothed, "drive.force": force_on_cord, "solver.duration": 0.1}
        found = [text for text in fs.solve("pulley", keys).warnings if "nothing moves" in text]
        assert bool(found) is rests
