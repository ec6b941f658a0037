"""Quantities as data: of one run, and of the runs of a table such as a slip curve."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from tests.fits.measurements import FORCE, LOAD, MU_S, SLOPE, frictionless, pulley
from tests.support.scenarios import SCENARIOS

BREAKAWAY = "breakaway_time"


def breakaway(mu_s: float, load: float = 2224.1) -> float:
    return float(fs.solve(pulley(), {MU_S: mu_s, LOAD: load}).quantities[BREAKAWAY])


def fit_friction(**options: Any) -> fs.Fit:
    """Return the fit of static friction, from one start."""
    return fs.fit(pulley(), free={MU_S: (0.1, 0.4)}, starts=1, **options)


def test_a_quantity_of_one_run() -> None:
    fit = fit_friction(quantities={BREAKAWAY: breakaway(0.27)}, sigma={BREAKAWAY: 0.01})
    assert fit.values[MU_S] == pytest.approx(0.27, rel=1e-6)
    assert fit.residuals[0].unit == "s"
    # By a difference of two runs: dt/dmu of the standard error.
    error = 0.01 * 0.002 / (breakaway(0.271) - breakaway(0.269))
    assert fit.standard_errors[MU_S] == pytest.approx(error, rel=1e-3)


def test_a_table_of_runs() -> None:
    loads = np.array([1900.0, 2000.0, 2100.0, 2200.0])
    times = [1e3 * breakaway(0.27, load) for load in loads]
    named: dict[str, Any] = {"quantities": {BREAKAWAY: "t"}, "units": {BREAKAWAY: "ms"}}
    fit = fit_friction(data={"W": loads, "t": times}, over={LOAD: "W"}, **named)
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
        quantities={BREAKAWAY: breakaway(0.27)},
        sigma={BREAKAWAY: 1e-3, "angle": 1e-3},
    )
    assert fit.values[MU_S] == pytest.approx(0.27, rel=1e-6)
    assert [part.name for part in fit.residuals] == ["angle", BREAKAWAY]


@pytest.mark.slow
def test_friction_of_a_belt_from_its_slip_and_a_speed() -> None:
    """A short run of a belt of 20 bodies without motion across itself: 0.07 s each."""
    coarse = {"mechanism.belt.bodies": 20, "solver.duration": 0.2, "output.interval": 0.005}
    # Fixed steps: those of an adaptive method change with the key, and the residual with them.
    belt = fs.load(SCENARIOS / "belt_string.toml", {**coarse, "solver.backend": "moreau"})
    mu = "effects.belt_friction.mu_s,effects.belt_friction.mu_k"
    torque, torques = "drive.driver.torque.value.1", [-12.0, -15.0]
    known = dict.fromkeys(mu.split(","), 0.8)
    runs = [fs.solve(belt, {**known, torque: value}) for value in torques]
    fit = fs.fit(
        belt,
        data={"M": torques, "slip": [run.quantities["slip_percent"].value for run in runs]},
        quantities={"slip_percent": "slip"},
        over={torque: "M"},
        sigma={"slip_percent": 0.005},
        free={mu: (0.6, 1.2, 0.9)},
        starts=1,
    )
    assert fit.values[mu] == pytest.approx(0.8, rel=1e-3)
    assert fit.residuals[0].unit == "%"
    assert fit.not_identified == {}

    key = "mechanism.pulleys.1.inertia"
    speed = fs.solve(belt, {key: 3e-4}).dataset["pulley_speed"]
    data = {"time": speed["time"].to_numpy(), "w": speed.sel(pulley="driven").to_numpy()}
    channels = {"pulley_speed.driven": "w"}
    by_speed = fs.fit(belt, data=data, channels=channels, free={key: (2e-4, 4e-4)}, starts=1)
    assert by_speed.values[key] == pytest.approx(3e-4, rel=1e-6)


def test_a_quantity_that_the_scenario_jumps_over() -> None:
    """Below mu_s = 0.19672 the pulley breaks away at once, above it at 0.541 s."""
    fit = fit_friction(quantities={BREAKAWAY: 0.5}, sigma={BREAKAWAY: 0.01}, bootstrap=40)
    assert fit.values[MU_S] == pytest.approx(0.19672, rel=1e-4)
    assert (fit.standard_errors[MU_S], fit.intervals[MU_S]) == (None, None)
    assert fit.not_identified[MU_S] == (
        "the run jumps or kinks at the estimate; a bootstrap needs no derivatives"
    )
    assert fit.bootstrap is not None
    assert fit.bootstrap.intervals[MU_S] is not None
    assert (fit.degrees, fit.finding.kind, fit.exit_code) == (0, "out_of_reach", 1)
    assert fit.warnings[1] == fit.finding.sentence
    assert fit.warnings[2].startswith(
        "chi squared 16.9 with 0 degrees of freedom is above 6.63, which chance exceeds in 1 %"
    )
    assert fit.summary().startswith("Pulley on a dry shaft: fit of 1 key to 1 value\n")


def test_a_unit_in_the_heading_of_a_key_of_the_runs(tmp_path: Path) -> None:
    path = tmp_path / "curve.csv"
    lines = [f"{force / 1e3},{SLOPE * (force - 100.0)}" for force in (200.0, 300.0)]
    path.write_text("\n".join(["P [kN],w (rad/s)", *lines]))
    free = {LOAD: (50.0, 150.0)}
    quantities = {"final_angular_velocity": "w"}
    fit = fs.fit(
        frictionless(), data=path, quantities=quantities, over={FORCE: "P"}, free=free, starts=1
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
