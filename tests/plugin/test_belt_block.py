"""The plug-in that the documentation shows whole: a block on a belt, held by a spring."""

import tomllib
from collections.abc import Iterator
from math import atan2, pi, sqrt
from typing import Any

import pytest

import frictionsim as fs
from tests.support.plugins import BELT_BLOCK, install, searched
from tests.support.scenarios import Scenario

MODULE = BELT_BLOCK / "frictionsim_belt_block" / "belt_block.py"
DATA: Scenario = tomllib.loads(MODULE.with_suffix(".toml").read_text())


@pytest.fixture(scope="module", autouse=True)
def plugin(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """Let this process find the installed package."""
    with searched(install(BELT_BLOCK, tmp_path_factory.mktemp("site"))):
        yield


def test_it_is_as_short_as_the_documentation_promises() -> None:
    assert len(MODULE.read_text().splitlines()) <= 60


def test_the_block_sticks_and_slips_with_the_period_of_the_closed_form() -> None:
    """The belt drags it at V until k x = mu_s m g, and it slips until it has the belt's speed.

    With the natural frequency n, x_s - x_k = (mu_s - mu_k) m g/k and a = atan(n (x_s - x_k)/V) it
    slips for 2 (pi - a)/n, and sticks for 2 (x_s - x_k)/V.
    """
    result = fs.solve(DATA, check=True)
    n, speed = sqrt(100.0 / 1.0), 0.1 * 1.0  # 1/s, and m/s of the belt
    excess = (0.5 - 0.3) * 9.81 * 1.0 / 100.0
    slips = 2.0 * (pi - atan2(n * excess, speed)) / n
    first = 0.5 * 9.81 / 100.0 / speed
    times = [e.time for e in result.record.transitions]
    period = slips + 2.0 * excess / speed
    expected = [first + i * period + part for i in range(20) for part in (0.0, slips)]
    assert len(times) > 10
    assert times == pytest.approx(expected[: len(times)], rel=1e-7)


def test_its_statics_are_the_stretch_at_which_it_breaks_away() -> None:
    assert fs.static(DATA)["stretch"].value == pytest.approx(0.5 * 9.81 / 100.0)
