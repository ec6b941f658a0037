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


def measured_velocity(noise: float = 0.0, **solver: Any) -> dict[str, Any]:
    return series(pulley(**solver).replace(TRUTH), angular_velocity=noise)


def fit_velocity(scenario: fs.Scenario, data: Any, free: Any, **options: Any) -> fs.Fit:
    return fs.fit(scenario, data=data, channels="angular_velocity", free=free, **options)


# --- recovery -----------------------------------------------------------------------------------


def test_exact_data_give_back_the_values() -> None:
    fit = fit_velocity(pulley(), measured_velocity(), FREE)
    assert fit.values == pytest.approx(TRUTH, rel=1e-6)
    assert fit.status == "done"
    assert fit.exit_code == 0
    assert fit.warnings == ()
    assert len(fit.starts) == 3
    assert fit.residual_rms["angular_velocity"] < 1e-7


def test_noisy_data_give_them_within_the_errors_they_have() -> None:
    data = measured_velocity(0.1)
    fit = fit_velocity(pulley(), data, FREE, starts=1)
    for key, truth in TRUTH.items():
        error = fit.standard_errors[key]
        assert error is not None
        assert 1e-4 < error < 1e-2
        assert abs(fit.values[key] - truth) < 3.0 * error
    assert fit.residual_rms["angular_velocity"] == pytest.approx(0.1, rel=0.3)
    assert [fit.correlations[key][key] for key in FREE] == [1.0, 1.0]
    assert fit.correlations[MU_S][MU_K] == fit.correlations[MU_K][MU_S]
    # The fitted scenario has these residuals.
    again = fs.loads(fit.to_toml())
    assert again.to_dict() == fit.scenario.to_dict()
    solved = fs.solve(again, {"output.interval": 0.05, "output.at_events": False}).dataset
    rms = float(np.sqrt(np.mean((data["angular_velocity"] - solved["angular_velocity"]) ** 2)))
    assert rms == pytest.approx(fit.residual_rms["angular_velocity"], rel=1e-9)


@pytest.mark.filterwarnings("error")  # SciPy divides by a slope that there is not
def test_a_scan_finds_what_a_start_without_slope_does_not() -> None:
    """With mu_s = 0.39 the pulley never breaks away: one start stays there (test_findings)."""
    free = {MU_S: (0.1, 0.4, 0.39)}
    data = series(pulley().replace({MU_S: 0.231}), angular_velocity=0.0)
    several = fit_velocity(pulley(), data, free, starts=3)
    assert several.values[MU_S] == pytest.approx(0.231, rel=1e-6)
    assert len(several.starts) == 3
    assert several.starts[0]["cost"] <= several.starts[-1]["cost"]


def test_a_key_over_decades_is_scaled_by_its_logarithm() -> None:
    data = series(pulley().replace({DAMPING: 0.02}), angular_velocity=1e-3)
    fit = fit_velocity(pulley(), data, {DAMPING: (1e-3, 100.0)})
    assert fit.values[DAMPING] == pytest.approx(0.02, rel=0.05)
    low, high = fit.intervals[DAMPING] or (0.0, 0.0)
    assert low * high == pytest.approx(fit.values[DAMPING] ** 2)  # symmetric in the logarithm


# --- standard errors ----------------------------------------------------------------------------


def line(noise: float, seed: int, count: int = 30) -> dict[str, Any]:
    """Return the velocity of the pulley without friction, in closed form, with noise."""
    time = np.linspace(0.0, 1.0, count)
    rng = np.random.default_rng(seed)
    return {"time": time, "w": SLOPE * 200.0 * time + noise * rng.normal(size=count)}


def fit_line(data: dict[str, Any], free: Any = None, **options: Any) -> fs.Fit:
    free = free or {FORCE: (0.0, 1000.0)}
    channels = {"angular_velocity": "w"}
    return fs.fit(frictionless(), data=data, channels=channels, free=free, starts=1, **options)


def test_a_linear_fit_has_the_errors_of_linear_regression() -> None:
    data = line(0.1, seed=3)
    slopes = SLOPE * data["time"]
    unknown, given = fit_line(data), fit_line(data, sigma={"angular_velocity": 0.1})
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


def test_two_channels_are_weighed_by_the_noise_of_each() -> None:
    data = series(pulley().replace(TRUTH), 0.02, angular_velocity=0.5, angle=1e-3)
    sigma = {"angular_velocity": 0.5, "angle": 1e-3}
    fit, given = (
        fs.fit(pulley(), data=data, channels=list(sigma), free=FREE, starts=1, **options)
        for options in ({}, {"sigma": sigma})
    )
    velocity, angle = fit.residuals
    assert velocity.sigma == pytest.approx(0.5, rel=0.2)
    assert angle.sigma == pytest.approx(1e-3, rel=0.2)
    for key in FREE:
        assert fit.values[key] == pytest.approx(given.values[key], rel=1e-3)
        assert fit.standard_errors[key] == pytest.approx(given.standard_errors[key], rel=0.2)


def test_the_bootstrap_agrees_with_the_standard_errors() -> None:
    data = line(0.1, seed=5)
    for options in ({}, {"sigma": {"angular_velocity": 0.1}}):
        fit = fit_line(data, bootstrap=40, **options)
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
    data = series(pulley().replace(TRUTH), angular_velocity=0.2)
    options: dict[str, Any] = {
        "free": FREE,
        "channels": ["angular_velocity"],
        "sigma": {"angular_velocity": 0.2},
    }
    alone, fit = (fs.fit(pulley(), data=data, **options, starts=1, bootstrap=n) for n in (0, 40))
    assert fit.bootstrap is not None
    assert fit.runs - alone.runs < 10 * 40
    rng, fitted = np.random.default_rng([0, 1]), fit.residuals[0].fitted
    errors, distances = [fit.standard_errors[key] for key in FREE], []
    for estimates in fit.bootstrap.values[:8]:
        drawn = fitted + 0.2 * rng.normal(size=fitted.size)
        resampled = {"time": data["time"], "angular_velocity": drawn}
        whole = fs.fit(pulley(), data=resampled, **options, starts=1)
        distances.append((estimates - list(whole.values.values())) / errors)
    # Located to a tenth of the standard errors each; where a kink is in between, to some tenths.
    assert np.sqrt(np.mean(np.square(distances))) < 0.25
    assert np.median(np.abs(distances)) < 0.02


def test_correlated_residuals_are_reported() -> None:
    """Data with a drift that the scenario does not have."""
    data = line(0.01, seed=1)
    data["w"] = data["w"] + 0.5 * np.sin(3.0 * data["time"])
    (warning,) = fit_line(data).warnings
    assert warning.startswith(
        "neighbouring residuals of angular_velocity are alike (correlation 0."
    )
    assert warning.endswith("the standard errors are too small")


def test_a_sigma_that_is_too_small_is_reported() -> None:
    (warning,) = fit_line(line(0.1, seed=1), sigma={"angular_velocity": 0.02}).warnings
    assert warning.startswith("chi squared ")
    assert " sigma, of angular_velocity; the scenario lacks something" in warning
    assert warning.endswith("or sigma is too small, and so are the standard errors")
    # Chi squared of 3 values, of which chance exceeds 11.34 in 1 % of fits.
    slope = 5.0 * np.array([0.3, 0.6, 0.9])
    aside = np.array([2.0, 0.0, -2.0 / 3.0])  # orthogonal to the times
    for size, count in ((2.0, 1), (1.2, 0)):  # chi squared 17.8 and 6.4, with 9.21 of two degrees
        data = {"time": [0.3, 0.6, 0.9], "w": slope + 0.1 * size * aside}
        fit = fit_line(data, sigma={"angular_velocity": 0.1})
        assert len(fit.warnings) == count
        assert fit.chi_squared == pytest.approx(size**2 * 40.0 / 9.0, rel=1e-3)
        line_of_chi = next(x for x in fit.summary().splitlines() if x.startswith("chi"))
        assert ", of 2 degrees of freedom: reduced " in line_of_chi
        assert line_of_chi.endswith(" (near 1 if sigma is right)")


# --- what is not identified ---------------------------------------------------------------------


def test_static_friction_of_a_pulley_that_never_sticks() -> None:
    sliding = pulley(duration=0.5).replace(
        {"mechanism.initial_angular_velocity": 50.0, FORCE: 2224.1}
    )
    data = series(sliding, 0.01, angular_velocity=0.05)
    fit = fit_velocity(sliding, data, FREE)
    assert fit.not_identified == {MU_S: "the data do not change with it"}
    assert fit.values[MU_S] == 0.2  # as in the scenario
    assert fit.standard_errors[MU_S] is None
    assert fit.intervals[MU_S] is None
    assert np.isnan(fit.correlations[MU_S][MU_K])
    assert fit.standard_errors[MU_K] is not None
    assert fit.degrees == data["time"].size - 1
    assert fit.exit_code == 0
    assert f"{MU_S} is not identified: the data do not change with it" in fit.summary()
    assert fit.warnings[0] == f"{MU_S} is not identified: the data do not change with it"


def test_two_keys_of_which_only_the_difference_counts() -> None:
    """Without friction the torque is (P - W) r_e: force and load are one unknown."""
    free = {FORCE: (200.0, 500.0), LOAD: (50.0, 300.0)}
    fit = fit_line(line(0.1, 2), free)
    why = "the data determine only a combination of it and {} (correlation 1.000); fix one"
    assert fit.not_identified == {FORCE: why.format(LOAD), LOAD: why.format(FORCE)}
    assert fit.degrees == 29
    assert fit.values[FORCE] - fit.values[LOAD] == pytest.approx(200.0, abs=10.0)


def test_an_estimate_at_its_bound() -> None:
    fit = fit_line(line(0.1, 2), {FORCE: (100.0, 250.0)})
    why = "its estimate is at the upper bound 250; widen the bounds"
    assert fit.not_identified == {FORCE: why}
    assert fit.standard_errors[FORCE] is None


def test_a_key_that_the_data_determine_no_better_than_its_bounds() -> None:
    sigma = {"angular_velocity": 500.0}
    fit = fit_line(line(50.0, 2), {FORCE: (-2000.0, 2000.0)}, sigma=sigma)
    assert fit.not_identified == {FORCE: "the data determine it no better than its bounds do"}


def test_data_in_another_unit_are_no_better_than_a_constant() -> None:
    data = line(0.0, 2)
    (doubt,) = (w for w in fit_line(data | {"w": 1e3 * data["w"]}).warnings if "spread" in w)
    # Of a ramp from zero that the fit does not reach: root of mean square over that about the mean.
    w = data["w"]
    ratio = float(np.sqrt(np.mean(w * w)) / np.std(w))
    assert float(doubt.split()[5]) == pytest.approx(ratio, rel=0.02)
    assert not any("spread" in warning for warning in fit_line(line(0.1, 2)).warnings)


def test_as_many_values_as_keys_need_a_sigma() -> None:
    data = {"time": [0.5], "w": [2.5]}
    unknown, given = fit_line(data), fit_line(data, sigma={"angular_velocity": 0.1})
    assert unknown.values[FORCE] == pytest.approx(300.0)
    assert (unknown.not_identified, unknown.standard_errors) == ({}, {FORCE: None})
    assert unknown.warnings == (
        "no standard error is known: there are as many values as free keys, which leave no scatter;"
        " give sigma",
    )
    assert f"#   {FORCE} = 300, unknown\n" in unknown.to_toml()
    assert given.standard_errors[FORCE] == pytest.approx(0.1 / (0.5 * SLOPE))


def test_differences_do_not_pass_a_jump() -> None:
    """Below mu_s = 0.19664 the pulley slips back at the start; a step is 0.00075 long."""
    truth = 0.197
    data = series(pulley().replace({MU_S: truth}), angular_velocity=0.0)
    free = {MU_S: (0.05, 0.4, truth)}
    exact, rough = (
        fit_velocity(pulley(), data, free, sigma={"angular_velocity": sigma}, starts=1)
        for sigma in (1e-3, 0.1)
    )
    near = [
        series(pulley().replace({MU_S: mu}), angular_velocity=0.0)["angular_velocity"]
        for mu in (truth - 1e-4, truth + 1e-4)
    ]
    slope = (near[1] - near[0]) / 2e-4
    error = 1.0 / np.linalg.norm(slope)
    assert exact.standard_errors[MU_S] == pytest.approx(1e-3 * error, rel=1e-3)
    assert rough.standard_errors[MU_S] == pytest.approx(0.1 * error, rel=1e-3)
    assert exact.warnings == rough.warnings == ()


def test_intervals_stay_within_the_bounds() -> None:
    bounds = (299.0, 303.0)
    data = line(0.1, seed=3)
    wide = fit_line(data).intervals[FORCE] or (0.0, 0.0)
    expected = tuple(min(max(end, bounds[0]), bounds[1]) for end in wide)
    assert expected != wide
    assert fit_line(data, {FORCE: bounds}).intervals[FORCE] == pytest.approx(expected, rel=1e-6)


# --- processes ----------------------------------------------------------------------------------


def resampled(monkeypatch: pytest.MonkeyPatch, cores: int, **options: Any) -> fs.Fit:
    """Return a fit with resamples on a number of cores, however little time they take."""
    monkeypatch.setattr("frictionsim.fits.search.SECONDS_THAT_PAY", 0.0)
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


def test_what_the_monitor_raises_ends_a_fit_and_its_processes(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def interrupt(done: int) -> None:
        if done >= 30:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        resampled(monkeypatch, 2, progress=interrupt)
    assert all_processes_end()


@pytest.mark.filterwarnings("error")
def test_a_process_that_is_killed_ends_the_fit(monkeypatch: pytest.MonkeyPatch) -> None:
    def kill(done: int) -> None:
        for process in multiprocessing.active_children():
            process.kill()

    with pytest.raises(
        fs.SolverError, match=r"a worker process was killed, .*; nothing of the fit is kept"
    ):
        resampled(monkeypatch, 2, progress=kill)
    assert all_processes_end()
