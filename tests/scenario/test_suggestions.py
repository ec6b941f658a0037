"""The key that is meant is suggested, also for a start of it."""

import re
from typing import Any

import pytest

import frictionsim as fs

SINE = {"sine": {"mean": 0.0, "amplitude": 1.0, "frequency_hz": 2.0}}


@pytest.mark.parametrize(
    ("table", "written", "meant"),
    [
        ("drive.force.sine", "freq", "frequency_hz"),
        ("drive.force.sine", "frequency", "frequency_hz"),
        ("drive.force.sine", "ampl", "amplitude"),
        ("drive.force.sine", "phase", "phase_deg"),
        ("drive.force", "sien", "sine"),
        ("output", "int", "interval"),
        ("effects", "shaft_frction", "shaft_friction"),
        ("effects", "shaftfriction", "shaft_friction"),
        ("effects", "damping", "viscous_damping"),  # the only one with this ending
        # A common ending is no misspelling.
        ("effects", "hinge_friction", ""),
        ("effects", "friction", ""),
    ],
)
def test_the_key_that_is_meant_is_suggested(table: str, written: str, meant: str) -> None:
    force: dict[str, Any] = {"drive.force": {} if table == "drive.force" else SINE}
    with pytest.raises(fs.ScenarioError) as refused:
        fs.load("pulley", {**force, f"{table}.{written}": {}})
    suggested = re.findall(r"did you mean '(\w+)'", str(refused.value))
    assert suggested == ([meant] if meant else [])


@pytest.mark.parametrize(
    ("scenario", "key", "meant"),
    [
        ("pulley", "rtol", "'solver.rtol'"),
        ("pulley", "mu_s", "'effects.shaft_friction.mu_s' or 'effects.cord_friction.mu_s'"),
        ("pulley", "effects.wrap_deg", "'effects.cord_friction.wrap_deg'"),
        ("shaft", "stiffness", "'effects.torsion_spring.stiffness'"),
        ("epicyclic", "planet_mass", "'mechanism.planet_mass'"),
    ],
)
def test_a_key_without_its_tables_is_completed(scenario: str, key: str, meant: str) -> None:
    with pytest.raises(fs.ScenarioError) as caught:
        fs.load(scenario, [f"{key}=1.5"])
    name = key.rpartition(".")[2]
    assert str(caught.value) == f"--set: {key}: unknown key '{name}' (did you mean {meant}?)"
