"""Belts of bodies in the plane against closed forms: waves, weight, full slip."""

from math import exp, pi

import pytest

from tests.benchmarks.validation_belts import (
    CORRECTED,
    FAST,
    SLOW,
    pulleys,
    slip_row,
    waves_of_belt,
    weight,
)
from tests.support.belt_closed_forms import capstan_with_bending

OFF = -1  # where a row has the difference from its closed form, %


@pytest.mark.usefixtures("uncompiled")
def test_waves_run_along_the_belt_and_across_a_span() -> None:
    rows = waves_of_belt(60)
    assert len(rows) == 3
    # The depth of the contacts makes a span shorter and its ends soft; 1.8 % at most was found.
    assert max(abs(row[OFF]) for row in rows) < 2.5


def test_pulleys_swing_against_each_other() -> None:
    # With the square of the length of a body: 2.1 % at 150 bodies, 0.48 % at 300.
    assert abs(pulleys(CORRECTED, 300)[OFF]) < 0.6


def test_a_level_span_hangs_in_a_catenary_and_an_upright_one_is_tighter_above() -> None:
    sag, slope = (abs(row[OFF]) for row in weight(150))
    assert sag < 0.02  # of a parabola through the joints; 0.002 % was found
    assert slope < 1e-5  # 2e-7 % was found, by roundings of a slope over 0.5 m


@pytest.mark.parametrize(
    ("speed", "limit"),
    [
        (SLOW, 0.2),  # 0.04 % was found
        (FAST, 1.0),  # creep between the spans counts 0.7 % at 60 m/s; 0.3 % was found
    ],
)
def test_a_belt_that_slips_as_a_whole_obeys_the_capstan_equation(
    speed: float, limit: float
) -> None:
    *_, off, warning = slip_row(CORRECTED, False, 300, speed)
    assert (abs(off) < limit, warning) == (True, "")


def test_a_belt_that_hardly_bends_obeys_the_plain_capstan() -> None:
    ratios = [capstan_with_bending(0.3, pi, rigidity, 0.027, 770.0) for rigidity in (1e-8, 0.026)]
    assert ratios[0] == pytest.approx(exp(0.3 * pi), rel=1e-3)
    assert ratios[1] == pytest.approx(2.49, abs=5e-3)
