"""Reference problems with exact solutions.

The pulley of "Analysis of friction systems on shafts", Int. J. Applied Engineering Research
13(11), 2018, 8871-8881, as in `scenarios/pulley.toml`; the numbers were computed in closed form
with more digits than are given here.
"""

import json
from math import exp, hypot
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from frictionsim.results import Record, Transition

CORD_RADIUS, INERTIA, LOAD, DRAG = 0.0508, 1.355, 2224.1, 1.355
SHAFT_RADIUS, MU_S, MU_K = 0.0254, 0.2, 0.1
# The friction radii r mu / sqrt(1 + mu^2), eqs 5-6.
R_S, R_K = (SHAFT_RADIUS * mu / hypot(1.0, mu) for mu in (MU_S, MU_K))

# The ramp of the shipped scenario.
P_START, P_END, T_RAMP = 1832.6, 3113.75, 0.8
BREAKAWAY = 0.5464484749599702  # s

# time, angle, angular velocity, angular acceleration on that ramp.
RAMP = (
    (0.8, 0.409948331933859, 3.688585024454578, 19.708734137880),
    (1.0, 1.516824769440999, 7.261172419414380, 16.136146742920),
    (2.0, 14.714153835301298, 17.461162515888788, 5.936156646446),
    (5.0, 79.265498512658450, 23.101775325535755, 0.295543836799),
    (10.0, 195.958541846241300, 23.395327803626450, 0.001991358708),
)

# The force rises and returns to the band between kinetic and static limit:
# kinetic limit 10.25 < |M| = 19.89 < static limit 20.21 N m.
RETURN_FORCE = {
    "time": [0.0, 0.8, 4.0, 4.8, 12.0],
    "value": [1832.6, 3113.75, 3113.75, 1832.6, 1832.6],
}
RETURN_STICK = (5.133702705857667, 72.00814966611645)  # s, rad
RETURN_OF_EQ_30 = 30.28587  # rad at 12 s, where the body should still be at 72.008


class SlipOnRamp(NamedTuple):
    """Sliding in direction s from rest at t0 under P = p0 + p1 t, in closed form.

    I dw/dt = (P - W) r_e - b w - s r_k (P + W) is linear in w, with lambda = b/I:
    w = (A1/lambda) t + A0/lambda - A1/lambda^2 + C exp(-lambda (t - t0)).
    """

    p0: float
    p1: float
    t0: float
    angle0: float
    s: int

    def __call__(self, t: float) -> tuple[float, float]:
        """Return angle and angular velocity at t, rad and rad/s."""
        lam = DRAG / INERTIA
        arm = CORD_RADIUS - self.s * R_K
        a0 = (self.p0 * arm - LOAD * (CORD_RADIUS + self.s * R_K)) / INERTIA
        a1 = self.p1 * arm / INERTIA
        steady = a0 / lam - a1 / lam**2
        c = -(a1 / lam * self.t0 + steady)

        def particular(x: float) -> float:
            return a1 * x * x / (2 * lam) + steady * x

        decay = exp(-lam * (t - self.t0))
        w = a1 / lam * t + steady + c * decay
        angle = self.angle0 + particular(t) - particular(self.t0) - c / lam * (decay - 1.0)
        return angle, w


def cases(kind: str) -> list[dict[str, Any]]:
    """Return the independently computed scenarios of a kind in tests/data."""
    return json.loads((Path(__file__).parents[1] / "data" / f"{kind}_cases.json").read_text())


def assert_agrees(
    run: Record, events: list[Transition], case: dict[str, Any], time: float = 1e-8
) -> None:
    """Compare events and final state of a run with those of a case; its audit must be passed."""
    assert len(events) == case["event_count"]
    for event, (at, mode_from, mode_to, angle) in zip(events, case["events"], strict=False):
        assert (event.mode_from, event.mode_to) == (mode_from, mode_to)
        assert event.time == pytest.approx(at, abs=time)
        assert event.position == pytest.approx(angle, abs=1e-8)
    final = [run.channels[name][-1] for name in ("angle", "angular_velocity")]
    assert final == pytest.approx(case["final"], abs=1e-8)
    assert {name: check for name, check in run.checks.items() if not check.ok} == {}
