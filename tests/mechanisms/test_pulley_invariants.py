"""Properties of random pulleys: energy, friction law, symmetries."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.support.scenarios import Scenario, changed, simulate, sound


def close(actual: Any, expected: Any, tolerance: float = 1e-6) -> bool:
    """Compare channels of two runs at rtol 1e-9 whose steps differ.

    A hundred steps of 1e-9 each, and a position that is off where a stop came a little late.
    """
    scale = max(1.0, float(np.max(np.abs(expected), initial=0.0)))
    return bool(np.max(np.abs(actual - expected), initial=0.0) <= tolerance * scale)


forces = st.one_of(
    st.floats(0.0, 6000.0),
    st.lists(st.floats(0.0, 6000.0), min_size=2, max_size=6).map(
        lambda values: {"time": [0.3 * i for i in range(len(values))], "value": values}
    ),
    st.builds(
        lambda mean, amplitude, hz, phase: {
            "sine": {"mean": mean, "amplitude": amplitude, "frequency_hz": hz, "phase_deg": phase}
        },
        st.floats(1000.0, 4000.0),
        st.floats(1.0, 3000.0),
        st.floats(0.2, 5.0),
        st.floats(-180.0, 180.0),
    ),
    st.builds(
        lambda a, b, start, length: {
            "smooth_step": {"from": a, "to": b, "start": start, "stop": start + length}
        },
        st.floats(0.0, 6000.0),
        st.floats(0.0, 6000.0),
        st.floats(0.0, 1.0),
        st.floats(0.001, 1.0),
    ),
)


@st.composite
def scenarios(draw: st.DrawFn, force: Any = forces) -> Scenario:
    # No smaller one: friction below the rounding of the moments is neither there nor absent.
    mu_s = round(draw(st.floats(0.0, 1.0)), 9)
    effects: dict[str, Any] = {
        "shaft_friction": {
            "shaft_radius": draw(st.floats(0.005, 0.05)),
            "mu_s": mu_s,
            "mu_k": mu_s * draw(st.sampled_from([0.0, 0.5, 0.9, 1.0])),
        }
    }
    if draw(st.booleans()):
        effects["viscous_damping"] = {"coefficient": draw(st.floats(0.0, 5.0))}
    return {
        "kind": "pulley",
        "mechanism": {
            "cord_radius": 0.0508,
            "inertia": draw(st.floats(0.1, 10.0)),
            "load": draw(st.floats(100.0, 4000.0)),
        },
        "drive": {
            "force": draw(force),
            "direction": draw(st.sampled_from(["vertical", "horizontal"])),
        },
        "effects": effects,
        "solver": {"duration": 2.0},
        # Runs are compared sample by sample, and each has its own times of events.
        "output": {"interval": 0.02, "at_events": False},
    }


@given(scenarios(), st.sampled_from(["events", "rkf45"]))
def test_every_run_passes_its_audit(data: Scenario, backend: str) -> None:
    data["solver"]["backend"] = backend
    data["output"]["at_events"] = True
    run = sound(data)
    for channel in run.channels.values():
        assert np.all(np.isfinite(channel))
    for heat in ("energy_friction", "energy_damping"):
        # The weights of the method are not all positive: less than its tolerance may come back.
        lost = np.diff(run.channels.get(heat, np.zeros(2)))
        assert np.all(lost >= -1e-12 - 1e-9 * run.channels["energy_friction"][-1])
    stick = run.channels["mode"] == 0
    assert np.all(run.channels["angular_velocity"][stick] == 0.0)
    assert np.all(run.channels["angular_acceleration"][stick] == 0.0)
    # rkf45 may be past zero by its tolerance where it has not yet noticed.
    assert np.all(run.channels["angular_velocity"][~stick] * run.channels["mode"][~stick] >= -1e-8)


@given(scenarios())
def test_backends_agree(data: Scenario) -> None:
    events = simulate(data)
    data["solver"]["backend"] = "rkf45"
    assert close(simulate(data).channels["angle"], events.channels["angle"])


@given(scenarios(), st.floats(100.0, 3000.0), st.floats(0.0, 1.0), st.floats(0.1, 10.0))
def test_breakaway_depends_on_static_friction_alone(
    data: Scenario, rate: float, share: float, inertia: float
) -> None:
    load = data["mechanism"]["load"]
    ramp = {"time": [0.0, 2.0], "value": [load, load + 2.0 * rate]}
    data = changed(data, drive__force=ramp)
    mu_k = data["effects"]["shaft_friction"]["mu_s"] * share
    other = changed(
        data,
        mechanism__inertia=inertia,
        effects__shaft_friction__mu_k=mu_k,
        effects__viscous_damping=None,
    )
    rkf45 = changed(data, solver__backend="rkf45")
    first = [
        next((e.time for e in simulate(scenario).transitions), None)
        for scenario in (data, other, rkf45)
    ]
    assert first[1] == first[0]
    assert first[2] == pytest.approx(first[0], abs=1e-12)  # another piece to look for it in


@given(scenarios(st.floats(0.0, 6000.0)))
def test_without_losses_energy_is_kept_and_motion_reverses(data: Scenario) -> None:
    bare = data | {"effects": {}}
    run = simulate(bare)
    energy = run.channels["energy_kinetic"] + run.channels["energy_potential"]
    # A constant force has the potential -P r_e theta: what it puts in is what is stored.
    assert close(energy, run.channels["energy_input"], 1e-8)  # rtol 1e-9 of some ten steps
    end = {
        "initial_angle_deg": float(np.rad2deg(run.channels["angle"][-1])),
        "initial_angular_velocity": -float(run.channels["angular_velocity"][-1]),
    }
    back = bare | {"mechanism": data["mechanism"] | end}
    turned = simulate(back).channels["angle"][-1]
    assert close(turned, 0.0, 1e-6 * (1 + abs(run.channels["angle"][-1])))
