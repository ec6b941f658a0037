"""Reports of sweeps in a real browser."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

import frictionsim as fs
from frictionsim.api.sweep_dataset import table_of
from frictionsim.parameter_study.block import AUDIT_FAILED
from frictionsim.parameter_study.statistics import extremes
from frictionsim.reports import sweep_report as sweep_data
from frictionsim.reports.sweep_report import sweep_page
from tests.support.browser import opened
from tests.support.scenarios import SCENARIOS
from tests.support.sweeps import with_outcomes

PULLEY = SCENARIOS / "pulley.toml"
MU, LOAD = "effects.shaft_friction.mu_s", "mechanism.load"
LOOSE = {"solver.rtol": 1e-3, "solver.duration": 1.0, "output.interval": 0.1}
HOSTILE = "<b>b</b></script><script>alert(1)</script> \"q\" 'p' & \x1b[31m \u202eend"
CHART = "document.getElementById('chart').data"
MOST_BYTES = 6e6


@pytest.fixture(scope="module")
def grid(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A grid of three keys; the runs with the largest friction fail: it has no budget for them."""
    path = tmp_path_factory.mktemp("sweeps") / "grid.h5"
    vary = {MU: [0.2, 0.25, 0.3], LOAD: [1900.0, 2000.0], "solver.max_steps": [5, 1000]}
    fs.sweep(PULLEY, vary, LOOSE, output=path, workers=1)
    return path


@pytest.fixture(scope="module")
def sample(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("sweeps") / "sample.h5"
    fs.sweep(
        PULLEY,
        {MU: "uniform(0.2, 0.3)", LOAD: "normal(2000, 50)"},
        LOOSE,
        sample=32,
        output=path,
        workers=1,
    )
    return path


def pick(page: Any, **choices: str) -> None:
    for name, label in choices.items():
        page.select_option(f"select[name={name}]", label=label)


def test_a_run_whose_audit_failed_is_no_part_of_a_curve(
    browser: Any, grid: Path, tmp_path: Path
) -> None:
    table = with_outcomes(table_of(fs.open_sweep(grid)), {5: AUDIT_FAILED})
    path = tmp_path / "a.html"
    path.write_text(sweep_page(table, iter(["runs"]), "a.h5"), encoding="utf-8")
    with opened(browser, path) as page:
        pick(page, view="curves", quantity="final_angle, rad", at2="1000")
        found = page.evaluate(f"{CHART}.map(({{name, x}}) => [name, [...x]])")
    whole = [0.2, 0.25, 0.3]
    assert found == [["1900 N", [0.2, 0.3]], ["2000 N", whole], ["audit failed: 1", [0.25]]]


def test_curves_map_and_runs_are_those_of_the_file(
    browser: Any, grid: Path, tmp_path: Path
) -> None:
    with opened(browser, fs.report(grid, tmp_path / "a.html")) as page, h5py.File(grid) as file:
        pick(page, view="map", quantity="final_angle, rad", at2="1000")
        assert page.evaluate(f"{CHART}[0].z") == file["final_angle"][:, :, 1].T.tolist()
        pick(page, at2="5")
        assert page.evaluate(f"{CHART}.map(({{name}}) => name)")[1:] == ["failed: 6"]
        assert page.evaluate(f"{CHART}[0].z.flat().every((value) => value === null)")
        pick(page, view="curves", at2="1000")
        assert page.evaluate(f"{CHART}.map(({{name, x, y}}) => [name, [...x], [...y]])") == [
            [f"{load:g} N", list(file[MU][:]), list(file["final_angle"][:, number, 1])]
            for number, load in enumerate(file[LOAD][:])
        ]
        page.locator("#runs tbody button").nth(3).focus()
        page.keyboard.press("Enter")
        shown = page.inner_text("#run")
        assert "Run 3" in shown
        assert f"{LOAD}\n2000 N" in shown
        page.fill("input[name=run]", "0")
        page.keyboard.press("Tab")
        assert "budget_exceeded" in page.inner_text("#run")
        assert page.locator("tr[aria-current] th").inner_text() == "0"
        page.fill("input[name=run]", "99")
        page.keyboard.press("Tab")
        assert "the sweep has the runs 0 to 11" in page.inner_text("#run")
        point = page.locator("#chart .scatterlayer .trace").first.locator(".point").first
        point.scroll_into_view_if_needed()
        box = point.bounding_box()
        place = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        page.mouse.move(*place)
        page.locator("#chart .hoverlayer .hovertext").wait_for()
        page.mouse.click(*place)
        page.locator("#run h3", has_text="Run 1").wait_for()


def test_a_histogram_has_the_statistics_of_the_sample(
    browser: Any, sample: Path, tmp_path: Path
) -> None:
    with opened(browser, fs.report(sample, tmp_path / "a.html"), color_scheme="dark") as page:
        with h5py.File(sample) as file:
            values, mu = file["final_angle"][:], file[MU][:]
        pick(page, quantity="final_angle, rad", view="histogram")
        counts, width = page.evaluate(f"[[...{CHART}[0].y], {CHART}[0].width[0]]")
        assert sum(counts) == 32
        assert width * len(counts) == pytest.approx(np.ptp(values))
        assert page.evaluate(f"{CHART}[1].x[0]") == pytest.approx(values.mean())
        pick(page, view="scatter", x=MU)
        assert page.evaluate(f"[...{CHART}[0].x]") == list(mu)
        assert page.evaluate(f"[...{CHART}[0].y]") == list(values)
        pick(page, quantity="force_to_lift, N", view="Sobol indices")
        total = page.evaluate(f"{CHART}[1].x")
        shown = page.locator("table", has_text="force_to_lift: part of its variance")
        assert sorted(f"{value:.3g}" for value in total) == sorted(
            shown.locator("tbody td:last-child").all_inner_texts()
        )


def test_a_report_of_a_sweep_is_complete_without_scripts(
    browser: Any, grid: Path, tmp_path: Path
) -> None:
    report = fs.report(grid, tmp_path / "a.html")
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto(report.as_uri())
    shown = page.inner_text("body")
    assert "6 of 12 runs are done; 6 failed: not in the table below" in shown
    assert "budget_exceeded" in shown
    # Its file is named once; headings are those of axes.
    assert shown.count(str(grid)) == 1
    assert f"{LOAD}, N" in page.locator("#runs thead").inner_text().split("\t")
    assert " / " not in page.locator("#runs thead").inner_text()
    assert page.locator("#runs tbody tr").count() == 12
    assert "[study]" in page.inner_text("pre")
    assert page.locator("th:not([scope]), table:not(:has(caption))").count() == 0
    context.close()


def hostile(dataset: Any) -> Any:
    """Return a sweep with markup in title, keys, values, names, units, reasons and warnings."""
    # `array` and `__proto__` are names that scripts might take for their own.
    found = dataset.rename({LOAD: HOSTILE, "final_angle": "array", "energy_input": "__proto__"})
    found = found.assign_coords({MU: [HOSTILE, "b", "c"]})
    found.attrs |= {"title": HOSTILE, "study": HOSTILE}
    found["array"].attrs["units"] = HOSTILE
    for name in ("failure", "reason", "warnings"):
        found[name][:] = HOSTILE
    return found


def test_markup_in_a_sweep_stays_text(browser: Any, grid: Path, tmp_path: Path) -> None:
    with fs.open_sweep(grid) as dataset:
        report = fs.report(hostile(dataset.load()), tmp_path / "a.html")
    with opened(browser, report) as page:
        option = page.locator("select[name=quantity] option", has_text="array").first
        page.select_option("select[name=quantity]", value=option.get_attribute("value"))
        pick(page, view="curves")
        page.fill("input[name=run]", "1")
        page.keyboard.press("Tab")
        assert page.locator("body b, body script[src], section script").count() == 0
        assert r"\u001b[31m \u202eend" in page.inner_text("#run")
        assert r"\x1b[31m \u202eend" in page.inner_text("#runs")
        assert "</script><script>alert(1)</script>" in page.inner_text("pre")
        assert "<b>b</b></script>" in page.locator("#chart .ytitle").text_content()


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
    table = table_of(large((1000, 300)))
    kept = sweep_data.kept_of(table)
    assert kept.runs.size * 7 < 1.1 * sweep_data.MAX_VALUES
    assert {77 * 300 + 123, 5 * 300 + 3} <= set(kept.runs.tolist())
    assert extremes(table)["value0"].largest_run in kept.runs
    html = sweep_page(table, iter(["many", "a line"]), "many.h5")
    assert len(html) < MOST_BYTES
    assert f"{kept.runs.size} of 300000 runs are in this page, with extremes" in html
    assert f'data-value="{77 * 300 + 123}"' in html
    assert "diverged" in html


def test_a_thinned_sweep_opens(
    browser: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sweep_data, "MAX_VALUES", 20_000)
    found = large((100, 130))
    missing = min({*range(13_000)} - {*sweep_data.kept_of(table_of(found)).runs.tolist()})
    with opened(browser, fs.report(found, tmp_path / "a.html")) as page:
        assert page.evaluate(f"{CHART}[0].type") == "heatmap"
        page.fill("input[name=run]", str(missing))
        page.keyboard.press("Tab")
        assert f"Run {missing} is not in this page" in page.inner_text("#run")


def test_a_sweep_that_was_stopped_shows_what_is_left(
    browser: Any, grid: Path, tmp_path: Path
) -> None:
    with fs.open_sweep(grid) as dataset:
        found = dataset.load()
    found["status"][2] = 0
    found["final_angle"][2] = np.nan
    found.attrs |= {"status": "interrupted", "reason": "stopped by Ctrl-C"}
    with opened(browser, fs.report(found, tmp_path / "a.html")) as page:
        shown = page.inner_text("body")
        assert "sweep interrupted" in shown
        assert "4 not run" in shown
        assert "stopped: stopped by Ctrl-C" in shown
        pick(page, view="curves", quantity="final_angle, rad", at2="1000")
        assert page.evaluate(f"{CHART}.at(-1).name") == "not run: 2"


def test_numbers_that_are_not_finite_have_a_report(browser: Any, tmp_path: Path) -> None:
    found = large((100, 130)).isel({MU: slice(0, 4), LOAD: slice(0, 3)})
    found["value0"][0] = np.inf
    found["value1"][:] = np.inf
    found["value2"][:] = np.nan
    found["value3"][:] = 1e308
    with opened(browser, fs.report(found, tmp_path / "a.html")) as page:
        for number in range(4):
            for view in ("curves", "map"):
                pick(page, quantity=f"value{number}, N", view=view)


def test_bins_hold_all_finite_values() -> None:
    for values in ([1.0, 2.0, 3.0, np.inf], [-1e308, 1e308, np.nan], [0.0, 1e-320], [7.0, 7.0]):
        with np.errstate(all="ignore"):  # as in a report
            found = sweep_data._bins(np.array(values))
        assert found["counts"].sum() == np.isfinite(values).sum()
        assert (np.diff(found["edges"]) >= 0.0).all()
        assert np.isfinite(found["edges"]).all()
