"""Cost diagrams: failed runs are seen, above all errors."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.costs.made import drawn_table
from tests.costs.made import made_row as row


def crosses(ax: Any) -> Any:
    """Return the places of the crosses, (n, 2), in pixels."""
    points = [
        line.get_transform().transform(np.column_stack(line.get_data()))
        for line in ax.lines
        if line.get_marker() == "x"
    ]
    return np.concatenate(points) if points else np.zeros((0, 2))


@pytest.mark.parametrize("worst", [1e-9, 3e4])
def test_failed_runs_are_crosses_inside_the_panels_above_all_errors(
    worst: float, tmp_path: Path
) -> None:
    rows = [row("a", 1e-10, 0.1), row("a", worst, 0.01), row("a", None, 0.2), row("b", None, 9.0)]
    rows.append(row("b", None, 0.0, 0))  # refused, at the least work
    figure = drawn_table(tmp_path / "a.csv", rows, {"angle": 0.0})
    figure.draw_without_rendering()
    for ax in figure.axes:
        frame, places = ax.get_window_extent(), crosses(ax)
        assert len(places) == 3
        assert np.all((places > frame.min) & (places < frame.max))
        (line,) = (line for line in ax.lines if line.get_marker() == "o")
        assert line.get_color() == "#0072B2"
        highest = ax.transData.transform(np.column_stack(line.get_data()))[:, 1].max()
        assert highest < places[:, 1].min()
    words = [text.get_text() for text in figure.legends[0].get_texts()]
    assert words == ["a", "a: 1 failed", "b: 2 failed"]


def test_meshes_have_a_line_each_method_and_a_marker_each_number_of_bodies(tmp_path: Path) -> None:
    meshes = [("corrected", bodies) for bodies in (50, 100)]
    rows = [row("moreau", 0.1 / m[1], 0.1 * m[1], mesh=m) for m in meshes]
    rows.append(row("moreau", None, 0.0, mesh=meshes[0]))
    figure = drawn_table(tmp_path / "a.csv", rows, {"angle": 1e-3})
    left, right = figure.axes
    points = [
        (*line.get_xdata(), *line.get_ydata()) for line in left.lines if len(line.get_xdata()) == 1
    ]
    assert points[:2] == [(5.0, pytest.approx(2e-3)), (10.0, pytest.approx(1e-3))]
    assert (len(crosses(left)), len(crosses(right))) == (1, 0)
    assert {"50 bodies", "100 bodies", "moreau, corrected", "below the reference uncertainty"} <= {
        text.get_text() for text in figure.legends[0].get_texts()
    }
