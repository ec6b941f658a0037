"""Every pair of friction law and method that a belt may have, and every effect left out."""

import pytest

import frictionsim as fs
from frictionsim.results import failures
from tests.support.belt_scenarios import every_effect, pair
from tests.support.scenarios import Scenario, simulate, with_method

PARAMETERS = {
    "regularised": {"transition_speed": 0.05},
    "creep": {"transition_speed": 0.05, "maximum_creep": 1e-6},
}
SHORT = 2e-5  # s: some steps of each method


def data_of(law: str, backend: str) -> Scenario:
    data = with_method(pair(solver__duration=SHORT), law, backend)
    data["effects"]["belt_friction"] |= PARAMETERS.get(law, {})
    return data


@pytest.mark.usefixtures("uncompiled")
@pytest.mark.parametrize("backend", ["rkf45", "moreau"])
@pytest.mark.parametrize("law", ["set-valued", *PARAMETERS])
def test_a_pair_comes_to_its_end(law: str, backend: str) -> None:
    """Steps of a fixed length are for the set-valued law alone."""
    data = data_of(law, backend)
    if backend == "moreau" and law != "set-valued":
        with pytest.raises(fs.ScenarioError, match="moreau"):
            fs.load(data)
        return
    done = simulate(data)
    assert (done.status, done.reason) == ("done", "")


@pytest.mark.slow
@pytest.mark.parametrize("backend", ["rkf45", "moreau"])
@pytest.mark.parametrize("effect", ["belt_friction", "axial_damping", "bending", "every"])
def test_compiled_kernels_of_other_effects_keep_their_law_and_energy(
    effect: str, backend: str
) -> None:
    settings = {"solver__backend": backend, "solver__duration": SHORT}
    data = every_effect(**settings)
    if effect != "every":
        data = pair(**settings, **{f"effects__{effect}": None})
    done = simulate(data)
    assert (done.status, failures(done.checks)) == ("done", "")
