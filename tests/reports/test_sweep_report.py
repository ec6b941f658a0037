"""Reports of sweeps, with their tables in a real browser."""

import re
from base64 import b64decode
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

import frictionsim as fs
from tests.support.browser import check_sorting, opened, without_scripts
from tests.support.cases import slow
from tests.support.scenarios import SCENARIOS

PULLEY = SCENARIOS / "pulley.toml"
MU, LOAD = "effects.shaft_friction.mu_s", "mechanism.load"
LOOSE = {"solver.rtol": 1e-3, "solver.duration": 1.0, "output.interval": 0.1}
HOSTILE = "<b>b</b></script><script>alert(1)</script> \"q\" 'p' & \x1b[31m \u202eend"
MAX_BYTES = 6e6


# The picture of each takes a third of a second.
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


def pictures_of(path: Path) -> list[tuple[str, bytes]]:
    """Return the title and the SVG of each picture of a report."""
    pairs = re.findall(
        r"<details[^>]*><summary>([^<]*)</summary><img[^>]*base64,([^\"]*)",
        path.read_text(encoding="utf-8"),
    )
    return [(title, b64decode(image)) for title, image in pairs]


@pytest.mark.parametrize("name", ["grid", slow("sample")])
def test_the_pictures_of_a_report_are_those_of_plot(
    name: str, request: pytest.FixtureRequest, reports: dict[str, Path], told: Any, here: Path
) -> None:
    path = request.getfixturevalue(name)
    pictures = dict(pictures_of(reports[name]))
    with fs.open_sweep(path) as dataset:
        defined = [n for n, v in dataset.items() if v.dtype == float and bool(v.notnull().any())]
    assert list(pictures) == ["The first quantities that vary", *defined]
    last = list(pictures)[-1]
    told("plot", path, "--view", last, "-o", "a.svg")
    assert pictures[last] == (here / "a.svg").read_bytes()


def test_tables_are_sorted_by_numbers_and_by_keyboard(
    browser: Any, sample: Path, reports: dict[str, Path]
) -> None:
    with opened(browser, reports["sample"], color_scheme="dark") as page:
        with h5py.File(sample) as file:
            check_sorting(page, "#runs", "final_angle", file["final_angle"][:].tolist())
        assert page.evaluate("[...document.images].every((one) => one.naturalWidth > 100)")


def test_too_many_keys_for_a_picture_are_reported(tmp_path: Path) -> None:
    vary = {MU: [0.2, 0.25], LOAD: [1900.0, 2000.0], "mechanism.inertia": [1.0, 1.4]}
    vary |= {"effects.shaft_friction.mu_k": [0.1, 0.11]}
    report = fs.report(fs.sweep(PULLEY, vary, LOOSE, workers=1), tmp_path / "a.html")
    assert pictures_of(report) == []
    assert ">4 keys have several values" in report.read_text("utf-8")


def test_a_report_of_a_sweep_is_complete_without_scripts(
    browser: Any, grid: Path, reports: dict[str, Path]
) -> None:
    with without_scripts(browser, reports["grid"]) as page:
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


def hostile(dataset: Any) -> Any:
    """Return a sweep with markup in title, keys, values, names, units, reasons and warnings."""
    # `array` and `__proto__` are names that scripts might take for their own.
    renamed = dataset.rename({LOAD: HOSTILE, "final_angle": "array", "force_to_lift": "__proto__"})
    renamed = renamed.assign_coords({MU: [HOSTILE, "b", "c"]})
    renamed.attrs |= {"title": HOSTILE, "study": HOSTILE}
    renamed["array"].attrs["units"] = HOSTILE
    for name in ("failure", "reason", "warnings"):
        renamed[name][:] = HOSTILE
    return renamed


@pytest.mark.slow
def test_markup_in_a_sweep_stays_text(browser: Any, grid: Path, tmp_path: Path) -> None:
    with fs.open_sweep(grid) as dataset:
        report = fs.report(hostile(dataset.load()), tmp_path / "a.html")
    with opened(browser, report) as page:
        assert page.locator("body b, body script[src], section script").count() == 0
        assert r"\x1b[31m \u202eend" in page.inner_text("#runs")
        assert "</script><script>alert(1)</script>" in page.inner_text("pre")
        assert all(b"<script" not in image for _, image in pictures_of(report))


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


def test_a_sweep_that_was_stopped_shows_what_is_left(grid: Path, tmp_path: Path) -> None:
    with fs.open_sweep(grid) as dataset:
        sweep = dataset.load().drop_vars("force_to_lift")
    sweep["status"][2] = 0
    sweep["final_angle"][2] = np.nan
    sweep.attrs |= {"status": "interrupted", "reason": "stopped by Ctrl-C"}
    shown = fs.report(sweep, tmp_path / "a.html").read_text(encoding="utf-8")
    assert "sweep interrupted" in shown
    assert "4 not run" in shown
    assert "stopped: stopped by Ctrl-C" in shown


def test_numbers_that_are_non_finite_have_a_report(tmp_path: Path) -> None:
    sweep = large((100, 130)).isel({MU: slice(0, 4), LOAD: slice(0, 3)})
    sweep["value0"][0] = np.inf
    sweep["value1"][:] = np.inf
    sweep["value2"][:] = np.nan
    sweep["value3"][:] = 1e308
    report = fs.report(sweep, tmp_path / "a.html")
    assert pictures_of(report) == []
    assert "has numbers above 1e+100" in report.read_text("utf-8")
    sweep["value3"][:] = 1e90
    sweep["value3"][0] = 2e90
    sweep["value1"][:] = 3.0
    report = fs.report(sweep, tmp_path / "a.html")
    titles = {title for title, _ in pictures_of(report)}
    assert {"value0", "value3"} <= titles
    assert "value1" not in titles  # it does not vary
    text = report.read_text("utf-8")
    assert re.search("Without a picture: [^;]*value1[^;]*; the table has", text)
    assert ">none<" in text[text.index('id="runs"') :]
