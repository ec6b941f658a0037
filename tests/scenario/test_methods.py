"""Friction laws and methods: every pair runs or is refused with what to use."""

import re
from functools import cache
from itertools import product
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from tests.support.scenarios import (
    FRICTION_EFFECTS,
    SCENARIOS,
    Scenario,
    changed,
    pulley,
    simulate,
    with_method,
)

SHIPPED = {"belt_drive": "belt_verification"}
KINDS = fs.kinds()
METHODS = ("events", "rkf45", "moreau", "bdf", "radau", "lsoda", "rk45", "dop853")
SCIPY = METHODS[3:]
# Of one coordinate, and of belts: the methods of each law, in the order in which they are advised.
ONE_COORDINATE = {
    "set-valued": ("events", "rkf45"),
    "regularised": (*SCIPY, "rkf45"),
    "published": ("rkf45",),
}
BELTS = {"set-valued": ("rkf45", "moreau"), "regularised": ("rkf45",), "creep": ("rkf45",)}
LAWS = (*ONE_COORDINATE, "creep")
SINGLE_DOF = [(law, method) for law, methods in ONE_COORDINATE.items() for method in methods]
# Required parameters of a law.
PARAMETERS: dict[str, dict[str, Any]] = {
    "regularised": {"transition_speed": 0.1},
    "creep": {"transition_speed": 0.1, "maximum_creep": 1e-6},
}


@cache
def loaded(kind: str) -> Any:
    return fs.load(SHIPPED.get(kind, kind)).to_dict()


def of_kind(kind: str, law: str, backend: str) -> Scenario:
    data = with_method(loaded(kind), law, backend)
    for key in ("step", "max_step"):
        data["solver"].pop(key, None)
    for name in data["effects"].keys() & FRICTION_EFFECTS:
        for key in ("transition_speed", "maximum_creep"):
            data["effects"][name].pop(key, None)
        data["effects"][name] |= PARAMETERS.get(law, {})
    return data


@pytest.mark.parametrize("kind", KINDS)
def test_every_law_and_method_fit_or_are_refused_with_alternatives(kind: str) -> None:
    pairs = BELTS if kind == "belt_drive" else ONE_COORDINATE
    known = {method for methods in pairs.values() for method in methods}
    for law, backend in product(LAWS, METHODS):
        data = of_kind(kind, law, backend)
        able = pairs.get(law, ())
        if backend in able:
            scenario = fs.load(data, folder=SCENARIOS)
            assert (scenario.law, scenario.solver.backend) == (law, backend)
            continue
        with pytest.raises(fs.ScenarioError) as refused:
            fs.load(data, folder=SCENARIOS)
        told = " ".join(refused.value.faults)
        if not able:  # the kind does not have the law at all
            assert "should be 'set-valued'" in told or "no such parameter" in told
        elif backend not in known:
            assert f"'{backend}' does not support" in told
        else:
            assert f"use one of {', '.join(able)} (--set solver.backend={able[0]})" in told
            for advice in re.findall(r"\((--set [^)]+)\)", told):
                overrides = advice.removeprefix("--set ").split(" --set ")
                fs.load(data, overrides, folder=SCENARIOS)


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "belt_drive"])
def test_every_pair_of_law_and_method_runs(kind: str) -> None:
    for pair in SINGLE_DOF:
        data = changed(of_kind(kind, *pair), solver__duration=0.02, solver__rtol=1e-5)
        assert simulate(data).status == "done", pair


def test_methods_agree_on_a_law() -> None:
    """They integrate the same equation and differ by their tolerances only."""
    data = changed(pulley(), solver={"rtol": 1e-9, "duration": 1.5})
    data["effects"]["shaft_friction"]["transition_speed"] = 0.05
    angles = [
        float(simulate(with_method(data, "regularised", name)).channels["angle"][-1])
        for name in ("rkf45", *SCIPY)
    ]
    # SciPy's bound is on a mean over the states, whose energies are thousands.
    assert np.ptp(angles) < 1e-4


def gear(**effects: Any) -> Scenario:
    data = fs.load("epicyclic").to_dict()
    for name, keys in effects.items():
        data["effects"][name] |= keys
    return changed(data, solver__backend="rkf45")


def test_one_of_two_friction_effects_may_name_the_law() -> None:
    smoothed = {"law": "regularised", "transition_speed": 1e-2}
    for effects in (
        {"hinge_friction": smoothed},
        {"rolling_friction": smoothed},
        {"hinge_friction": {"law": "regularised"}, "rolling_friction": {"transition_speed": 1e-2}},
        {"hinge_friction": smoothed, "rolling_friction": smoothed},
    ):
        assert fs.load(gear(**effects)).law == "regularised"


def test_the_published_gear_has_its_law_in_the_equation() -> None:
    assert fs.load(changed(gear(), mechanism__formulation="published")).law == ""


def test_without_friction_any_method_works() -> None:
    for backend in (method for method in METHODS if method != "moreau"):
        data = changed(pulley(solver__backend=backend), effects={}, solver__duration=0.5)
        assert simulate(data).status == "done", backend


def test_without_friction_steps_may_be_fixed() -> None:
    data = changed(pulley(solver__backend="rkf45", solver__step=1e-3), effects={})
    assert simulate(changed(data, solver__duration=0.5)).statistics.steps == 500
