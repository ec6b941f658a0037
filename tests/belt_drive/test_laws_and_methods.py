"""Every pair of friction law and method that a belt may have is run, as plain Python."""

import json
import os
import subprocess
import sys

import numpy as np
import pytest

from frictionsim.scenario.methods import BELT
from tests.support.belt_scenarios import pair
from tests.support.scenarios import ROOT, Scenario, simulate, with_method

PARAMETERS = {
    "regularised": {"transition_speed": 0.05},
    "creep": {"transition_speed": 0.05, "maximum_creep": 1e-6},
}
SHORT = 2e-5  # s: some steps of each method


def data_of(law: str, backend: str) -> Scenario:
    data = with_method(pair(solver__duration=SHORT), law, backend)
    data["effects"]["belt_friction"] |= PARAMETERS.get(law, {})
    return data


@pytest.fixture(scope="module")
def outcomes() -> dict[str, list[str]]:
    """Status, reason and finite driven speed of each pair, from a process without a compiler."""
    done = subprocess.run(
        [sys.executable, "-m", __name__],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
    )
    found: dict[str, list[str]] = json.loads(done.stdout)
    return found


@pytest.mark.parametrize("pair_of_names", BELT, ids=", ".join)
def test_a_pair_comes_to_its_end(
    pair_of_names: tuple[str, str], outcomes: dict[str, list[str]]
) -> None:
    assert outcomes[", ".join(pair_of_names)] == ["done", ""]


if __name__ == "__main__":
    runs = {names: simulate(data_of(*names)) for names in BELT}
    print(json.dumps({", ".join(names): [r.status, r.reason] for names, r in runs.items()}))


@pytest.mark.parametrize("method", ["rk45", "lsoda"])
def test_methods_of_scipy_move_the_belt_as_our_own(method: str) -> None:
    """A method that does not evaluate the equations leaves the drive at rest."""
    changes = {"solver__duration": 3e-3, "output__interval": 1e-3, "solver__rtol": 1e-6}
    ours, theirs = (
        simulate(pair(**changes, solver__backend=backend)) for backend in ("rkf45", method)
    )
    speed, expected = (run.channels["pulley_speed"][-1] for run in (theirs, ours))
    assert np.abs(expected).max() > 0.0
    # Bodies meet their pulleys in other steps: the difference is that of the methods.
    np.testing.assert_allclose(speed, expected, rtol=2e-3, atol=1e-6)
