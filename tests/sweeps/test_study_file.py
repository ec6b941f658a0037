"""Studies as TOML: reading, writing, refusals."""

import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import frictionsim as fs
from tests.support.scenarios import SCENARIOS
from tests.support.sweep_files import planned

PULLEY = (SCENARIOS / "pulley.toml").as_posix()
MU_S = "effects.shaft_friction.mu_s"
SHORT = {"solver.duration": 1.0}
STUDY = f"""
[study]
scenario = "{PULLEY}"
sample = 16
method = "lhs"
seed = 7

[set]
"solver.rtol" = 1e-6
"solver.duration" = 0.9
mechanism.load = 2000.0

[vary]
effects.shaft_friction.mu_s = "uniform(0.1, 0.4)"
"drive.force.value.1" = "normal(3000.0, 50.0)"
"""


def test_a_study_is_that_of_its_arguments(tmp_path: Path) -> None:
    (tmp_path / "study.toml").write_text(STUDY)
    read = fs.sweep(tmp_path / "study.toml", workers=1)
    given = fs.sweep(
        PULLEY,
        {MU_S: "uniform(0.1, 0.4)", "drive.force.value.1": "normal(3000.0, 50.0)"},
        {"solver.rtol": 1e-6, "solver.duration": 0.9, "mechanism.load": 2000.0},
        sample=16,
        method="lhs",
        seed=7,
        workers=1,
    )
    assert read.equals(given)
    scenario = fs.load(
        PULLEY, {"solver.rtol": 1e-6, "solver.duration": 0.9, "mechanism.load": 2000.0}
    )
    assert fs.loads(read.to_toml("scenario")).to_dict() == scenario.to_dict()
    assert fs.loads(given.to_toml("scenario")).to_dict() == scenario.to_dict()


FAULTY = """[study]
scenario = "p.toml"
zip = 1

[set]
solver.atol = -1.0
"solver.rtoll" = 1e-6
"mechanism.load" = 3.0

[vary]
effects.shaft_friction.mu_k = "uniform(3, 1)"
"mechanism.load,mechanism.inertia" = [3.0]
"mechanism.cord_radius" = [0.1]
mechanism.cord_radius = [0.2]
"""
TWICE = "is given twice, with and without quotes; leave one out"
FAULTS = [
    "study.toml:3: study.zip: should be true or false, got 1",
    "study.toml:6: set.solver.atol: should be greater than 0, got -1.0",
    "study.toml:7: set.solver.rtoll: unknown key 'rtoll' (did you mean 'rtol'?)",
    "study.toml:8: set.mechanism.load: is both set for all runs and varied; leave out one",
    "study.toml:11: vary.effects.shaft_friction.mu_k: uniform(3, 1): expected a below b",
    f"study.toml:14: vary.mechanism.cord_radius: {TWICE}",
    "p.toml:10: mechanism.inertias: unknown key 'inertias' (did you mean 'inertia'?)",
]


def test_all_faults_of_a_study_are_told_with_file_line_and_key(
    here: Path, told: Callable[..., tuple[str, str]]
) -> None:
    text = (SCENARIOS / "pulley.toml").read_text()
    (here / "p.toml").write_text(text.replace("inertia =", "inertias ="))
    (here / "study.toml").write_text(FAULTY)
    *_, err = told("sweep", "study.toml", code=2)
    assert err.removeprefix("frictionsim: ").splitlines() == FAULTS
    tables = FAULTY.replace('scenario = "p.toml"', "[study.scenario]").replace(
        "zip = 1", "kind = 1"
    )
    (here / "study.toml").write_text(tables)
    *_, err = told("sweep", "study.toml", code=2)
    assert "study.toml:3: study.scenario.kind: expected one of 'pulley'" in err


def test_none_takes_a_key_out_of_runs() -> None:
    damping = "effects.viscous_damping"
    swept = fs.sweep(PULLEY, {damping: [None, {"coefficient": 2.0}]}, SHORT | {"title": None})
    assert swept.coords[damping].values.tolist() == ["none", "{ coefficient = 2.0 }"]
    free = fs.solve(PULLEY, SHORT | {damping: None})
    assert swept["final_angle"][0] == free.quantities["final_angle"].value
    again = fs.sweep(tomllib.loads(swept.attrs["study"]))
    assert again["final_angle"].equals(swept["final_angle"])


@pytest.mark.parametrize(
    ("key", "values", "options"),
    [
        ("mechanism.initial_angular_velocity", [1e9, -2.5e-300, 0.1], {"zip": True}),
        ("title", ['a "b"', "ä, =1 \U0001f600", "\\'''"], {}),
        (MU_S, "lin(0.1, 0.4, 3)", {}),
        (MU_S, "uniform(0.1, 0.3)", {"sample": 16, "method": "lhs", "seed": 2**63 - 1}),
        (MU_S, "uniform(0.1, 0.3)", {"sample": 2, "indices": True}),
    ],
)
def test_a_study_that_is_written_is_the_same_when_read(
    key: str, values: Any, options: dict[str, Any]
) -> None:
    sweep = planned({key: values}, {"solver.duration": 1e-3}, **options)
    written = tomllib.loads(sweep.attrs["study"])
    again = planned(None, None, scenario=written)
    assert again[key].identical(sweep[key])
    assert again.attrs["study"] == sweep.attrs["study"]
    for name in ("zip", "indices"):
        assert bool(written["study"].get(name)) == options.get(name, False)
    for name in options.keys() & {"sample", "method", "seed"}:
        assert written["study"][name] == options[name]
    if isinstance(values, list):
        assert sweep[key].values.tolist() == values
