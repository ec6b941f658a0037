"""`fs.plot` of sweeps: of a file, of the dataset, and of a part of it."""

from pathlib import Path

import numpy as np
import pytest
import xarray

import frictionsim as fs
from frictionsim.api.sweep_result import table_of
from frictionsim.io.hdf5_reader import read_sweep
from tests.support.scenarios import SCENARIOS

MU_S, WAY = "effects.shaft_friction.mu_s", "drive.direction"


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> tuple[xarray.Dataset, Path]:
    path = tmp_path_factory.mktemp("sweep") / "s.h5"
    vary = {MU_S: [0.1, 0.2, 0.3], WAY: ["vertical", "horizontal"]}
    return fs.sweep(
        SCENARIOS / "pulley.toml", vary, {"solver.rtol": 1e-4}, output=path
    ).dataset, path


def test_the_table_of_a_dataset_is_that_of_its_file(swept: tuple[xarray.Dataset, Path]) -> None:
    dataset, path = swept
    found, read = table_of(dataset), read_sweep(path)
    assert found.dimensions == read.dimensions
    assert found.units == read.units
    assert found.statuses == read.statuses
    assert found.texts == read.texts
    assert {k: found.attributes[k] for k in read.attributes} == read.attributes
    for name, values in read.values.items():
        np.testing.assert_array_equal(found.values[name], values)
    for key, coordinate in read.coordinates.items():
        np.testing.assert_array_equal(found.coordinates[key].values, coordinate.values)
        assert found.coordinates[key]._replace(values=0) == coordinate._replace(values=0)


def test_a_file_and_a_dataset_and_a_part_of_it_are_drawn(
    swept: tuple[xarray.Dataset, Path],
) -> None:
    dataset, path = swept
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
