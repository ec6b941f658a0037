"""Runs that are stopped, and their checkpoints changed."""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import frictionsim as fs
from frictionsim.errors import BudgetExceeded
from tests.support.belt_scenarios import pair, trio
from tests.support.scenarios import SCENARIOS, Scenario, changed, pulley

SINE = {"sine": {"mean": 2224.1, "amplitude": 1000.0, "frequency_hz": 1.0}}
SHORT = {"duration": 1.5, "rtol": 1e-4, "atol": 1e-6}
WITHOUT_CONTACT = {"effects__contact": None, "effects__bending": None}


def shipped(name: str, backend: str, **changes: Any) -> Scenario:
    """Return a shipped scenario of one coordinate as data, with few samples."""
    data = fs.load(SCENARIOS / f"{name}.toml").to_dict()
    short = {"solver__rtol": 1e-4, "solver__atol": 1e-6, "solver__backend": backend}
    return changed(data, **{**short, "output__interval": 0.05, **changes})


def sliding(**changes: Any) -> Scenario:
    """Return a pulley that sticks and slips."""
    return pulley(drive__force=SINE, solver=dict(SHORT), output__interval=0.05, **changes)


def belt(data: Scenario, backend: str, **changes: Any) -> Scenario:
    """Return a belt as data, for a few milliseconds."""
    short = {"solver__duration": 4e-3, "output__interval": 2e-4, "solver__backend": backend}
    return changed(data, **{**short, **changes})


SPEED = {"speed": {"sine": {"mean": 0.5, "amplitude": 3.0, "frequency_hz": 0.7}}}
PRESCRIBED: dict[str, Any] = {"drive": SPEED, "solver__duration": 3.0}
LAW = "effects__shaft_friction__law"
PUBLISHED: dict[str, Any] = {LAW: "published", "solver__backend": "rkf45"}
REGULARISED = PUBLISHED | {LAW: "regularised", "effects__shaft_friction__transition_speed": 0.05}
FORMULATION = "mechanism__formulation"
STIFF = {"effects__axial_damping": {"coefficient": 200.0}}
# Scenarios, and after how many calls of `on_step` they are stopped.
ORIGINALS: dict[str, tuple[Callable[[], Scenario], int]] = {
    "pulley events": (lambda: sliding(), 40),
    "pulley rkf45": (lambda: sliding(solver__backend="rkf45"), 60),
    "pulley at rest": (lambda: pulley(output__interval=0.1), 4),
    "pulley published": (lambda: sliding(**PUBLISHED, solver__step=1e-2), 60),
    "pulley regularised": (lambda: sliding(**REGULARISED), 60),
    "pulley frictionless": (lambda: sliding(effects__shaft_friction=None), 40),
    "marble machine events": (lambda: shipped("marble_machine", "events"), 60),
    "marble machine rkf45": (lambda: shipped("marble_machine", "rkf45"), 60),
    "gear events": (lambda: shipped("epicyclic", "events"), 40),
    "gear rkf45": (lambda: shipped("epicyclic", "rkf45"), 40),
    "gear of given speed": (lambda: shipped("epicyclic", "events", **PRESCRIBED), 60),
    "gear published": (lambda: shipped("epicyclic", "rkf45", **{FORMULATION: "published"}), 40),
    "hoist drum events": (lambda: shipped("hoist_drum", "events"), 40),
    "hoist drum rkf45": (lambda: shipped("hoist_drum", "rkf45"), 150),
    "end stop events": (lambda: shipped("hard/bouncing_body", "events"), 40),
    "lift events": (lambda: shipped("lift", "events"), 25),
    "lift with slack rope": (lambda: shipped("hard/lift_slack_rope", "events"), 40),
    "belt moreau": (lambda: belt(pair(), "moreau"), 12),
    "belt rkf45": (lambda: belt(pair(), "rkf45"), 12),
    "belt stiff moreau": (lambda: belt(pair(**STIFF), "moreau"), 12),
    "belt of many effects moreau": (lambda: belt(trio(), "moreau"), 12),
    "belt of many effects rkf45": (lambda: belt(trio(), "rkf45"), 12),
    "string moreau": (lambda: belt(pair(**WITHOUT_CONTACT), "moreau"), 12),
    "string stiff moreau": (lambda: belt(pair(**WITHOUT_CONTACT, **STIFF), "moreau"), 12),
    "string rkf45": (lambda: belt(pair(**WITHOUT_CONTACT), "rkf45"), 12),
}


@cache
def original(name: str) -> fs.Result:
    """Return a run that was stopped."""
    data, calls = ORIGINALS[name]
    left = iter(range(calls))

    def on_step(t: float) -> None:
        if next(left, None) is None:
            raise BudgetExceeded(f"stopped at t = {t:.9g} s")

    result = fs.solve(data(), progress=on_step)
    assert result.failure == "budget_exceeded", f"{name}: {result.status}, {result.reason}"
    return result


def write_original(
    name: str, folder: Path, change: Callable[[dict[str, Any]], object] = lambda state: None
) -> Path:
    """Write a run that was stopped, with a change to its state; return its file."""
    record = original(name).record
    state = dict(record.checkpoint or {})
    change(state)
    return fs.Result(record._replace(checkpoint=state)).save(folder / "a.partial.h5")
