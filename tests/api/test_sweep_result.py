"""Results of runs, sweeps, studies and fits: what they have in common, and access to datasets."""

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray
from matplotlib.figure import Figure

import frictionsim as fs
from tests.support.sweep_files import LOAD, LOOSE, MU_S, PULLEY

WAY = "drive.direction"
DONE, FAILED, AUDIT_FAILED = 1, 2, 3  # of a run, as a file has them


@pytest.fixture(scope="module")
def swept() -> fs.Sweep:
    return fs.sweep(PULLEY, {LOAD: [1900.0, 2000.0, 2100.0]}, LOOSE, workers=1)


def results() -> list[Any]:
    study = fs.cost(PULLEY, LOOSE, backends="events", tolerances=[1e-3], repeats=1)
    fitted = fs.fit(
        PULLEY, LOOSE, quantities={"force_to_lift": 2800.0}, free={LOAD: (1e3, 3e3)}, starts=1
    )
    return [fs.solve(PULLEY, LOOSE), study, fitted]


@pytest.mark.parametrize(
    ("statuses", "code"),
    [
        ((DONE, FAILED, AUDIT_FAILED), 0),
        ((FAILED, FAILED, FAILED), 1),
        ((FAILED, AUDIT_FAILED, FAILED), 3),
        ((AUDIT_FAILED, AUDIT_FAILED, AUDIT_FAILED), 3),
    ],
)
def test_a_sweep_without_a_sound_run_has_another_exit_code(
    statuses: tuple[int, ...], code: int, swept: fs.Sweep
) -> None:
    table = swept.table._replace(status=np.array(statuses, dtype=np.int8))
    assert fs.Sweep(table, None).exit_code == code


def test_results_are_summarised_drawn_and_saved_alike(swept: fs.Sweep, tmp_path: Path) -> None:
    for outcome, name in zip((*results(), swept), ("a.h5", "b.csv", "c.toml", "d.h5"), strict=True):
        assert (outcome.status, outcome.reason, outcome.exit_code) == ("done", "", 0)
        assert outcome.summary().splitlines()[0] in outcome._repr_html_().replace("&#x27;", "'")
        assert outcome.to_json()["status"] == "done"
        alone = outcome.plot()
        assert isinstance(alone, Figure)
        part = Figure(figsize=(14, 6), layout="constrained").subfigures(1, 2)[1]
        assert outcome.plot(figure=part) is part
        assert len(part.axes) == len(alone.axes)
        assert outcome.save(tmp_path / name) == tmp_path / name
        assert (tmp_path / name).stat().st_size


def test_a_sweep_is_read_as_its_dataset(swept: fs.Sweep, tmp_path: Path) -> None:
    dataset = swept.dataset
    assert list(swept) == list(dataset)
    assert len(swept) == len(dataset)
    assert "final_angle" in swept
    np.testing.assert_array_equal(swept["final_angle"], dataset["final_angle"])
    np.testing.assert_array_equal(swept.final_angle, dataset["final_angle"])
    assert swept.sel({LOAD: 2000.0}).equals(dataset.isel({LOAD: 1}))
    assert swept.attrs == dataset.attrs
    opened = fs.open_sweep(swept.save(tmp_path / "s.h5"))
    assert opened.identical(swept)
    assert opened.equals(dataset)
    assert not opened.equals(swept.isel({LOAD: slice(2)}))
    assert pickle.loads(pickle.dumps(opened)).identical(swept)
    assert swept.save(tmp_path / "s.csv").read_text().count("\n") == 4


@pytest.fixture(scope="module")
def grid(tmp_path_factory: pytest.TempPathFactory) -> tuple[xarray.Dataset, Path]:
    path = tmp_path_factory.mktemp("sweep") / "s.h5"
    vary = {MU_S: [0.1, 0.2, 0.3], WAY: ["vertical", "horizontal"]}
    return fs.sweep(PULLEY, vary, LOOSE, output=path, workers=1).dataset, path


def test_the_table_of_a_dataset_is_that_of_its_file(grid: tuple[xarray.Dataset, Path]) -> None:
    dataset, path = grid
    with xarray.open_dataset(path, engine="h5netcdf") as of_file:
        xarray.testing.assert_equal(of_file.load(), dataset)
    assert fs.open_sweep(path).dataset.identical(dataset)


def test_a_file_and_a_dataset_and_a_part_of_it_are_drawn(grid: tuple[xarray.Dataset, Path]) -> None:
    dataset, path = grid
    for source in (path, str(path), dataset):
        figure = fs.plot(source, "final_angle")
        drawn = [line.get_ydata() for line in figure.axes[0].lines]
        np.testing.assert_array_equal(drawn, dataset["final_angle"].values.T)
    chosen = fs.plot(dataset, "final_angle, force_to_lift", at={WAY: "horizontal"})
    part = fs.plot(dataset.sel({WAY: "horizontal"}), "final_angle")
    for figure, count in ((chosen, 2), (part, 1)):
        assert len(figure.axes) == count
        (line,) = figure.axes[0].lines
        np.testing.assert_array_equal(line.get_ydata(), dataset["final_angle"].values[:, 1])
