"""Studies as TOML: reading, writing, refusals."""

import os
import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

import frictionsim as fs
from frictionsim.parameter_study.design import METHODS, Sampling
from frictionsim.parameter_study.study_file import SweepOptions, SweepStudy, study_of, study_toml
from frictionsim.parameter_study.values import Levels, values_of
from tests.support.scenarios import SCENARIOS

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
mechanism.load = 2000.0

[vary]
effects.shaft_friction.mu_s = "uniform(0.1, 0.4)"
"drive.force.value.1" = "normal(3000.0, 50.0)"
"""


def read(folder: Path, text: str) -> SweepStudy:
    return study_of(tomllib.loads(text), folder, "study")


def test_a_study_reads_no_pipe(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "study.toml").write_text('[study]\nscenario = "pipe"\n[vary]\n"a.b" = [1]\n')
    with pytest.raises(fs.InputError, match=r"study\.scenario: expected a file, 'pipe' is none"):
        fs.sweep(tmp_path / "study.toml")


def test_a_study_is_read(tmp_path: Path) -> None:
    study = read(tmp_path, STUDY)
    assert study.scenario == fs.load(PULLEY, {"solver.rtol": 1e-6, "mechanism.load": 2000.0})
    assert study.options.sampling == Sampling(16, "lhs", 7)
    assert study.options.vary == {
        MU_S: values_of("", "uniform(0.1, 0.4)"),
        "drive.force.value.1": values_of("", "normal(3000.0, 50.0)"),
    }


def test_the_scenario_is_looked_for_beside_the_study(tmp_path: Path) -> None:
    (tmp_path / "p.toml").write_text((SCENARIOS / "pulley.toml").read_text())
    text = f'[study]\nscenario = "p.toml"\n[vary]\n"{MU_S}" = [0.2, 0.3]\n'
    assert read(tmp_path, text).scenario == fs.load(PULLEY)


@given(
    st.one_of(
        st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1),
        st.lists(st.text(st.characters(codec="utf-8", exclude_categories=("Cs",))), min_size=1),
        st.sampled_from(["lin(0.1, 0.4, 3)", "log(1, 100, 3)", "uniform(1e-3, 0.1)"]),
    ),
    st.one_of(
        st.none(),
        st.builds(
            Sampling,
            st.integers(1, 100),
            st.sampled_from(METHODS),
            st.integers(0, 2**63 - 1),
            st.booleans(),
        ),
    ),
    st.booleans(),
)
def test_a_study_that_is_written_is_the_same_when_read(
    given_values: object, sampling: Sampling | None, together: bool
) -> None:
    vary = {MU_S: values_of(MU_S, given_values)}
    of_sample = dict(zip(("sample", "method", "seed", "indices"), sampling or (), strict=False))
    options = SweepOptions.of(vary=vary, zip=together, **of_sample)
    study = SweepStudy(fs.load(PULLEY, {"solver.duration": 2.0}), options)
    read = study_of(tomllib.loads(study_toml(study)), Path(), "study")
    assert read.scenario == study.scenario
    assert (read.options.zip, read.options.sampling) == (together, sampling)
    before, after = vary[MU_S], read.options.vary[MU_S]
    if isinstance(before, Levels):
        assert isinstance(after, Levels)
        assert after.values == before.values
    else:
        assert after == before
