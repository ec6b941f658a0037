"""Pictures of sweeps: what is drawn are the numbers of the table; nothing is missing silently."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import pytest
from matplotlib.collections import QuadMesh
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

import frictionsim as fs
from frictionsim.errors import InputError
from tests.support.sweeps import (
    AUDIT_FAILED,
    FAILED,
    NOT_RUN,
    Function,
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


@pytest.mark.parametrize("function", [lambda x, w: -x, lambda x, w: 10.0**x])
def test_marks_lie_below_all_values(function: Function) -> None:
    table = grid_of({"x": FIVE, "w": ["a", "b"]}, {"f": lambda x, w: function(x.astype(float), w)})
    figure = draw_sweep(with_outcomes(table, {2: FAILED, 5: FAILED}))
    figure.draw_without_rendering()
    (ax,) = figure.axes
    lowest = min(np.nanmin(line.get_ydata()) for line in lines_of(ax) if line.get_ydata().size == 5)
    for mark in lines_of(ax, "x"):
        half = 0.03  # of the height of the panel, that of a mark
        top = ax.transAxes.transform((0.0, mark.get_ydata()[0] + half))
        assert ax.transData.inverted().transform(top)[1] < lowest


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
    figure = draw_sweep(grid_of({"w": words}, {"f": lambda w: np.where(w == "up", 1.0, 3.0)}))
    (ax,) = figure.axes
    (line,) = lines_of(ax)
    assert line.get_linestyle() == "None"
    assert line.get_ydata().tolist() == [1.0, 3.0]
    assert [label.get_text() for label in ax.get_xticklabels()] == words
    for vary in ({"w": words, "x": FIVE}, {"x": FIVE, "w": words}):
        table = grid_of(vary, {"f": _signed})
        figure = draw_sweep(table)
        up, down = lines_of(figure.axes[0])
        assert up.get_ydata().tolist() == FIVE
        assert down.get_ydata().tolist() == [-x for x in FIVE]
        assert up.get_linestyle() != down.get_linestyle()  # in grey
        assert legend_of(figure) == ["w = up", "w = down"]
    (ax,) = draw_sweep(grid_of({"on": [False, True]}, {"f": lambda on: on * 1.0})).axes
    assert [label.get_text() for label in ax.get_xticklabels()] == ["false", "true"]


def test_values_that_are_long_texts_are_cut_in_the_legend() -> None:
    values = {"x": FIVE, "w": ["up", f"a{'x' * 60_000}"]}
    assert legend_of(draw_sweep(grid_of(values, {"f": _signed}))) == ["w = up", f"w = a{'x' * 28}…"]


def _signed(*columns: Any) -> Any:
    word, number = columns if isinstance(columns[0][0], str) else columns[::-1]
    return np.where(word == "up", 1.0, -1.0) * number.astype(float)


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


def test_a_number_in_a_cell_has_an_exponent_only_where_the_tables_have_one() -> None:
    values = np.array([14025.4, -999999.0, 1234567.0, 0.012345, 1.2e-5])
    x, y = [0.0, 1.0, 2.0, 3.0, 4.0], [1.0, 2.0]
    table = grid_of({"x": x, "y": y}, {"f": lambda x, y: values[x.astype(int)] * y})
    written = [text.get_text() for text in draw_sweep(table).axes[0].texts]
    assert written[::2] == ["14025", "-999999", "1.23e+06", "0.0123", "1.2e-05"]


def test_cells_without_a_sound_value_differ_from_each_other() -> None:
    table = grid_of({"x": FIVE, "y": FIVE}, {"f": lambda x, y: 10.0 * x + y})
    table.values["f"][7] = np.nan
    figure = draw_sweep(with_outcomes(table, {0: FAILED, 1: AUDIT_FAILED, 2: NOT_RUN}))
    ax = figure.axes[0]
    (mesh,) = meshes(ax)
    values = np.ma.masked_array(mesh.get_array()).reshape(5, 5).T
    assert np.argwhere(np.ma.getmaskarray(values)).tolist() == [[0, 0], [0, 2], [1, 2]]
    assert values[0, 1] == 12.0
    (failed,), (audit,) = lines_of(ax, "x"), lines_of(ax, "D")
    assert (failed.get_xdata().tolist(), failed.get_ydata().tolist()) == ([1.0], [1.0])
    assert (audit.get_xdata().tolist(), audit.get_ydata().tolist()) == ([1.0], [2.0])
    (undefined,), (left,) = lines_of(ax, "v"), lines_of(ax, "_")
    assert (undefined.get_xdata().tolist(), undefined.get_ydata().tolist()) == ([2.0], [3.0])
    assert (left.get_xdata().tolist(), left.get_ydata().tolist()) == ([1.0], [3.0])
    assert legend_of(figure) == [f"{name}: 1 run" for name in MARKS]


def test_a_map_over_decades_has_a_logarithmic_scale_and_no_contours() -> None:
    figure = draw_sweep(grid_of({"x": FIVE, "y": FIVE}, {"f": lambda x, y: 10.0 ** (x + y)}))
    assert isinstance(meshes(figure.axes[0])[0].norm, LogNorm)
    assert len(figure.axes[0].collections) == 1
    assert {text.get_rotation() for text in figure.axes[0].texts} == {0.0}


@pytest.mark.parametrize(
    ("function", "jumps"),
    [
        (lambda x: np.where(x < 0.35, 0.0, 0.5 + x), [0.3]),
        (lambda x: np.where(x < 0.75, 5.0 * x, 0.0), [0.7]),
        (lambda x: np.where((x > 0.25) & (x < 0.65), 40.0 - x, x), [0.2, 0.6]),
        (lambda x: np.maximum(x - 0.45, 0.0), []),  # a bend
        (lambda x: x**2, []),
        (lambda x: np.exp(3.0 * x), []),
        (lambda x: np.sin(6.0 * x), []),
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
    # Of three keys one of text has the panels.
    table = grid_of({"w": ["a", "b"], "x": FIVE, "y": FIVE}, {"f": lambda w, x, y: x * y})
    assert [ax.get_title() for ax in draw_sweep(table).axes][:2] == ["w = a", "w = b"]


def test_of_more_keys_values_are_chosen() -> None:
    two = [0.1, 0.3]
    table = grid_of(dict.fromkeys("abcd", two), {"f": lambda a, b, c, d: a + 10.0 * d})
    figure = draw_sweep(table, at={"b": "0.3", "c": 0.1, "d": 0.30000000000000004})
    (line,) = lines_of(figure.axes[0])
    np.testing.assert_array_equal(line.get_ydata(), np.array(two) + 10.0 * 0.3)
    assert "b = 0.3 m; c = 0.1 m; d = 0.3 m" in title_of(figure)


def test_values_together_are_drawn_over_the_first_number() -> None:
    vary = {"w": ["a", "b", "c"], "x": [3.0, 1.0, 2.0], "y": [7.0, 8.0, 9.0]}
    figure = draw_sweep(grid_of(vary, {"f": lambda w, x, y: y.astype(float)}, "zip"))
    (line,) = lines_of(figure.axes[0])
    assert (line.get_xdata().tolist(), line.get_ydata().tolist()) == (
        [1.0, 2.0, 3.0],
        [8.0, 9.0, 7.0],
    )
    assert "together with w, y" in title_of(figure)


def test_the_first_quantities_that_vary_are_drawn() -> None:
    functions: Any = {f"q{i}": (lambda x, i=i: i * x) for i in range(9)}
    figure = draw_sweep(grid_of({"x": FIVE}, functions))
    assert [ax.get_ylabel() for ax in figure.axes] == [f"q{i}, N m" for i in range(1, 7)]
    assert "6 of 8 quantities that vary" in title_of(figure)
    same = draw_sweep(grid_of({"x": FIVE}, {"f": lambda x: 5.0, "g": lambda x: np.nan}))
    assert "no quantity varies" in title_of(same)
    low, high = same.axes[0].get_ylim()
    assert low < 4.9
    assert high > 5.1
    assert legend_of(same) == ["not defined: 5 runs"]


def test_neither_inputs_nor_the_same_numbers_twice_are_drawn_and_slip_is_first() -> None:
    """The key of a grid, of values together and of a sample; its unit is that of the quantity."""
    functions: Any = {
        "load": lambda x: x,
        "tight": lambda x: 3.0 * x,
        "tight_again": lambda x: 3.0 * x,
        "constant": lambda x: 7.0,
        "efficiency": lambda x: 1.0 / x,
        "slip_percent": lambda x: x**2,
        "gappy": lambda x: np.where(x > 2.0, x, np.nan),
    }
    wanted = ["slip percent", "efficiency", "tight"]
    for table in (
        grid_of({"x": FIVE}, functions),
        grid_of({"x": FIVE}, functions, "zip"),
        sample_of({"x": "uniform(1, 5)"}, functions, Sampling(16)),
    ):
        for coordinate in table.coordinates.values():
            assert coordinate.unit != "N m"
        table.units.update(dict.fromkeys(functions, table.coordinates["x"].unit))
        figure = draw_sweep(table)
        labels = [
            ax.get_xlabel() if "runs" in ax.get_ylabel() else ax.get_ylabel() for ax in figure.axes
        ]
        assert [label.partition(",")[0] for label in labels] == wanted
        assert len(draw_sweep(table, ["load"]).axes) == 1  # what is asked for is drawn
    two = grid_of({"x": FIVE, "y": [1.0, 2.0]}, {"a": lambda x, y: y, "b": lambda x, y: x * y})
    two.units.update(dict.fromkeys("ab", two.coordinates["y"].unit))
    assert [ax.get_label() for ax in draw_sweep(two).axes].count("<colorbar>") == 1


def test_a_sweep_without_quantities_is_refused_with_the_reason_of_a_run() -> None:
    empty = grid_of({"x": FIVE}, {"f": lambda x: x})._replace(values={}, units={})
    empty.texts["reason"][0] = "no memory"
    with pytest.raises(InputError, match=r"no run has quantities \(no memory\)"):
        draw_sweep(empty)


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
    names = [label.get_text() for label in right.get_yticklabels()]
    assert names == ["r.load", "mu", "p.load"]
    # 3 a + b c: parts of the variance 9/12, 0.5^2 1.5^2, 5^2/12 and what is left of b c.
    variances = np.array([25.0 / 12.0, 0.75, 0.5625])
    whole = 0.75 + 25.25 * 7.0 / 3.0 - 7.5**2
    assert first == pytest.approx(variances / whole, abs=0.15)  # of 64 rows
    assert right.get_ylim()[0] > right.get_ylim()[1]
    assert right.get_title(loc="left") == "from 64 rows; 95 % confidence"
    intervals = np.concatenate([c.get_segments() for c in right.collections])[:, :, 0]
    bars = np.concatenate([first, total])
    assert np.all((intervals[:, 0] <= bars) & (bars <= intervals[:, 1]))


def test_a_sample_without_indices_has_no_column_for_them() -> None:
    vary = {"a": "uniform(0.0, 1.0)", "b": "uniform(0.0, 1.0)"}
    table = sample_of(vary, {"f": lambda a, b: np.sin(40.0 * a + 30.0 * b)}, Sampling(64))
    figure = draw_sweep(table)
    assert len(figure.axes) == 1
    assert legend_of(figure) == ["mean", "50 %", "5 % and 95 %"]


def test_a_single_run_is_a_point() -> None:
    figure = draw_sweep(grid_of({"x": [2.0], "w": ["a"]}, {"f": lambda x, w: x.astype(float)}))
    (line,) = lines_of(figure.axes[0])
    assert (line.get_xdata().tolist(), line.get_ydata().tolist()) == ([2.0], [2.0])
    assert "w = a; 1 run" in title_of(figure)
    # Equal values of a key are drawn side by side.
    table = grid_of({"x": [1.0, 1.0, 2.0]}, {"f": lambda x: x})
    table.values["f"][:] = [5.0, 6.0, 7.0]
    (ax,) = draw_sweep(table).axes
    assert [label.get_text() for label in ax.get_xticklabels()] == ["1", "1", "2"]
    (line,) = lines_of(ax)
    assert line.get_ydata().tolist() == [5.0, 6.0, 7.0]


def test_a_sweep_of_which_all_runs_failed_is_drawn_as_such(sample: Any) -> None:
    figure = draw_sweep(with_outcomes(sample, dict.fromkeys(range(320), FAILED)))
    assert "320 runs; 320 failed" in title_of(figure)
    said = [text.get_text() for ax in figure.axes for text in ax.texts]
    assert said.count("not defined in any run") == 2
    grid = grid_of({"x": FIVE, "y": FIVE}, {"f": lambda x, y: x})
    figure = draw_sweep(with_outcomes(grid, dict.fromkeys(range(25), FAILED)))
    assert figure.axes[0].get_title() == "f, N m: no values"
    assert legend_of(figure) == ["failed: 25 runs"]
    assert len(lines_of(figure.axes[0], "x")[0].get_xdata()) == 25


def test_keys_are_shortened_so_that_they_differ() -> None:
    keys = ["x", "a.mu", "b.mu", "c.load", "d.value.1"]
    table = grid_of(dict.fromkeys(keys, FIVE), {"f": lambda *x: x[0]}, "zip")
    assert "together with a.mu, b.mu, load, value.1" in title_of(draw_sweep(table))
    table = grid_of(
        {"x": FIVE, "a.mu_s,a.mu_k": FIVE, "b.load": FIVE}, {"f": lambda *x: x[0]}, "zip"
    )
    assert "together with mu_s, mu_k, load" in title_of(draw_sweep(table))
    assert draw_sweep(grid_of({"a.b": FIVE}, {"f": lambda x: x})).axes[0].get_xlabel() == "a.b, m"


def test_counts_are_drawn_as_points() -> None:
    table = grid_of({"x": FIVE}, {"f": lambda x: np.floor(0.7 * x)})
    assert lines_of(draw_sweep(table).axes[0])[0].get_linestyle() == "-"  # whole by chance: N m
    table.units["f"] = "1"
    assert lines_of(draw_sweep(table).axes[0])[0].get_linestyle() == "None"
