"""The contracts of mechanisms with solvers, and of scenarios with what is recorded of them."""

from math import pi, sin
from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.mechanisms.extension import MultiplesOf
from frictionsim.solvers import new_solver
from frictionsim.solvers.mechanism import SwitchingSurface, equation_of, friction_of
from tests.support.scenarios import pulley, simulate
from tests.support.wheels import buffer_to, settings, signal, wheel

DURATION = 3.0
EVENT = "half turn"


@pytest.mark.parametrize(
    "surface",
    [SwitchingSurface(lambda q, v: sin(q), EVENT), MultiplesOf(pi, is_event=True, event=EVENT)],
)
@pytest.mark.parametrize("friction", [0.0, 0.5])
@pytest.mark.parametrize("backend", ["events", "rkf45"])
def test_steps_end_on_switching_surfaces(
    backend: str, friction: float, surface: SwitchingSurface | MultiplesOf
) -> None:
    buffer, solver = buffer_to(DURATION), settings(backend=backend, duration=DURATION)
    # 1 kg m^2 under 2 N m, and 1 N m more where sin(q) is negative.
    mechanism = wheel(
        signal(2.0),
        lambda u, q, v: u + 0.5 * (1.0 - float(np.sign(sin(q)))),
        (lambda u: friction) if friction else None,
        surfaces=(surface,),
    )
    new_solver(mechanism, solver, buffer).run(lambda t: None)
    # From rest with 2 N m to pi, then with 3 N m to 2 pi, then with 2 N m to the end.
    t, v = 0.0, 0.0
    expected = []
    for k, torque in enumerate((2.0, 3.0), start=1):
        faster = (v * v + 2.0 * (torque - friction) * pi) ** 0.5
        t, v = t + (faster - v) / (torque - friction), faster
        expected.append((t, k * pi))
    events = [(e.time, e.position) for e in buffer.transitions if e.contact == EVENT]
    # Before and after the jump the motion is a parabola, which the method gives exactly; the last
    # stage of the step that ends on it may see what is beyond, which the tolerance covers.
    assert np.array(events[:2]) == pytest.approx(np.array(expected), abs=1e-8)


def test_output_channels_are_the_only_channels(tmp_path: Path) -> None:
    whole = simulate(pulley())
    some = simulate(pulley(output__channels=["mode", "angle"]))
    none = simulate(pulley(output__channels=[]))
    assert list(some.channels) == ["time", "angle", "mode"]
    assert np.array_equal(some.channels["angle"], whole.channels["angle"])
    assert list(none.channels) == ["time"]
    for run in (some, none):
        assert run.quantities == whole.quantities
        assert run.checks == whole.checks
        assert run.transitions == whole.transitions
        content = fs.open(fs.Result(run).save(tmp_path / "a.h5")).record
        assert content.channels.keys() == run.channels.keys()
        assert len(content.events["time"]) == 1
    assert "channels = []" in content.attributes["scenario"]


def test_what_a_system_lacks_is_named() -> None:
    with pytest.raises(TypeError, match=r"^dict lacks inertia, .*, reversing_load: see"):
        equation_of({}, ["energy_input"], [])
    with pytest.raises(TypeError, match=r"^dict lacks static_limit, .*, first_excess: see"):
        friction_of({}, "hub", {})
    with pytest.raises(TypeError, match="lack 'energy_input'"):
        equation_of(Mock(), ["energy_damping"], [])
