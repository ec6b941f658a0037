"""Threlfall's curve, which one coordinate takes as plain Python and a belt compiled."""

import numpy as np
import pytest

from frictionsim.solvers.friction_curve import friction_curve, rising_part
from tests.support.belt_kernels import compiled, kernels


@pytest.mark.parametrize("limits", [(0.6, 0.4), (1.0, 1.0), (3.0, 0.0)])
def test_the_curve_is_the_same_compiled(limits: tuple[float, float]) -> None:
    x = np.concatenate([np.linspace(0.0, 2.0, 401), [0.999999999, 1.000000001, 1e6]])
    plain = [friction_curve(float(at), *limits) for at in x]
    curve = compiled(kernels.friction_curve)
    values = [curve(float(at), *limits) for at in x]
    # The compiler may fuse a product with a sum: half a unit of each of some four operations.
    assert np.max(np.abs(np.subtract(values, plain))) <= 4 * np.spacing(limits[0])


def test_the_rising_part_is_that_of_the_curve() -> None:
    x = np.linspace(0.0, 1.0, 101)
    assert [rising_part(float(at)) for at in x] == pytest.approx(
        [friction_curve(float(at), 1.0, 0.3) for at in x], rel=1e-15
    )
    assert rising_part(7.0) == 1.0
