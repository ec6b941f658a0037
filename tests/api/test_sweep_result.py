"""Results of runs, sweeps, studies and fits: what they have in common, and access to datasets."""

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib import pyplot as plt
from matplotlib.figure import Figure

import frictionsim as fs
from frictionsim.api.result_base import ResultBase
from tests.support.scenarios import SCENARIOS

pytestmark = pytest.mark.quick

LOOSE = {"solver.rtol": 1e-4}
LOAD = "mechanism.load"


@pytest.fixture(scope="module")
def swept() -> fs.Sweep:
    return fs.sweep(SCENARIOS / "pulley.toml", {LOAD: [1900.0, 2000.0, 2100.0]}, LOOSE, workers=1)


def results() -> list[Any]:
    scenario = SCENARIOS / "pulley.toml"
    study = fs.cost(scenario, LOOSE, backends="events", tolerances=[1e-3], repeats=1)
    fitted = fs.fit(
        scenario, LOOSE, quantities={"force_to_lift": 2800.0}, free={LOAD: (1e3, 3e3)}, starts=1
    )
    return [fs.solve(scenario, LOOSE), study, fitted]


def test_results_are_summarised_drawn_and_saved_alike(swept: fs.Sweep, tmp_path: Path) -> None:
    for found, name in zip((*results(), swept), ("a.h5", "b.h5", "c.toml", "d.h5"), strict=True):
        assert isinstance(found, ResultBase)
        assert (found.status, found.reason, found.exit_code) == ("done", "", 0)
        assert found.summary().splitlines()[0] in found._repr_html_().replace("&#x27;", "'")
        assert found.to_json()["status"] == "done"
        assert isinstance(found.plot(), Figure)
        figure, axes = plt.subplots(1, 2, figsize=(14, 6), layout="constrained")
        assert found.plot(ax=axes[1]) is figure
        assert axes[0] in figure.axes
        assert axes[1] not in figure.axes
        assert [len(part.axes) for part in figure.subfigs] == [len(found.plot().axes)]
        plt.close(figure)
        assert found.save(tmp_path / name) == tmp_path / name
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
