"""The scenarios in `scenarios/validation` against the closed forms of their benchmarks."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from tests.benchmarks.results_common import solve
from tests.benchmarks.validation import steady_amplitude
from tests.support.cases import one_in
from tests.support.closed_forms_of_others import (
    RATIOS,
    den_hartog_amplitude,
    den_hartog_goes_on,
    flat_belt,
    friction_oscillator,
)
from tests.support.examples import examples
from tests.support.scenarios import quantity

# What is left of the start, more near resonance and with less friction, and the tolerance of the
# steps over some periods; found: 2e-8 and less.
LOOSER = "solver.rtol=1e-9", "solver.atol=1e-11", "solver.duration=40.0"
CLOSE = 1e-6


@pytest.mark.parametrize("ratio", one_in(4, RATIOS))
def test_amplitudes_are_those_of_den_hartog(ratio: float) -> None:
    assert den_hartog_goes_on(ratio)
    assert steady_amplitude(ratio, *LOOSER) == pytest.approx(den_hartog_amplitude(ratio), rel=CLOSE)


@pytest.mark.slow
@examples(8)
@given(st.floats(1.3, 3.0), st.floats(0.3, 0.7), st.sampled_from([0.0, 180.0]))
def test_drawn_amplitudes_are_those_of_den_hartog(
    ratio: float, friction: float, phase: float
) -> None:
    assume(den_hartog_goes_on(ratio, 1.05 * friction))
    load = f"forces.clamp.size={2000.0 * friction}"
    shifted = f"couples.exciter.size.sine.phase_deg={phase}"
    amplitude = steady_amplitude(ratio, *LOOSER[:2], "solver.duration=80.0", load, shifted)
    assert amplitude == pytest.approx(den_hartog_amplitude(ratio, friction), rel=CLOSE)


def test_below_its_limit_den_hartogs_oscillator_stops() -> None:
    assert not den_hartog_goes_on(0.55)
    stops = solve("validation/den_hartog", "couples.exciter.size.sine.frequency_hz=0.55", *LOOSER)
    rests = [event.time for event in stops.transitions if event.mode_to == 0]
    assert np.sum(np.array(rests) > 40.0 - 4.0 / 0.55) == 8, "twice in each period"
    goes_on = solve("validation/den_hartog", "couples.exciter.size.sine.frequency_hz=0.7", *LOOSER)
    assert max(event.time for event in goes_on.transitions) > 10.0
    assert all(event.time < 10.0 for event in goes_on.transitions if event.mode_to == 0)


def test_the_friction_oscillator_comes_to_rest_when_and_where_it_must() -> None:
    done = solve("validation/friction_oscillator")
    time, place = friction_oscillator()
    assert (time, place) == pytest.approx((22.423556350699, 0.682178936724), rel=1e-12)
    # A hundred tolerances of 1e-11 over a way of 100 rad.
    assert quantity(done, "last_rest_time") == pytest.approx(time, abs=1e-9)
    assert quantity(done, "final_angle") == pytest.approx(place, abs=1e-9)


@examples(8)
@given(st.floats(0.0, 20.0), st.floats(0.1, 20.0), st.sampled_from([1.0, -1.0]))
def test_drawn_friction_oscillators_come_to_rest_when_and_where_they_must(
    x: float, v: float, sense: float
) -> None:
    time, place = friction_oscillator(x, v)
    assume(abs(place) < 0.99)  # a turning point at the limit may be the last one or not
    done = solve(
        "validation/friction_oscillator",
        f"mechanism.initial_angle_deg={np.degrees(sense * x)}",
        f"mechanism.initial_angular_velocity={sense * v}",
        f"solver.duration={time + 1.0}",
    )
    assert quantity(done, "last_rest_time") == pytest.approx(time, abs=1e-8)
    assert quantity(done, "final_angle") == pytest.approx(sense * place, abs=1e-8)


@pytest.mark.slow
def test_the_flat_belt_creeps_by_the_closed_form() -> None:
    speed, tight, slack = flat_belt()
    assert (speed, tight, slack) == pytest.approx((11.30848, 663.02, 186.85), abs=5e-3)
    done = solve("validation/flat_belt")
    assert done.status == "done"
    # The dampers are solved for: the steps are those of the waves, 5.7 million otherwise.
    assert done.statistics.steps <= 200_000
    assert all(check.ok for check in done.checks.values())
    # Of 60 points: found 1.4e-5 rad/s, and 0.03 N.
    assert quantity(done, "driven_speed") == pytest.approx(speed, abs=2e-4)
    assert quantity(done, "tension_tight") == pytest.approx(tight, abs=0.3)
    assert quantity(done, "tension_slack") == pytest.approx(slack, abs=0.3)
    torque = done.channels["pulley_torque"][-1, 1]
    omega = done.channels["pulley_speed"][-1, 1]
    assert torque == pytest.approx(-25.0 - 2.0 * omega, rel=1e-5)
