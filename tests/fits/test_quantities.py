"""Quantities as data: of one run, and of the runs of a table such as a slip curve."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from tests.fits.measurements import FORCE, LOAD, MU_S, SLOPE, frictionless, pulley
from tests.support.scenarios import SCENARIOS


def breakaway(**overrides: float) -> float:
    keys = {"mu_s": MU_S, "load": LOAD}
    result = fs.solve(pulley(), {keys[name]: value for name, value in overrides.items()})
    time = result.quantities["breakaway_time"].value
    assert time is not None
    return time


def fit_friction(**options: Any) -> fs.Fit:
    """Return the fit of static friction, from one start."""
    return fs.fit(pulley(), free={MU_S: (0.1, 0.4)}, starts=1, **options)


def test_a_quantity_of_one_run() -> None:
    wanted, sigma = {"breakaway_time": breakaway(mu_s=0.27)}, {"breakaway_time": 0.01}
    fit = fit_friction(quantities=wanted, sigma=sigma)
    assert fit.values[MU_S] == pytest.approx(0.27, rel=1e-6)
    assert fit.residuals[0].unit == "s"
    # By a difference of two runs: dt/dmu of the standard error.
    error = 0.01 * 0.002 / (breakaway(mu_s=0.271) - breakaway(mu_s=0.269))
    assert fit.standard_errors[MU_S] == pytest.approx(error, rel=1e-3)


def test_a_table_of_runs() -> None:
    loads = np.array([1900.0, 2000.0, 2100.0, 2200.0])
    times = [1e3 * breakaway(mu_s=0.27, load=load) for load in loads]
    fit = fit_friction(
        data={"W": loads, "t": times},
        quantities={"breakaway_time": "t"},
        units={"breakaway_time": "ms"},
        over={LOAD: "W"},
    )
    assert fit.values[MU_S] == pytest.approx(0.27, rel=1e-6)
    (part,) = fit.residuals
    assert (part.unit, part.values.size) == ("ms", 4)
    assert fit.scenario.mechanism.load == 2224.1  # that of the scenario
    assert fit.measured.runs[0] == {LOAD: 1900.0}


def test_a_quantity_beside_channels() -> None:
    made = fs.solve(pulley(), {MU_S: 0.27, "output.interval": 0.1})
    fit = fit_friction(
        data=made.dataset.isel(time=[0, 3, 8, 12]),
        channels="angle",
        quantities={"breakaway_time": breakaway(mu_s=0.27)},
        sigma={"breakaway_time": 1e-3, "angle": 1e-3},
    )
    assert fit.values[MU_S] == pytest.approx(0.27, rel=1e-6)
    assert [part.name for part in fit.residuals] == ["angle", "breakaway_time"]


@pytest.mark.slow
def test_friction_of_a_belt_from_its_slip_and_a_speed() -> None:
    """A short run of a belt of 20 bodies without motion across itself: 0.07 s each."""
    coarse = {"mechanism.belt.bodies": 20, "solver.duration": 0.2, "output.interval": 0.005}
    # Fixed steps: those of an adaptive method change with the key, and the residual with them.
    belt = fs.load(SCENARIOS / "belt_string.toml", {**coarse, "solver.backend": "moreau"})
    mu = "effects.belt_friction.mu_s,effects.belt_friction.mu_k"
    torque = "drive.driver.torque.value.1"
    curve = [
        fs.solve(belt, {**dict.fromkeys(mu.split(","), 0.8), torque: value})
        .quantities["slip_percent"]
        .value
        for value in (-12.0, -15.0)
    ]
    fit = fs.fit(
        belt,
        data={"M": [-12.0, -15.0], "slip": curve},
        quantities={"slip_percent": "slip"},
        over={torque: "M"},
        sigma={"slip_percent": 0.005},
        free={mu: (0.6, 1.2, 0.9)},
        starts=1,
    )
    assert fit.values[mu] == pytest.approx(0.8, rel=1e-3)
    assert fit.residuals[0].unit == "%"
    assert fit.not_identified == {}

    speed = fs.solve(belt, {"mechanism.pulleys.1.inertia": 3e-4}).dataset["pulley_speed"]
    data = {"time": speed["time"].to_numpy(), "w": speed.sel(pulley="driven").to_numpy()}
    key = "mechanism.pulleys.1.inertia"
    by_speed = fs.fit(
        belt, data=data, channels={"pulley_speed.driven": "w"}, free={key: (2e-4, 4e-4)}, starts=1
    )
    assert by_speed.values[key] == pytest.approx(3e-4, rel=1e-6)


def test_a_quantity_that_the_scenario_jumps_over() -> None:
    """Below mu_s = 0.19672 the pulley breaks away at once, above it at 0.541 s."""
    fit = fs.fit(
        pulley(rtol=1e-9),
        quantities={"breakaway_time": 0.5},
        sigma={"breakaway_time": 0.01},
        free={MU_S: (0.1, 0.4)},
        starts=1,
        bootstrap=40,
    )
    assert fit.values[MU_S] == pytest.approx(0.19672, rel=1e-4)
    assert (fit.standard_errors[MU_S], fit.intervals[MU_S]) == (None, None)
    assert fit.not_identified[MU_S] == (
        "the run jumps or kinks at the estimate; a bootstrap needs no derivatives"
    )
    assert fit.bootstrap is not None
    assert fit.bootstrap.intervals[MU_S] is not None
    assert fit.degrees == 0
    assert (fit.finding.kind, fit.exit_code) == ("out_of_reach", 1)
    assert fit.warnings[1:] == (
        fit.finding.sentence,
        "chi squared 16.9 with 0 degrees of freedom is above 6.63, which chance exceeds in 1 % of"
        " fits: the residuals are up to 4.12 sigma, of breakaway_time; the scenario lacks something"
        " that the data show, or sigma is too small, and so are the standard errors",
    )
    assert fit.summary().startswith("Pulley on a dry shaft: fit of 1 key to 1 value\n")


def test_a_unit_in_the_heading_of_a_key_of_the_runs(tmp_path: Path) -> None:
    path = tmp_path / "curve.csv"
    lines = [f"{force / 1e3},{SLOPE * (force - 100.0)}" for force in (200.0, 300.0)]
    path.write_text("\n".join(["P [kN],w (rad/s)", *lines]))
    fit = fs.fit(
        frictionless(),
        data=path,
        quantities={"final_angular_velocity": "w"},
        over={FORCE: "P"},
        free={LOAD: (50.0, 150.0)},
        starts=1,
    )
    assert fit.values[LOAD] == pytest.approx(100.0, rel=1e-6)
    assert "\ndata: final_angular_velocity from 'w' in rad/s\n" in fit.summary()


def test_the_warnings_of_the_last_runs_are_reported() -> None:
    options: dict[str, Any] = {"sigma": {"final_angular_velocity": 0.1}, "starts": 1}
    options["free"] = {LOAD: (50.0, 150.0)}
    data = {"P": [-50.0, -20.0, 10.0], "w": SLOPE * np.array([-150.0, -120.0, -90.0])}
    quantities = {"final_angular_velocity": "w"}
    rows = fs.fit(frictionless(), data=data, quantities=quantities, over={FORCE: "P"}, **options)
    warning = "drive.force has a minimum of -50 N; a cord cannot push"
    assert rows.warnings == (f"{warning} (2 of 3 rows; the numbers are of the first)",)
    wanted = {"final_angular_velocity": SLOPE * -150.0}
    single = fs.fit(frictionless().replace({FORCE: -50.0}), quantities=wanted, **options)
    assert single.warnings == (warning,)
