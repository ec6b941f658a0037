"""Findings of fits in known cases: reached, out of reach, minima and others as good."""

from typing import Any

import pytest

import frictionsim as fs
from tests.fits.measurements import (
    DAMPING,
    FORCE,
    LOAD,
    MU_S,
    frictionless,
    pulley,
    series,
)

BOUNDS = (0.1, 0.4)
NO_CHANGE = "the data do not change with it"


def fit_one(bounds: tuple[float, ...], starts: int = 3, key: str = MU_S, **wanted: Any) -> fs.Fit:
    """Return the fit of a key of the pulley to single quantities."""
    sigma = wanted.pop("sigma", None)
    return fs.fit(pulley(), quantities=wanted, free={key: bounds}, starts=starts, sigma=sigma)


@pytest.mark.parametrize(
    ("bounds", "starts", "name", "wanted"),
    [
        (BOUNDS, 3, "breakaway_time", 0.79),
        # No search moves: the pulley rests for ever at nearly all values, and the angle is 0 there.
        ((0.25, 0.4, 0.39), 1, "final_angle", 6.0),
        ((0.25, 20.0, 3.0), 3, "final_angle", 6.0),
    ],
)
def test_a_value_that_is_reached(
    bounds: tuple[float, ...], starts: int, name: str, wanted: float
) -> None:
    fit = fit_one(bounds, starts, **{name: wanted})
    assert (fit.finding.kind, fit.exit_code) == ("reached", 0)
    assert fit.finding.sentence.endswith(" reached the data exactly")
    # Bisection and least squares are resolved to 1e-10 of the bounds.
    assert float(fs.solve(fit.scenario).quantities[name]) == pytest.approx(wanted, rel=1e-6)


def test_out_of_reach_says_what_is_reachable() -> None:
    fit = fit_one(BOUNDS, 1, breakaway_time=1.4)
    assert fit.exit_code == 1
    assert fit.warnings[-1] == fit.finding.sentence
    # The ramp of the force ends at 0.8 s, where the largest mu_s at which it moves breaks away.
    assert fit.finding.reachable == (0.0, pytest.approx(0.8, rel=1e-6))
    assert fit.finding.sentence == (
        "out of reach: breakaway_time = 1.4 s; runs within the bounds gave 0 to 0.8 s"
    )
    told = fit.to_json()
    assert (told["finding"], told["sentence"]) == ("out_of_reach", fit.finding.sentence)
    assert told["reachable"] == list(fit.finding.reachable or ())
    assert fit.finding.sentence in fit.summary()
    assert f"\n# {fit.finding.sentence}\n" in fit.to_toml()


def test_data_beyond_an_extremum_are_not_said_to_be_without_change() -> None:
    """The dwell is longest at a radius between the bounds: the slope is zero there."""
    radius = "effects.tracer_point.radius"
    quantities = {"tracer_dwell_time": 0.09}
    dwell = fs.load("epicyclic_dwell", {"solver.rtol": 1e-6})
    fit = fs.fit(dwell, quantities=quantities, free={radius: (0.05, 0.08)}, starts=1)
    least, largest = fit.finding.reachable
    assert fit.finding.kind == "out_of_reach"
    assert largest > 1.5 * least
    assert fit.not_identified == {radius: "no run within the bounds reaches the data"}


def test_a_value_that_is_jumped_over_is_out_of_reach() -> None:
    """At mu_s the moments at t = 0 are at their limit: more friction, and it breaks away later."""
    fit = fit_one(BOUNDS, 1, breakaway_time=0.5)
    assert (fit.finding.kind, fit.exit_code) == ("out_of_reach", 1)
    edge = fit.values[MU_S]
    below, above = (
        float(fs.solve(pulley(), {MU_S: edge + step}).quantities["breakaway_time"])
        for step in (-1e-9, 1e-9)
    )
    assert below == 0.0
    assert f"; it jumps from 0 to {above:.6g} s at {MU_S} = {edge:.6g}; " in fit.finding.sentence


@pytest.mark.slow
def test_a_value_that_noise_explains_is_not_out_of_reach() -> None:
    # The nearest is 0.0412 away, 2.06 sigma; with half of it, it is out of reach (test_quantities).
    fit = fit_one(BOUNDS, breakaway_time=0.5, sigma={"breakaway_time": 0.02})
    assert (fit.finding.kind, fit.exit_code) == ("minimum", 0)


def test_a_quantity_that_does_not_depend_on_the_key() -> None:
    """The damping does not act before the breakaway."""
    time = float(fs.solve(pulley()).quantities["breakaway_time"])
    reached, not_reached = (
        fit_one((0.1, 5.0), key=DAMPING, breakaway_time=wanted) for wanted in (time, 0.7)
    )
    assert (reached.finding.kind, reached.exit_code) == ("reached", 0)
    assert reached.not_identified == {DAMPING: NO_CHANGE}
    assert reached.finding.other_minima == ()
    assert (not_reached.finding.kind, not_reached.exit_code) == ("out_of_reach", 1)
    assert not_reached.finding.sentence == (
        f"out of reach: breakaway_time = 0.7 s; runs within the bounds gave {time:.6g} s"
    )


def test_a_series_that_does_not_depend_on_the_key() -> None:
    """The force of the shipped ramp never lifts the load."""
    data, rests = series(pulley(), angle=0.0), {MU_S: (0.36, 0.9, 0.5)}
    fit = fs.fit(pulley(), data=data, channels="angle", free=rests, starts=1)
    assert fit.finding.kind == "minimum"
    assert fit.not_identified == {MU_S: NO_CHANGE}
    assert (fit.values, fit.finding.other_minima) == ({MU_S: 0.5}, ())


def test_ends_on_one_plateau_are_no_other_minima() -> None:
    """Below mu_s = 0.19671 the pulley breaks away at once."""
    fit = fit_one(BOUNDS, breakaway_time=0.0)
    ends = [start["last"][MU_S] for start in fit.starts]
    assert max(ends) - min(ends) > 0.02
    assert max(ends) < 0.19672
    assert fit.finding.sentence == "3 of 3 searches reached the data exactly"
    assert (fit.finding.also, fit.exit_code) == ("", 0)
    assert fit.not_identified == {MU_S: NO_CHANGE}


PHASE = f"{FORCE}.sine.phase_deg"
SINE = {"mean": 300.0, "amplitude": 100.0, "frequency_hz": 0.5, "phase_deg": 45.0}


def two_phases(sigma_of_angle: float | None = None) -> fs.Fit:
    """Fit the phase of a force over half a period to quantities of a phase of 45 degrees.

    Velocity follows from the impulse, which has cos(phase) and so two phases; the angle, if it is
    given, tells these apart.
    """
    scenario = frictionless().replace({FORCE: {"sine": SINE}})
    sigma = {"final_angular_velocity": 1e-3}
    if sigma_of_angle is not None:
        sigma["final_angle"] = sigma_of_angle
    made = fs.solve(scenario).quantities
    return fs.fit(
        scenario,
        quantities={name: float(made[name]) for name in sigma},
        sigma=sigma if sigma_of_angle is not None else None,
        free={PHASE: (-170.0, 150.0)},
        starts=4,
    )


def test_two_minima_that_give_the_data_are_told_with_their_values() -> None:
    fit = two_phases()
    assert (fit.finding.kind, fit.exit_code) == ("reached", 0)
    (other,) = fit.finding.other_minima
    phases = sorted([fit.values[PHASE], other[PHASE]])
    assert phases == pytest.approx([-45.0, 45.0], abs=1e-4)
    also = f"the data fit as well, within their noise, at {PHASE} = {other[PHASE]:.6g}"
    assert fit.finding.also == also
    assert also in fit.warnings
    assert f"; {also}\n" in f"{fit.summary()}\n"
    assert fit.to_json()["other_minima"] == [other]


def test_a_minimum_within_the_noise_of_the_best_is_told_and_a_worse_one_is_not() -> None:
    """The angles of the two phases differ by 0.68 rad, of which the fit leaves the worse one."""
    near, far = two_phases(1.0), two_phases(0.05)
    for fit in (near, far):
        assert fit.values[PHASE] == pytest.approx(45.0, abs=1e-3)
    (other,) = near.finding.other_minima
    assert other[PHASE] == pytest.approx(-45.0, abs=1.0)
    assert far.finding.other_minima == ()
    assert any(start["last"][PHASE] < 0.0 for start in far.starts)


def test_noisy_data_have_a_minimum() -> None:
    data, free = series(frictionless(), angular_velocity=0.1), {LOAD: (50.0, 150.0)}
    fit = fs.fit(frictionless(), data=data, channels="angular_velocity", free=free)
    assert fit.finding == ("minimum", "3 of 3 searches found this minimum", None, "", ())


def test_data_of_zeros_are_no_defect() -> None:
    """A pulley that is lifted cannot have stood still: no value fits, and none is divided by."""
    drive = {"time": [0.0, 0.8, 4.0, 5.0], "value": [1832.6, 3113.75, 3113.75, 3113.75]}
    lifted = fs.load("pulley", {"drive.force": drive, "solver.duration": 1.0})
    key, data = "drive.force.value.3", {"time": [0.6, 0.7], "angle": [1e-300, 0.0]}
    fitted = fs.fit(lifted, data=data, channels="angle", free={key: (1500.0, 6000.0)}, starts=1)
    assert 1500.0 <= fitted.values[key] <= 6000.0
