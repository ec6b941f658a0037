"""A belt's effect from outside the package: one file and one line, and everything knows it."""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from frictionsim.mechanisms.belt_drive.effects import EFFECTS
from frictionsim.scenario.loading import ValidationFailure, validate
from tests.support.belt_scenarios import pair
from tests.support.scenarios import ROOT, SCENARIOS

pytestmark = pytest.mark.slow

DAMPING = 0.5  # as in `foundation_run`
# 80 found; a large function more is 0.15 s more on one core.
MAX_FUNCTIONS = 82


def run(cache: Path, *arguments: str) -> dict[str, Any]:
    done = subprocess.run(
        [sys.executable, "-m", "tests.support.foundation_run", *arguments],
        cwd=ROOT,
        env={**os.environ, "XDG_CACHE_HOME": str(cache), "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    found: dict[str, Any] = json.loads(done.stdout)
    return found


@pytest.fixture(scope="module")
def cache(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("cache")


@pytest.fixture(scope="module")
def found(cache: Path) -> dict[str, Any]:
    """What a process says that finds no kernels: by fixed steps compiled, the rest as Python."""
    return run(cache, "all")


def test_without_its_line_no_scenario_has_it() -> None:
    assert "foundation" not in [effect.key for effect in EFFECTS]
    with pytest.raises(ValidationFailure, match="foundation"):
        validate(pair(effects__foundation={"stiffness": 1.0}), SCENARIOS)


@pytest.mark.parametrize(("method", "least"), [("adaptive", 1e-9), ("fixed", 1e-6)])
def test_runs_with_it_pass_their_audit(method: str, least: float, found: dict[str, Any]) -> None:
    of = found[method]
    assert of["status"] == "done"
    assert of["effects"] == ["contact", "belt_friction", "foundation"]
    assert of["failed"] == []
    assert of["damping"] > least  # J; it has the only damper


def test_the_belt_rests_under_its_force(found: dict[str, Any]) -> None:
    at_rest = found["with"]
    assert at_rest["residual"] < 1e-7 * 200.0
    # A sum of forces of some 1e4 N/m times rounded coordinates.
    assert np.max(np.abs(at_rest["acceleration"])) * at_rest["mass"] < 1e-6
    shift = np.hypot(*(np.subtract(at_rest[key], found["without"][key]) for key in "xy"))
    assert np.max(shift) > 1e-4


def test_it_bounds_the_steps(found: dict[str, Any]) -> None:
    at_rest, without = found["with"], found["without"]
    assert at_rest["decay"] == pytest.approx(DAMPING / at_rest["mass"])
    assert without["decay"] == 0.0
    assert at_rest["frequency"] > without["frequency"]


def test_few_kernels_are_compiled_once_and_kept_on_the_disk(
    found: dict[str, Any], cache: Path
) -> None:
    assert "add_foundation" in found["compiled"]
    assert len(found["compiled"]) <= MAX_FUNCTIONS
    assert run(cache)["compiled"] == []
