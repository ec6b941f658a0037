"""How often the 95 % intervals of fits hold the truth: noisy data of runs with drawn values."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import pytest

import frictionsim as fs

SEEDS = 40  # always the same
# Fewer than these of 40 intervals of 95 % hold the truth once in 1400 times (binomial).
LEAST = 33
MU_S, MU_K = "effects.shaft_friction.mu_s", "effects.shaft_friction.mu_k"
DAMPING, FORCE = "effects.viscous_damping.coefficient", "drive.force.value.0"
# Bounds of each key, and the range that the truth is drawn from: below mu_s = 0.1966 the pulley
# slips back at the start, and all that it does is another.
BOUNDS = {MU_S: (0.05, 0.4), MU_K: (0.02, 0.3), DAMPING: (0.2, 10.0), FORCE: (1500.0, 2200.0)}
TRUTHS = {MU_S: (0.2, 0.3), MU_K: (0.08, 0.15), DAMPING: (1.0, 3.0), FORCE: (1750.0, 1950.0)}
VELOCITY, ANGLE, TIME = 0.2, 0.05, 0.01  # noise: rad/s, rad, s


class Case(NamedTuple):
    """Data of one kind, with a truth and noise that depend on the seed."""

    keys: tuple[str, ...]  # that are free
    fit: Callable[[dict[str, float], np.random.Generator], fs.Fit]  # of the true values
    truths: Mapping[str, tuple[float, float]] = MappingProxyType({})  # other ranges of them


def scenario(duration: float = 2.0) -> fs.Scenario:
    return fs.load(fs.scenarios()["pulley"], {"solver.rtol": 1e-7, "solver.duration": duration})


def noisy(
    truth: dict[str, float], rng: np.random.Generator, samples: int = 40
) -> dict[str, np.ndarray]:
    data = fs.solve(scenario(), {**truth, "output.interval": 2.0 / samples}).dataset
    count = data.sizes["time"]
    return {
        "time": data["time"].to_numpy(),
        "angular_velocity": data["angular_velocity"].to_numpy() + VELOCITY * rng.normal(size=count),
        "angle": data["angle"].to_numpy() + ANGLE * rng.normal(size=count),
    }


def by_series(*channels: str, **options: Any) -> Callable[..., fs.Fit]:
    def fit(truth: dict[str, float], rng: np.random.Generator) -> fs.Fit:
        bounds = {key: BOUNDS[key] for key in truth}
        return fs.fit(scenario(), data=noisy(truth, rng), channels=channels, free=bounds, **options)

    return fit


def by_breakaway(truth: dict[str, float], rng: np.random.Generator) -> fs.Fit:
    pulley, loads = scenario(1.0), np.linspace(1900.0, 2250.0, 8)
    times = [
        fs.solve(pulley, {**truth, "mechanism.load": load}).quantities["breakaway_time"].value
        for load in loads
    ]
    data = {"load": loads, "time": np.array(times) + TIME * rng.normal(size=loads.size)}
    bounds = {key: BOUNDS[key] for key in truth}
    return fs.fit(
        pulley,
        data=data,
        quantities={"breakaway_time": "time"},
        over={"mechanism.load": "load"},
        free=bounds,
        starts=1,
    )


THREE = (MU_S, MU_K, DAMPING)
CASES = {
    "velocity": Case(THREE, by_series("angular_velocity")),
    "velocity, sigma given": Case(
        THREE, by_series("angular_velocity", sigma={"angular_velocity": VELOCITY})
    ),
    "velocity, sigma given, mu_s from 0.18": Case(
        THREE,
        by_series("angular_velocity", sigma={"angular_velocity": VELOCITY}),
        {MU_S: (0.18, 0.3)},
    ),
    "velocity and angle": Case(THREE, by_series("angular_velocity", "angle")),
    "breakaway over load": Case((MU_S, FORCE), by_breakaway),
}


def measure(case: Case, seed: int) -> tuple[dict[str, float], fs.Fit]:
    rng = np.random.default_rng(seed)
    truth = {key: float(rng.uniform(*(TRUTHS | dict(case.truths))[key])) for key in case.keys}
    return truth, case.fit(truth, rng)


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_intervals_hold_the_truth_as_often_as_they_say(name: str) -> None:
    case = CASES[name]
    fits = [measure(case, seed) for seed in range(SEEDS)]
    for key in case.keys:
        known = [(truth, fit) for truth, fit in fits if fit.intervals[key] is not None]
        assert len(known) >= SEEDS - 2, key  # of 200 at most one was not identified
        held = sum(
            low <= truth[key] <= high
            for truth, fit in known
            for low, high in [fit.intervals[key] or (0.0, 0.0)]
        )
        assert held >= LEAST - (SEEDS - len(known)), key
