"""Fits recover the values behind the data, and state their uncertainty."""

import multiprocessing
from time import monotonic, sleep
from typing import Any

import numpy as np
import pytest
from scipy import stats

import frictionsim as fs
from tests.fits.measurements import (
    DAMPING,
    FORCE,
    LOAD,
    MU_K,
    MU_S,
    SLOPE,
    frictionless,
    pulley,
    series,
)

TRUTH = {MU_S: 0.231, MU_K: 0.123}
FREE = {MU_S: (0.05, 0.4), MU_K: (0.02, 0.3)}
VELOCITY = "angular_velocity"


def velocity(noise: float = 0.0, **truth: Any) -> dict[str, Any]:
    return series(pulley().replace(truth or TRUTH), angular_velocity=noise)


def fit_velocity(data: Any, free: Any, **options: Any) -> fs.Fit:
    return fs.fit(pulley(), data=data, channels=VELOCITY, free=free, **options)


# --- recovery -----------------------------------------------------------------------------------


def test_exact_data_give_back_the_values() -> None:
    fit = fit_velocity(velocity(), FREE)
    assert fit.values == pytest.approx(TRUTH, rel=1e-6)
    assert (fit.status, fit.exit_code, fit.warnings, len(fit.starts)) == ("done", 0, (), 3)
    assert fit.residual_rms[VELOCITY] < 1e-7


def test_noisy_data_give_them_within_the_errors_they_have() -> None:
    data = velocity(0.1)
    fit = fit_velocity(data, FREE, starts=1)
    for key, truth in TRUTH.items():
        error = fit.standard_errors[key]
        assert error is not None
        assert 1e-4 < error < 1e-2
        assert abs(fit.values[key] - truth) < 3.0 * error
    assert fit.residual_rms[VELOCITY] == pytest.approx(0.1, rel=0.3)
    assert [fit.correlations[key][key] for key in FREE] == [1.0, 1.0]
    assert fit.correlations[MU_S][MU_K] == fit.correlations[MU_K][MU_S]
    # The fitted scenario has these residuals.
    again = fs.loads(fit.to_toml())
    assert again.to_dict() == fit.scenario.to_dict()
    solved = fs.solve(again, {"output.interval": 0.05, "output.at_events": False}).dataset
    rms = float(np.sqrt(np.mean((data[VELOCITY] - solved[VELOCITY]) ** 2)))
    assert rms == pytest.approx(fit.residual_rms[VELOCITY], rel=1e-9)


@pytest.mark.filterwarnings("error")  # SciPy divides by a slope that there is not
def test_a_scan_finds_what_a_start_without_slope_does_not() -> None:
    """With mu_s = 0.39 the pulley never breaks away: one start stays there (test_findings)."""
    several = fit_velocity(velocity(**{MU_S: 0.231}), {MU_S: (0.1, 0.4, 0.39)}, starts=3)
    assert several.values[MU_S] == pytest.approx(0.231, rel=1e-6)
    assert len(several.starts) == 3
    assert several.starts[0]["cost"] <= several.starts[-1]["cost"]


def test_a_key_over_decades_is_scaled_by_its_logarithm() -> None:
    fit = fit_velocity(velocity(1e-3, **{DAMPING: 0.02}), {DAMPING: (1e-3, 100.0)})
    assert fit.values[DAMPING] == pytest.approx(0.02, rel=0.05)
    low, high = fit.intervals[DAMPING] or (0.0, 0.0)
    assert low * high == pytest.approx(fit.values[DAMPING] ** 2)  # symmetric in the logarithm


# --- standard errors ----------------------------------------------------------------------------


def line(noise: float, seed: int, count: int = 30) -> dict[str, Any]:
    """Return the velocity of the pulley without friction, in closed form, with noise."""
    time = np.linspace(0.0, 1.0, count)
    rng = np.random.default_rng(seed)
    return {"time": time, "w": SLOPE * 200.0 * time + noise * rng.normal(size=count)}


def fit_line(data: dict[str, Any], free: Any = None, sigma: Any = None, **options: Any) -> fs.Fit:
    free = free or {FORCE: (0.0, 1000.0)}
    options |= {"sigma": {VELOCITY: sigma}} if sigma else {}
    return fs.fit(
        frictionless(), data=data, channels={VELOCITY: "w"}, free=free, starts=1, **options
    )


def test_a_linear_fit_has_the_errors_of_linear_regression() -> None:
    data = line(0.1, seed=3)
    slopes = SLOPE * data["time"]
    unknown, given = fit_line(data), fit_line(data, sigma=0.1)
    force = 100.0 + float(slopes @ data["w"] / (slopes @ slopes))
    residuals = data["w"] - slopes * (force - 100.0)
    scatter = float(np.sqrt(residuals @ residuals / 29.0))
    for fit, sigma, factor in (
        (unknown, scatter, stats.t.ppf(0.975, 29)),
        (given, 0.1, stats.norm.ppf(0.975)),
    ):
        error = sigma / np.sqrt(slopes @ slopes)
        assert fit.values[FORCE] == pytest.approx(force, rel=1e-7)
        assert fit.standard_errors[FORCE] == pytest.approx(error, rel=1e-5)
        interval = [force - factor * error, force + factor * error]
        assert fit.intervals[FORCE] == pytest.approx(interval, rel=1e-6)
    assert unknown.chi_squared is None
    assert given.chi_squared == pytest.approx(float(residuals @ residuals) / 0.01)
    assert given.reduced_chi_squared == pytest.approx((given.chi_squared or 0.0) / 29.0)
    low, high = fit_line(data, {FORCE: (299.0, 303.0)}).intervals[FORCE] or (0.0, 0.0)
    wide = unknown.intervals[FORCE] or (0.0, 0.0)
    assert (low, high) == pytest.approx((max(wide[0], 299.0), min(wide[1], 303.0)), rel=1e-6)
    assert (low, high) != wide


def test_two_channels_are_weighed_by_the_noise_of_each() -> None:
    sigma = {VELOCITY: 0.5, "angle": 1e-3}
    data = series(pulley().replace(TRUTH), 0.02, **sigma)
    fit, given = (
        fs.fit(pulley(), data=data, channels=list(sigma), free=FREE, starts=1, **options)
        for options in ({}, {"sigma": sigma})
    )
    for part in fit.residuals:
        assert part.sigma == pytest.approx(sigma[part.name], rel=0.2)
    for key in FREE:
        assert fit.values[key] == pytest.approx(given.values[key], rel=1e-3)
        assert fit.standard_errors[key] == pytest.approx(given.standard_errors[key], rel=0.2)


@pytest.mark.parametrize("sigma", [None, 0.1])
def test_the_bootstrap_agrees_with_the_standard_errors(sigma: float | None) -> None:
    fit = fit_line(line(0.1, seed=5), sigma=sigma, bootstrap=40)
    assert fit.bootstrap is not None
    assert (fit.bootstrap.done, fit.bootstrap.failed) == (40, 0)
    low, high = fit.bootstrap.intervals[FORCE] or (0.0, 0.0)
    lower, upper = fit.intervals[FORCE] or (0.0, 0.0)
    assert high - low == pytest.approx(upper - lower, rel=0.35)
    assert low < fit.values[FORCE] < high


def test_resamples_of_two_keys_take_few_runs_and_have_the_estimates_of_whole_fits() -> None:
    """The data of a resample are the fit and the drawn noise, here fitted anew from other starts.

    Derivatives at the start of each resample and of each step would take 15 to 28 runs.
    """
    data, options = velocity(0.2), {"sigma": {VELOCITY: 0.2}, "starts": 1}
    alone, fit = (fit_velocity(data, FREE, **options, bootstrap=n) for n in (0, 40))
    assert fit.bootstrap is not None
    assert fit.runs - alone.runs < 10 * 40
    rng, fitted = np.random.default_rng([0, 1]), fit.residuals[0].fitted
    errors, distances = [fit.standard_errors[key] for key in FREE], []
    for estimates in fit.bootstrap.values[:8]:
        drawn = fitted + 0.2 * rng.normal(size=fitted.size)
        whole = fit_velocity({"time": data["time"], VELOCITY: drawn}, FREE, **options)
        distances.append((estimates - list(whole.values.values())) / errors)
    # Located to a tenth of the standard errors each; where a kink is in between, to some tenths.
    assert np.sqrt(np.mean(np.square(distances))) < 0.25
    assert np.median(np.abs(distances)) < 0.02


def test_data_that_the_scenario_does_not_give_are_reported() -> None:
    data, drift = line(0.01, seed=1), np.sin(3.0 * np.linspace(0.0, 1.0, 30))
    (alike,) = fit_line(data | {"w": data["w"] + 0.5 * drift}).warnings
    assert alike.startswith("neighbouring residuals of angular_velocity are alike (correlation 0.")
    assert alike.endswith("the standard errors are too small")
    (small,) = fit_line(line(0.1, seed=1), sigma=0.02).warnings
    assert small.startswith("chi squared ")
    assert " sigma, of angular_velocity; the scenario lacks something" in small
    assert small.endswith("or sigma is too small, and so are the standard errors")
    # Of a ramp from zero in another unit: root of mean square over that about the mean.
    w = line(0.0, 2)["w"]
    (doubt,) = (x for x in fit_line(line(0.0, 2) | {"w": 1e3 * w}).warnings if "spread" in x)
    ratio = float(np.sqrt(np.mean(w * w)) / np.std(w))
    assert float(doubt.split()[5]) == pytest.approx(ratio, rel=0.02)
    assert not fit_line(line(0.1, 2)).warnings


def test_chi_squared_is_judged_by_its_degrees_of_freedom() -> None:
    """Of 3 values chance exceeds 9.21 with two degrees of freedom in 1 % of fits."""
    slope = 5.0 * np.array([0.3, 0.6, 0.9])
    aside = np.array([2.0, 0.0, -2.0 / 3.0])  # orthogonal to the times
    for size, count in ((2.0, 1), (1.2, 0)):  # chi squared 17.8 and 6.4
        data = {"time": [0.3, 0.6, 0.9], "w": slope + 0.1 * size * aside}
        fit = fit_line(data, sigma=0.1)
        assert len(fit.warnings) == count
        assert fit.chi_squared == pytest.approx(size**2 * 40.0 / 9.0, rel=1e-3)
        said = next(x for x in fit.summary().splitlines() if x.startswith("chi"))
        assert ", of 2 degrees of freedom: reduced " in said


# --- what is not identified ---------------------------------------------------------------------


def test_static_friction_of_a_pulley_that_never_sticks() -> None:
    sliding = pulley(duration=0.5).replace(
        {"mechanism.initial_angular_velocity": 50.0, FORCE: 2224.1}
    )
    data = series(sliding, 0.01, angular_velocity=0.05)
    fit = fs.fit(sliding, data=data, channels=VELOCITY, free=FREE)
    assert fit.not_identified == {MU_S: "the data do not change with it"}
    assert fit.values[MU_S] == 0.2  # as in the scenario
    assert (fit.standard_errors[MU_S], fit.intervals[MU_S]) == (None, None)
    assert np.isnan(fit.correlations[MU_S][MU_K])
    assert fit.standard_errors[MU_K] is not None
    assert (fit.degrees, fit.exit_code) == (data["time"].size - 1, 0)
    assert fit.warnings[0] == f"{MU_S} is not identified: the data do not change with it"
    assert fit.warnings[0] in fit.summary()


COMBINED = "the data determine only a combination of it and {} (correlation 1.000); fix one"


@pytest.mark.parametrize(
    ("free", "sigma", "reasons"),
    [
        # Without friction the torque is (P - W) r_e: force and load are one unknown.
        (
            {FORCE: (200.0, 500.0), LOAD: (50.0, 300.0)},
            None,
            {FORCE: COMBINED.format(LOAD), LOAD: COMBINED.format(FORCE)},
        ),
        (
            {FORCE: (100.0, 250.0)},
            None,
            {FORCE: "its estimate is at the upper bound 250; widen the bounds"},
        ),
        (
            {FORCE: (-2000.0, 2000.0)},
            500.0,
            {FORCE: "the data determine it no better than its bounds do"},
        ),
    ],
)
def test_a_key_that_the_data_do_not_determine(free: Any, sigma: Any, reasons: Any) -> None:
    fit = fit_line(line(0.1, 2), free, sigma)
    assert fit.not_identified == reasons
    assert fit.standard_errors[FORCE] is None
    assert fit.degrees == 30 - (len(free) > 1 or sigma is not None)
    if len(free) > 1:
        assert fit.values[FORCE] - fit.values[LOAD] == pytest.approx(200.0, abs=10.0)


def test_as_many_values_as_keys_need_a_sigma() -> None:
    data = {"time": [0.5], "w": [2.5]}
    unknown, given = fit_line(data), fit_line(data, sigma=0.1)
    assert unknown.values[FORCE] == pytest.approx(300.0)
    assert (unknown.not_identified, unknown.standard_errors) == ({}, {FORCE: None})
    assert unknown.warnings == (
        "no standard error is known: there are as many values as free keys, which leave no scatter;"
        " give sigma",
    )
    assert f"#   {FORCE} = 300, unknown\n" in unknown.to_toml()
    assert given.standard_errors[FORCE] == pytest.approx(0.1 / (0.5 * SLOPE))


@pytest.mark.parametrize("sigma", [1e-3, 0.1])
def test_differences_do_not_pass_a_jump(sigma: float) -> None:
    """Below mu_s = 0.19664 the pulley slips back at the start; a step is 0.00075 long."""
    truth = 0.197
    below, here, above = (velocity(**{MU_S: truth + x}) for x in (-1e-4, 0.0, 1e-4))
    free = {MU_S: (0.05, 0.4, truth)}
    fit = fit_velocity(here, free, sigma={VELOCITY: sigma}, starts=1)
    slope = (above[VELOCITY] - below[VELOCITY]) / 2e-4
    assert fit.standard_errors[MU_S] == pytest.approx(sigma / np.linalg.norm(slope), rel=1e-3)
    assert fit.warnings == ()


# --- processes ----------------------------------------------------------------------------------


def resampled(monkeypatch: pytest.MonkeyPatch, cores: int, **options: Any) -> fs.Fit:
    """Return a fit with resamples on a number of cores, however little time they take."""
    monkeypatch.setattr("frictionsim.fits.search.LONG", 0.0)
    monkeypatch.setattr("frictionsim.fits.search.available_cores", lambda: cores)
    return fit_line(line(0.1, seed=5, count=6), bootstrap=40, **options)


def all_processes_end() -> bool:
    """Return whether no process is left; one that was killed takes a moment to end."""
    deadline = monotonic() + 20.0
    while multiprocessing.active_children() and monotonic() < deadline:
        sleep(0.01)
    return not multiprocessing.active_children()


def test_resamples_on_several_cores_give_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    found = []
    monkeypatch.setattr("frictionsim.fits.search.SECONDS_BETWEEN_TICKS", 1e-3)
    for cores in (1, 2):
        numbers: list[int] = []
        found.append(resampled(monkeypatch, cores, progress=numbers.append))
        # The last number comes again where no run ends for some time, so that a cancel is seen.
        assert (len(numbers) > len({*numbers})) == (cores > 1)
        assert sorted({*numbers}) == list(range(1, found[-1].to_json()["runs"] + 1))
        assert numbers == sorted(numbers)
    one, two = found
    assert one.to_json() == two.to_json()
    assert (one.bootstrap or found)[-1].tolist() == (two.bootstrap or found)[-1].tolist()
    assert all_processes_end()


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("kills", [False, True])
def test_a_fit_ends_with_its_processes(monkeypatch: pytest.MonkeyPatch, kills: bool) -> None:
    """By what the monitor raises, and by a process that is killed."""

    def disturb(done: int) -> None:
        for process in multiprocessing.active_children() if kills else []:
            process.kill()
        if done >= 30 and not kills:
            raise KeyboardInterrupt

    said = r"a worker process was killed, .*; nothing of the fit is kept" if kills else None
    with pytest.raises(fs.SolverError if kills else KeyboardInterrupt, match=said):
        resampled(monkeypatch, 2, progress=disturb)
    assert all_processes_end()
