"""A body at rest on a shaft whose loads cannot move it for as long as they are smooth."""

import random
from math import hypot
from typing import Any

import numpy as np
import pytest

from frictionsim.mechanisms.shaft.equation import ROUNDING, _largest_excess_of, terms_of
from frictionsim.mechanisms.shaft.loads import middle_and_range
from frictionsim.scenario import signals
from frictionsim.scenario.signals import PiecewiseLinear, Sine, SmoothStep
from frictionsim.scenario.validation import validate
from tests.support.scenarios import SCENARIOS, Scenario, simulate


def loaded(couple: Any, forces: list[Scenario], **solver: Any) -> Scenario:
    """Return a body on a dry shaft; a pinned load of 100 N gives a static limit of 1.2 N m."""
    pinned = {"name": "load", "size": 100.0, "direction": [0.0, -1.0], "point": [0.0, 0.0]}
    return {
        "kind": "shaft",
        "mechanism": {"inertia": 0.05},
        "forces": [pinned, *forces],
        "couples": [{"name": "drive", "size": couple}],
        "effects": {"shaft_friction": {"shaft_radius": 0.02, "mu_s": 0.75, "mu_k": 0.5}},
        "solver": {"duration": 1.0, **solver},
        "output": {"interval": 0.5},
    }


@pytest.mark.parametrize("backend", ["events", "rkf45"])
def test_a_rest_costs_no_more_with_many_periods(
    backend: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A hundred thousand periods, each up to 99 % of the limit, of which none can move it."""
    monkeypatch.setattr("frictionsim.simulation.run_warnings.MAX_EXTREMA", 10)
    calls = 0
    plain = Sine.__call__

    def counted(self: Sine, t: float) -> float:
        nonlocal calls
        calls += 1
        return plain(self, t)

    monkeypatch.setattr(signals.Sine, "__call__", counted)
    wave = {"sine": {"amplitude": 1.19, "frequency_hz": 1000.0, "phase_deg": 50.0}}
    data = loaded(wave, [], duration=100.0, backend=backend)
    data["output"]["interval"] = 50.0
    found = simulate(data)
    assert found.status == "done"
    assert found.transitions == []
    assert calls < 1000


def drawn_size(rng: random.Random, size: float) -> Any:
    kind = rng.choice(["number", "sine", "table"])
    if kind == "number":
        return rng.uniform(-size, size)
    if kind == "sine":
        wave = {"amplitude": rng.uniform(0.0, size), "frequency_hz": rng.uniform(0.3, 20.0)}
        return {"sine": wave | {"mean": rng.uniform(-size, size), "phase_deg": rng.uniform(0, 360)}}
    return {"time": [0.0, 0.5, 1.0], "value": [rng.uniform(-size, size) for _ in range(3)]}


def test_no_excess_is_above_its_bound() -> None:
    """Against 200 values between the ends of each smooth part."""
    rng = random.Random(7)
    close = 0
    for _ in range(60):
        forces = [
            {
                "name": f"force_{k}",
                "size": drawn_size(rng, 60.0),
                "direction": [rng.uniform(-1.0, 1.0), 1.0],
                "point": [rng.uniform(-0.02, 0.02), 0.0],
            }
            for k in range(rng.randint(0, 2))
        ]
        terms = terms_of(validate(loaded(drawn_size(rng, 1.0), forces), SCENARIOS))
        bound, r_s, angle = _largest_excess_of(terms, 0.012), 0.012, rng.uniform(-3.0, 3.0)
        for begin, end in ((0.0, 0.5), (0.5, 1.0)):
            for s in (1, -1):
                largest = max(
                    s * terms.applied_torque(t, angle, 0.0)
                    - r_s * hypot(terms.across(t, angle, 0.0), terms.up(t, angle, 0.0))
                    for t in np.linspace(begin, end, 200, endpoint=False).tolist()
                )
                found = bound(s, angle, begin, end)
                assert found >= largest - ROUNDING * 10.0
                close += found < largest + 0.1
    assert close > 60  # of 240: the bound is of use


@pytest.mark.parametrize(
    ("signal", "interval", "low", "high"),
    [
        (Sine(2.0, 3.0, 50.0, 1.0), (0.0, 9.0), -1.0, 5.0),
        (PiecewiseLinear([0.0, 1.0, 2.0], [1.0, 4.0, 0.0]), (1.0, 2.0), 0.0, 4.0),
        (SmoothStep(1.0, 3.0, 2.0, 4.0), (0.0, 2.0), 1.0, 1.0),
        (SmoothStep(1.0, 3.0, 2.0, 4.0), (2.0, 4.0), -0.5, 4.5),  # 1 to 3, and its curvature
    ],
)
def test_the_range_of_a_signal(
    signal: Any, interval: tuple[float, float], low: float, high: float
) -> None:
    middle, bound = middle_and_range(signal)(*interval)
    assert (middle - bound, middle + bound) == pytest.approx((low, high), abs=1e-12)
