"""The effect `end_stops` of a body on a shaft: channels, audit, warnings, rest."""

from math import degrees, radians, sqrt
from typing import Any

import numpy as np
import pytest

import frictionsim as fs
from tests.support.changed_samples import Samples, nearly_done
from tests.support.scenarios import changed, simulate
from tests.support.stopped_bodies import stopped, with_friction

OF_EFFECT = {"stop_torque", "energy_impact"}


def test_only_the_effect_leaves_a_trace() -> None:
    data = with_friction(stopped(0.5, solver__duration=1.0), 0.1, 0.1)
    with_stops, without = simulate(data), simulate(changed(data, effects__end_stops=None))
    assert with_stops.channels.keys() - without.channels.keys() == OF_EFFECT
    assert with_stops.checks.keys() - without.checks.keys() == {"end_stops", "impact_law"}
    of_run = {"impacts", "impact_speed_max", "energy_impact"}
    assert with_stops.quantities.keys() - without.quantities.keys() == of_run
    # Before the first impact the motion is the same.
    for name, values in without.channels.items():
        assert with_stops.channels[name] == pytest.approx(values, rel=1e-9, abs=1e-12)
    assert with_stops.quantities["impacts"].value == 0
    assert with_stops.quantities["impact_speed_max"].value is None


def test_stops_that_are_not_reached_change_nothing() -> None:
    data = stopped(0.5, effects__end_stops={"highest_angle_deg": 1e6})
    free = simulate(changed(data, effects__end_stops=None))
    assert simulate(data).quantities["final_angle"] == free.quantities["final_angle"]


def test_the_audit_sees_what_stops_do_not_do() -> None:
    """A body beyond a stop, an impact that loses nothing, and one against its law."""
    run = nearly_done(stopped(0.5))
    assert Samples(run).failed() == set()
    assert Samples(run).audit()["impact_law"].value < 1e-15
    for beyond in (radians(60.0) + 1e-11, radians(-50.0) - 1e-11):
        samples = Samples(run)
        samples["angle"][7] = beyond
        assert samples.failed() == {"end_stops"}
    samples = Samples(run)
    samples["energy_impact"] = 0.0
    assert samples.failed() == {"energy_balance"}
    # The first rebound does not happen, and its energy is booked as lost.
    samples = Samples(run)
    samples.sides("angular_velocity")[0, 1] = 0.0
    assert samples.failed() == {"impact_law"}
    assert samples.audit()["impact_law"].value == pytest.approx(0.36, rel=1e-12)


def test_a_rebound_that_rounding_hides_is_seen_if_it_is_fast() -> None:
    """At 1 rad, flights of some 1e-6 rad have no digits for a loss of 2e-9 of their energy."""
    keys = {"highest_angle_deg": 60.0, "restitution": 1.0 - 1e-9, "capture_speed": 1e-6}
    data = stopped(0.5, effects__end_stops=keys, solver__duration=2.0, output__interval=0.5)
    slow = simulate(changed(data, mechanism={"inertia": 0.5, "initial_angle_deg": 60.0 - 1e-5}))
    assert {name for name, check in slow.checks.items() if not check.ok} == {"impact_law"}
    assert simulate(data).checks["impact_law"].ok


def test_ever_shorter_bounces_are_no_reason_to_sample_more_often() -> None:
    data = with_friction(stopped(0.5), 0.1, 0.05)
    done = simulate(data)
    gaps = np.diff([event.time for event in done.transitions])
    assert gaps.min() < 0.001
    assert done.warnings == ()
    # Stick and slip between the stops still is one: changes 0.3 s apart.
    sine = {"sine": {"mean": 0.0, "amplitude": 0.11, "frequency_hz": 1.0}}
    slow = simulate(changed(data, couples=[{"name": "drive", "size": sine}], output__interval=1.0))
    assert "shortest time between two changes of a contact" in slow.warnings[-1]


def test_a_thousand_impacts_are_too_many() -> None:
    stops = {"highest_angle_deg": 60.0, "restitution": 0.99, "capture_speed": 5e-5}
    done = simulate(stopped(20.0, effects__end_stops=stops, solver__duration=60.0))
    count = done.quantities["impacts"].value
    assert count is not None
    assert count > 1000
    assert done.warnings == (
        f"{count:.0f} impacts on the end stops, most of them negligible bounces; increase"
        " effects.end_stops.capture_speed",
    )
    few = changed(stopped(20.0, effects__end_stops=stops), effects__end_stops__capture_speed=0.05)
    assert simulate(few).warnings == ()


@pytest.mark.parametrize("at_events", [True, False])
def test_impacts_are_counted_without_samples_at_them(at_events: bool) -> None:
    data = stopped(0.5, solver__duration=4.0, output={"interval": 4.0, "at_events": at_events})
    values = simulate(data).quantities
    assert values["impacts"].value == 2
    # From rest over the angle to the stop with 1 rad/s^2.
    assert values["impact_speed_max"].value == pytest.approx(sqrt(2.0 * radians(60.0)), rel=1e-11)


# --- a body at rest on a stop is at rest, without dry friction


def pressed(value: Any, highest: float = 1.0, start: float = 0.0, **stop: float) -> fs.Scenario:
    return fs.load(
        {
            "kind": "shaft",
            "mechanism": {"inertia": 1.0, "initial_angle_deg": degrees(start)},
            "couples": [{"name": "motor", "size": value}],
            "effects": {"end_stops": {"highest_angle_deg": degrees(highest), **stop}},
            "solver": {"duration": 8.0},
        }
    )


def rests(scenario: fs.Scenario) -> tuple[float | None, float | None]:
    quantities = fs.solve(scenario).quantities
    return quantities["breakaway_time"].value, quantities["last_rest_time"].value


@pytest.mark.parametrize(("torque", "highest"), [(1.0, 1.0), (3.0, 0.2)])
def test_a_body_without_friction_comes_to_rest_on_its_stop(torque: float, highest: float) -> None:
    breakaway, rest = rests(pressed(torque, highest))
    assert breakaway is None
    # Uniformly accelerated, exact but for the rounding of the steps.
    assert rest == pytest.approx(sqrt(2.0 * highest / torque), rel=1e-12)


def test_a_body_that_bounces_comes_to_rest_after_its_last_bounce() -> None:
    # A restitution of 1/2: flights of 2 v/M, each half as long, from v = sqrt(2 M q).
    _, rest = rests(pressed(1.0, restitution=0.5, capture_speed=1e-6))
    # The flights that are left out, below the capture speed, take 4e-6 s at most.
    assert rest == pytest.approx(sqrt(2.0) * (1.0 + 2.0 * 0.5 / (1.0 - 0.5)), abs=4e-6)


def test_it_leaves_the_stop_where_the_torque_turns() -> None:
    breakaway, rest = rests(pressed({"time": [0.0, 3.0, 5.0], "value": [1.0, 1.0, -1.0]}))
    assert breakaway == pytest.approx(4.0, rel=1e-12)
    assert rest == pytest.approx(sqrt(2.0), rel=1e-12)


def test_a_body_that_never_meets_its_stop_is_never_at_rest() -> None:
    assert rests(pressed(-1.0)) == (None, None)
