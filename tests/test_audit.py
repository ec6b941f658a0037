"""The self-audit passes sound runs and catches what it is there for."""

from typing import Any

import numpy as np
import pytest

from frictionsim.audit import audit
from frictionsim.run import Run

from .conftest import pulley, simulate
from .problems import RETURN_FORCE


@pytest.fixture(scope="module")
def sound() -> Run:
    return simulate(pulley(drive__force=RETURN_FORCE, solver__duration=12.0))


def failed(run: Run) -> set[str]:
    return {name for name, check in audit(run).items() if not check.ok}


def spoiled(run: Run, **courses: Any) -> Run:
    return run._replace(series=run.series._replace(**courses))


def with_sample(course: Any, i: int, value: float) -> Any:
    course = course.copy()
    course[i] = value
    return course


def test_a_sound_run_passes(sound: Run) -> None:
    assert set(audit(sound)) == {"energy", "friction", "power", "drift"}
    assert failed(sound) == set()


def test_energy_that_is_missing_is_found(sound: Run) -> None:
    ledger = sound.series.ledger
    lossy = ledger | {"energy_friction": ledger["energy_friction"] * (1.0 - 1e-5)}
    assert failed(spoiled(sound, ledger=lossy)) == {"energy"}


def test_friction_beyond_its_limit_is_found(sound: Run) -> None:
    series = sound.series
    stick, slip = np.flatnonzero(series.mode == 0)[-1], np.flatnonzero(series.mode == 1)[5]
    for i in (stick, slip):
        friction = with_sample(series.friction, i, -1.1 * abs(series.friction[i]))
        assert failed(spoiled(sound, friction=friction)) == {"friction"}


def test_friction_that_drives_is_found(sound: Run) -> None:
    series = sound.series
    slip = np.flatnonzero(series.mode == 1)[5]
    friction = with_sample(series.friction, slip, -series.friction[slip])
    assert failed(spoiled(sound, friction=friction)) == {"power"}


def test_drift_of_one_rounding_is_found(sound: Run) -> None:
    position = sound.series.position
    drifted = with_sample(position, -1, np.nextafter(position[-1], np.inf))
    assert "drift" in failed(spoiled(sound, position=drifted))


def test_two_sticks_with_a_slip_between_samples_are_no_drift() -> None:
    data = pulley(
        drive__force={"sine": {"mean": 2450.0, "amplitude": 450.0, "frequency_hz": 0.5}},
        solver__duration=8.0,
        output__interval=1.9,
    )
    run = simulate(data)
    assert np.any(np.diff(run.series.position[run.series.mode == 0]) > 1.0)
    assert failed(run) == set()
