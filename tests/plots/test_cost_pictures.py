"""Cost diagrams: failed runs are seen, inside the panels."""

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from tests.costs.made import drawn_table
from tests.costs.made import made_row as row
from tests.support.cases import slow

STRIP = 0.09  # of the height of a panel, for crosses


def drawn(rows: list[dict[str, Any]], uncertainty: float = 0.0) -> Figure:
    with TemporaryDirectory() as folder:
        return drawn_table(Path(folder, "a.csv"), rows, {"angle": uncertainty})


def crosses(ax: Any) -> list[Any]:
    return [line for line in ax.lines if line.get_marker() == "x"]


@pytest.mark.parametrize("worst", [slow(1e-9), slow(0.5), 3e4])
def test_crosses_of_failed_runs_lie_inside_both_panels_above_all_errors(worst: float) -> None:
    rows = [row("a", 1e-10, 0.1), row("a", worst, 0.01), row("a", None, 0.2), row("b", None, 9.0)]
    figure = drawn([*rows, row("b", None, 0.0, 0)])
    assert figure.get_figwidth() == 9.0
    figure.draw_without_rendering()
    for ax in figure.axes:
        frame = ax.get_window_extent()
        centres = np.concatenate(
            [ax.transData.transform(np.column_stack(line.get_data())) for line in crosses(ax)]
        )
        assert len(centres) == 3
        radius = 4.0 * figure.dpi / 72.0
        assert (centres > np.array(frame.min) + radius * np.array([0.0, 1.0])).all()
        assert (centres < np.array(frame.max) - radius * np.array([0.0, 1.0])).all()
        others = [line for line in ax.lines if line.get_marker() == "o"]
        points = ax.transData.transform(np.column_stack(others[0].get_data()))
        strip = frame.y1 - STRIP * frame.height
        assert points[:, 1].max() < strip < centres[:, 1].min()
        ticks = ax.transData.transform([(1.0, tick) for tick in ax.get_yticks()])[:, 1]
        assert ticks.max() <= strip + 0.5
    left, right = ([text.get_text() for text in ax.texts] for ax in figure.axes)
    assert (left, right) == (["failed"], [])  # beside the frame, where no cross is
    assert figure.axes[0].texts[0].get_window_extent().x1 < figure.axes[0].get_window_extent().x0


def test_without_failed_runs_there_is_no_strip() -> None:
    for ax in drawn([row("a", 1e-9, 0.1), row("a", 1e-6, 0.01)]).axes:
        assert not crosses(ax)
        assert not ax.texts
        assert ax.get_ylim()[1] == pytest.approx(10.0)


def test_crosses_of_failed_meshes_lie_inside_the_left_panel() -> None:
    meshes = [("corrected", bodies) for bodies in (50, 100)]
    rows = [row("moreau", 0.1 / m[1], 0.1 * m[1], mesh=m) for m in meshes]
    figure = drawn([*rows, row("moreau", None, 0.0, mesh=meshes[0])], 1e-3)
    figure.draw_without_rendering()
    left, right = figure.axes
    frame = left.get_window_extent()
    (cross,) = crosses(left)
    x, y = left.transData.transform(np.column_stack(cross.get_data()))[0]
    assert frame.x0 <= x < frame.x1
    assert frame.y1 - STRIP * frame.height < y < frame.y1 - 3.0
    assert not crosses(right)
    assert [text.get_text() for text in left.texts] == ["failed"]
    assert figure.legends[0].get_texts()[-1].get_text() == "below the reference uncertainty"
