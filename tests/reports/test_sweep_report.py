"""Reports of sweeps, with their tables in a real browser."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

import frictionsim as fs
from tests.support.browser import check_sorting, opened
from tests.support.html_elements import charts_of
from tests.support.scenarios import SCENARIOS

PULLEY = SCENARIOS / "pulley.toml"
MU, LOAD = "effects.shaft_friction.mu_s", "mechanism.load"
LOOSE = {"solver.rtol": 1e-3, "solver.duration": 1.0, "output.interval": 0.1}
MAX_BYTES = 6e6


QUANTITIES = ("force_to_lift", "final_angle")


def with_few_quantities(sweep: fs.Sweep, path: Path, *names: str) -> Path:
    """Write a sweep with some of its quantities."""
    table = sweep.table
    values, units = ({name: of[name] for name in names} for of in (table.values, table.units))
    return fs.Sweep(table._replace(values=values, units=units)).save(path)


@pytest.fixture(scope="module")
def grid(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A grid of three keys; the runs with the largest friction fail: it has no budget for them."""
    path = tmp_path_factory.mktemp("sweeps") / "grid.h5"
    vary = {MU: [0.2, 0.25, 0.3], LOAD: [1900.0, 2000.0], "solver.max_steps": [5, 1000]}
    return with_few_quantities(fs.sweep(PULLEY, vary, LOOSE, workers=1), path, *QUANTITIES)


@pytest.fixture(scope="module")
def sample(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("sweeps") / "sample.h5"
    vary = {MU: "uniform(0.2, 0.3)", LOAD: "normal(2000, 50)"}
    return with_few_quantities(
        fs.sweep(PULLEY, vary, LOOSE, sample=16, workers=1), path, QUANTITIES[-1]
    )


@pytest.fixture(scope="module")
def reports(grid: Path, sample: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    folder = tmp_path_factory.mktemp("reports")
    return {path.stem: fs.report(path, folder / f"{path.stem}.html") for path in (grid, sample)}


def test_a_grid_of_two_keys_has_a_map_of_each_quantity(tmp_path: Path) -> None:
    both = f"{MU},effects.shaft_friction.mu_k"
    # Cells of values in disorder would overlap.
    vary = {both: [0.25, 0.3, 0.2], LOAD: [2000.0, 2100.0, 1900.0]}
    sweep = fs.sweep(PULLEY, vary, LOOSE, workers=1)
    page = fs.report(sweep, tmp_path / "a.html").read_text("utf-8")
    traces, layout = charts_of(page)["charts"]
    titles = [each["text"] for each in layout["annotations"]]
    assert layout["xaxis"]["title"]["text"] == "mu_s, mu_k"
    drawn = dict(zip(titles, traces, strict=True))
    of_lift = drawn["force_to_lift, N"]
    assert of_lift["type"] == "heatmap"
    shape = [int(n) for n in of_lift["z_shape"]]
    wanted = sweep.dataset["force_to_lift"].transpose(LOAD, both).sortby([LOAD, both])
    assert np.array_equal(of_lift["x"], [0.2, 0.25, 0.3])
    assert np.array_equal(of_lift["y"], [1900.0, 2000.0, 2100.0])
    assert np.array_equal(of_lift["z"].reshape(shape), wanted)


def test_values_of_true_and_false_are_words(tmp_path: Path) -> None:
    path, vary = (
        tmp_path / "s.h5",
        {"output.at_events": [True, False], "solver.max_steps": [90, 80]},
    )
    sweep = fs.sweep(PULLEY, vary, LOOSE, output=path, workers=1)
    for number, source in enumerate((sweep, path)):
        page = fs.report(source, tmp_path / f"{number}.html").read_text("utf-8")
        booleans, counts = charts_of(page)["charts"][0][:2]
        assert booleans["x"] == ["true", "true", "false", "false"]
        assert counts["x"] == [90, 80, 90, 80]


@pytest.mark.parametrize(("name", "keys"), [("grid", 3), ("sample", 2)])
def test_other_sweeps_have_each_quantity_over_each_key(
    name: str, keys: int, request: pytest.FixtureRequest, reports: dict[str, Path]
) -> None:
    traces, layout = charts_of(reports[name].read_text("utf-8"))["charts"]
    with fs.open_sweep(request.getfixturevalue(name)) as dataset:
        done = dataset["status"].to_numpy().ravel() == 1
        values = np.where(done, dataset["final_angle"].to_numpy().ravel(), np.nan)
    last = traces[-keys:]
    for trace in last:
        assert trace["mode"] == "markers"
        assert np.array_equal(trace["y"], values, equal_nan=True)
    axes = sorted(key for key in layout if key.startswith("xaxis"))
    assert len(axes) == len(traces)


def test_a_curve_over_one_key_has_a_gap_at_a_jump(tmp_path: Path) -> None:
    """The pulley is lifted after its force has grown, or runs back at once: nothing is between."""
    vary = {LOAD: np.linspace(1700.0, 2300.0, 13).tolist()}
    sweep = fs.sweep(PULLEY, vary, {**LOOSE, "solver.rtol": 1e-6}, workers=1)
    page = fs.report(sweep, tmp_path / "a.html").read_text("utf-8")
    traces, layout = charts_of(page)["charts"]
    drawn = {layout[f"yaxis{trace['yaxis'][1:]}"]["title"]["text"]: trace["y"] for trace in traces}
    for name, gaps in (("breakaway_time, s", [11]), ("force_to_lift, N", [])):
        values = sweep.dataset[name.partition(",")[0]].to_numpy()
        np.testing.assert_array_equal(drawn[name], np.insert(values, gaps, np.nan))


@pytest.mark.dev
def test_tables_are_sorted_by_numbers_and_by_keyboard(
    browser: Any, sample: Path, reports: dict[str, Path]
) -> None:
    with opened(browser, reports["sample"], color_scheme="dark") as page:
        with h5py.File(sample) as file:
            check_sorting(page, "#runs", "final_angle", file["final_angle"][:].tolist())
        assert page.locator(".js-plotly-plot .point").count() > 10


def large(shape: tuple[int, int]) -> Any:
    """Return a grid of many runs, whose largest value is at an odd place."""
    import xarray

    values = np.random.default_rng(1).random(shape)
    values[77, 123] = 9.0
    status = np.ones(shape, np.int8)
    status[5, 3] = 2
    texts = {name: np.full(shape, "", dtype=object) for name in ("reason", "warnings", "failure")}
    texts["failure"][5, 3] = "diverged"
    dims = (MU, LOAD)
    flags = {"flag_values": [0, 1, 2, 3], "flag_meanings": "not_run done failed audit_failed"}
    attrs = dict.fromkeys(("study", "scenario", "source", "kind", "reason"), "x")
    return xarray.Dataset(
        {
            **{f"value{i}": (dims, values + i, {"units": "N"}) for i in range(4)},
            "status": (dims, status, flags),
            **{name: (dims, text) for name, text in texts.items()},
        },
        {
            MU: (MU, np.linspace(0.1, 0.3, shape[0]), {"units": "1"}),
            LOAD: (LOAD, np.linspace(1e3, 2e3, shape[1]), {"units": "N"}),
        },
        attrs | {"title": "many", "design": "grid", "status": "done"},
    )


def test_a_large_sweep_is_thinned_and_keeps_extremes_and_failures(tmp_path: Path) -> None:
    sweep = large((100, 130)).drop_vars(["value1", "value2", "value3"])
    html = fs.report(sweep, tmp_path / "a.html").read_text(encoding="utf-8")
    assert len(html) < MAX_BYTES
    table = html[html.index('id="runs"') :]
    rows = table[: table.index("</table>")].count("<tr>") - 1
    assert 1000 < rows < 12_000 / 4  # as many cells as a page has room for
    assert f"{rows} of 13000 runs are in the table, with extremes" in html
    assert f'data-value="{77 * 130 + 123}"' in html  # the largest value
    assert f'data-value="{5 * 130 + 3}"' in html  # which failed
    assert "diverged" in html
