"""Keys: the one that is meant is suggested, those taken out are known, those varied have units."""

import re
from collections.abc import Callable
from typing import Any

import pytest

import frictionsim as fs
from tests.support.belt_scenarios import pair
from tests.support.scenarios import Scenario, shipped

Told = Callable[..., tuple[str, str]]
SINE = {"sine": {"mean": 0.0, "amplitude": 1.0, "frequency_hz": 2.0}}


@pytest.mark.parametrize(
    ("table", "written", "meant"),
    [
        ("drive.force.sine", "freq", "frequency_hz"),
        ("drive.force.sine", "phase", "phase_deg"),
        ("drive.force", "sien", "sine"),
        ("output", "int", "interval"),
        ("effects", "shaft_frction", "shaft_friction"),
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
        ("shaft", "stiffness", "'effects.torsion_spring.stiffness'"),
        ("epicyclic", "planet_mass", "'mechanism.planet_mass'"),
    ],
)
def test_a_key_without_its_tables_is_completed(scenario: str, key: str, meant: str) -> None:
    with pytest.raises(fs.ScenarioError) as caught:
        fs.load(scenario, [f"{key}=1.5"])
    name = key.rpartition(".")[2]
    assert str(caught.value) == f"--set: {key}: unknown key '{name}' (did you mean {meant}?)"


@pytest.mark.parametrize(
    ("key", "said"),
    [
        ("effects.shaft_fricton", "(did you mean 'shaft_friction'?)"),
        ("effects.viscous_damping.coeff", "(did you mean 'coefficient'?)"),
        ("nope", "; known: kind, title, solver, output, mechanism, drive, effects"),
    ],
)
def test_an_unknown_key_is_not_taken_out_in_silence(key: str, said: str, told: Told) -> None:
    wanted = f"{key}: unknown key '{key.rpartition('.')[2]}'"
    _, stderr = told("check", "pulley", "--set", f"{key}=none", code=2)
    assert stderr == f"frictionsim: --set: {wanted}{'' if said[0] == ';' else ' '}{said}\n"
    for run in (
        lambda: fs.load("pulley", {key: None}),
        lambda: fs.sweep("pulley", {key: ["none"]}),
    ):
        with pytest.raises(fs.FrictionsimError) as raised:
            run()
        assert wanted in str(raised.value)


@pytest.mark.parametrize("value", ["1", "none"])
def test_a_key_of_a_table_without_keys_is_told_so(value: str, told: Told) -> None:
    given = ("--set", "effects.wear={}", "--set", f"effects.wear.x={value}")
    _, stderr = told("check", "belt_string", *given, code=2)
    assert stderr.endswith("effects.wear.x: unknown key 'x'; this table has no keys\n")


@pytest.mark.parametrize(
    ("name", "overrides"),
    [
        ("pulley", {"effects.viscous_damping": None, "effects.hanging_masses": None}),
        ("belt_drive", {"effects.patch": None, "effects.belt_friction.pulleys.driver": None}),
        ("belt_drive", {"drive.driven": None, "solver.step": None}),
    ],
)
def test_known_keys_are_taken_out_where_they_are_not(name: str, overrides: dict[str, Any]) -> None:
    fs.load(name, overrides)


ON_THE_BODY: dict[str, Any] = {"direction": [0.0, -1.0], "point": [0.1, 0.0]}


def shaft() -> Scenario:
    """Return a body with forces of several names, in one instant."""
    forces = [
        {"name": "load", "size": {"sine": {"amplitude": 2.0, "frequency_hz": 1.0}}, **ON_THE_BODY},
        {"name": "size", "size": 1.0, **ON_THE_BODY},
        {"name": "cord", "size": 3.0, "direction": [0.0, -1.0], "cord_radius": 0.1},
    ]
    couples = [{"name": "motor", "size": 1.0}]
    return shipped("shaft", forces=forces, couples=couples, solver__duration=1e-3)


def belt() -> Scenario:
    friction = {"mu_s": 0.6, "mu_k": 0.6, "pulleys": {"driven": {"mu_s": 0.6, "mu_k": 0.5}}}
    short = {"solver__backend": "moreau", "solver__rtol": None, "solver__duration": 1e-3}
    return pair(**short, effects__belt_friction=friction)


UNITS = [
    (shaft(), "mechanism.inertia", 1.0, "kg m^2"),
    (shaft(), "forces.1.size", 2.0, "N"),
    (shaft(), "forces.size.size", 2.0, "N"),  # of an entry with that name
    (shaft(), "forces.load.point.1", 0.1, "m"),
    (shaft(), "couples.motor.size", 2.0, "N m"),
    (shaft(), "forces.load.size.sine.frequency_hz", 2.0, "Hz"),
    (belt(), "effects.belt_friction.pulleys.driven.mu_k", 0.4, "1"),
]


@pytest.mark.parametrize(("data", "key", "value", "unit"), UNITS)
def test_entries_of_lists_have_the_unit_of_their_key(
    data: Scenario, key: str, value: float, unit: str
) -> None:
    swept = fs.sweep(data, {key: [value]}, workers=1)
    assert swept.status == "done"
    assert swept.dataset[key].attrs["units"] == unit
