"""A belt's effect from outside the package: one file and one line, and everything knows it."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from frictionsim.mechanisms.belt_drive.effects import EFFECTS
from frictionsim.scenario.loading import ValidationFailure, validate
from tests.support.belt_scenarios import pair
from tests.support.scenarios import ROOT, SCENARIOS

# 80 found; a large function more is 0.15 s more on one core.
MAX_FUNCTIONS = 82


def test_without_its_line_no_scenario_has_it() -> None:
    assert "foundation" not in [effect.key for effect in EFFECTS]
    with pytest.raises(ValidationFailure, match="foundation"):
        validate(pair(effects__foundation={"stiffness": 1.0}), SCENARIOS)


@pytest.mark.slow
def test_with_its_line_a_belt_has_it_and_few_kernels_are_compiled_once(tmp_path: Path) -> None:
    """Its action on a belt is checked in the process; the second process finds all kernels."""
    functions = []
    for arguments in (["all"], []):
        done = subprocess.run(
            [sys.executable, "-m", "tests.support.foundation_run", *arguments],
            cwd=ROOT,
            env={**os.environ, "XDG_CACHE_HOME": str(tmp_path), "PYTHONPATH": str(ROOT)},
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        functions.append(json.loads(done.stdout))
    assert "add_foundation" in functions[0]
    assert len(functions[0]) <= MAX_FUNCTIONS
    assert functions[1] == []
