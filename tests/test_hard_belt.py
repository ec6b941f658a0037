"""The belts of `scenarios/hard`: what must come out of each, by both backends with exact stick."""

from math import exp, pi

import numpy as np
import pytest

from frictionsim.run import Run, run
from frictionsim.scenario import load

from .conftest import SCENARIOS

HARD = SCENARIOS / "hard"
BACKENDS = ("moreau", "rkf45")


def outcome(name: str, backend: str, *overrides: str) -> Run:
    """Run a hard scene, which has to pass its audit and hold nothing that is not finite."""
    done = run(load(HARD / f"{name}.toml", list(overrides), backend), lambda t: None)
    assert (done.status, done.reason) == ("done", "")
    assert {key: check for key, check in done.checks.items() if not check.ok} == {}
    assert all(np.isfinite(course).all() for course in done.courses.values())
    return done


def figure(of: Run, name: str) -> float:
    value = of.quantities[name].value
    assert value is not None
    return value


def test_every_hard_belt_has_a_test() -> None:
    with open(__file__) as source:
        tested = source.read()
    assert [p.stem for p in HARD.glob("belt_*.toml") if f'"{p.stem}"' not in tested] == []


@pytest.mark.parametrize("backend", BACKENDS)
def test_stiff_damping_leaves_the_step_to_the_waves(backend: str) -> None:
    done = outcome("belt_stiff_damping", backend)
    # The two methods are 2e-4 apart here; the slip is that of the weaker damping to 1 %.
    assert figure(done, "tension_tight") == pytest.approx(634.1, rel=5e-4)
    if backend == "moreau":
        assert done.counts.steps < 35_000


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_reversed_torque_reverses_the_drive(backend: str) -> None:
    done = outcome("belt_reversal", backend)
    speed = done.courses["pulley_speed"]
    assert (speed[done.time < 0.14] <= 0.0).all()
    assert (speed[done.time > 0.3] > 0.0).all()
    # Tight and slack span change places.
    assert figure(done, "tension_driver_to_driven") < figure(done, "tension_driven_to_driver")
    assert figure(done, "tension_tight") == pytest.approx(760.29, rel=1e-4)


@pytest.mark.parametrize("backend", BACKENDS)
def test_an_overloaded_belt_has_the_capstan_s_ratio(backend: str) -> None:
    done = outcome("belt_overload", backend)
    ratio = figure(done, "tension_tight") / figure(done, "tension_slack")
    # Bending takes 4 % of exp(mu pi) at 150 bodies, the polygon 1 % of it.
    assert 0.94 * exp(0.3 * pi) < ratio < exp(0.3 * pi)
    assert abs(figure(done, "drive_speed")) > 100.0 * abs(figure(done, "driven_speed"))


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_slack_belt_is_warned_of(backend: str) -> None:
    done = outcome("belt_slack", backend)
    assert "goes slack at t = " in done.warnings[0]
    assert "chaotic" in done.warnings[0]


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_stopped_pulley_stands_and_the_belt_stays_on(backend: str) -> None:
    done = outcome("belt_sudden_stop", backend)
    late = done.time > 0.21
    assert (done.courses["pulley_speed"][late, 1] == 0.0).all()
    assert (done.courses["pulley_index"].max(axis=1) == 1.0).all()


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_loose_belt_rests_in_place(backend: str) -> None:
    done = outcome("belt_loose", backend)
    assert figure(done, "pretension") == pytest.approx(0.5, rel=1e-6)
    assert abs(figure(done, "drive_speed")) < 1.0


@pytest.mark.parametrize("backend", BACKENDS)
def test_twelve_bodies_close_their_energy(backend: str) -> None:
    done = outcome("belt_coarse", backend)
    assert len(done.axes["body"]) == 12
    assert figure(done, "driven_speed") == pytest.approx(-12.0, rel=0.05)  # a polygon of 60 degrees


@pytest.mark.parametrize("backend", BACKENDS)
def test_six_hundred_bodies_have_the_tensions_of_150(backend: str) -> None:
    fine = outcome("belt_fine", backend)
    coarse = outcome("belt_fine", "moreau", "mechanism.belt.bodies=150")
    for name in ("tension_tight", "tension_slack"):
        # The polygon of 150 bodies shakes the start of a belt by some per cent.
        assert figure(fine, name) == pytest.approx(figure(coarse, name), rel=0.02)


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_stiff_contact_has_the_tensions_of_the_soft_one(backend: str) -> None:
    stiff = outcome("belt_stiff_contact", backend)
    soft = outcome(
        "belt_stiff_contact", "moreau", "effects.contact.c1=3.0256e9", "effects.contact.c2=6.5e5"
    )
    for name in ("tension_tight", "tension_slack"):
        assert figure(stiff, name) == pytest.approx(figure(soft, name), rel=0.01)


@pytest.mark.parametrize("backend", BACKENDS)
def test_squealing_friction_stays_within_its_law(backend: str) -> None:
    done = outcome("belt_squeal", backend)
    size = np.abs(done.courses["friction_force"])
    normal, sticking = done.courses["normal_force"], done.courses["sticking"] > 0.0
    assert (size <= 0.6 * normal * (1.0 + 1e-9)).all()
    share = figure(done, "stick_fraction")
    assert 0.2 < share < 0.9
    assert sticking.any()


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_roller_is_let_go_and_caught(backend: str) -> None:
    done = outcome("belt_lift_off", backend)
    roller = done.axes["pulley"].index("tensioner")
    touching = (done.courses["pulley_index"] == roller).any(axis=1)
    assert touching.any()
    assert not touching.all()


@pytest.mark.parametrize("backend", BACKENDS)
def test_oil_that_passes_makes_the_belt_slip_and_lets_it_grip_again(backend: str) -> None:
    done = outcome("belt_oil_passes", backend)
    rim = np.abs(done.courses["pulley_speed"])
    slip = 1.0 - rim[:, 1] / rim[:, 0].clip(1e-3)
    moving = done.time > 0.3
    assert slip[moving].max() > 0.3
    assert np.median(slip[moving][:100]) < 0.1


@pytest.mark.long
def test_the_energy_of_a_long_run_closes() -> None:
    done = outcome("belt_long", "moreau")
    assert done.checks["energy"].value < 1e-4
