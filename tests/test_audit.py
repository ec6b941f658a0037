"""The self-audit passes sound runs and catches what it is there for."""

from typing import Any

import numpy as np
import pytest

from frictionsim.audit import audit
from frictionsim.mechanisms.base import Contact, Series
from frictionsim.mechanisms.pulley import build
from frictionsim.one_coordinate import OneCoordinate
from frictionsim.scenario import validate
from frictionsim.series import failures

from .conftest import SCENARIOS, pulley, simulate
from .problems import RETURN_FORCE

DATA = pulley(drive__force=RETURN_FORCE, solver__duration=12.0)
SCENE = validate(DATA, SCENARIOS)


@pytest.fixture(scope="module")
def sound() -> Series:
    simulation = OneCoordinate(SCENE, build(SCENE))
    simulation.solve(lambda t: None)
    return simulation.series()


def contact() -> Contact:
    found = build(SCENE).contact
    assert found is not None
    return found


def failed(series: Series) -> set[str]:
    checks = audit(series, contact(), SCENE.solver.rtol, SCENE.solver.atol)
    return {name for name, check in checks.items() if not check.ok}


def with_sample(course: Any, i: int, value: float) -> Any:
    course = course.copy()
    course[i] = value
    return course


def test_a_sound_run_passes(sound: Series) -> None:
    assert set(simulate(DATA).checks) == {"energy", "friction", "power", "drift"}
    assert failed(sound) == set()


def test_energy_that_is_missing_is_found(sound: Series) -> None:
    lossy = sound.ledger | {"energy_friction": sound.ledger["energy_friction"] * (1.0 - 1e-5)}
    assert failed(sound._replace(ledger=lossy)) == {"energy"}


def test_friction_beyond_its_limit_is_found(sound: Series) -> None:
    stick, slip = np.flatnonzero(sound.mode == 0)[-1], np.flatnonzero(sound.mode == 1)[5]
    for i in (stick, slip):
        friction = with_sample(sound.friction, i, -1.1 * abs(sound.friction[i]))
        assert failed(sound._replace(friction=friction)) == {"friction"}


def test_friction_that_drives_is_found(sound: Series) -> None:
    slip = np.flatnonzero(sound.mode == 1)[5]
    friction = with_sample(sound.friction, slip, -sound.friction[slip])
    assert failed(sound._replace(friction=friction)) == {"power"}


def test_drift_of_one_rounding_is_found(sound: Series) -> None:
    drifted = with_sample(sound.position, -1, np.nextafter(sound.position[-1], np.inf))
    assert "drift" in failed(sound._replace(position=drifted))


def test_two_sticks_with_a_slip_between_samples_are_no_drift() -> None:
    data = pulley(
        drive__force={"sine": {"mean": 2450.0, "amplitude": 450.0, "frequency_hz": 0.5}},
        solver__duration=8.0,
        output__interval=1.9,
    )
    run = simulate(data)
    assert np.any(np.diff(run.courses["angle"][run.courses["mode"] == 0]) > 1.0)
    assert failures(run.checks) == ""
