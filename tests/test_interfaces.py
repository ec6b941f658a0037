"""The contracts: of mechanisms with backends, and of kinds with what simulates and records them."""

from math import pi, sin
from pathlib import Path

import numpy as np
import pytest

import frictionsim as fs
from frictionsim.io import hdf5_reader, hdf5_writer
from frictionsim.mechanisms.single_dof import MultiplesOf
from frictionsim.scenario import methods
from frictionsim.scenario.kinds import KINDS, mechanism_module
from frictionsim.scenario.settings import SolverSettings
from frictionsim.scenario.signals import Constant
from frictionsim.solvers import new_solver
from frictionsim.solvers.common import SampleBuffer, SampleTimes
from frictionsim.solvers.mechanism import (
    DryFriction,
    Mechanism,
    SwitchingSurface,
    equation_of,
    friction_of,
)
from tests.support.scenarios import SCENARIOS, pulley, simulate

DURATION = 3.0


def wheel(friction: float, surface: SwitchingSurface | MultiplesOf) -> Mechanism:
    """A wheel of 1 kg m^2 under 2 N m, and 1 N m more where sin(q) is negative."""

    def applied_torque(u: float, q: float, v: float) -> float:
        return u + 0.5 * (1.0 - np.sign(sin(q)))

    contact = DryFriction(
        "hub",
        static_limit=lambda u, q: friction,
        kinetic_limit=lambda u, q, v, s: friction,
        roundoff=lambda u, q: 1e-14,
    )
    return Mechanism(
        drive=Constant(2.0),
        inertia=1.0,
        applied_torque=applied_torque,
        contact=contact if friction else None,
        power_flows={"energy_input": lambda u, q, v: applied_torque(u, q, v) * v},
        stored_energies={"energy_kinetic": lambda q, v: 0.5 * v * v},
        channels=lambda trajectory: {},
        channel_info={},
        quantities=lambda trajectory: {},
        effects=(),
        switching_surfaces=(surface,),
    )


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
    buffer = SampleBuffer(SampleTimes(DURATION, DURATION))
    settings = SolverSettings(backend=backend, duration=DURATION)
    new_solver(wheel(friction, surface), settings, buffer).run(lambda t: None)
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


@pytest.mark.parametrize("kind", KINDS)
def test_each_kind_provides_the_required_names(kind: str) -> None:
    module = mechanism_module(kind)
    laws, names = zip(*module.SCENARIO.PAIRS, strict=True)
    assert set(laws) <= methods.LAWS.keys()
    assert set(names) <= methods.METHODS.keys()
    assert set(module.PANELS) <= module.SCENARIO.CHANNELS.keys()
    assert callable(module.simulation)
    assert callable(module.statics)


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
        hdf5_writer.write(run, tmp_path / "a.h5")
        content = hdf5_reader.read(tmp_path / "a.h5")
        assert content.channels.keys() == run.channels.keys()
        assert len(content.events["time"]) == 1
    assert "channels = []" in content.attributes["scenario"]


def test_what_a_system_lacks_is_named() -> None:
    whole = mechanism_module("pulley").build(fs.load(SCENARIOS / "pulley.toml")).system
    with pytest.raises(TypeError, match=r"^dict lacks inertia, .*, reversing_load: see"):
        equation_of({}, ["energy_input"], [])
    with pytest.raises(TypeError, match=r"^dict lacks static_limit, .*, first_excess: see"):
        friction_of({}, "hub", {})
    with pytest.raises(TypeError, match="lack 'energy_input'"):
        equation_of(whole, ["energy_damping"], [])
