"""Friction laws and methods: every pair runs or is refused with what to use."""

import re
from functools import cache
from itertools import product
from typing import Any

import numpy as np
import pytest

from frictionsim.scenario.kinds import KINDS, mechanism_module
from frictionsim.scenario.loading import ValidationFailure, load, validate
from frictionsim.scenario.methods import LAWS, METHODS, REGULARISED, SCIPY, SINGLE_DOF
from frictionsim.scenario.overrides import apply_override
from tests.support.scenarios import SCENARIOS, Scenario, changed, pulley, simulate, with_method

SHIPPED = {"belt_drive": "belt_verification"}
# Required parameters of a law.
PARAMETERS: dict[str, dict[str, Any]] = {
    "regularised": {"transition_speed": 0.1},
    "creep": {"transition_speed": 0.1, "maximum_creep": 1e-6},
}


@cache
def loaded(kind: str) -> Any:
    scenario = load(SCENARIOS / f"{SHIPPED.get(kind, kind)}.toml")
    return scenario, scenario.model_dump(by_alias=True, exclude_none=True)


def of_kind(kind: str, law: str, backend: str) -> Scenario:
    shipped, data = loaded(kind)
    data = with_method(data, law, backend)
    for key in ("step", "max_step"):
        data["solver"].pop(key, None)
    for name in shipped.friction_effects:
        for key in ("transition_speed", "maximum_creep"):
            data["effects"][name].pop(key, None)
        data["effects"][name] |= PARAMETERS.get(law, {})
    return data


@pytest.mark.parametrize("kind", KINDS)
def test_every_law_and_method_fit_or_are_refused_with_alternatives(kind: str) -> None:
    pairs = mechanism_module(kind).SCENARIO.PAIRS
    known = {method for _, method in pairs}
    for law, backend in product(LAWS, METHODS):
        data = of_kind(kind, law, backend)
        if (law, backend) in pairs:
            scenario = validate(data, SCENARIOS)
            assert (scenario.law, scenario.solver.backend) == (law, backend)
            continue
        with pytest.raises(ValidationFailure) as refused:
            validate(data, SCENARIOS)
        told = " ".join(sentence for _, sentence in refused.value.faults)
        able = [method for of, method in pairs if of == law]
        if not able:  # the kind does not have the law at all
            assert "expected 'set-valued'" in told or "no such parameter" in told
        elif backend not in known:
            assert f"'{backend}' does not support" in told
        else:
            assert f"use one of {', '.join(able)} (--set solver.backend={able[0]})" in told
            for advice in re.findall(r"\((--set [^)]+)\)", told):
                fixed = changed(data)
                for override in advice.removeprefix("--set ").split(" --set "):
                    apply_override(fixed, override)
                validate(fixed, SCENARIOS)


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "belt_drive"])
@pytest.mark.parametrize("pair", SINGLE_DOF, ids=", ".join)
def test_every_pair_of_law_and_method_runs(kind: str, pair: tuple[str, str]) -> None:
    data = changed(of_kind(kind, *pair), solver__duration=0.02, solver__rtol=1e-5)
    assert simulate(data).status == "done"


def test_methods_agree_on_a_law() -> None:
    """They integrate the same equation and differ by their tolerances only."""
    data = changed(pulley(), solver__rtol=1e-9, effects__shaft_friction__law=REGULARISED)
    data["effects"]["shaft_friction"]["transition_speed"] = 0.05
    angles = [
        float(simulate(with_method(data, REGULARISED, name)).channels["angle"][-1])
        for name in ("rkf45", *SCIPY)
    ]
    # SciPy's bound is on a mean over the states, whose energies are thousands.
    assert np.ptp(angles) < 1e-4
    exact = [
        float(simulate(with_method(pulley(), "set-valued", name)).channels["angle"][-1])
        for name in ("events", "rkf45")
    ]
    assert np.ptp(exact) < 1e-6  # rtol 1e-9 of 34 rad, over some hundred steps


def gear(**effects: Any) -> Scenario:
    data = load(SCENARIOS / "epicyclic.toml").model_dump(by_alias=True, exclude_none=True)
    for name, keys in effects.items():
        data["effects"][name] |= keys
    return changed(data, solver__backend="rkf45")


def test_one_of_two_friction_effects_may_name_the_law() -> None:
    smoothed = {"law": REGULARISED, "transition_speed": 1e-2}
    for effects in (
        {"hinge_friction": smoothed},
        {"rolling_friction": smoothed},
        {"hinge_friction": {"law": REGULARISED}, "rolling_friction": {"transition_speed": 1e-2}},
        {"hinge_friction": smoothed, "rolling_friction": smoothed},
    ):
        assert validate(gear(**effects), SCENARIOS).law == REGULARISED


def test_the_published_gear_has_its_law_in_the_equation() -> None:
    assert validate(changed(gear(), mechanism__formulation="published"), SCENARIOS).law == ""


@pytest.mark.parametrize("backend", [m for m in METHODS if m != "moreau"])
def test_without_friction_any_method_works(backend: str) -> None:
    data = changed(pulley(solver__backend=backend), effects={}, solver__duration=0.5)
    assert simulate(data).status == "done"


def test_without_friction_steps_may_be_fixed() -> None:
    data = changed(pulley(solver__backend="rkf45", solver__step=1e-3), effects={})
    assert simulate(changed(data, solver__duration=0.5)).statistics.steps == 500
