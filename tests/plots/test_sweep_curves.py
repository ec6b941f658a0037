"""Curves of sweeps: no line where nothing was computed, and none that suggests what is not."""

from typing import Any

import numpy as np
import pytest
from matplotlib.collections import LineCollection

from frictionsim.plots.sweep import draw_sweep
from frictionsim.plots.sweep_curves import jumps_of
from tests.plots.test_sweep import FIVE, lines_of
from tests.support.sweeps import grid_of


def stuck(x: Any) -> Any:
    """Return what is zero up to 3, and jumps there."""
    return np.where(x > 3.0, 10.0 + x, 0.0)


def jumps_drawn(ax: Any) -> list[Any]:
    return [
        segment.tolist()
        for part in ax.collections
        if isinstance(part, LineCollection)
        for segment in part.get_segments()
    ]


def test_a_curve_is_not_joined_across_a_jump() -> None:
    x = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    (ax,) = draw_sweep(grid_of({"x": x}, {"f": stuck})).axes
    (line,) = lines_of(ax)
    np.testing.assert_array_equal(line.get_xdata(), [1.0, 2.0, 3.0, np.nan, 4.0, 5.0, 6.0])
    np.testing.assert_array_equal(line.get_ydata(), [0, 0, 0, np.nan, 14.0, 15.0, 16.0])
    assert jumps_drawn(ax) == [[[3.0, 0.0], [4.0, 14.0]]]


@pytest.mark.parametrize(
    "function",
    [
        np.exp,
        np.sin,
        lambda x: x**3,
        lambda x: np.abs(x - 3.0),
        lambda x: np.maximum(x, 3.2),
        np.sqrt,
    ],
)
def test_a_curve_without_a_jump_is_joined(function: Any) -> None:
    x = np.linspace(1.0, 6.0, 12)
    assert not jumps_of(x, function(x)).size
    assert not jumps_of(x**3, function(x)).size
    assert not jumps_of(x[:4], stuck(x[:4])).size


def test_a_jump_beside_a_failed_run_is_a_gap_anyway() -> None:
    x = np.arange(1.0, 9.0)
    assert jumps_of(x, stuck(x)).tolist() == [3]
    values = stuck(x)
    values[3] = np.nan
    assert not jumps_of(x, values).size


def test_counts_are_points() -> None:
    table = grid_of({"x": FIVE}, {"f": lambda x: np.floor(0.7 * x)})
    assert lines_of(draw_sweep(table).axes[0])[0].get_linestyle() == "-"  # whole by chance: N m
    table.units["f"] = "1"
    assert lines_of(draw_sweep(table).axes[0])[0].get_linestyle() == "None"
