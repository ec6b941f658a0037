"""The contract that mechanisms offer and backends use, on one that no scenario describes."""

from math import pi, sin

import numpy as np
import pytest

from frictionsim import backends
from frictionsim.backends.base import Recording, SampleTimes
from frictionsim.drives import Constant
from frictionsim.mechanisms.base import Contact, Kink, Mechanism
from frictionsim.parameters import Solver

DURATION = 3.0


def wheel(friction: float, kink: Kink) -> Mechanism:
    """A wheel of 1 kg m^2 under 2 N m, and 1 N m more where sin(q) is negative."""

    def moment(u: float, q: float, v: float) -> float:
        return u + 0.5 * (1.0 - np.sign(sin(q)))

    contact = Contact(
        "hub",
        static_limit=lambda u, q: friction,
        kinetic_limit=lambda u, q, v, s: friction,
        rounding=lambda u, q: 1e-14,
    )
    return Mechanism(
        drive=Constant(2.0),
        inertia=1.0,
        moment=moment,
        contact=contact if friction else None,
        powers={"energy_input": lambda u, q, v: moment(u, q, v) * v},
        stores={"energy_kinetic": lambda q, v: 0.5 * v * v},
        channels=lambda series: {},
        channel_info={},
        figures=lambda series: {},
        effects=(),
        kinks=(kink,),
    )


EVENT = "half turn"


@pytest.mark.parametrize("kink", [Kink(lambda q, v: sin(q), event=EVENT), Kink(None, pi, EVENT)])
@pytest.mark.parametrize("friction", [0.0, 0.5])
@pytest.mark.parametrize("backend", ["events", "rkf45"])
def test_steps_end_on_the_kinks_of_a_mechanism(backend: str, friction: float, kink: Kink) -> None:
    recording = Recording(SampleTimes(DURATION, DURATION))
    settings = Solver(backend=backend, duration=DURATION)
    backends.solver_of(backend)(wheel(friction, kink), settings, recording, lambda t: None)
    # From rest with 2 N m to pi, then with 3 N m to 2 pi, then with 2 N m to the end.
    t, v = 0.0, 0.0
    expected = []
    for k, torque in enumerate((2.0, 3.0), start=1):
        faster = (v * v + 2.0 * (torque - friction) * pi) ** 0.5
        t, v = t + (faster - v) / (torque - friction), faster
        expected.append((t, k * pi))
    found = [(e.time, e.position) for e in recording.transitions if e.contact == EVENT]
    # Before and after the jump the motion is a parabola, which the method gives exactly; the last
    # stage of the step that ends on it may see what is beyond, which the tolerance covers.
    assert np.array(found[:2]) == pytest.approx(np.array(expected), abs=1e-8)
