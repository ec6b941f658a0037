"""Loops of belts are vector instructions: what none of their numbers shows, and a step is slow by.

LLVM decides it, and does so anew with an argument more or a condition; a loop that loses its
vectors takes three to twelve times as long.
"""

import json
import os
import platform
import subprocess
import sys

import pytest

from tests.support.packed_loops import TARGET
from tests.support.scenarios import ROOT

# Beside each vector loop stands a scalar one for what is left of a row, unrolled up to three times:
# measured are shares of 0.22 and more; without vectors it is 0. The elimination of the dampers has
# loops in which a number depends on the one before: 0.17.
LEAST_SHARE, LEAST_SHARE_OF_ELIMINATION = 0.2, 0.15


@pytest.mark.skipif(
    platform.machine() not in ("x86_64", "AMD64"), reason="instructions of x86-64 are counted"
)
def test_every_loop_is_made_of_vector_instructions_with_every_signature() -> None:
    environment = {**os.environ, **TARGET, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-m", "tests.support.packed_loops"]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    counts = {name: numbers for name, numbers in json.loads(done.stdout).items() if any(numbers)}
    known = {"press, damping wrap inv_tau", "press_on_line, inv_tau", "press_in_step, wrap d"}
    assert known <= set(counts)
    least = {"eliminate, ": LEAST_SHARE_OF_ELIMINATION}
    scalar = {
        name: numbers
        for name, numbers in counts.items()
        if numbers[0] < least.get(name, LEAST_SHARE) * sum(numbers)
    }
    assert not scalar, "packed and scalar instructions of loops that lost their vectors"
