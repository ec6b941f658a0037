"""Laws of friction that only adaptive steps integrate, and every effect left out."""

import pytest

from frictionsim.results import failures
from tests.support.belt_scenarios import every_effect, pair
from tests.support.scenarios import simulate, with_method

PARAMETERS = {
    "regularised": {"transition_speed": 0.05},
    "creep": {"transition_speed": 0.05, "maximum_creep": 1e-6},
}
SHORT = 2e-5  # s: some steps of each method


@pytest.mark.usefixtures("uncompiled")
@pytest.mark.parametrize("law", PARAMETERS)
def test_a_law_of_the_slip_comes_to_its_end(law: str) -> None:
    data = with_method(pair(solver__duration=SHORT), law, "rkf45")
    data["effects"]["belt_friction"] |= PARAMETERS[law]
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
