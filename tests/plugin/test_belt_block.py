"""The plug-in that the documentation shows whole: a block on a belt, held by a spring."""

import tomllib
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import pytest

import frictionsim as fs
from tests.support.plugins import BELT_BLOCK, install, searched
from tests.support.scenarios import Scenario
from tests.support.stick_slip_reference import cycles

MODULE = BELT_BLOCK / "frictionsim_belt_block" / "belt_block.py"
DATA: Scenario = tomllib.loads(MODULE.with_suffix(".toml").read_text())


@pytest.fixture(scope="module", autouse=True)
def plugin(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Any]:
    """Let this process find the installed package."""
    with searched(install(BELT_BLOCK, tmp_path_factory.mktemp("site"))):
        yield


def test_it_is_as_short_as_the_documentation_promises() -> None:
    assert len(MODULE.read_text().splitlines()) <= 60


# Of the limit cycle: period, slip and stick, s, by an independent program.
PERIOD, SLIP, STICK = 12.0010312948, 4.2959995255, 7.7050317693


def test_the_block_sticks_and_slips_with_the_times_of_its_limit_cycle() -> None:
    """The belt drags it at V until k x = F_s, and it slips until it has the belt's speed."""
    result = fs.solve(DATA, check=True)
    times = [e.time for e in result.record.transitions]
    assert times[0] == pytest.approx(1.0 / 0.2, abs=1e-12)
    assert len(times) == 10
    slips = [b - a for a, b in zip(times[::2], times[1::2], strict=True)]
    sticks = [b - a for a, b in zip(times[1::2], times[2::2], strict=False)]
    periods = [b - a for a, b in pairwise(times[::2])]
    assert slips == pytest.approx([SLIP] * 5, abs=1e-8)
    assert sticks == pytest.approx([STICK] * 4, abs=1e-8)
    assert periods == pytest.approx([PERIOD] * 4, abs=1e-8)


def test_the_numbers_of_the_limit_cycle_are_those_of_the_independent_program() -> None:
    first, second = cycles(1.0, 1.0, 0.2, lambda v: 1.0 / (1.0 + 3.0 * v), 2)
    slip, period = first.end - first.begin, second.begin - first.begin
    assert (slip, period) == pytest.approx((SLIP, PERIOD), abs=1e-10)
    assert period - slip == pytest.approx(STICK, abs=1e-10)


def test_its_statics_are_the_stretch_at_which_it_breaks_away() -> None:
    assert fs.static(DATA)["stretch"].value == pytest.approx(1.0)
