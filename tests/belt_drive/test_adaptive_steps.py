"""The adaptive steps of belts: the waves they damp, their longest length, tolerance, default."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from frictionsim.results import Record
from frictionsim.solvers import rkf45 as rkf
from tests.support.belt_kernels import assemble, rkf45, stepper_of
from tests.support.belt_scenarios import pair, scenario_of, shipped
from tests.support.belt_waves import waves
from tests.support.cases import one_in, slow
from tests.support.scenarios import changed, simulate

NO_DAMPER = {"effects__axial_damping": None, "effects__contact__damping": 0.0}
# By the kernels of other tests.
NEXT_TO_NONE = {"effects__axial_damping__coefficient": 1e-9, "effects__contact__damping": 1e-9}


def growth(z: complex) -> complex:
    """Return R(z) from the stages: one step of y' = z y from y = 1, with h = 1."""
    k1 = z
    k2 = z * (1.0 + rkf.A21 * k1)
    k3 = z * (1.0 + rkf.A31 * k1 + rkf.A32 * k2)
    k4 = z * (1.0 + rkf.A41 * k1 + rkf.A42 * k2 + rkf.A43 * k3)
    k5 = z * (1.0 + rkf.A51 * k1 + rkf.A52 * k2 + rkf.A53 * k3 + rkf.A54 * k4)
    k6 = z * (1.0 + rkf.A61 * k1 + rkf.A62 * k2 + rkf.A63 * k3 + rkf.A64 * k4 + rkf.A65 * k5)
    rates = (k1, k3, k4, k5, k6)
    weights = (rkf.B1, rkf.B3, rkf.B4, rkf.B5, rkf.B6)
    errors = (rkf.E1, rkf.E3, rkf.E4, rkf.E5, rkf.E6)
    y5 = 1.0 + sum(b * k for b, k in zip(weights, rates, strict=True))
    return y5 + rkf45.DISSIPATION * sum(e * k for e, k in zip(errors, rates, strict=True))


@given(st.complex_numbers(max_magnitude=5.0, allow_nan=False))
def test_the_stability_polynomial_is_that_of_the_stages(z: complex) -> None:
    # Sums of a few terms of up to 5^6/6!: rounding alone.
    assert abs(np.polyval(rkf45.STABILITY_POLYNOMIAL, z) - growth(z)) <= 1e-12


@given(st.floats(1e-3, 4.06))
def test_every_wave_loses_energy(omega_h: float) -> None:
    """Where Fehlberg's solution of order 5 lets all waves below omega h = 2.05 grow."""
    size = abs(np.polyval(rkf45.STABILITY_POLYNOMIAL, 1j * omega_h))
    # |R|^2 = 1 + (2 (a5 - a6) - 1/72) y^6 + ...; below y = 0.01 that is less than a rounding.
    assert size < 1.0 or (omega_h < 0.01 and size <= 1.0 + 1e-15)


@pytest.mark.parametrize(
    ("eigenvalues", "limit"), [([1j, -1j], 4.06), ([-1.0], 3.96), ([-0.2 + 0.98j], 3.76)]
)
def test_the_longest_step_of_an_oscillator(eigenvalues: list[complex], limit: float) -> None:
    """Undamped, overdamped, and of a damping ratio of 0.2, which is stable for least."""
    step = rkf45.max_stable_step(np.array(eigenvalues) * 1e5 + 0j) * 1e5
    assert step == pytest.approx(limit, abs=0.03)  # steps of 0.02 are tried


@pytest.mark.usefixtures("uncompiled")
@pytest.mark.parametrize(
    "changes",
    one_in(2, [{}, {"mechanism__belt__pretension": 2.0}, {"effects__contact__c2": 1e8}, NO_DAMPER]),
    ids=["pair", "slack", "stiff contact", "no damper"],
)
def test_the_longest_step_is_that_of_the_waves_of_the_belt(changes: dict[str, Any]) -> None:
    """The waves of the equations of motion themselves, at rest: no bound, no wave numbers."""
    model = assemble(scenario_of(pair(effects__belt_friction=None, **changes)))
    highest = float(np.max(waves(model)[0]))
    # 4.06 without damping, 3.76 at worst; bounds of the waves are up to 3 % high, and contacts
    # and tensions may be twice those at rest.
    assert 3.5 < rkf45.max_stable_step(model.eigenvalues) * highest < 4.1


def test_a_step_after_a_rejected_one_is_no_longer() -> None:
    """Its error said that the step before was too long, whatever a kink then makes of it."""
    scenario = scenario_of(pair(solver__rtol=1e-7))
    stepper = stepper_of(assemble(scenario), scenario)
    stepper.start()
    after_rejection: list[float] = []
    while len(after_rejection) < 20:
        rejected = stepper.statistics[1]
        stepper.advance(1.0, 1.0, 1)
        if stepper.statistics[1] > rejected:
            t_old, t, following, _ = stepper.arrays()["clock"]
            after_rejection.append(following / (t - t_old))
    assert max(after_rejection) <= 1.0 + 1e-6


@pytest.mark.parametrize("rtol", [1e-3, 1e-5])
def test_a_belt_without_dampers_keeps_its_energy_and_tensions(rtol: float) -> None:
    """Of order 5, steps at 1e-3 shook it until its spans carried 1003 and 660 N."""
    solver = {"solver__backend": "rkf45", "solver__rtol": rtol, "solver__duration": 0.1}
    data = shipped("belt_drive", **solver, **NEXT_TO_NONE)
    done, fixed = simulate(data), simulate(changed(data, solver__backend="moreau"))
    assert all(check.ok for check in done.checks.values())
    # Measured: 1e-6, the loss of the shortest waves.
    assert done.checks["energy_balance"].value <= 2e-5
    for name in ("tension_tight", "tension_slack"):
        assert done.quantities[name].value == pytest.approx(fixed.quantities[name].value, rel=1e-3)
    steps, rejected = done.statistics.steps, done.statistics.rejected
    assert steps + rejected <= 1.1 * longest_steps(data)


def longest_steps(data: dict[str, Any]) -> float:
    """Return the steps of omega h = 4 for the duration, omega that of the fastest waves."""
    frequency = assemble(scenario_of(data)).max_frequency
    return float(data["solver"]["duration"]) * frequency / 4.0


def speed_error(done: Record, reference: Record) -> float:
    """Return the largest difference of the pulleys' speeds, rad/s."""
    return float(np.max(np.abs(done.channels["pulley_speed"] - reference.channels["pulley_speed"])))


@pytest.mark.parametrize("bodies", [60, slow(150)])
def test_the_default_closes_the_energy_and_beats_fixed_steps(bodies: int) -> None:
    changes = {"mechanism__belt__bodies": bodies, "solver__duration": 0.15}
    data = shipped("belt_drive", solver__backend="rkf45", **changes)
    own, fixed = simulate(data), simulate(shipped("belt_drive", **changes))
    tight = simulate(changed(data, solver__rtol=1e-8))
    assert own.checks["energy_balance"].value <= 1e-6
    # Measured: a tenth of the error of `moreau` and less.
    assert speed_error(own, tight) < 0.5 * speed_error(fixed, tight)
    if bodies == 150:  # the dampers of a contact bound the steps of longer bodies
        assert own.statistics.steps + own.statistics.rejected <= 1.1 * longest_steps(data)


def test_the_default_beats_fixed_steps_on_a_guided_belt() -> None:
    """A relaxation of half the time made points circle about their limit: 70 times the error."""
    data = shipped(
        "belt_string",
        solver__backend="rkf45",
        solver__duration=0.1,
        mechanism__belt__bodies=40,
        output__interval=1e-3,
    )
    own, fixed = simulate(data), simulate(changed(data, solver__backend="moreau"))
    tight, rough = (simulate(changed(data, solver__rtol=rtol)) for rtol in (1e-9, 1e-4))
    assert own.checks["energy_balance"].value <= 1e-6
    # In the mean over samples: a step that meets a switch at a bad moment errs by 5e-6 rad/s for an
    # instant, on one mesh of some six. Else it is 1e-7 to 2e-7.
    errors = [
        float(
            np.sqrt(np.mean((run.channels["pulley_speed"] - tight.channels["pulley_speed"]) ** 2))
        )
        for run in (own, fixed)
    ]
    assert errors[0] < max(errors[1], 5e-7)
    assert speed_error(rough, tight) < 1e-3
