"""The picture of a fit."""

from pathlib import Path

import numpy as np
import pytest

import frictionsim as fs
from tests.fits.measurements import FORCE, SLOPE, frictionless

TIME = np.linspace(0.1, 0.9, 9)


@pytest.fixture(scope="module")
def series() -> fs.Fit:
    noise = 0.1 * np.random.default_rng(0).normal(size=(2, TIME.size))
    data = {
        "time": TIME,
        "angular_velocity": SLOPE * 200.0 * TIME + noise[0],
        "angle": 0.5 * SLOPE * 200.0 * TIME**2 + noise[1],
    }
    channels = ["angular_velocity", "angle"]
    free = {FORCE: (0.0, 1000.0)}
    return fs.fit(frictionless(), data=data, channels=channels, free=free, starts=1)


def test_data_fit_and_residuals_over_time(series: fs.Fit, tmp_path: Path) -> None:
    figure = series.plot()
    assert [ax.get_ylabel() for ax in figure.axes] == [
        "angular\nvelocity, rad/s",
        "residual, rad/s",
        "angle, rad",
        "residual, rad",
    ]
    assert figure.axes[1].get_xlabel() == "time, s"
    data, fitted = figure.axes[0].lines
    assert data.get_ydata() == pytest.approx(SLOPE * 200.0 * TIME, abs=0.4)
    assert (data.get_linestyle(), data.get_marker()) == ("None", "o")
    force = series.values[FORCE]
    assert fitted.get_ydata() == pytest.approx(SLOPE * (force - 100.0) * TIME, rel=1e-6)
    residuals = figure.axes[1].lines[-1]
    assert residuals.get_ydata() == pytest.approx(data.get_ydata() - fitted.get_ydata())
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels == ["data", "fit", "data minus fit", "± standard deviation of the data"]
    assert series.save(tmp_path / "fit.png").read_bytes().startswith(b"\x89PNG")


def test_a_quantity_over_the_key_of_its_runs() -> None:
    data = {"P": [300.0, 200.0, 400.0], "w": SLOPE * np.array([200.0, 100.0, 300.0])}
    sought = {"quantities": {"final_angular_velocity": "w"}, "over": {FORCE: "P"}}
    free = {"mechanism.load": (0.0, 150.0)}
    axes = fs.fit(frictionless(), data=data, **sought, free=free, starts=1).plot().axes
    assert axes[1].get_xlabel() == f"{FORCE}, N"
    drawn = [line.get_xdata().tolist() for line in axes[0].lines]
    assert drawn == [[300.0, 200.0, 400.0], [200.0, 300.0, 400.0]]
