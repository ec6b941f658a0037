"""Studies as TOML: reading, writing, refusals."""

import os
import tomllib
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

import frictionsim as fs
from tests.support.examples import examples
from tests.support.scenarios import SCENARIOS
from tests.support.sweep_files import planned

PULLEY = (SCENARIOS / "pulley.toml").as_posix()
MU_S = "effects.shaft_friction.mu_s"
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


def test_a_study_reads_no_pipe(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "study.toml").write_text('[study]\nscenario = "pipe"\n[vary]\n"a.b" = [1]\n')
    with pytest.raises(fs.InputError, match=r"study\.scenario: expected a file, 'pipe' is none"):
        fs.sweep(tmp_path / "study.toml")


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


def test_the_scenario_is_looked_for_beside_the_study(tmp_path: Path) -> None:
    text = (SCENARIOS / "pulley.toml").read_text().replace("2224.1", "2222.0")
    (tmp_path / "p.toml").write_text(text)
    (tmp_path / "study.toml").write_text(
        f'[study]\nscenario = "p.toml"\n[vary]\n"{MU_S}" = [0.2, 0.3]\n'
    )
    assert "load = 2222.0" in fs.sweep(tmp_path / "study.toml", workers=1).attrs["scenario"]


SAMPLES = st.fixed_dictionaries(
    {
        "sample": st.sampled_from([1, 2, 16, 64]),
        "method": st.sampled_from(["sobol", "lhs", "random"]),
        "seed": st.integers(0, 2**63 - 1),
        "indices": st.booleans(),
    }
)
# Titles are one line without control characters; the word none removes a key.
TEXTS = st.text(st.characters(codec="utf-8", exclude_categories=("C", "Zl", "Zp"))).filter(
    lambda text: text != "none"
)


@examples(6)
@given(
    st.one_of(
        st.tuples(
            st.just("mechanism.initial_angular_velocity"),
            st.lists(st.floats(-1e9, 1e9), min_size=1),
            st.just({"zip": True}),
        ),
        st.tuples(st.just("title"), st.lists(TEXTS, min_size=1, unique=True), st.just({})),
        st.tuples(
            st.just(MU_S), st.sampled_from(["lin(0.1, 0.4, 3)", "log(0.1, 10, 3)"]), st.just({})
        ),
        st.tuples(st.just(MU_S), st.just("uniform(0.1, 0.3)"), SAMPLES),
    )
)
def test_a_study_that_is_written_is_the_same_when_read(
    given: tuple[str, Any, dict[str, Any]],
) -> None:
    key, values, options = given
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
