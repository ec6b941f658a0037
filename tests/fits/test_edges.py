"""Estimates at and near an edge beyond which there is no run: invalid values, or runs that fail."""

from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from tests.fits.measurements import DAMPING, MU_K, MU_S, pulley, series

KINETIC = (0.02, 0.3)  # bounds of mu_k; the scenario has mu_s = 0.2, which it may not exceed
WORDS = f"its estimate is at the edge of valid values, 0.2; above it, {MU_K}: 0.2"
ENDS = f"interval of {MU_K} ends at the edge of valid values, 0.2; beyond it, {MU_K}: 0.2"


def velocity(noise: float = 0.02, **keys: float) -> dict[str, Any]:
    names = {"mu_s": MU_S, "mu_k": MU_K}
    scenario = pulley().replace({names[name]: value for name, value in keys.items()})
    return series(scenario, angular_velocity=noise)


def fit_velocity(data: Any, free: Any, **options: Any) -> fs.Fit:
    return fs.fit(pulley(), data=data, channels="angular_velocity", free=free, **options)


def test_an_estimate_at_an_edge_is_told_and_has_no_interval_beyond() -> None:
    data = velocity(mu_s=0.26, mu_k=0.21)
    fit = fit_velocity(data, {MU_K: KINETIC}, starts=1, bootstrap=40)
    assert fit.values[MU_K] == pytest.approx(0.2, abs=1e-7)
    assert fit.not_identified[MU_K].startswith(WORDS)
    assert "kinetic friction must not exceed static friction" in fit.warnings[0]
    assert (fit.standard_errors[MU_K], fit.intervals[MU_K]) == (None, None)
    assert fit.bootstrap is not None
    assert fit.bootstrap.intervals[MU_K] is None


def test_other_keys_have_their_minimum_along_the_edge() -> None:
    data = velocity(mu_s=0.26, mu_k=0.24)
    both = fit_velocity(data, {MU_K: KINETIC, DAMPING: (0.1, 20.0)}, starts=2)
    held = fs.fit(
        pulley().replace({MU_K: 0.2}),
        data=data,
        channels="angular_velocity",
        free={DAMPING: (0.1, 20.0)},
        starts=1,
    )
    assert both.not_identified[MU_K].startswith(WORDS)
    assert both.values[DAMPING] == pytest.approx(held.values[DAMPING], rel=1e-5)
    assert both.standard_errors[DAMPING] == pytest.approx(held.standard_errors[DAMPING], rel=0.02)
    assert both.finding.sentence == "2 of 2 searches found this minimum"


def test_an_edge_that_moves_with_another_key_is_followed() -> None:
    """The breakaway wants less static friction than the speed wants kinetic friction."""
    early = fs.solve(pulley(), {MU_S: 0.2, MU_K: 0.2}).quantities
    slow = fs.solve(pulley(), {MU_S: 0.25, MU_K: 0.25}).quantities
    names = ("breakaway_time", "final_angular_velocity")
    options: dict[str, Any] = {
        "quantities": {names[0]: float(early[names[0]]), names[1]: float(slow[names[1]])},
        "sigma": {names[0]: 0.01, names[1]: 0.3},
    }
    fit = fs.fit(pulley(), free={MU_S: (0.05, 0.4), MU_K: KINETIC}, starts=1, **options)
    one = fs.fit(pulley(), free={f"{MU_S},{MU_K}": (0.05, 0.3)}, starts=1, **options)
    (both,) = one.values.values()
    # The edge is resolved to 1e-9 of the bounds, which differences over 2e-3 of them see.
    assert list(fit.values.values()) == pytest.approx([both, both], rel=1e-5)
    assert "; below it, " in fit.not_identified[MU_S]
    assert "; above it, " in fit.not_identified[MU_K]
    assert set(fit.intervals.values()) == {None}


def test_an_interval_ends_at_the_edge_and_says_so() -> None:
    data = velocity(0.1, mu_s=0.2, mu_k=0.198)
    fit = fit_velocity(data, {MU_K: KINETIC}, starts=1, bootstrap=40)
    error, (low, high) = fit.standard_errors[MU_K], fit.intervals[MU_K] or (0.0, 0.0)
    assert error is not None
    assert fit.values[MU_K] + 1.96 * error > 0.2 > fit.values[MU_K] + 1e-4
    assert high == pytest.approx(0.2, abs=1e-8)
    assert high <= 0.2
    assert fit.values[MU_K] - low == pytest.approx(2.04 * error, rel=0.01)  # Student, 30
    assert fit.warnings[1].startswith(f"the 95 % {ENDS}")
    drawn = fit.bootstrap and fit.bootstrap.intervals[MU_K]
    assert drawn is not None
    assert drawn[1] <= 0.2
    assert fit.warnings[0].startswith(f"the bootstrap {ENDS}")
    assert fit.warnings[1] in fit.summary()
    assert fit.warnings[1] in fit.to_json()["warnings"]
    assert f"\n# {fit.warnings[1]}" in fit.to_toml()
    assert fs.loads(fit.to_toml()).to_dict() == fit.scenario.to_dict()


def test_an_interval_ends_where_runs_fail() -> None:
    """The force lifts the load up to mu_s = 0.3536, and breaks away by 0.8 s."""
    fit = fs.fit(
        pulley(),
        quantities={"breakaway_time": 0.79},
        sigma={"breakaway_time": 0.02},
        free={MU_S: (0.21, 2.0, 0.3)},
        starts=1,
    )
    _, high = fit.intervals[MU_S] or (0.0, 0.0)
    last, beyond = (
        fs.solve(pulley(), {MU_S: mu}).quantities["breakaway_time"].value
        for mu in (high, high + 1e-5)
    )
    assert (last, beyond) == (pytest.approx(0.8, rel=1e-6), None)
    assert fit.warnings[0].endswith("; beyond it, the run gives no breakaway_time")


def test_derivatives_beside_an_edge_are_those_of_the_other_side() -> None:
    data = velocity(0.0, mu_s=0.2, mu_k=0.1997)  # a step of differences is 0.0006 long
    near = fit_velocity(data, {MU_K: KINETIC}, starts=1, sigma={"angular_velocity": 1e-4})
    made = [velocity(0.0, mu_s=0.2, mu_k=mu)["angular_velocity"] for mu in (0.1996, 0.1998)]
    error = 1e-4 / np.linalg.norm((made[1] - made[0]) / 2e-4)
    assert near.standard_errors[MU_K] == pytest.approx(error, rel=1e-3)
