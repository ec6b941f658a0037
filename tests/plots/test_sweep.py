"""Pictures of sweeps: what is drawn are the numbers of the table; nothing is missing silently."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pytest
from matplotlib.collections import QuadMesh
from matplotlib.figure import Figure

import frictionsim as fs
from tests.support.sweeps import (
    AUDIT_FAILED,
    FAILED,
    NOT_RUN,
    Sampling,
    grid_of,
    sample_of,
    with_outcomes,
)

MARKS = {"failed": "x", "not defined": "v", "not run": "_", "audit failed": "D"}
FIVE = [1.0, 2.0, 3.0, 4.0, 5.0]


def draw_sweep(table: Any, quantities: Sequence[str] = (), **options: Any) -> Figure:
    return fs.plot(fs.Sweep(table), ",".join(quantities) or None, **options)


def lines_of(ax: Any, marker: str | None = None) -> list[Any]:
    """Return the lines with a marker, or those without a mark of a run that is not sound."""
    marks = set(MARKS.values())
    return [
        line
        for line in ax.lines
        if (line.get_marker() == marker if marker else line.get_marker() not in marks)
    ]


def title_of(figure: Figure) -> str:
    return " ".join(figure.get_suptitle().split())


def legend_of(figure: Figure) -> list[str]:
    return [text.get_text() for legend in figure.legends for text in legend.get_texts()]


def curves() -> Any:
    """Return a grid of five runs: one failed, one with a failed audit, one undefined, one left."""
    table = grid_of({"a.b.x": FIVE}, {"f": lambda x: x**2, "g": lambda x: -x})
    table.values["f"][3] = np.nan
    return with_outcomes(table, {1: FAILED, 2: AUDIT_FAILED, 4: NOT_RUN})


def test_a_curve_has_the_values_of_the_sound_runs_and_marks_at_the_others() -> None:
    figure = draw_sweep(curves(), ["f"])
    (ax,) = figure.axes
    (line,) = lines_of(ax)
    np.testing.assert_array_equal(line.get_xdata(), FIVE)
    np.testing.assert_array_equal(line.get_ydata(), [1.0, np.nan, np.nan, np.nan, np.nan])
    at = {name: lines_of(ax, marker) for name, marker in MARKS.items() if name != "audit failed"}
    places = {name: line.get_xdata().tolist() for name, (line,) in at.items()}
    assert places == {"failed": [2.0], "not defined": [4.0], "not run": [5.0]}
    (audit,) = lines_of(ax, "D")
    assert (audit.get_xdata().tolist(), audit.get_ydata().tolist()) == ([3.0], [9.0])
    assert legend_of(figure) == [f"{name}: 1 run" for name in MARKS]
    assert title_of(figure) == (
        "A sweep: sweep over x (done: 4 of 5 runs; 1 failed; 1 with a failed audit)"
    )
    assert ax.get_xlabel() == "a.b.x, m"
    assert ax.get_ylabel() == "f, N m"


def test_values_are_drawn_in_ascending_order_with_logarithmic_axes_where_they_fit() -> None:
    table = grid_of({"x": [100.0, 1.0, 10.0]}, {"f": lambda x: 2.0 * x})
    (ax,) = draw_sweep(table).axes
    (line,) = lines_of(ax)
    assert line.get_xdata().tolist() == [1.0, 10.0, 100.0]
    assert line.get_ydata().tolist() == [2.0, 20.0, 200.0]
    assert ax.get_xscale() == "log"
    for values in (FIVE, [-1.0, 1.0, 10.0], [0.0, 1.0, 10.0], [1.0, 1.1, 1.21]):
        (ax,) = draw_sweep(grid_of({"x": values}, {"f": lambda x: x})).axes
        assert ax.get_xscale() == "linear"
    (ax,) = draw_sweep(grid_of({"x": FIVE}, {"f": lambda x: 10.0**x})).axes
    assert ax.get_yscale() == "log"


def test_text_is_drawn_as_points_by_category_and_beside_a_number_as_curves() -> None:
    words = ["up", "down"]
    (ax,) = draw_sweep(grid_of({"w": words}, {"f": lambda w: np.where(w == "up", 1.0, 3.0)})).axes
    (line,) = lines_of(ax)
    assert (line.get_linestyle(), line.get_ydata().tolist()) == ("None", [1.0, 3.0])
    assert [label.get_text() for label in ax.get_xticklabels()] == words
    signed = grid_of({"w": words, "x": FIVE}, {"f": lambda w, x: np.where(w == "up", x, -x)})
    figure = draw_sweep(signed)
    up, down = lines_of(figure.axes[0])
    assert up.get_ydata().tolist() == FIVE
    assert down.get_ydata().tolist() == [-x for x in FIVE]
    assert up.get_linestyle() != down.get_linestyle()  # in grey
    assert legend_of(figure) == ["w = up", "w = down"]
    counts = grid_of({"x": FIVE}, {"f": lambda x: np.floor(0.7 * x)})
    assert lines_of(draw_sweep(counts).axes[0])[0].get_linestyle() == "-"  # N m, whole by chance
    counts.units["f"] = "1"
    assert lines_of(draw_sweep(counts).axes[0])[0].get_linestyle() == "None"
    (ax,) = draw_sweep(grid_of({"on": [False, True]}, {"f": lambda on: on * 1.0})).axes
    assert [label.get_text() for label in ax.get_xticklabels()] == ["false", "true"]


def meshes(ax: Any) -> list[QuadMesh]:
    return [artist for artist in ax.collections if isinstance(artist, QuadMesh)]


def test_a_map_has_the_values_in_cells_halfway_between_them() -> None:
    # Uneven, in no order, the second key logarithmic.
    table = grid_of({"x": [5.0, 1.0, 7.0], "y": [1.0, 100.0, 10.0]}, {"f": lambda x, y: x - y})
    figure = draw_sweep(table)
    ax, bar = figure.axes
    (mesh,) = meshes(ax)
    expected = [[x - y for x in (1.0, 5.0, 7.0)] for y in (1.0, 10.0, 100.0)]
    np.testing.assert_array_equal(np.asarray(mesh.get_array()).reshape(3, 3), expected)
    corners = np.asarray(mesh.get_coordinates())
    np.testing.assert_allclose(corners[0, :, 0], [-1.0, 3.0, 6.0, 8.0])
    np.testing.assert_allclose(corners[:, 0, 1], 10.0 ** np.array([-0.5, 0.5, 1.5, 2.5]))
    assert (ax.get_xscale(), ax.get_yscale()) == ("linear", "log")
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("x, m", "y, m")
    assert bar.get_ylabel() == "f, N m"
    written = {text.get_text() for text in ax.texts}
    assert written == {f"{value:.3g}" for row in expected for value in row}


def test_cells_without_a_sound_value_are_empty_with_marks() -> None:
    table = grid_of({"x": FIVE, "y": FIVE}, {"f": lambda x, y: 10.0 * x + y})
    table.values["f"][7] = np.nan
    figure = draw_sweep(with_outcomes(table, {0: FAILED, 1: AUDIT_FAILED, 2: NOT_RUN}))
    (mesh,) = meshes(figure.axes[0])
    values = np.ma.masked_array(mesh.get_array()).reshape(5, 5).T
    assert np.argwhere(np.ma.getmaskarray(values)).tolist() == [[0, 0], [0, 2], [1, 2]]
    places = [lines_of(figure.axes[0], marker)[0].get_xydata().tolist() for marker in "xv_D"]
    assert places == [[[1.0, 1.0]], [[2.0, 3.0]], [[1.0, 3.0]], [[1.0, 2.0]]]
    every = draw_sweep(with_outcomes(table, dict.fromkeys(range(25), FAILED)))
    assert every.axes[0].get_title() == "f, N m: no values"
    assert legend_of(every) == ["failed: 25 runs"]


@pytest.mark.parametrize(
    ("function", "jumps"),
    [
        (lambda x: np.where(x < 0.35, 0.0, 0.5 + x), [0.3]),
        (lambda x: np.where((x > 0.25) & (x < 0.65), 40.0 - x, x), [0.2, 0.6]),
        (lambda x: np.maximum(x - 0.45, 0.0), []),  # a bend
        (lambda x: np.exp(3.0 * x), []),
    ],
)
def test_no_line_joins_the_sides_of_a_jump(function: Any, jumps: list[float]) -> None:
    x = np.round(np.linspace(0.0, 1.0, 11), 12)
    (ax,) = draw_sweep(grid_of({"x": x}, {"f": function})).axes
    (line,) = lines_of(ax)
    drawn = np.asarray(line.get_xdata(), dtype=float)
    gaps = np.flatnonzero(np.isnan(drawn))
    assert drawn[gaps - 1].tolist() == pytest.approx(jumps)
    np.testing.assert_array_equal(drawn[np.isfinite(drawn)], x)


def test_a_third_key_has_a_panel_for_each_value_on_one_scale() -> None:
    table = grid_of(
        {"x": FIVE, "z": [1.0, 2.0, 3.0], "y": [0.0, 1.0]},
        {"f": lambda x, z, y: 100 * z + 10 * y + x},
    )
    figure = draw_sweep(table)
    panels = [ax for ax in figure.axes if ax.get_title()]
    assert [ax.get_title() for ax in panels] == ["y = 0 m", "y = 1 m"]
    for y, ax in enumerate(panels):
        (mesh,) = meshes(ax)
        expected = [[100.0 * z + 10.0 * y + x for x in FIVE] for z in (1, 2, 3)]
        np.testing.assert_array_equal(np.asarray(mesh.get_array()).reshape(3, 5), expected)
        assert (mesh.norm.vmin, mesh.norm.vmax) == (101.0, 315.0)
    # Of three keys one of text has the panels; those with nothing below have numbers at their axes.
    table = grid_of({"w": ["a", "b", "c"], "x": FIVE, "y": FIVE}, {"f": lambda w, x, y: x * y})
    panels = draw_sweep(table).axes[:3]
    assert [ax.get_title() for ax in panels] == ["w = a", "w = b", "w = c"]
    shown = [ax.xaxis.get_tick_params()["labelbottom"] for ax in panels]
    assert shown == [False, True, True]


def test_of_more_keys_values_are_chosen() -> None:
    two = [0.1, 0.3]
    table = grid_of(dict.fromkeys("abcd", two), {"f": lambda a, b, c, d: a + 10.0 * d})
    figure = draw_sweep(table, at={"b": "0.3", "c": 0.1, "d": 0.30000000000000004})
    (line,) = lines_of(figure.axes[0])
    np.testing.assert_array_equal(line.get_ydata(), np.array(two) + 10.0 * 0.3)
    assert "b = 0.3 m; c = 0.1 m; d = 0.3 m" in title_of(figure)


def test_neither_inputs_nor_the_same_numbers_twice_are_drawn_and_slip_is_first() -> None:
    functions: Any = {
        "load": lambda x: x,
        "tight": lambda x: 3.0 * x,
        "tight_again": lambda x: 3.0 * x,
        "constant": lambda x: 7.0,
        "efficiency": lambda x: 1.0 / x,
        "slip_percent": lambda x: x**2,
    }
    table = grid_of({"x": FIVE}, functions)
    table.units.update(dict.fromkeys(functions, table.coordinates["x"].unit))
    labels = [ax.get_ylabel().partition(",")[0] for ax in draw_sweep(table).axes]
    assert labels == ["slip", "efficiency", "tight"]
    assert len(draw_sweep(table, ["load"]).axes) == 1  # what is asked for is drawn


@pytest.fixture(scope="module")
def sample() -> Any:
    normal, uniform = "normal(5.0, 0.5)", "uniform(1.0, 2.0)"
    vary = {"p.mu": "uniform(0.0, 1.0)", "p.load": normal, "r.load": uniform}
    functions = {
        "f": lambda a, b, c: 3.0 * a + b * c,
        "g": lambda a, b, c: np.where(a < 0.1, np.nan, a),
    }
    return sample_of(vary, functions, Sampling(64, indices=True))


def pairs(figure: Figure) -> Iterator[tuple[Any, Any]]:
    """Return histogram and tornado of each row."""
    return zip(figure.axes[::2], figure.axes[1::2], strict=True)


def test_a_histogram_counts_all_runs_and_has_the_statistics_of_the_summary(
    sample: Any,
) -> None:
    figure = draw_sweep(sample)
    runs = {}
    for (left, _), name in zip(pairs(figure), ("f", "g"), strict=True):
        values = sample.values[name][:128]  # the others are for indices
        values = values[np.isfinite(values)]
        runs[name] = values.size
        assert sum(bar.get_height() for bar in left.patches) == values.size
        mean, deviation = np.mean(values), np.std(values, ddof=1)
        low, median, high = np.quantile(values, [0.05, 0.5, 0.95])
        drawn = [line.get_xdata()[0] for line in left.lines]
        assert drawn == pytest.approx([mean, median, low, high], rel=1e-12)
        title = left.get_title(loc="left")
        assert f"mean {mean:.5g}, standard deviation {deviation:.4g} N m" in title
        assert f"5 %: {low:.5g}, 50 %: {median:.5g}, 95 %: {high:.5g} N m" in title
        assert left.get_xlabel() == f"{name}, N m"
    assert runs["g"] < 128
    assert f"from {runs['g']} of 128 runs" in title
    assert "sobol sample, 128 independent runs; 320 runs" in title_of(figure)


def test_a_tornado_has_the_largest_index_at_the_top(sample: Any) -> None:
    """Their values are those of closed forms in the tests of sensitivity."""
    ((_, right),) = pairs(draw_sweep(sample, ["f"]))
    first, total = np.reshape([bar.get_width() for bar in right.patches], (2, 3))
    assert np.all(np.diff(total) < 0.0)
    assert [label.get_text() for label in right.get_yticklabels()] == ["r.load", "mu", "p.load"]
    assert right.get_ylim()[0] > right.get_ylim()[1]
    assert right.get_title(loc="left") == "from 64 rows; 95 % confidence"
    intervals = np.concatenate([c.get_segments() for c in right.collections])[:, :, 0]
    bars = np.concatenate([first, total])
    assert np.all((intervals[:, 0] <= bars) & (bars <= intervals[:, 1]))
    none = draw_sweep(with_outcomes(sample, dict.fromkeys(range(320), FAILED)))
    said = [text.get_text() for ax in none.axes for text in ax.texts]
    assert said.count("not defined in any run") == 2
